//! How the damping scatters over recordings drawn anew.

use std::collections::BTreeMap;

use chainwave_analysis::probability::student;
use chainwave_measurement::{Estimate, Observation};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::damping::N_DAMPINGS;
use crate::least_squares::Reduced;

/// Draws behind the variance of each view.
const N_DRAWS: usize = 500;
const SEED: u64 = 1;

/// How a quantity scatters over trials drawn anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverTrials {
    /// Its standard deviation.
    pub sigma: f64,
    /// Degrees of freedom of that: few where the recordings of one view say most.
    pub freedom: f64,
}

impl OverTrials {
    fn factor_95(&self) -> f64 {
        student(Estimate::COVERAGE_95, self.freedom)
    }

    /// The 95 % interval around a value, by Student's t.
    pub fn interval_95(&self, value: f64) -> (f64, f64) {
        let half = self.factor_95() * self.sigma;
        (value - half, value + half)
    }

    /// The estimate that has that interval.
    pub fn estimate(&self, value: f64) -> Estimate {
        Estimate::new(value, self.factor_95() / Estimate::COVERAGE_95 * self.sigma)
    }
}

/// How c_d and c_s scatter over experiments whose recordings are drawn with replacement from those of each view; `None` where a view
/// has a single one.
///
/// Of a view's n recordings n - 1 are drawn and weighed n/(n - 1) times, which leaves no bias in the variance (Rao and Wu 1988). Views
/// are drawn one by one, since their variances add, and each has n - 1 degrees of freedom (Satterthwaite 1946 for their sum). A draw
/// only weighs the recordings' equations, and one Gauss-Newton step from the minimum answers it, right to second order: no simulation
/// is needed (the one-step bootstrap).
pub(super) fn bootstrap(
    observations: &[Observation],
    equations: &Reduced,
) -> Option<[OverTrials; N_DAMPINGS]> {
    let mut random = Pcg64::seed_from_u64(SEED);
    let views = views(observations);
    if views.iter().any(|view| view.len() < 2) {
        return None;
    }
    let mut of_views = Vec::with_capacity(views.len());
    for view in &views {
        let drawn = view.len() - 1;
        let mut draws: Vec<[f64; N_DAMPINGS]> = Vec::with_capacity(N_DRAWS);
        // Few trials are drawn in few ways.
        let mut known: BTreeMap<Vec<u32>, Option<[f64; N_DAMPINGS]>> = BTreeMap::new();
        for _ in 0..N_DRAWS {
            let mut times = vec![0; view.len()];
            (0..drawn).for_each(|_| times[random.random_range(0..view.len())] += 1);
            let step = known.entry(times).or_insert_with_key(|times| {
                let mut weights = vec![1.0; equations.n_recordings()];
                for (r, times) in view.iter().zip(times) {
                    weights[*r] = f64::from(*times) * view.len() as f64 / drawn as f64;
                }
                equations.weighted(|r| weights[r]).step().map(|step| [step[0], step[1]])
            });
            draws.extend(*step);
        }
        of_views.push((drawn as f64, std::array::from_fn(|i| variance(&draws, i))));
    }
    Some(std::array::from_fn(|i| {
        let sum: f64 = of_views.iter().map(|(_, variances): &(f64, [f64; N_DAMPINGS])| variances[i]).sum();
        let squares: f64 = of_views.iter().map(|(freedom, variances)| variances[i].powi(2) / freedom).sum();
        OverTrials { sigma: sum.sqrt(), freedom: sum.powi(2) / squares }
    }))
}

fn variance(draws: &[[f64; N_DAMPINGS]], i: usize) -> f64 {
    let n = draws.len().max(2) as f64;
    let mean = draws.iter().map(|draw| draw[i]).sum::<f64>() / n;
    draws.iter().map(|draw| (draw[i] - mean).powi(2)).sum::<f64>() / (n - 1.0)
}

/// The recordings of each view.
fn views(observations: &[Observation]) -> Vec<Vec<usize>> {
    let mut numbers: Vec<u32> = observations.iter().map(|observation| observation.view).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let of = |number: &u32| (0..observations.len()).filter(|r| observations[*r].view == *number).collect();
    numbers.iter().map(of).collect()
}
