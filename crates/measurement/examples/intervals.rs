//! Estimates with their uncertainty: scaled, and held against a truth.
//!
//! `cargo run --release -p chainwave-measurement --example intervals`

use chainwave_measurement::{Estimate, median};

#[expect(clippy::print_stdout, reason = "the numbers are the program's result")]
fn main() {
    let readings_m = [2.31e-4, 2.29e-4, 2.36e-4, 2.30e-4, 2.33e-4];
    let truth_m = 2.32e-4;
    let Some(middle_m) = median(readings_m.to_vec()) else { return };
    let deviations = readings_m.iter().map(|reading| (reading - middle_m).abs()).collect();
    // A normal deviate's median amount is 0.6745 of its standard deviation; the median of n is 1.2533 times as uncertain as their mean.
    let sigma_m = median(deviations).unwrap_or(0.0) / 0.6745 * 1.2533 / (readings_m.len() as f64).sqrt();
    let place = Estimate::new(middle_m, sigma_m);
    let in_um = place.scaled(1e6);
    println!(
        "{:.2} +- {:.2} um; 95 % interval holds {:.2} um: {}",
        in_um.value,
        in_um.sigma,
        1e6 * truth_m,
        place.covers_95(truth_m)
    );
}
