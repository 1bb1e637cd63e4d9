//! What holds of every source file: its length, no silenced lint, nothing unfinished, no path of one machine.

use crate::support::repository::{rust_sources, sources};

/// Longer files hold more than one idea.
const MOST_LINES: usize = 500;
/// The same of files of tests alone, each of which has one subject.
const MOST_LINES_OF_TESTS: usize = 550;

#[test]
fn lints_are_silenced_only_with_a_reason() {
    assert_nowhere("use #[expect(.., reason = \"..\")]", silences_a_lint);
}

#[test]
fn nothing_is_left_unfinished() {
    // Spelled in two parts, or this file would name itself.
    let unfinished = [concat!("todo", "!("), concat!("unimplemented", "!("), concat!("dbg", "!(")];
    assert_nowhere("finish it", |line| unfinished.iter().any(|word| line.contains(word)));
}

/// A closure that is called by value is put in line into a function of its own first, which lacks the vectors' instructions: a loop was three times
/// slower so, and nothing else said it.
#[test]
fn loops_in_closures_are_dispatched_as_such() {
    let call = concat!("dispatch", "(");
    let is_closure =
        |rest: &str| rest.starts_with('|') || rest.starts_with("move |") || rest.starts_with("#[inline");
    let wrong: Vec<String> = rust_sources()
        .iter()
        .filter(|source| {
            source
                .text
                .match_indices(call)
                .any(|(at, _)| is_closure(source.text[at + call.len()..].trim_start()))
        })
        .map(|source| source.path.display().to_string())
        .collect();
    assert!(
        wrong.is_empty(),
        "expected chainwave_vectors::dispatch_loop for a closure:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn no_file_is_too_long() {
    let long: Vec<String> = rust_sources()
        .iter()
        .map(|source| (source.text.lines().count(), &source.path))
        .filter(|(n_lines, path)| {
            let is_test = path.components().any(|part| part.as_os_str() == "tests");
            *n_lines > if is_test { MOST_LINES_OF_TESTS } else { MOST_LINES }
        })
        .map(|(n_lines, path)| format!("{}: {n_lines} lines", path.display()))
        .collect();
    assert!(long.is_empty(), "expected at most {MOST_LINES} lines a file:\n{}", long.join("\n"));
}

#[test]
fn every_file_says_first_what_it_holds() {
    let silent: Vec<String> = rust_sources()
        .iter()
        .filter(|source| !source.text.starts_with("//! "))
        .map(|source| source.path.display().to_string())
        .collect();
    assert!(
        silent.is_empty(),
        "begin these with a line `//! ...` that says what is in the room:\n{}",
        silent.join("\n")
    );
}

#[test]
fn no_path_of_one_machine_is_written_down() {
    let found: Vec<String> =
        sources().iter().flat_map(|source| source.lines_where(names_a_machines_folder)).collect();
    assert!(found.is_empty(), "paths of one machine:\n{}", found.join("\n"));
}

/// Asserts that no line of code matches; comments may speak of anything.
fn assert_nowhere(hint: &str, matches: impl Fn(&str) -> bool) {
    let code = |line: &str| matches(line.split("//").next().unwrap_or_default());
    let found: Vec<String> = rust_sources().iter().flat_map(|source| source.lines_where(code)).collect();
    assert!(found.is_empty(), "{hint}:\n{}", found.join("\n"));
}

/// Whether a line holds the attribute `allow`, alone or behind a condition.
fn silences_a_lint(line: &str) -> bool {
    let attribute = line.contains("#[") || line.contains("#![");
    attribute && line.match_indices("allow(").any(|(at, _)| !line[..at].ends_with(is_part_of_a_name))
}

/// Whether a line holds an absolute path into somebody's own folders.
fn names_a_machines_folder(line: &str) -> bool {
    let folders = ["root", "home", "work", "Users"].map(|name| format!("/{name}/"));
    let starts_a_path =
        |at: usize| !line[..at].ends_with(|c: char| is_part_of_a_name(c) || c == '.' || c == '-');
    folders.iter().any(|folder| line.match_indices(folder.as_str()).any(|(at, _)| starts_a_path(at)))
}

fn is_part_of_a_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[test]
fn the_rules_find_what_they_look_for() {
    let silenced = ["#![", "#[", "#[cfg_attr(test, "]
        .map(|start| format!("{start}{}dead_code)]", concat!("all", "ow(")));
    assert!(silenced.iter().all(|line| silences_a_lint(line)), "{silenced:?}");
    assert!(!silences_a_lint("#[expect(dead_code, reason = \"..\")]"));
    assert!(!silences_a_lint("disallow(x)"));

    let folder = concat!("/ho", "me/");
    for line in [format!("{folder}someone/a.cine"), format!("path = \"{folder}x\"")] {
        assert!(names_a_machines_folder(&line), "{line}");
    }
    for line in [format!("https://example.org{folder}x"), format!("..{folder}x"), "/usr/lib".to_owned()] {
        assert!(!names_a_machines_folder(&line), "{line}");
    }
}
