//! Counts how often the tests of waves leave a simpler model that holds, and prints the counts as `src/measured_rates.rs` has them.

use std::num::NonZero;

use chainwave_analysis::{AnalysisError, LEVEL, false_choices};

/// Cases of each.
const N: u64 = 1000;

#[expect(clippy::print_stdout, reason = "the counts are the program's result")]
fn main() -> Result<(), AnalysisError> {
    let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let p_values = [
        ("MOTION_ACROSS", false_choices::of_bodies_at_rest(0..N)),
        ("LINE", false_choices::of_continua(0..N)),
        ("ONE_SPEED", false_choices::of_one_speed(0..N, 0.0, n_threads)?),
    ];
    for (name, p_values) in p_values {
        let told = p_values.iter().filter(|p_value| **p_value < LEVEL).count();
        println!("{name}: level: {LEVEL}, told: {told}, of: {}", p_values.len());
    }
    Ok(())
}
