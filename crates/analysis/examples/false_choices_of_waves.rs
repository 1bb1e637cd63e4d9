//! The p-values that the tests of waves give where a simpler model holds, of case after case: the counts behind
//! `docs/src/reference/decisions.md` and `src/measured_rates.rs`.
//!
//! `cargo run --release -p chainwave-analysis --example false_choices_of_waves -- [CASES] [FIRST SEED]`

use std::num::NonZero;

use chainwave_analysis::{AnalysisError, false_choices};

#[expect(clippy::print_stdout, reason = "the counts are the program's result")]
fn main() -> Result<(), AnalysisError> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |usual: u64| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (n, first) = (number(1000), number(0));
    let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let seeds = first..first + n;
    let across = false_choices::of_bodies_at_rest(seeds.clone());
    let lines = false_choices::of_continua(seeds.clone());
    let speeds = false_choices::of_one_speed(seeds.clone(), 0.0, n_threads)?;
    println!("tests,seed,motion_across,line,one_speed");
    for (((seed, across), line), speed) in seeds.zip(across).zip(lines).zip(speeds) {
        println!("waves,{seed},{across:.2e},{line:.2e},{speed:.2e}");
    }
    Ok(())
}
