//! The p-values that the tests of fits give where a simpler model holds, of experiment after experiment: the counts behind
//! `docs/src/reference/decisions.md` and `src/measured_rates.rs`.
//!
//! `cargo run --release -p chainwave-inference --example false_choices_of_fits -- [EXPERIMENTS] [FIRST SEED]`

use std::num::NonZero;

use chainwave_inference::FitError;
use chainwave_inference::false_choices::{NullChain, p_values};

#[expect(clippy::print_stdout, reason = "the counts are the program's result")]
fn main() -> Result<(), FitError> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |usual: u64| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (n, first) = (number(1000), number(0));
    let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let of = |softens: bool, chain_damping_kg_per_s: f64| {
        let truth = NullChain { softens, chain_damping_kg_per_s, mass_scatter: 0.0 };
        p_values(&truth, first..first + n, n_threads)
    };
    let (linear, alike) = (of(false, 0.003)?, of(true, 0.0)?);
    println!("tests,seed,softening,scatter,damping,structure,hypothesis");
    for ((seed, linear), alike) in (first..).zip(linear).zip(alike) {
        println!(
            "fits,{seed},{:.2e},{:.2e},{:.2e},{:.2e},{:.2e}",
            linear.softening, alike.scatter, alike.chain_damping, alike.structure, alike.hypothesis
        );
    }
    Ok(())
}
