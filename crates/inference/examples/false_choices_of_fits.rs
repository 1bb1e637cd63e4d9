//! Counts how often the tests of fits leave a simpler model that holds, and prints the counts as `src/measured_rates.rs` has them.

use std::num::NonZero;

use chainwave_analysis::LEVEL;
use chainwave_inference::FitError;
use chainwave_inference::false_choices::{PValues, TrueChain, p_values};

#[expect(clippy::print_stdout, reason = "the counts are the program's result")]
fn main() -> Result<(), FitError> {
    // Experiments of each.
    let n = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1000);
    let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let of = |softens: bool, chain_damping_kg_per_s: f64| {
        let truth = TrueChain { softens, chain_damping_kg_per_s, mass_scatter: 0.0 };
        p_values(&truth, 0..n, n_threads)
    };
    let (linear, alike) = (of(false, 0.003)?, of(true, 0.0)?);
    for (name, found, p_value) in [
        ("SOFTENING", &linear, (|found| found.softening) as fn(&PValues) -> f64),
        ("SCATTER", &alike, |found| found.scatter),
        ("DAMPING", &alike, |found| found.chain_damping),
        ("STRUCTURE", &alike, |found| found.structure),
        ("HYPOTHESIS", &alike, |found| found.hypothesis),
    ] {
        for level in [LEVEL, 0.05, 0.1, 0.3] {
            let told = found.iter().filter(|found| p_value(found) < level).count();
            println!("{name}: level: {level}, told: {told}, of: {}", found.len());
        }
    }
    Ok(())
}
