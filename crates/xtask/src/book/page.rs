//! A page of the book, cut into what is only read and what is made again.
//!
//! | written in a page | means |
//! |---|---|
//! | a block `console` | lines behind `$ ` are run, what they print stands below; with the word `fails` the last one fails |
//! | a block with the word `file=NAME` | the file of that name in the page's folder, for the commands below |
//! | `<!-- run: COMMANDS -->` | commands that the reader need not see |
//! | `<!-- made by: COMMANDS -->` .. `<!-- end -->` | what stands between is what the commands print; within a block if it is one |
//! | `<!-- says: COMMANDS -->` | each line that they print stands word for word in the paragraph or table below |
//! | `<!-- counted: FILE: COMMANDS -->` | the file of counts, named from the page, is what the commands print in hours: run with `--all` alone |
//! | `<!-- again: FILE: COMMANDS -->` | each line that they print stands in that file: a part of it that takes seconds |
//! | `<!-- needs: demo -->` | the page's folder has the demo: `demo/recordings`, `demo/results` and what the run said, `demo/said.txt` |
//! | `<!-- figures: FOLDER -->` | the pictures of the page are those of the same names in that folder |

use std::fmt;

/// What opens and closes what is made by commands.
const NOTE_OPENS: &str = "<!-- ";
const NOTE_CLOSES: &str = "-->";
const END: &str = "<!-- end -->";
const FENCE: &str = "```";

/// A page in its parts; written one after the other they are the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Page {
    pub(crate) parts: Vec<Part>,
}

/// A part of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Part {
    /// Lines that are only read.
    Prose(String),
    /// A note that nothing follows.
    Note { kind: NoteKind, text: String, written: String },
    /// Commands, each with what it prints.
    Console { opening: String, fails: bool, exchanges: Vec<Exchange> },
    /// A file for the commands below.
    File { opening: String, name: String, content: String },
    /// What commands make; `fence` is the line that opens a block around it.
    Made { command: String, written: String, fence: Option<String>, content: String },
    /// A file of counts, and commands that print all of it or some of its lines.
    Counts { is_all: bool, file: String, command: String, written: String },
    /// A paragraph in which stands what commands print.
    Says { command: String, written: String, paragraph: String },
}

/// What a note without content of its own asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoteKind {
    /// Commands to run.
    Run,
    /// What the page's folder needs.
    Needs,
    /// Where its pictures come from.
    Figures,
}

/// A command and what it prints, each with the ends of its lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Exchange {
    pub(crate) command: String,
    pub(crate) output: String,
}

impl Page {
    /// Cuts a page. What is not understood is named with its line.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut lines = Lines { lines: text.split_inclusive('\n').collect(), next: 0 };
        let mut parts: Vec<Part> = Vec::new();
        while let Some(line) = lines.take() {
            let at = lines.next;
            let part = part(line, &mut lines).map_err(|reason| format!("line {at}: {reason}"))?;
            match (parts.last_mut(), part) {
                (Some(Part::Prose(before)), Part::Prose(more)) => before.push_str(&more),
                (_, part) => parts.push(part),
            }
        }
        Ok(Self { parts })
    }

    /// Whether it asks for something that takes long to make.
    pub(crate) fn needs_the_demo(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Note { kind: NoteKind::Needs, .. }))
    }

    /// Whether anything of it is made again.
    pub(crate) fn is_made(&self) -> bool {
        self.parts.iter().any(|part| !matches!(part, Part::Prose(_)))
    }

    /// Whether it has counts that are kept.
    pub(crate) fn is_counted(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Counts { .. }))
    }

    /// The pictures that its links show, as they are named there.
    pub(crate) fn pictures(&self) -> Vec<&str> {
        let prose = self.parts.iter().filter_map(|part| match part {
            Part::Prose(text) => Some(text),
            _ => None,
        });
        let shown = prose.flat_map(|text| text.split("![").skip(1));
        shown.filter_map(|rest| rest.split_once("](")?.1.split(')').next()).collect()
    }
}

impl fmt::Display for Page {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.parts.iter().try_for_each(|part| match part {
            Part::Prose(text) => f.write_str(text),
            Part::Note { written, .. } | Part::Counts { written, .. } => f.write_str(written),
            Part::Console { opening, exchanges, .. } => {
                f.write_str(opening)?;
                for Exchange { command, output } in exchanges {
                    write!(f, "$ {command}{output}")?;
                }
                writeln!(f, "{FENCE}")
            }
            Part::File { opening, content, .. } => writeln!(f, "{opening}{content}{FENCE}"),
            Part::Made { written, fence: None, content, .. } => writeln!(f, "{written}{content}{END}"),
            Part::Made { written, fence: Some(fence), content, .. } => {
                writeln!(f, "{written}{fence}{content}{FENCE}\n{END}")
            }
            Part::Says { written, paragraph, .. } => write!(f, "{written}{paragraph}"),
        })
    }
}

/// Lines with their ends, one after the other.
struct Lines<'a> {
    lines: Vec<&'a str>,
    next: usize,
}

impl<'a> Lines<'a> {
    fn take(&mut self) -> Option<&'a str> {
        let line = self.lines.get(self.next)?;
        self.next += 1;
        Some(line)
    }

    /// The lines up to one that ends them, which is taken and left out.
    fn up_to(&mut self, end: impl Fn(&str) -> bool, name: &str) -> Result<String, String> {
        let mut taken = String::new();
        loop {
            match self.take() {
                Some(line) if end(line) => return Ok(taken),
                Some(line) => taken.push_str(line),
                None => return Err(format!("expected {name} below, found the page's end")),
            }
        }
    }

    /// A paragraph: the lines up to an empty one, which stays.
    fn paragraph(&mut self) -> String {
        let rest = &self.lines[self.next..];
        let n = rest.iter().take_while(|line| !line.trim().is_empty()).count();
        self.next += n;
        rest[..n].concat()
    }
}

fn part(line: &str, lines: &mut Lines<'_>) -> Result<Part, String> {
    if let Some(information) = line.strip_prefix(FENCE) {
        return block(line, information.trim(), lines);
    }
    let kind = |name| line.strip_prefix(NOTE_OPENS).and_then(|note| note.strip_prefix(name));
    for (name, kind_of_note) in
        [("run:", NoteKind::Run), ("needs:", NoteKind::Needs), ("figures:", NoteKind::Figures)]
    {
        if kind(name).is_some() {
            let (text, written) = note(name, line, lines)?;
            return Ok(Part::Note { kind: kind_of_note, text, written });
        }
    }
    for (name, is_all) in [("counted:", true), ("again:", false)] {
        if kind(name).is_some() {
            let (text, written) = note(name, line, lines)?;
            let (file, command) =
                text.split_once(':').ok_or_else(|| format!("expected a file and `:` behind {name}"))?;
            let (file, command) = (file.trim().to_owned(), command.trim().to_owned());
            return Ok(Part::Counts { is_all, file, command, written });
        }
    }
    if kind("says:").is_some() {
        let (command, written) = note("says:", line, lines)?;
        return Ok(Part::Says { command, written, paragraph: lines.paragraph() });
    }
    if kind("made by:").is_some() {
        let (command, written) = note("made by:", line, lines)?;
        let content = lines.up_to(|line| line.trim_end() == END, END)?;
        let (fence, content) = without_fence(content);
        return Ok(Part::Made { command, written, fence, content });
    }
    Ok(Part::Prose(line.to_owned()))
}

/// The commands of a note, and how it is written.
fn note(name: &str, first: &str, lines: &mut Lines<'_>) -> Result<(String, String), String> {
    let mut written = first.to_owned();
    while !written.trim_end().ends_with(NOTE_CLOSES) {
        written.push_str(lines.take().ok_or("expected --> below, found the page's end")?);
    }
    let within = written.trim_end().strip_prefix(NOTE_OPENS).and_then(|text| text.strip_suffix(NOTE_CLOSES));
    let text = within.and_then(|text| text.strip_prefix(name)).unwrap_or_default().trim().to_owned();
    Ok((text, written))
}

fn block(opening: &str, information: &str, lines: &mut Lines<'_>) -> Result<Part, String> {
    let content = lines.up_to(|line| line.trim_end() == FENCE, FENCE)?;
    let words: Vec<&str> = information.split_whitespace().collect();
    if words.first() == Some(&"console") {
        let (opening, fails) = (opening.to_owned(), words.contains(&"fails"));
        return Ok(Part::Console { opening, fails, exchanges: exchanges(&content)? });
    }
    if let Some(name) = words.iter().find_map(|word| word.strip_prefix("file=")) {
        return Ok(Part::File { opening: opening.to_owned(), name: name.to_owned(), content });
    }
    Ok(Part::Prose(format!("{opening}{content}{FENCE}\n")))
}

/// Commands begin with `$ ` and go on behind a backslash; the other lines are what they print.
fn exchanges(content: &str) -> Result<Vec<Exchange>, String> {
    let mut exchanges: Vec<Exchange> = Vec::new();
    for line in content.split_inclusive('\n') {
        match (line.strip_prefix("$ "), exchanges.last_mut()) {
            (Some(command), _) => {
                exchanges.push(Exchange { command: command.to_owned(), output: String::new() });
            }
            (None, Some(last)) if last.output.is_empty() && last.command.ends_with("\\\n") => {
                last.command.push_str(line);
            }
            (None, Some(last)) => last.output.push_str(line),
            (None, None) => return Err(format!("expected `$ ` and a command, found {line:?}")),
        }
    }
    Ok(exchanges)
}

fn without_fence(content: String) -> (Option<String>, String) {
    let Some((fence, rest)) = content.split_once('\n').filter(|(first, _)| first.starts_with(FENCE)) else {
        return (None, content);
    };
    match rest.strip_suffix("```\n") {
        Some(within) => (Some(format!("{fence}\n")), within.to_owned()),
        None => (None, content),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "\
# A page

<!-- needs: demo -->
<!-- run: ln -s demo/recordings shots
cd shots --out x
-->

```csv file=points.csv
name,x_px
1,60
```

Text.

```console fails
$ echo a \\
  b
a b
$ false
```

<!-- made by: echo '|a|' -->
|a|
<!-- end -->

<!-- made by: cat demo/said.txt -->
```text
c_d
```
<!-- end -->

<!-- says: echo 17 -->
There are
17 of them.

![A picture](figures/one.png) and `code`.

```sh
$ not run
```
";

    #[test]
    fn a_page_is_its_parts() {
        let page = Page::parse(PAGE).unwrap();
        assert_eq!(page.to_string(), PAGE);
        assert!(page.needs_the_demo() && page.is_made());
        assert_eq!(page.pictures(), ["figures/one.png"]);
        let run = page.parts.iter().find_map(|part| match part {
            Part::Note { kind: NoteKind::Run, text, .. } => Some(text.as_str()),
            _ => None,
        });
        assert_eq!(run, Some("ln -s demo/recordings shots\ncd shots --out x"));
    }

    #[test]
    fn commands_and_what_they_print_are_told_apart() {
        let page = Page::parse(PAGE).unwrap();
        let console = page.parts.iter().find_map(|part| match part {
            Part::Console { fails: true, exchanges, .. } => Some(exchanges.as_slice()),
            _ => None,
        });
        let exchange =
            |command: &str, output: &str| Exchange { command: command.into(), output: output.into() };
        let expected = [exchange("echo a \\\n  b\n", "a b\n"), exchange("false\n", "")];
        assert_eq!(console, Some(&expected[..]));
        let file = page.parts.iter().find_map(|part| match part {
            Part::File { name, content, .. } => Some((name.as_str(), content.as_str())),
            _ => None,
        });
        assert_eq!(file, Some(("points.csv", "name,x_px\n1,60\n")));
    }

    #[test]
    fn what_is_made_is_found_within_its_block() {
        let page = Page::parse(PAGE).unwrap();
        let made: Vec<_> = page
            .parts
            .iter()
            .filter_map(|part| match part {
                Part::Made { command, fence, content, .. } => {
                    Some((command.as_str(), fence.is_some(), &**content))
                }
                _ => None,
            })
            .collect();
        assert_eq!(made, [("echo '|a|'", false, "|a|\n"), ("cat demo/said.txt", true, "c_d\n")]);
        let says = page.parts.iter().find_map(|part| match part {
            Part::Says { command, paragraph, .. } => Some((command.as_str(), paragraph.as_str())),
            _ => None,
        });
        assert_eq!(says, Some(("echo 17", "There are\n17 of them.\n")));
    }

    #[test]
    fn what_is_not_closed_is_named() {
        for (page, named) in [
            ("a\n```console\n$ b\n", "line 2: expected ```"),
            ("<!-- made by: a -->\nb\n", "line 1: expected <!-- end -->"),
            ("<!-- run: a\n", "line 1: expected -->"),
            ("```console\na\n```\n", "expected `$ ` and a command"),
            ("<!-- again: counts.csv -->\n", "line 1: expected a file and `:`"),
        ] {
            let reason = Page::parse(page).unwrap_err();
            assert!(reason.contains(named), "{page:?}: {reason}");
        }
    }
}
