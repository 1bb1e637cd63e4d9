//! Runs what a page says, in the order of the page and in a folder of its own, and holds what comes against what stands there.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::counts;
use super::page::{NoteKind, Page, Part};
use super::said::{alike, difference, missing};

/// Where a page is played.
pub(crate) struct Stage<'a> {
    /// The page's own folder, in which its commands run.
    pub(crate) folder: &'a Path,
    /// The folder of the page in the book, from which its pictures are named.
    pub(crate) beside: &'a Path,
    /// Where programs are looked for.
    pub(crate) programs: &'a OsString,
    /// How much is counted again.
    pub(crate) counting: Counting,
    /// A folder for what a count that is interrupted goes on from, `$KEPT` in commands.
    pub(crate) kept: &'a Path,
}

/// How much of what takes long is counted again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Counting {
    /// Nothing.
    None,
    /// Some lines of each file of counts.
    Part,
    /// All of them.
    All {
        /// Whether files that differ are written anew.
        write: bool,
    },
}

/// What came of a page.
#[derive(Debug)]
pub(crate) struct Played {
    /// The page with what its commands print now.
    pub(crate) renewed: Page,
    /// Pictures that are others now: the new one, and where it belongs.
    pub(crate) pictures: Vec<(PathBuf, PathBuf)>,
    /// What differs, in words; nothing when the page is as it should be.
    pub(crate) differences: Vec<String>,
    /// What cannot be renewed by writing the page anew: commands that failed, and prose.
    pub(crate) left: usize,
}

/// Plays a page.
pub(crate) fn play(page: &Page, stage: &Stage<'_>) -> Played {
    let mut played = Played { renewed: page.clone(), pictures: Vec::new(), differences: Vec::new(), left: 0 };
    for index in 0..page.parts.len() {
        let Some(part) = played.renewed.parts.get_mut(index) else { continue };
        let mut report = Report { differences: &mut played.differences, left: &mut played.left };
        match part {
            Part::Prose(_) | Part::Note { kind: NoteKind::Needs, .. } => {}
            Part::Note { kind: NoteKind::Run, text, .. } => {
                report.failure(text, &stage.run(text), false);
            }
            Part::Note { kind: NoteKind::Figures, text, .. } => {
                let changed = changed_pictures(page, &stage.folder.join(&*text), stage.beside, &mut report);
                played.pictures.extend(changed);
            }
            Part::File { name, content, .. } => {
                if let Err(why) = fs::write(stage.folder.join(&*name), content) {
                    report.left(format!("  {name}: {why}"));
                }
            }
            Part::Console { fails, exchanges, .. } => {
                let last = exchanges.len().saturating_sub(1);
                for (index, exchange) in exchanges.iter_mut().enumerate() {
                    let ended = stage.run(&format!("exec 2>&1\n{}", exchange.command));
                    report.failure(&exchange.command, &ended, *fails && index == last);
                    report.renew(&exchange.command, &mut exchange.output, ended.printed);
                }
            }
            Part::Made { command, content, .. } => {
                let ended = stage.run(command);
                if !report.failure(command, &ended, false) {
                    report.renew(command, content, ended.printed);
                }
            }
            Part::Counts { is_all, file, command, .. } => {
                let path = stage.beside.join(&*file);
                match (stage.counting, *is_all) {
                    (Counting::All { write }, true) => count(stage, command, &path, write, &mut report),
                    (Counting::Part, false) => count_again(stage, command, &path, &mut report),
                    _ => {}
                }
            }
            Part::Says { command, paragraph, .. } => {
                let ended = stage.run(command);
                if !report.failure(command, &ended, false) {
                    for line in missing(&ended.printed, paragraph) {
                        report.left(format!(
                            "  $ {command}\n    says {line:?}, and the paragraph below does not"
                        ));
                    }
                }
            }
        }
    }
    played
}

/// Counts all of a file anew.
fn count(stage: &Stage<'_>, command: &str, path: &Path, write: bool, report: &mut Report<'_>) {
    let ended = stage.run(command);
    if report.failure(command, &ended, false) {
        return;
    }
    let there = fs::read_to_string(path).unwrap_or_default();
    if counts::is_all_of(&ended.printed, &there) {
        return;
    }
    let differs = format!("  {} has other counts now", path.display());
    match write.then(|| counts::write(path, &ended.printed)) {
        None => report.left(differs),
        Some(Ok(())) => report.differences.push(differs),
        Some(Err(why)) => report.left(format!("  {}: {why}", path.display())),
    }
}

/// Counts some lines of a file again.
fn count_again(stage: &Stage<'_>, command: &str, path: &Path, report: &mut Report<'_>) {
    let there = match fs::read_to_string(path) {
        Ok(there) => there,
        Err(why) => return report.left(format!("  {}: {why}", path.display())),
    };
    let ended = stage.run(command);
    if report.failure(command, &ended, false) {
        return;
    }
    let missing = counts::not_in(&ended.printed, &there);
    if !missing.is_empty() || counts::lines(&ended.printed).nth(1).is_none() {
        report.left(format!(
            "  $ {command}\n    {} has not (--all counts it anew):\n    + {}",
            path.display(),
            missing.join("\n    + ")
        ));
    }
}

/// How commands ended, and what they printed.
struct Ended {
    printed: String,
    complaint: String,
    well: bool,
}

impl Stage<'_> {
    /// Runs commands by a shell that ends with the first that fails.
    fn run(&self, commands: &str) -> Ended {
        let output = Command::new("bash")
            .args(["-eo", "pipefail", "-c", commands])
            .current_dir(self.folder)
            .env("PATH", self.programs)
            .env("KEPT", self.kept)
            .env("LC_ALL", "C.UTF-8")
            .stdin(Stdio::null())
            .output();
        match output {
            Ok(output) => Ended {
                printed: with_last_end(String::from_utf8_lossy(&output.stdout).into_owned()),
                complaint: String::from_utf8_lossy(&output.stderr).into_owned(),
                well: output.status.success(),
            },
            Err(why) => Ended { printed: String::new(), complaint: format!("bash: {why}\n"), well: false },
        }
    }
}

/// Where differences are collected.
struct Report<'a> {
    differences: &'a mut Vec<String>,
    left: &'a mut usize,
}

impl Report<'_> {
    /// Says what no writing mends.
    fn left(&mut self, difference: String) {
        self.differences.push(difference);
        *self.left += 1;
    }

    /// Whether commands ended otherwise than they should; says so.
    fn failure(&mut self, command: &str, ended: &Ended, should_fail: bool) -> bool {
        let otherwise = ended.well == should_fail;
        if otherwise {
            let how = if ended.well { "ended well, and should fail" } else { "failed" };
            let said = ended.complaint.lines().chain(ended.printed.lines().filter(|_| !ended.well));
            let said: String = said.map(|line| format!("\n    {line}")).collect();
            self.left(format!("  $ {}\n    {how}{said}", command.trim_end()));
        }
        otherwise
    }

    /// Puts what was printed in the place of what is written, where it says something else.
    fn renew(&mut self, command: &str, written: &mut String, printed: String) {
        if !alike(written, &printed) {
            let difference = difference(written, &printed);
            self.differences.push(format!("  $ {}\n{}", command.trim_end(), difference.trim_end()));
            *written = printed;
        }
    }
}

/// The pictures of a page that differ from those of a folder.
fn changed_pictures(
    page: &Page,
    made: &Path,
    beside: &Path,
    report: &mut Report<'_>,
) -> Vec<(PathBuf, PathBuf)> {
    let mut changed = Vec::new();
    for shown in page.pictures() {
        let shown = beside.join(shown);
        let made = made.join(shown.file_name().unwrap_or_default());
        match fs::read(&made) {
            Err(why) => report.left(format!("  {}: {why}", made.display())),
            Ok(picture) if fs::read(&shown).is_ok_and(|there| there == picture) => {}
            Ok(_) => {
                report.differences.push(format!("  {} is another picture now", shown.display()));
                changed.push((made, shown));
            }
        }
    }
    changed
}

/// A page's lines all have an end.
fn with_last_end(mut printed: String) -> String {
    if !printed.is_empty() && !printed.ends_with('\n') {
        printed.push('\n');
    }
    printed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays a page in a folder of this test's own; what is left when it has ended is removed.
    fn played(name: &str, text: &str) -> Played {
        counted(name, text, Counting::Part, None).0
    }

    /// The same with a file of counts, and that file afterwards.
    fn counted(name: &str, text: &str, counting: Counting, counts: Option<&str>) -> (Played, Option<String>) {
        let folder = std::env::temp_dir().join(format!("xtask-book-{name}-{}", std::process::id()));
        fs::create_dir_all(folder.join("figures")).unwrap();
        fs::write(folder.join("figures/a.png"), "new").unwrap();
        let file = folder.join("pages/counts/a.csv");
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        counts.into_iter().for_each(|counts| fs::write(&file, counts).unwrap());
        let programs = std::env::var_os("PATH").unwrap();
        let stage = Stage {
            folder: &folder,
            beside: &folder.join("pages"),
            programs: &programs,
            counting,
            kept: &folder,
        };
        let played = play(&Page::parse(text).unwrap(), &stage);
        let counts = fs::read_to_string(&file).ok();
        fs::remove_dir_all(&folder).unwrap();
        (played, counts)
    }

    #[test]
    fn a_page_that_says_what_its_commands_print_is_left_alone() {
        let text = "\
```csv file=p.csv
a,1
```
<!-- run: mkdir there -->
```console fails
$ cat p.csv
a,1
$ ls there; echo lost >&2; false
lost
```
<!-- made by: echo 3 s -->
4 s
<!-- end -->
<!-- says: wc -l < p.csv -->
There is 1 line.
";
        let played = played("alike", text);
        assert_eq!((played.differences, played.left), (Vec::new(), 0));
        assert_eq!(played.renewed.to_string(), text);
    }

    #[test]
    fn what_differs_is_told_and_renewed() {
        let played =
            played("renewed", "```console\n$ echo b\na\n```\n<!-- made by: echo d -->\nc\n<!-- end -->\n");
        assert_eq!(played.differences, ["  $ echo b\n    - a\n    + b", "  $ echo d\n    - c\n    + d"]);
        let renewed = "```console\n$ echo b\nb\n```\n<!-- made by: echo d -->\nd\n<!-- end -->\n";
        assert_eq!((played.renewed.to_string().as_str(), played.left), (renewed, 0));
    }

    #[test]
    fn what_no_writing_mends_is_counted() {
        let played = played(
            "left",
            "<!-- run: no-such-program -->\n<!-- says: echo 18 -->\n17\n\n```console fails\n$ true\n```\n",
        );
        assert_eq!((played.left, played.differences.len()), (3, 3), "{:?}", played.differences);
        assert!(played.differences[0].contains("no-such-program: command not found"), "{played:?}");
        assert!(played.differences[1].contains("says \"18\""), "{played:?}");
        assert!(played.differences[2].contains("should fail"), "{played:?}");
    }

    const COUNTS: &str = "\
<!-- counted: counts/a.csv: printf 'seed,n\\n1,5\\n2,6\\n' -->
<!-- again: counts/a.csv:
printf 'seed,n\\n2,6\\n'
-->
";

    #[test]
    fn some_lines_of_a_count_are_counted_again() {
        let of = |name: &str, counts| counted(name, COUNTS, Counting::Part, counts).0;
        let right = of("count-right", Some("# on a day\nseed,n\n1,5\n2,6\n"));
        assert_eq!((right.differences, right.left), (Vec::new(), 0));
        let wrong = of("count-wrong", Some("seed,n\n1,5\n2,7\n"));
        assert!(wrong.left == 1 && wrong.differences[0].contains("+ 2,6"), "{wrong:?}");
        assert_eq!(of("count-none", None).left, 1);
        let nothing = counted(
            "count-nothing",
            "<!-- again: counts/a.csv: echo seed,n -->\n",
            Counting::Part,
            Some("seed,n\n"),
        );
        assert_eq!(nothing.0.left, 1, "a head alone is no count");
        assert_eq!(counted("count-fast", COUNTS, Counting::None, None).0.left, 0);
    }

    #[test]
    fn a_whole_count_is_compared_and_written() {
        let of = |name: &str, write, counts| counted(name, COUNTS, Counting::All { write }, counts);
        let (same, _) = of("all-same", false, Some("# x\nseed,n\n1,5\n2,6\n"));
        assert_eq!((same.differences, same.left), (Vec::new(), 0));
        let (differs, _) = of("all-differs", false, Some("seed,n\n1,5\n"));
        assert_eq!((differs.differences.len(), differs.left), (1, 1));
        let (renewed, counts) = of("all-renewed", true, None);
        let counts = counts.unwrap();
        assert_eq!((renewed.differences.len(), renewed.left), (1, 0));
        assert!(counts.starts_with("# counted on ") && counts.ends_with("\nseed,n\n1,5\n2,6\n"), "{counts}");
    }

    #[test]
    fn pictures_are_held_against_those_that_are_made() {
        let played = played("pictures", "<!-- figures: figures -->\n![one](a.png) ![two](b.png)\n");
        assert!(played.differences[0].contains("a.png is another picture now"), "{played:?}");
        assert!(played.pictures.len() == 1 && played.pictures[0].1.ends_with("pages/a.png"), "{played:?}");
        assert_eq!(played.left, 1, "b.png is not made: {played:?}");
    }
}
