//! Fits chains that are not what their model states, and prints of each experiment how far off the dampings are: the counts behind
//! `docs/src/measured/models.md`.
//!
//! `cargo run --release -p chainwave-inference --example wrong_models -- [EXPERIMENTS] [FIRST SEED] [CHAIN]...`

use std::num::NonZero;

use chainwave_inference::wrong_models::{C_D_KG_PER_S, C_S_KG_PER_S, ChainBeyondModel, fits};
use chainwave_inference::{FitError, TrackFit};
use chainwave_measurement::Estimate;

#[expect(clippy::print_stdout, reason = "the counts are the program's result")]
fn main() -> Result<(), FitError> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |usual: u64| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (n, first) = (number(10), number(0));
    let names: Vec<String> = arguments.collect();
    let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let quantity = |name: &str| format!("{name}_n,{name}_within_95,{name}_rms_sigma");
    let of_each = ["c_d_as_stated", "c_d", "c_s"].map(quantity).join(",");
    println!("chain,seed,reduced_chi_squared,told,{of_each},c_d_sigma_over_noise,named");
    let is_asked =
        |truth: &&ChainBeyondModel| names.is_empty() || names.iter().any(|name| name == truth.name);
    for truth in ChainBeyondModel::ALL.iter().filter(is_asked) {
        for (seed, fit) in (first..first + n).zip(fits(truth, first..first + n, n_threads)?) {
            println!("\"{}\",{seed},{}", truth.name, fit.map_or_else(|_| failed(), |fit| told(&fit)));
        }
    }
    Ok(())
}

/// What a fit says; dampings that are not believed are not stated.
fn told(fit: &TrackFit) -> String {
    let is_told = fit.as_stated.is_told() || !fit.beyond.is_empty();
    let stated = fit.stated.map_or("0,0,".to_owned(), |one| off(&one.chain_damping_kg_per_s, C_D_KG_PER_S));
    let damping = &fit.damping;
    let believed = |found: &Estimate, truth: f64| match fit.is_believed() {
        true => off(found, truth),
        false => "0,0,".to_owned(),
    };
    let named: Vec<String> = fit.beyond.iter().map(|one| format!("{one:?}")).collect();
    format!(
        "{:.3},{},{},{},{},{:.2},\"{}\"",
        fit.reduced_chi_squared,
        u8::from(is_told),
        stated,
        believed(&damping.chain_damping_kg_per_s, C_D_KG_PER_S),
        believed(&damping.striker_damping_kg_per_s, C_S_KG_PER_S),
        damping.chain_damping_kg_per_s.sigma / fit.by_noise.chain_damping_kg_per_s.sigma,
        named.join(" and "),
    )
}

/// One interval, whether it holds, and how far off the value is in standard uncertainties.
fn off(found: &Estimate, truth: f64) -> String {
    let off = ((found.value - truth) / found.sigma).abs();
    format!("1,{},{off:.2}", u8::from(found.covers_95(truth)))
}

fn failed() -> String {
    ",0,0,0,,0,0,,0,0,,,\"\"".to_owned()
}
