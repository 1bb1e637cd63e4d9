//! `cargo xtask dist`: the command with its pages and papers as one archive, for systems without a compiler.

use std::fs;
use std::io;
use std::path::Path;

use crate::command_line::{CommandLine, output_folder, workspace};
use crate::failure::Failure;
use crate::given_command;

/// Papers of the project that belong to the command.
const PAPERS: [&str; 5] = ["README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT"];
/// Shells, and the files that make them complete commands.
const COMPLETIONS: [(&str, &str); 3] =
    [("bash", "chainwave.bash"), ("fish", "chainwave.fish"), ("zsh", "_chainwave")];

/// Builds the command and packs it; the archive's name and hash are the last things printed.
pub(crate) fn run(out: Option<&Path>) -> Result<(), Failure> {
    let out = workspace().join(output_folder(out, "target/dist")?);
    let system = said(&["rustc", "-vV"])?;
    let host = system.lines().find_map(|line| line.strip_prefix("host: ")).unwrap_or("unknown");
    let name = format!("chainwave-{}-{host}", env!("CARGO_PKG_VERSION"));
    given_command::build().run()?;
    let folder = out.join(&name);
    fill(&folder)?;
    let archive = format!("{name}.tar.gz");
    // Owners and times of this machine say nothing to others.
    let plain = ["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner"];
    CommandLine::new(["tar"]).with(plain).with(["-czf", &archive, &name]).within(&out).run()?;
    let hash = CommandLine::new(["sha256sum", &archive]).within(&out);
    let hash =
        hash.output().ok_or_else(|| Failure::at(&out.join(&archive))(io::Error::other("no sha256sum")))?;
    let hashes = out.join(format!("{archive}.sha256"));
    fs::write(&hashes, format!("{hash}\n")).map_err(Failure::at(&hashes))?;
    let n_bytes = fs::metadata(out.join(&archive)).map_err(Failure::at(&out))?.len();
    println!("{}: {:.1} MB\n{hash}", out.join(&archive).display(), n_bytes as f64 / 1e6);
    Ok(())
}

/// The folder that is packed: command, pages of the manual, completions, papers. What an earlier run left there goes.
fn fill(folder: &Path) -> Result<(), Failure> {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(Failure::at(folder))?;
    }
    let chainwave = given_command::copy_into(&folder.join("bin")).map_err(Failure::at(folder))?;
    let chainwave = chainwave.to_string_lossy();
    let manual = folder.join("share/man/man1");
    let help = said(&[&chainwave, "--help"])?;
    for command in commands(&help) {
        let name =
            if command.is_empty() { "chainwave.1".to_owned() } else { format!("chainwave-{command}.1") };
        let words: Vec<&str> =
            [&*chainwave, "man", command].into_iter().filter(|word| !word.is_empty()).collect();
        write(&manual, &name, &said(&words)?)?;
    }
    for (shell, name) in COMPLETIONS {
        write(&folder.join("share/completions"), name, &said(&[&chainwave, "completions", shell])?)?;
    }
    for paper in PAPERS {
        let text = fs::read_to_string(workspace().join(paper)).map_err(Failure::at(Path::new(paper)))?;
        write(folder, paper, text.trim_end())?;
    }
    Ok(())
}

/// The names of the commands that a page of help lists, and none for the program itself.
fn commands(help: &str) -> Vec<&str> {
    let listed =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // Names are indented by two columns, the lines that go on by more.
    let named = listed.filter_map(|line| {
        line.strip_prefix("  ")?.split_whitespace().next().filter(|_| !line.starts_with("   "))
    });
    [""].into_iter().chain(named.filter(|name| *name != "help")).collect()
}

/// What a command prints.
fn said(words: &[&str]) -> Result<String, Failure> {
    let command = CommandLine::new(words.iter().copied());
    command.output().ok_or_else(|| Failure::Ended { command: command.to_string(), code: None })
}

fn write(folder: &Path, name: &str, text: &str) -> Result<(), Failure> {
    let path = folder.join(name);
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&path, format!("{text}\n")))
        .map_err(Failure::at(&path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_from_the_help() {
        let help = "Usage: x\n\nCommands:\n  inspect  Say what\n  plan     Say what will\n           be told\n  help     Print\n\nOptions:\n  -h";
        assert_eq!(commands(help), ["", "inspect", "plan"]);
    }

    #[test]
    fn papers_of_the_archive_are_there() {
        for paper in PAPERS {
            assert!(workspace().join(paper).is_file(), "{paper}");
        }
    }
}
