//! `cargo xtask bench`: runs the crates' benchmarks, makes ratios of those that belong together, and compares them with the table that
//! stands in the book for the same processor.

mod pairs;
mod processor;
mod table;
mod times;

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::command_line::{CommandLine, OpenCv, workspace};
use crate::failure::Failure;
use pairs::{PAIRS, PROGRAMS, Pair, Program};
pub(crate) use processor::Machine;
use processor::load;
use table::RatioRow;
use times::Time;

/// Where the tables lie, one a processor and instruction set.
const TABLES: &str = "docs/src/measured/benchmarks";

/// `cargo xtask bench`: ratios of benchmarks.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Bench {
    /// Whether the table of this processor is written anew.
    pub(crate) write: bool,
    /// How many times each program runs.
    pub(crate) n_rounds: usize,
    /// Without it, what takes OpenCV is not measured.
    pub(crate) opencv: OpenCv,
    /// Programs of benchmarks that run; all when empty.
    pub(crate) programs: Vec<String>,
}

impl Default for Bench {
    fn default() -> Self {
        Self { write: false, n_rounds: 3, opencv: OpenCv::With, programs: Vec::new() }
    }
}

/// Measures, prints, and compares. Rounds go through all programs in turn, so that what disturbs one minute disturbs one round.
pub(crate) fn run(bench: &Bench) -> Result<(), Failure> {
    let machine = Machine::this();
    let busy = load();
    let programs: Vec<Program> = PROGRAMS.into_iter().filter(|program| bench.wants(program)).collect();
    let mut rounds = Vec::new();
    for round in 1..=bench.n_rounds {
        let mut round_times = BTreeMap::new();
        for program in &programs {
            println!("round {round} of {}: {}", bench.n_rounds, line(*program));
            let line = line(*program);
            let printed =
                line.output().ok_or_else(|| Failure::Ended { command: line.to_string(), code: None })?;
            let found = times::times(&printed);
            round_times.extend(found.into_iter().map(|(name, time)| ((program.name, name), time)));
        }
        rounds.push(round_times);
    }
    let rows: Vec<RatioRow> = PAIRS.iter().filter_map(|pair| of_rounds(pair, &rounds)).collect();
    close(bench, &machine, busy, &rows)
}

impl Bench {
    fn wants(&self, program: &Program) -> bool {
        let is_named = self.programs.is_empty() || self.programs.iter().any(|name| name == program.name);
        is_named && (self.opencv == OpenCv::With || !program.opencv)
    }
}

/// Times by program and path of names.
type Times = BTreeMap<(&'static str, String), Time>;

/// Runs the benchmarks of a program that belong to a pair.
fn line(program: Program) -> CommandLine {
    // The whole workspace's features, so that nothing is built twice; a filter of divan's is a regular expression.
    CommandLine::new(["cargo", "bench", "--workspace", "--bench", program.name, "--"]).with(
        program.wanted().into_iter().map(|path| format!("^{}::{path}$", program.name).replace('/', "::")),
    )
}

fn of_rounds(pair: &Pair, rounds: &[Times]) -> Option<RatioRow> {
    let time = |round: &Times, (program, path): (Program, &str)| {
        round.get(&(program.name, path.to_owned())).copied()
    };
    let ratio = |round: &Times| Some(times::ratio(time(round, pair.ours)?, time(round, pair.other)?));
    RatioRow::of_rounds(pair.measure, pair.against, rounds.iter().filter_map(ratio).collect())
}

/// Prints the table beside the earlier one, and writes it where that is asked.
fn close(
    bench: &Bench,
    machine: &Machine,
    busy: Option<(f64, usize)>,
    rows: &[RatioRow],
) -> Result<(), Failure> {
    let path = workspace().join(TABLES).join(machine.file_name());
    let earlier = match fs::read_to_string(&path) {
        Err(why) if why.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(why) => return Err(Failure::at(&path)(why)),
        Ok(text) => table::read(&text).ok_or_else(|| {
            Failure::at(&path)(io::Error::new(io::ErrorKind::InvalidData, "no table of ratios"))
        })?,
    };
    let about = about(bench, machine, busy);
    println!("\n{}\nhow many times faster, the median of the rounds (and their range):\n", about.join("\n"));
    print!("{}", table::compared(rows, &earlier));
    match (earlier.is_empty(), table::n_lost(rows, &earlier)) {
        (true, _) => println!("\nThere is no earlier table of this processor: {}", path.display()),
        (false, n) => println!("\n{n} of {} lost a tenth or more against {}", rows.len(), path.display()),
    }
    if bench.write {
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        fs::create_dir_all(&folder).map_err(Failure::at(&folder))?;
        let mut rows = table::with_others_of(rows, &earlier);
        let is_of =
            |pair: &Pair, row: &RatioRow| (pair.measure, pair.against) == (&*row.measure, &*row.against);
        rows.sort_by_key(|row| PAIRS.iter().position(|pair| is_of(pair, row)));
        fs::write(&path, table::written(&about, &rows)).map_err(Failure::at(&path))?;
        println!("{}: written", path.display());
    }
    Ok(())
}

/// Where and how it was measured.
fn about(bench: &Bench, machine: &Machine, busy: Option<(f64, usize)>) -> Vec<String> {
    let Machine { processor, instruction_set } = machine;
    let loaded = busy.map(|(load, n_cores)| {
        let how = if load > 0.5 { "busy with other work" } else { "idle" };
        format!("the machine, of {n_cores} cores, was {how} before: load {load:.1}")
    });
    let rounds = format!("{} rounds, each by the fastest of its samples", bench.n_rounds);
    [format!("{processor}, {instruction_set}"), rounds].into_iter().chain(loaded).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_runs_the_benchmarks_of_pairs_alone() {
        let line = line(PROGRAMS[0]).to_string();
        let start = "cargo bench --workspace --bench matching -- ";
        assert!(line.starts_with(start) && line.contains("^matching::solve_affine::cubic$"), "{line}");
    }

    #[test]
    fn opencv_can_be_left_out() {
        let bench = Bench { opencv: OpenCv::Without, ..Bench::default() };
        assert!(PROGRAMS.iter().filter(|program| bench.wants(program)).all(|program| !program.opencv));
        let one = Bench { programs: vec!["ring".into()], ..Bench::default() };
        assert_eq!(PROGRAMS.iter().filter(|program| one.wants(program)).count(), 1);
    }

    #[test]
    fn rounds_become_a_row() {
        let time = |fastest_s| Time { fastest_s, items_per_s: None };
        let pair = &PAIRS[0];
        let round = |ours, other| -> Times {
            let of = |(program, path): (Program, &str), s| ((program.name, path.to_owned()), time(s));
            [of(pair.ours, ours), of(pair.other, other)].into()
        };
        let row = of_rounds(pair, &[round(1.0, 20.0), round(2.0, 20.0), round(1.0, 30.0)]).unwrap();
        assert_eq!((row.ratio, row.least, row.most), (20.0, 10.0, 30.0));
        assert_eq!(of_rounds(pair, &[BTreeMap::new()]), None);
    }
}
