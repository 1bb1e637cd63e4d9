//! Fits chains that are not what their model states, and prints how far off the dampings are: the table of `docs/src/measured/models.md`.
//!
//! `cargo run --release -p chainwave-inference --example wrong_models -- [SEEDS] [FIRST SEED] [PART OF A NAME]`

use std::num::NonZero;

use chainwave_inference::wrong_models::{C_D_KG_PER_S, C_S_KG_PER_S, TrueChain, fits};
use chainwave_inference::{Damping, FitError, TrackFit};
use chainwave_measurement::Estimate;

#[expect(clippy::print_stdout, reason = "the table is the program's result")]
fn main() -> Result<(), FitError> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |usual: u64| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (n, first) = (number(10), number(0));
    let part = arguments.next().unwrap_or_default();
    let n_threads = NonZero::<usize>::MIN;
    println!(
        "| chain | chi squared | told | c_d as stated (rms, sigma) | c_d | c_s | within 95 % | c_d sigma / noise's | believed | asked for |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for truth in TrueChain::ALL.iter().filter(|truth| truth.name.contains(&part)) {
        let found: Vec<TrackFit> =
            fits(truth, first..first + n, n_threads)?.into_iter().filter_map(Result::ok).collect();
        let told = found.iter().filter(|fit| fit.as_stated.is_told() || !fit.beyond.is_empty()).count();
        let believed: Vec<&TrackFit> = found.iter().filter(|fit| fit.is_believed()).collect();
        let mean = |of: &dyn Fn(&TrackFit) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
        let c_d = |damping: &Damping| damping.chain_damping_kg_per_s;
        let rms = |of: &dyn Fn(&TrackFit) -> Estimate, truth: f64| {
            let squares = believed.iter().map(|fit| ((of(fit).value - truth) / of(fit).sigma).powi(2));
            (squares.sum::<f64>() / believed.len() as f64).sqrt()
        };
        let all = |of: &dyn Fn(&TrackFit) -> Estimate| {
            mean(&|fit| ((of(fit).value - C_D_KG_PER_S) / of(fit).sigma).powi(2)).sqrt()
        };
        let held = believed.iter().filter(|fit| c_d(&fit.damping).covers_95(C_D_KG_PER_S)).count();
        let mut asked: Vec<String> = Vec::new();
        for fit in &found {
            let name = fit.beyond.iter().map(|one| format!("{one:?}")).collect::<Vec<_>>().join("+");
            match asked.iter().position(|known| *known == name) {
                Some(_) => {}
                None => asked.push(name),
            }
        }
        println!(
            "| {} | {:.3} | {told}/{} | {:.1} | {:.2} | {:.2} | {held}/{} | {:.1} | {}/{} | {} |",
            truth.name,
            mean(&|fit| fit.reduced_chi_squared),
            found.len(),
            all(&|fit| c_d(&fit.stated)),
            rms(&|fit| c_d(&fit.damping), C_D_KG_PER_S),
            rms(&|fit| fit.damping.striker_damping_kg_per_s, C_S_KG_PER_S),
            believed.len(),
            mean(&|fit| c_d(&fit.damping).sigma / c_d(&fit.by_noise).sigma),
            believed.len(),
            found.len(),
            asked.join(", "),
        );
    }
    Ok(())
}
