//! The list of tests that found out while they ran that they lack something, and what is said of it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Variable by which tests learn where the list is; the crate `testkit` writes it.
pub(crate) const VARIABLE: &str = "CHAINWAVE_SKIPPED";

/// A list beside the binaries, emptied.
pub(crate) fn new_list(beside: &Path) -> io::Result<PathBuf> {
    let list = beside.with_file_name("skipped-tests.txt");
    fs::write(&list, "")?;
    Ok(list)
}

/// How many tests skipped, and why, in one line: they count as passed to the runner.
pub(crate) fn told(list: &str) -> String {
    let mut by_reason: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (test, reason) in list.lines().filter_map(|line| line.split_once('\t')) {
        by_reason.entry(reason).or_default().insert(test);
    }
    let counted = |(reason, tests): (&&str, &BTreeSet<&str>)| match tests.len() {
        1 => format!("1 test ({reason})"),
        n => format!("{n} tests ({reason})"),
    };
    let all: Vec<String> = by_reason.iter().map(counted).collect();
    match all.is_empty() {
        true => "Skipped: no test.".to_owned(),
        false => format!("Skipped, though counted as passed: {}.", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_are_counted_once_by_their_reason() {
        let list = "a one\tno data\na one\tno data\nb one\tno data\nb two\tno program\n";
        assert_eq!(told(list), "Skipped, though counted as passed: 2 tests (no data), 1 test (no program).");
        assert_eq!(told(""), "Skipped: no test.");
    }

    #[test]
    fn a_new_list_is_empty() {
        let folder = std::env::temp_dir().join(format!("xtask-skipped-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("skipped-tests.txt"), "old\tlist\n").unwrap();
        let list = new_list(&folder.join("chainwave")).unwrap();
        assert_eq!(fs::read_to_string(&list).unwrap(), "");
        fs::remove_dir_all(&folder).unwrap();
    }
}
