//! `cargo xtask book`: runs the commands of the book's pages again, holds what they print against what stands there, and renders it.
//!
//! What a page has run, and how that is marked, says [`page`]. Pages that need the demo take minutes; `--fast` leaves them out, as
//! the tests do.

mod counts;
mod offline;
pub(crate) mod page;
mod play;
mod said;

use std::env;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process;

use crate::command_line::{CommandLine, workspace};
use crate::failure::Failure;
use crate::given_command;
use page::Page;
use play::{Counting, Played, Stage};

/// Where the pages of the book lie, and papers that are held like them.
pub(crate) const BOOK: &str = "docs/src";
const PAPERS: [&str; 2] = ["README.md", "pipelines/hec26-demo/README.md"];
/// Where the rendered book lies, as `docs/book.toml` says.
const RENDERED: &str = "target/book";
/// What commands name from the top of the workspace.
const SHARED: [&str; 4] = ["data-samples", "docs", "pipelines", "tests"];

/// `cargo xtask book`: pages as their commands make them.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Book {
    /// Whether pages that differ are written anew.
    pub(crate) write: bool,
    /// Whether pages that need the demo, the rendering, and what is counted again are left out.
    pub(crate) fast: bool,
    /// Whether everything is counted again that takes hours.
    pub(crate) all: bool,
    /// Parts of the names of the pages that are played; all when empty.
    pub(crate) pages: Vec<String>,
}

/// Plays the pages, and renders the book where mdBook is installed.
pub(crate) fn run(book: &Book) -> Result<(), Failure> {
    let counting = match (book.fast, book.all) {
        (_, true) => Counting::All { write: book.write },
        (true, false) => Counting::None,
        (false, false) => Counting::Part,
    };
    let work = Work::new(chainwave()?, counting)?;
    let pages = pages(book)?;
    if counting != Counting::None && pages.iter().any(|(_, page)| page.is_counted()) {
        given_command::build_examples().run()?;
    }
    if pages.iter().any(|(_, page)| page.needs_the_demo()) {
        work.make_the_demo()?;
    }
    let mut differ = Vec::new();
    for (path, page) in &pages {
        let played = work.play(path, page)?;
        tell(path, &played);
        if book.write {
            write(path, page, &played)?;
        }
        let n_left = if book.write { played.left } else { played.differences.len() };
        if n_left > 0 {
            differ.push(path.display().to_string());
        }
    }
    if !book.fast {
        render()?;
    }
    if differ.is_empty() {
        return Ok(());
    }
    Err(Failure::Differs(differ))
}

/// The command that pages are played with: the one that the environment names, or as it is built now.
fn chainwave() -> Result<PathBuf, Failure> {
    if let Some(named) = env::var_os("CHAINWAVE_COMMAND") {
        return Ok(named.into());
    }
    given_command::build().run()?;
    let name = format!("chainwave{}", env::consts::EXE_SUFFIX);
    let here = env::current_exe().map_err(Failure::at(Path::new("chainwave")))?;
    Ok(here.with_file_name(name))
}

/// The pages that have something to play, by their names from the top of the workspace.
fn pages(book: &Book) -> Result<Vec<(PathBuf, Page)>, Failure> {
    let mut paths = markdown_below(Path::new(BOOK)).map_err(Failure::at(Path::new(BOOK)))?;
    paths.extend(PAPERS.map(PathBuf::from));
    paths.sort();
    let asked = |path: &Path| {
        book.pages.is_empty() || book.pages.iter().any(|part| path.to_string_lossy().contains(&**part))
    };
    let mut pages = Vec::new();
    for path in paths.into_iter().filter(|path| asked(path)) {
        let text = fs::read_to_string(workspace().join(&path)).map_err(Failure::at(&path))?;
        let page = Page::parse(&text)
            .map_err(|reason| Failure::at(&path)(io::Error::new(io::ErrorKind::InvalidData, reason)))?;
        if page.is_made() && !(book.fast && page.needs_the_demo()) {
            pages.push((path, page));
        }
    }
    Ok(pages)
}

/// Markdown in a folder of the workspace and those below it, by their names from its top.
pub(crate) fn markdown_below(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(workspace().join(folder))? {
        let entry = entry?;
        let path = folder.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            paths.extend(markdown_below(&path)?);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            paths.push(path);
        }
    }
    Ok(paths)
}

/// The folder in which pages are played; it goes when they have been.
struct Work {
    folder: PathBuf,
    kept: PathBuf,
    counting: Counting,
    chainwave: PathBuf,
    programs: OsString,
}

impl Work {
    /// A new folder beside the command; it, this program and what counts are found before any others of their names.
    fn new(chainwave: PathBuf, counting: Counting) -> Result<Self, Failure> {
        let beside = chainwave.parent().unwrap_or(Path::new("."));
        let folder = beside.join(format!("book-{}", process::id()));
        let kept = beside.join("book-kept");
        for folder in [&folder, &kept] {
            fs::create_dir_all(folder).map_err(Failure::at(folder))?;
        }
        let others = env::var_os("PATH").unwrap_or_default();
        let here = env::current_exe().map_err(Failure::at(&folder))?;
        let here = here.parent().unwrap_or(beside);
        let ours = [beside.to_owned(), here.to_owned(), here.join("examples")];
        let programs = ours.into_iter().chain(env::split_paths(&others));
        let programs = env::join_paths(programs)
            .map_err(|why| Failure::at(&folder)(io::Error::new(io::ErrorKind::InvalidInput, why)))?;
        Ok(Self { folder, kept, counting, chainwave, programs })
    }

    /// Films the demo and processes it, once for all pages.
    fn make_the_demo(&self) -> Result<(), Failure> {
        let demo = self.folder.join("demo");
        fs::create_dir_all(&demo).map_err(Failure::at(&demo))?;
        let experiment = workspace().join("pipelines/hec26-demo/experiment.toml");
        let line = |script: &str| {
            CommandLine::new(["bash", "-eo", "pipefail", "-c", script])
                .with([&self.chainwave, &experiment])
                .within(&demo)
        };
        line("\"$0\" synthesize \"$1\" --out recordings").run()?;
        line("\"$0\" run recordings/experiment.toml --out results 2>&1 | tee said.txt").run()
    }

    /// Plays a page in a folder of its own.
    fn play(&self, path: &Path, page: &Page) -> Result<Played, Failure> {
        let folder = self.folder.join(path.with_extension(""));
        fs::create_dir_all(&folder).map_err(Failure::at(&folder))?;
        for name in SHARED {
            link(&workspace().join(name), &folder.join(name))?;
        }
        if page.needs_the_demo() {
            link(&self.folder.join("demo"), &folder.join("demo"))?;
        }
        let beside = workspace().join(path);
        let beside = beside.parent().unwrap_or(workspace());
        let stage = Stage {
            folder: &folder,
            beside,
            programs: &self.programs,
            counting: self.counting,
            kept: &self.kept,
        };
        Ok(play::play(page, &stage))
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        if let Err(why) = fs::remove_dir_all(&self.folder) {
            eprintln!("{}: {why}", self.folder.display());
        }
    }
}

#[cfg(unix)]
fn link(to: &Path, at: &Path) -> Result<(), Failure> {
    std::os::unix::fs::symlink(to, at).map_err(Failure::at(at))
}

#[cfg(not(unix))]
fn link(_to: &Path, at: &Path) -> Result<(), Failure> {
    Err(Failure::at(at)(io::Error::new(io::ErrorKind::Unsupported, "the book's commands take a Unix shell")))
}

fn tell(path: &Path, played: &Played) {
    match played.differences.as_slice() {
        [] => println!("{}: as its commands make it", path.display()),
        differences => println!("{}:\n{}", path.display(), differences.join("\n")),
    }
}

/// Writes what has changed.
fn write(path: &Path, page: &Page, played: &Played) -> Result<(), Failure> {
    if played.renewed != *page {
        fs::write(workspace().join(path), played.renewed.to_string()).map_err(Failure::at(path))?;
        println!("{}: written anew", path.display());
    }
    for (from, to) in &played.pictures {
        fs::copy(from, to).map_err(Failure::at(to))?;
        println!("{}: copied anew", to.display());
    }
    Ok(())
}

/// Renders the book where that can be done.
fn render() -> Result<(), Failure> {
    if CommandLine::new(["mdbook", "--version"]).output().is_some() {
        CommandLine::new(["mdbook", "build", "docs"]).run()?;
        let rendered = workspace().join(RENDERED);
        let asks = offline::asks_of_the_net(&rendered).map_err(Failure::at(&rendered))?;
        return if asks.is_empty() { Ok(()) } else { Err(Failure::NotAlone(asks)) };
    }
    println!(
        "mdBook is not installed, so the book is not rendered: `cargo install mdbook --locked` installs it."
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_is_the_sum_of_its_parts() {
        let paths = markdown_below(Path::new(BOOK)).unwrap();
        assert!(paths.len() > 30, "{paths:?}");
        for path in paths {
            let text = fs::read_to_string(workspace().join(&path)).unwrap();
            assert_eq!(Page::parse(&text).unwrap().to_string(), text, "{}", path.display());
        }
    }

    #[test]
    fn a_command_in_the_book_is_run_or_says_that_it_is_not() {
        for path in markdown_below(Path::new(BOOK)).unwrap() {
            let text = fs::read_to_string(workspace().join(&path)).unwrap();
            let mut in_block = false;
            for (line, next) in text.lines().zip(text.lines().skip(1)) {
                in_block ^= line.starts_with("```");
                let commands = ["chainwave ", "cargo ", "$ "];
                let is_bare = line == "```" && in_block && commands.iter().any(|word| next.starts_with(word));
                assert!(!is_bare, "{}: `console` or `sh` before {next}", path.display());
            }
        }
    }
}
