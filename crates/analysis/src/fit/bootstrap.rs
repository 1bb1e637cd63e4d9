use chainwave_measurement::Observation;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::arrow::Eliminated;
use super::track_problem::{Linearised, N_DAMPINGS, Problem};

/// Draws behind the standard deviations.
const N_DRAWS: usize = 500;
const SEED: u64 = 1;

/// Standard deviations of c_d and c_s over experiments whose recordings are drawn with replacement from those of each view.
///
/// A draw only weighs the recordings' equations, and one Gauss-Newton step from the minimum answers it, right to second order: no
/// simulation is needed (the one-step bootstrap).
pub(super) fn bootstrap(
    problem: &Problem<'_>,
    at: &Linearised,
    recordings: &[Eliminated],
) -> [f64; N_DAMPINGS] {
    let mut random = Pcg64::seed_from_u64(SEED);
    let views = views(problem.observations);
    let mut draws: Vec<[f64; N_DAMPINGS]> = Vec::with_capacity(N_DRAWS);
    for _ in 0..N_DRAWS {
        let mut weights = vec![0.0; recordings.len()];
        for view in &views {
            view.iter().for_each(|_| weights[view[random.random_range(0..view.len())]] += 1.0);
        }
        draws.extend(at.equations(recordings, |r| weights[r], 0.0).step().map(|step| [step[0], step[1]]));
    }
    std::array::from_fn(|i| {
        let n = draws.len().max(2) as f64;
        let mean = draws.iter().map(|draw| draw[i]).sum::<f64>() / n;
        (draws.iter().map(|draw| (draw[i] - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
    })
}

/// The recordings of each view.
fn views(observations: &[Observation]) -> Vec<Vec<usize>> {
    let mut numbers: Vec<u32> = observations.iter().map(|observation| observation.view).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let of = |number: &u32| (0..observations.len()).filter(|r| observations[*r].view == *number).collect();
    numbers.iter().map(of).collect()
}
