//! The words after `cargo xtask`, and what they ask for.

use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

use crate::bench::Bench;
use crate::book::Book;
use crate::command_line::OpenCv;
use crate::counted::Counted;
use crate::demo::Demo;
use crate::failure::Failure;
use crate::paper::Paper;
use crate::test_run::TestRun;
use crate::tested::Tested;

/// What `cargo xtask help` prints.
pub(crate) const HELP: &str = "\
cargo xtask demo [--out DIR] [--seed N]
    Sets up, builds, films the synthetic experiment pipelines/hec26-demo and evaluates it. Recordings are written to
    DIR/recordings and results to DIR/results (DIR is target/demo unless given). OpenCV is not needed.
    --seed N   seed of the random speckle, noise, trigger jitter and striker speeds

cargo xtask paper [--out DIR] [--quick]
    Sets up, builds, and makes every figure and number of the paper in DIR (target/paper unless given) with
    pipelines/paper/run.sh: films 390 recordings, evaluates them, simulates the rings and the chain, draws and compares.
    A run that was interrupted continues when it is started again. OpenCV is not needed.
    --quick   a short chain and one trial of each view (DIR is target/paper-quick unless given)

cargo xtask test [--no-opencv] [--fast] [--package NAME]...
    Sets up, builds and runs all tests, by cargo-nextest if it is installed.
    --fast           leaves out the tests in modules named `slow`
    --package NAME   only the tests of this package; may be repeated
    CHAINWAVE_REFERENCE_DATA names the folder of third-party recordings; tests that need it are skipped without it.
    The last line says how many tests were skipped, and why.

cargo xtask book [--write] [--fast | --all] [PAGE]...
    Builds, runs the commands on the book's pages again, compares what they print and draw with the pages, and renders the
    book if mdBook is installed. The exit code is 1 if anything differs.
    --write   writes what differs into the pages
    --fast    leaves out the pages that need the demo's recordings (which take minutes), the counts, and the rendering
    --all     counts again everything in docs/src/measured/counts, which takes hours; otherwise a few lines of each file
    PAGE      a part of a page's name, such as guide/figures; may be repeated

cargo xtask bench [--write] [--rounds N] [--no-opencv] [PROGRAM]...
    Builds and runs the crates' benchmarks, prints how many times faster each is than the obvious program or a peer, and compares
    with the table of the same processor and instruction set in docs/src/measured/benchmarks: losses of 10 % or more are shown.
    --write     writes that table anew
    --rounds N  how many times all benchmarks run (3); the median of the rounds is taken
    PROGRAM     matching, chain, ring, regions, frames or follow; may be repeated
    CHAINWAVE_INSTRUCTION_SET=avx2 measures with AVX2 on a processor that has AVX-512.

cargo xtask counted FILE [--about] [--plain] [--words FILE] TITLE=FUNCTION(COLUMN)...
    Summarises the experiments in a file of counts (docs/src/measured/counts) in a table for the book.
    --about   prints only the notes at the head of the file
    --plain   prints only the values, one per line
    --words   a table with the columns name and words: the words that replace the names of rows

cargo xtask tested FILE TEST
    Runs a test that makes a table of the book, and prints the table as lines of a file of counts.

cargo xtask equations
    The preprocessor that mdBook runs: reads the book as JSON from standard input and writes it with its equations as MathML.

cargo xtask keys
    Prints the keys of configuration files as tables for the book, taken from the structures that read them.

cargo xtask python
    Builds the Python package, which contains the command, installs it in a fresh virtual environment (target/release/python)
    and runs its tests there. The wheel is kept in target/release/python/wheels.
    Without a Python that has venv and pip it says so and does nothing.

cargo xtask dist [--out DIR]
    Builds the command without OpenCV and packs it, with its manual, shell completions and documents, into one archive for
    systems like this one, with its SHA-256 beside it, in DIR (target/dist unless given).

cargo xtask setup [--no-opencv]
    Looks for what the build needs from the system and installs what is missing.

--no-opencv builds without OpenCV and clang, which only the program chainwave-opencv needs: for videos, boards and OpenCV's methods.
";

/// What the user asked for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// `cargo xtask demo`.
    Demo(Demo),
    /// `cargo xtask paper`.
    Paper(Paper),
    /// `cargo xtask test`.
    Test(TestRun),
    /// `cargo xtask book`.
    Book(Book),
    /// `cargo xtask bench`.
    Bench(Bench),
    /// `cargo xtask counted`.
    Counted(Counted),
    /// `cargo xtask tested`.
    Tested(Tested),
    /// `cargo xtask equations`.
    Equations,
    /// `cargo xtask equations supports RENDERER`: it does.
    Supports,
    /// `cargo xtask keys`.
    Keys,
    /// `cargo xtask python`.
    Python,
    /// `cargo xtask dist`.
    Dist {
        /// Where the archive goes.
        out: Option<PathBuf>,
    },
    /// `cargo xtask setup`.
    Setup { opencv: OpenCv },
    /// `cargo xtask help`.
    Help,
}

/// Reads the words after `cargo xtask`.
pub(crate) fn parse(words: impl IntoIterator<Item = OsString>) -> Result<Task, Failure> {
    let mut words = words.into_iter();
    let Some(command) = words.next() else { return Ok(Task::Help) };
    match text(command)?.as_str() {
        "demo" => demo(words),
        "paper" => paper(words),
        "test" => test(words),
        "book" => book(words),
        "bench" => bench(words),
        "counted" => counted(words),
        "tested" => tested(words),
        "equations" => equations(words),
        "keys" => alone("keys", words, Task::Keys),
        "python" => alone("python", words, Task::Python),
        "dist" => dist(words),
        "setup" => setup(words),
        "help" | "--help" | "-h" => Ok(Task::Help),
        other => {
            let expected = "demo, paper, test, book, bench, counted, tested, equations, keys, python, dist, setup or help";
            Err(Failure::Usage(format!("expected {expected}, found `{other}`")))
        }
    }
}

fn demo(mut words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut demo = Demo::default();
    while let Some(word) = words.next() {
        match text(word)?.as_str() {
            "--no-opencv" => {} // As always.
            "--out" => demo.out = Some(PathBuf::from(value("--out", &mut words)?)),
            "--seed" => demo.seed = Some(whole("--seed", &text(value("--seed", &mut words)?)?)?),
            other => return unknown("demo", other),
        }
    }
    Ok(Task::Demo(demo))
}

fn paper(mut words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut paper = Paper::default();
    while let Some(word) = words.next() {
        match text(word)?.as_str() {
            "--no-opencv" => {} // As always.
            "--quick" => paper.quick = true,
            "--out" => paper.out = Some(PathBuf::from(value("--out", &mut words)?)),
            other => return unknown("paper", other),
        }
    }
    Ok(Task::Paper(paper))
}

fn test(mut words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut test_run = TestRun::default();
    while let Some(word) = words.next() {
        match text(word)?.as_str() {
            "--no-opencv" => test_run.opencv = OpenCv::Without,
            "--fast" => test_run.fast = true,
            "--package" | "-p" => test_run.packages.push(text(value("--package", &mut words)?)?),
            other => return unknown("test", other),
        }
    }
    Ok(Task::Test(test_run))
}

fn book(words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut book = Book::default();
    for word in words {
        match text(word)?.as_str() {
            "--write" => book.write = true,
            "--fast" => book.fast = true,
            "--all" => book.all = true,
            option if option.starts_with('-') => return unknown("book", option),
            page => book.pages.push(page.to_owned()),
        }
    }
    Ok(Task::Book(book))
}

fn bench(mut words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut bench = Bench::default();
    while let Some(word) = words.next() {
        match text(word)?.as_str() {
            "--write" => bench.write = true,
            "--no-opencv" => bench.opencv = OpenCv::Without,
            "--rounds" => bench.n_rounds = whole("--rounds", &text(value("--rounds", &mut words)?)?)?,
            option if option.starts_with('-') => return unknown("bench", option),
            program => bench.programs.push(program.to_owned()),
        }
    }
    Ok(Task::Bench(bench))
}

/// A command without options.
fn alone(command: &str, mut words: impl Iterator<Item = OsString>, task: Task) -> Result<Task, Failure> {
    match words.next() {
        Some(word) => unknown(command, &text(word)?),
        None => Ok(task),
    }
}

fn tested(words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let words: Vec<String> = words.map(text).collect::<Result<_, _>>()?;
    match <[String; 2]>::try_from(words) {
        Ok([file, test]) => Ok(Task::Tested(Tested { file, test })),
        Err(words) => Err(Failure::Usage(format!("tested: expected FILE TEST, found {}", words.join(" ")))),
    }
}

fn counted(mut words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut counted = Counted::default();
    let mut file = None;
    while let Some(word) = words.next() {
        match text(word)?.as_str() {
            "--about" => counted.about = true,
            "--plain" => counted.plain = true,
            "--words" => counted.words = Some(value("--words", &mut words)?.into()),
            option if option.starts_with("--") => return unknown("counted", option),
            path if file.is_none() => file = Some(PathBuf::from(path)),
            column => counted.columns.push(column.to_owned()),
        }
    }
    counted.file = file.ok_or_else(|| Failure::Usage("counted: expected a file".to_owned()))?;
    Ok(Task::Counted(counted))
}

/// mdBook asks first whether a renderer is supported: the elements are those of HTML, and whatever shows HTML shows them.
fn equations(words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let words: Vec<String> = words.map(text).collect::<Result<_, _>>()?;
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => Ok(Task::Equations),
        ["supports", _] => Ok(Task::Supports),
        [other, ..] => unknown("equations", other),
    }
}

fn dist(mut words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut out = None;
    while let Some(word) = words.next() {
        match text(word)?.as_str() {
            "--out" => out = Some(PathBuf::from(value("--out", &mut words)?)),
            other => return unknown("dist", other),
        }
    }
    Ok(Task::Dist { out })
}

fn setup(words: impl Iterator<Item = OsString>) -> Result<Task, Failure> {
    let mut opencv = OpenCv::With;
    for word in words {
        match text(word)?.as_str() {
            "--no-opencv" => opencv = OpenCv::Without,
            other => return unknown("setup", other),
        }
    }
    Ok(Task::Setup { opencv })
}

fn value(option: &str, words: &mut impl Iterator<Item = OsString>) -> Result<OsString, Failure> {
    words.next().ok_or_else(|| Failure::Usage(format!("{option}: expected a value after it")))
}

fn whole<N: FromStr>(option: &str, word: &str) -> Result<N, Failure> {
    word.parse().map_err(|_| Failure::Usage(format!("{option}: expected a whole number, found `{word}`")))
}

fn text(word: OsString) -> Result<String, Failure> {
    word.into_string().map_err(|word| Failure::Usage(format!("expected UTF-8, found `{}`", word.display())))
}

fn unknown(command: &str, word: &str) -> Result<Task, Failure> {
    Err(Failure::Usage(format!("{command}: unknown option `{word}`")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Task, Failure> {
        parse(line.split_whitespace().map(OsString::from))
    }

    #[test]
    fn options_reach_their_command() {
        let demo = Demo { out: Some("there".into()), seed: Some(7) };
        assert_eq!(parsed("demo --out there --no-opencv --seed 7").unwrap(), Task::Demo(demo));
        let test_run = TestRun { opencv: OpenCv::With, fast: true, packages: vec!["a".into(), "b".into()] };
        assert_eq!(parsed("test --fast -p a --package b").unwrap(), Task::Test(test_run));
        let paper = Paper { out: Some("there".into()), quick: true };
        assert_eq!(parsed("paper --quick --out there --no-opencv").unwrap(), Task::Paper(paper));
        let book = Book { write: true, fast: true, all: false, pages: vec!["guide".into()] };
        assert_eq!(parsed("book guide --fast --write").unwrap(), Task::Book(book));
        let book = Book { all: true, pages: vec!["measured".into()], ..Book::default() };
        assert_eq!(parsed("book --all measured").unwrap(), Task::Book(book));
        let bench =
            Bench { write: false, n_rounds: 5, opencv: OpenCv::Without, programs: vec!["ring".into()] };
        assert_eq!(parsed("bench --rounds 5 ring --no-opencv").unwrap(), Task::Bench(bench));
        assert_eq!(parsed("setup --no-opencv").unwrap(), Task::Setup { opencv: OpenCv::Without });
        assert_eq!(parsed("python").unwrap(), Task::Python);
        assert_eq!(parsed("keys").unwrap(), Task::Keys);
        let columns = vec!["a=by(b)".to_owned()];
        let (file, words) = ("c.csv".into(), Some("w.csv".into()));
        let counted = Counted { file, about: false, words, plain: true, columns };
        assert_eq!(parsed("counted --plain c.csv a=by(b) --words w.csv").unwrap(), Task::Counted(counted));
        assert_eq!(parsed("equations supports html").unwrap(), Task::Supports);
        assert_eq!(parsed("").unwrap(), Task::Help);
    }

    #[test]
    fn opencv_is_on_unless_refused() {
        assert_eq!(
            parsed("test").unwrap(),
            Task::Test(TestRun { opencv: OpenCv::With, fast: false, packages: Vec::new() })
        );
        assert_eq!(parsed("setup").unwrap(), Task::Setup { opencv: OpenCv::With });
    }

    #[test]
    fn what_is_not_understood_is_named() {
        for (line, named) in [
            ("dmeo", "`dmeo`"),
            ("demo --fast", "demo: unknown option `--fast`"),
            ("demo --out", "--out: expected a value"),
            ("paper --seed 1", "paper: unknown option `--seed`"),
            ("book --quick", "book: unknown option `--quick`"),
            ("demo --seed -1", "--seed: expected a whole number, found `-1`"),
            ("setup --seed 1", "setup: unknown option `--seed`"),
        ] {
            let failure = parsed(line).unwrap_err();
            assert!(matches!(failure, Failure::Usage(_)), "{line}: {failure:?}");
            assert!(failure.to_string().contains(named), "{line}: {failure}");
        }
    }
}
