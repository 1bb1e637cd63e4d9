//! Files of counts: what takes hours to count is kept, a line for each single experiment, and some lines are counted again each time.

use std::fs;
use std::io;
use std::path::Path;

use crate::bench::Machine;
use crate::command_line::{CommandLine, workspace};

/// Where the versions stand that results depend on, and the words before them.
const VERSIONS: [(&str, &str, &str); 2] = [
    ("evaluation", "crates/experiment/src/evaluation.rs", "pub const EVALUATION_VERSION: u32 = "),
    ("correlation", "crates/correlation/src/lib.rs", "pub const ALGORITHM_VERSION: u32 = "),
];

/// The lines of a file of counts, without the notes at its head.
pub(super) fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#'))
}

/// Whether commands print what a file of counts has.
pub(super) fn is_all_of(printed: &str, file: &str) -> bool {
    lines(printed).eq(lines(file))
}

/// The lines that are printed and do not stand in a file of counts.
pub(super) fn not_in<'a>(printed: &'a str, file: &str) -> Vec<&'a str> {
    lines(printed).filter(|line| !lines(file).any(|other| other == *line)).collect()
}

/// Writes a file of counts, with what it was counted by at its head.
pub(super) fn write(path: &Path, printed: &str) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let machine = Machine::this();
    let day = CommandLine::new(["date", "-u", "+%F"]).output().unwrap_or_else(|| "a day unknown".to_owned());
    let by: Vec<String> = VERSIONS.iter().map(told).collect::<io::Result<_>>()?;
    let head = format!(
        "# counted on {day} with {}, on {} ({})\n",
        by.join(" and "),
        machine.processor,
        machine.instruction_set
    );
    fs::write(path, head + printed)
}

fn told((name, path, before): &(&str, &str, &str)) -> io::Result<String> {
    let text = fs::read_to_string(workspace().join(path))?;
    let version =
        text.split_once(before).and_then(|(_, rest)| rest.split_once(';')).map(|(version, _)| version);
    let missing = || io::Error::new(io::ErrorKind::InvalidData, format!("{path}: expected {before}"));
    Ok(format!("{name} {}", version.ok_or_else(missing)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_count_for_nothing() {
        let file = "# counted on a day\nkind,n\na,1\nb,2\n";
        assert!(is_all_of("kind,n\na,1\nb,2\n", file) && !is_all_of("kind,n\na,1\n", file));
        assert!(not_in("kind,n\nb,2\n", file).is_empty());
        assert_eq!(not_in("kind,n\nb,3\n", file), ["b,3"]);
    }

    #[test]
    fn versions_are_found() {
        for version in &VERSIONS {
            let told = told(version).unwrap();
            let number = told.strip_prefix(version.0).unwrap().trim();
            assert!(number.parse::<u32>().is_ok(), "{told}");
        }
    }
}
