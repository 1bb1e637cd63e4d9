//! The papers and the book: links lead somewhere, every page stands in the table of contents, and the code map names every crate.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use crate::support::repository::{Source, files, names_in, root, rust_sources, sources};

/// Where the pages of the book lie, and their table of contents.
const BOOK: &str = "docs/src";
const CONTENTS: &str = "docs/src/SUMMARY.md";
/// The paper with a table of all crates, a row each that begins with a link to its folder.
const CODE_MAP: &str = "README.md";

#[test]
fn every_relative_link_leads_somewhere() {
    let documents = documents();
    let broken: Vec<String> = documents
        .iter()
        .flat_map(|document| links(&document.text).into_iter().map(move |link| (document, link)))
        .filter_map(|(document, (line, target))| {
            let reason = broken(&document.path, target, &documents)?;
            Some(format!("{}:{line}: {target}: {reason}", document.path.display()))
        })
        .collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn every_file_named_as_code_is_there() {
    let documents = documents();
    let named = |document: &Source| -> Vec<String> {
        let paths = code(&document.text).into_iter().filter(|(_, text)| is_a_path(text));
        let gone = paths.filter(|(_, path)| !root().join(path).exists());
        gone.map(|(line, path)| format!("{}:{line}: {path}", document.path.display())).collect()
    };
    let gone: Vec<String> = documents.iter().flat_map(named).collect();
    assert!(gone.is_empty(), "no such file in the repository:\n{}", gone.join("\n"));
}

#[test]
fn every_page_of_the_book_stands_in_its_contents() {
    let contents = document(CONTENTS);
    let listed: BTreeSet<PathBuf> =
        links(&contents.text).into_iter().map(|(_, target)| Path::new(BOOK).join(target)).collect();
    let is_page = |path: &PathBuf| path.starts_with(BOOK) && path.extension().is_some_and(|end| end == "md");
    let pages: BTreeSet<PathBuf> =
        files().into_iter().filter(|path| is_page(path) && path != Path::new(CONTENTS)).collect();
    assert!(!pages.is_empty(), "no page in {BOOK}");
    let orphans: Vec<_> = pages.difference(&listed).collect();
    assert!(orphans.is_empty(), "pages that {CONTENTS} does not name: {orphans:?}");
    let missing: Vec<_> = listed.difference(&pages).collect();
    assert!(missing.is_empty(), "named by {CONTENTS}, but not there: {missing:?}");
}

#[test]
fn the_code_map_names_every_crate() {
    let mut mapped = mapped_crates(&document(CODE_MAP).text);
    mapped.sort();
    assert_eq!(mapped, names_in(Path::new("crates")), "the table of crates in {CODE_MAP}");
}

#[test]
fn every_kind_of_warning_stands_in_the_book() {
    assert_in_the_book(BOOK, &["code: \"", "Finding::all_of(\"", "Finding::all_of( \""], |code| {
        format!("`{code}`")
    });
}

#[test]
fn every_decision_stands_in_the_book() {
    assert_in_the_book(
        "docs/src/reference/decisions.md",
        &["question: \"", "plain(\"", "plain( \""],
        |question| format!("| {question} |"),
    );
}

/// Asserts that what stands between quotation marks behind one of some words of the libraries' sources, lines joined by a space, is
/// written in these pages.
fn assert_in_the_book(pages: &str, words: &[&str], written: impl Fn(&str) -> String) {
    let libraries =
        ["analysis", "experiment", "inference"].map(|name| Path::new("crates").join(name).join("src"));
    let of_library = |source: &Source| libraries.iter().any(|folder| source.path.starts_with(folder));
    let book: String =
        documents().into_iter().filter(|page| page.path.starts_with(pages)).map(|page| page.text).collect();
    let named: BTreeSet<String> = rust_sources()
        .iter()
        .filter(|source| of_library(source))
        .map(|source| source.text.split_whitespace().collect::<Vec<_>>().join(" "))
        .flat_map(|text| words.iter().flat_map(|word| quoted_after(&text, word)).collect::<Vec<_>>())
        .collect();
    assert!(named.len() > 5, "hardly anything is named: {named:?}");
    let missing: Vec<&String> = named.iter().filter(|name| !book.contains(&written(name))).collect();
    assert!(missing.is_empty(), "not in {pages}: {missing:?}");
}

/// What stands between a word that ends in a quotation mark and the next such mark; nothing where that is nothing.
fn quoted_after(text: &str, word: &str) -> Vec<String> {
    let behind = text.split(word).skip(1).filter_map(|rest| rest.split('"').next());
    behind.filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

/// Papers at the top, the book, and what says how studies and samples are made.
fn documents() -> Vec<Source> {
    let folders = ["docs", "pipelines", "data-samples"];
    let mut documents = sources();
    documents.retain(|source| {
        let path = &source.path;
        let stands_here =
            path.components().count() == 1 || folders.iter().any(|folder| path.starts_with(folder));
        stands_here && path.extension().is_some_and(|ending| ending == "md")
    });
    documents
}

fn document(path: &str) -> Source {
    let found = documents().into_iter().find(|document| document.path == Path::new(path));
    found.unwrap_or_else(|| panic!("expected {path}"))
}

/// The targets of a page's links with their lines; code is left out.
fn links(text: &str) -> Vec<(usize, &str)> {
    let mut in_fence = false;
    let mut links = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_fence = !in_fence;
        }
        if in_fence {
            continue;
        }
        // Every second part between backticks is code. Where the text of a link is, its target follows in the next part.
        for prose in line.split('`').step_by(2) {
            let targets = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            links.extend(targets.map(|target| (index + 1, target)));
        }
    }
    links
}

/// The code within lines, with their numbers.
fn code(text: &str) -> Vec<(usize, &str)> {
    let mut in_fence = false;
    let mut code = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_fence = !in_fence;
        } else if !in_fence {
            code.extend(line.split('`').skip(1).step_by(2).map(|text| (index + 1, text)));
        }
    }
    code
}

/// Whether code names a file or folder by its path from the top of the repository.
fn is_a_path(code: &str) -> bool {
    let folders = ["crates/", "data-samples/", "docs/", "pipelines/", "tests/small-experiment/"];
    folders.iter().any(|folder| code.starts_with(folder)) && !code.contains([' ', '*'])
}

/// What is wrong with a link, if anything: elsewhere in the web nothing is looked up.
fn broken(from: &Path, target: &str, documents: &[Source]) -> Option<String> {
    if ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme)) {
        return None;
    }
    let (file, anchor) = target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
    let folder = from.parent().unwrap_or(Path::new(""));
    let path = if file.is_empty() { Some(from.to_owned()) } else { within(&folder.join(file)) };
    let Some(path) = path.filter(|path| root().join(path).exists()) else {
        return Some("no such file in the repository".into());
    };
    if from.starts_with(BOOK) && !path.starts_with(BOOK) {
        return Some("the book as it is built has no such page: name the file as code".into());
    }
    let anchor = anchor?;
    let Some(document) = documents.iter().find(|document| document.path == path) else {
        return Some("an anchor into a file that is no page".into());
    };
    let there = headings(&document.text).any(|heading| anchor_of(heading) == anchor);
    (!there).then(|| format!("no heading of {} has that anchor", path.display()))
}

/// The path without `..`; `None` where it leaves the repository.
fn within(path: &Path) -> Option<PathBuf> {
    let mut clean = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => clean.pop().then_some(())?,
            Component::Normal(name) => clean.push(name),
            Component::CurDir => {}
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(clean)
}

fn headings(text: &str) -> impl Iterator<Item = &str> {
    let mut in_fence = false;
    text.lines().filter_map(move |line| {
        if line.starts_with("```") {
            in_fence = !in_fence;
        }
        let heading = line.trim_start_matches('#').strip_prefix(' ');
        heading.filter(|_| line.starts_with('#') && !in_fence)
    })
}

/// The anchor that GitHub and mdBook give a heading.
fn anchor_of(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>().to_lowercase()
}

/// The crates that begin a row of a table: `| [name](crates/name) | ...`.
fn mapped_crates(text: &str) -> Vec<String> {
    let rows = text.lines().filter_map(|line| line.strip_prefix("| ["));
    let linked = rows.filter_map(|row| row.split_once("](crates/")?.1.split_once(')'));
    linked.map(|(name, _)| name.to_owned()).collect()
}

#[test]
fn links_are_told_from_code() {
    let page = "a [b](c.md) and `[d](e)`, ![f](g.png) [`h`](i.md#j)\n```\n[k](l)\n```\n[m](n)";
    assert_eq!(links(page), [(1, "c.md"), (1, "g.png"), (1, "i.md#j"), (5, "n")]);
    assert_eq!(code(page), [(1, "[d](e)"), (1, "h")]);
    assert!(is_a_path("crates/a/b.rs") && !is_a_path("crates/*/b.rs") && !is_a_path("crates/a --out x"));
}

#[test]
fn broken_links_are_found() {
    let page = Source { path: "data-samples/README.md".into(), text: "# One, two\n".into() };
    let reason = |target: &str| broken(&page.path, target, std::slice::from_ref(&page));
    for target in ["../README.md", "#one-two", "https://example.org/nowhere"] {
        assert_eq!(reason(target), None, "{target}");
    }
    for target in ["nowhere.md", "../../outside", "/etc", "#three", "../Cargo.toml#x"] {
        assert!(reason(target).is_some(), "{target}");
    }
    assert!(broken(Path::new("docs/src/a.md"), "../../README.md", &[]).is_some());
    assert_eq!(anchor_of("One, two: `x_n(t)`"), "one-two-x_nt");
    assert_eq!(headings("# a\n```\n# b\n```\n## c d\n#e").collect::<Vec<_>>(), ["a", "c d"]);
}

#[test]
fn the_code_map_is_read_by_its_rows() {
    let table = "| crate | x |\n|---|---|\n| [one](crates/one) | see [two](crates/two) |\n";
    assert_eq!(mapped_crates(table), ["one"]);
}
