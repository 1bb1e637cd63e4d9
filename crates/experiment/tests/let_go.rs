//! What is measured of a chain that is let go from a load holds its truth.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::num::NonZero;
use std::path::Path;

use chainwave_analysis::{Missing, PeakEnergies, exact_motion, replicate};
use chainwave_experiment::{Experiment, measure_motion};
use chainwave_measurement::{ChainMotion, Trajectory};
use chainwave_mechanics::{Schedule, simulate};
use ndarray::Array2;

const DURATION_S: f64 = 0.012;

/// The small experiment's chain, let go from a load of 0.3 N against a wall.
fn let_go() -> Experiment {
    let text = include_str!("../../../tests/small-experiment/experiment.toml");
    let striker = "[striker]\nmass_kg = 4.3e-3\nvelocity_m_per_s = 2.73\nvelocity_sigma_m_per_s = 0.05\n";
    let release =
        "[drive]\nkind = \"free\"\nprecompression_n = 0.3\nscatter = 0.02\n\n[far_end]\nkind = \"fixed\"\n";
    let text = text.replace(striker, release).replace("striker_damping_kg_per_s = 0.2\n", "");
    Experiment::parse(Path::new("experiment.toml"), &text).unwrap()
}

/// Its motion from the places where it is held, in the small experiment's frames.
fn motion(experiment: &Experiment) -> ChainMotion {
    let chain = experiment.chain_driven(1.0, [3e-3, 0.0], DURATION_S).unwrap();
    let found = simulate(&chain, &Schedule::automatic(DURATION_S, 1e-5)).unwrap().trajectory;
    let held_m = found.displacement_m.column(0).to_owned();
    let times_s: Vec<f64> = (-40..290).map(|frame| f64::from(frame) * 4e-5).collect();
    let displacement_m = Array2::from_shape_fn((held_m.len(), times_s.len()), |(row, i)| {
        found.at(times_s[i]).map_or(0.0, |moment| moment.displacement_m(row) - held_m[row])
    });
    let velocity_m_per_s = Array2::zeros(displacement_m.dim());
    exact_motion(&Trajectory { times_s, displacement_m, velocity_m_per_s })
}

fn peak_energies(experiment: &Experiment, motion: &ChainMotion) -> PeakEnergies {
    let found = measure_motion(experiment, motion, None, NonZero::<usize>::MIN).unwrap();
    found.energies.unwrap()
}

#[test]
fn peak_energies_hold_the_truth_or_are_refused() {
    const N_SEEDS: usize = 200;
    /// As the small experiment's pictures leave in the mean of five trials.
    const NOISE_M: f64 = 1e-6;
    let mut experiment = let_go();
    experiment.analysis.n_replicas = 50;
    let exact = motion(&experiment);
    let truth = peak_energies(&experiment, &exact);
    let mut noisy = exact;
    noisy.independent_sigma_m.fill(NOISE_M);
    noisy.displacement_m.iter_mut().flatten().for_each(|x| x.sigma = NOISE_M);
    let (mut n, mut n_held, mut n_refused) = (0_u32, 0_u32, 0);
    for motion in replicate(&noisy, N_SEEDS, 17) {
        let found = peak_energies(&experiment, &motion);
        n_refused += found.missing.iter().filter(|(_, reason)| *reason == Missing::NotAboveRest).count();
        for (gap, energy_j) in found.gaps.iter().zip(&found.energy_j) {
            // The wave comes back from the wall to gaps 7 to 11 within the record and presses them harder than they were held; the first
            // six never hold more than at rest.
            let at = truth.gaps.iter().position(|known| known == gap && *gap > 6);
            assert!(at.is_some(), "gap {gap}: {energy_j:?}");
            n += 1;
            n_held += u32::from(at.is_some_and(|at| energy_j.covers_95(truth.energy_j[at].value)));
        }
    }
    assert!(n_refused > N_SEEDS && n as usize > 4 * N_SEEDS, "{n_refused} refused, {n} stated");
    // A sigma of 50 replicas makes 94.4 % of 95 % (Student). Three standard deviations of the binomial distribution on both sides.
    let (share, expected) = (f64::from(n_held) / f64::from(n), 0.944_f64);
    let tolerance = 3.0 * (expected * (1.0 - expected) / f64::from(n)).sqrt();
    assert!((share - expected).abs() < tolerance, "{n_held} of {n}");
}
