//! Replicas of a motion with one more draw of its stated errors: the parametric bootstrap.

use std::num::NonZero;
use std::ops::Range;

use chainwave_measurement::{ChainMotion, Estimate, map_in_parallel};
use ndarray::Array2;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Replicas of a motion as its stated errors would have made it: `n` times the motion plus independent noise of
/// [`ChainMotion::independent_sigma_m`] and each error mode times a standard normal amplitude (parametric bootstrap).
///
/// What a function of the motion scatters over the replicas is its standard uncertainty, with every correlation between
/// bodies and times in it. Replica k draws from its own stream of `seed`, so it does not depend on `n` or on the order in
/// which replicas are used. Samples that were lost stay lost.
pub fn replicate(motion: &ChainMotion, n: usize, seed: u64) -> impl Iterator<Item = ChainMotion> + '_ {
    (0..n)
        .flat_map(move |index| replicas_m(motion, index..index + 1, seed))
        .map(|displacement_m| ChainMotion { displacement_m, ..motion.clone() })
}

/// How many replicas of a motion are drawn, and from which stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Replicas {
    /// Their number.
    pub n: usize,
    /// Seed of their stream.
    pub seed: u64,
}

/// Replicas that are drawn together, so that patterns of errors are read from memory once for all of them.
const TOGETHER: usize = 4;

/// What a function makes of the displacements of each replica of a motion, as [`replicate`] gives them.
pub(crate) fn over_replicas<T: Send + Sync>(
    motion: &ChainMotion,
    Replicas { n, seed }: Replicas,
    n_threads: NonZero<usize>,
    of: impl Fn(Array2<Option<Estimate>>) -> T + Sync,
) -> Vec<T> {
    let groups = map_in_parallel(n.div_ceil(TOGETHER), n_threads, |group| {
        let together = group * TOGETHER..n.min((group + 1) * TOGETHER);
        replicas_m(motion, together, seed).into_iter().map(&of).collect::<Vec<T>>()
    });
    groups.into_iter().flatten().collect()
}

/// Displacements of some replicas of a motion, by their numbers.
fn replicas_m(motion: &ChainMotion, numbers: Range<usize>, seed: u64) -> Vec<Array2<Option<Estimate>>> {
    let mut randoms: Vec<Pcg64> = numbers.map(|index| generator(seed, index)).collect();
    let amplitudes: Vec<Vec<f64>> = randoms
        .iter_mut()
        .map(|random| (0..motion.modes.len()).map(|_| normal(random)).collect::<Vec<f64>>())
        .map(|of_modes| motion.modes.of_patterns(&of_modes))
        .collect();
    let mut errors_m = vec![Array2::<f64>::zeros(motion.displacement_m.dim()); randoms.len()];
    for body in 0..motion.n_bodies() {
        for (k, pattern) in motion.modes.patterns().iter().enumerate() {
            let Some(of_body) = pattern.row(body) else { continue };
            for (error_m, amplitudes) in errors_m.iter_mut().zip(&amplitudes) {
                error_m.row_mut(body).scaled_add(amplitudes[k], &of_body);
            }
        }
    }
    let replicas = errors_m.into_iter().zip(&mut randoms);
    replicas.map(|(error_m, random)| with_errors(motion, error_m, random)).collect()
}

/// A motion with the errors of its modes, and one more draw of those that are independent.
fn with_errors(
    motion: &ChainMotion,
    mut error_m: Array2<f64>,
    random: &mut Pcg64,
) -> Array2<Option<Estimate>> {
    error_m
        .zip_mut_with(&motion.independent_sigma_m, |error_m, sigma_m| *error_m += sigma_m * normal(random));
    let mut displacement_m = motion.displacement_m.clone();
    displacement_m.zip_mut_with(&error_m, |x, error_m| {
        if let Some(x) = x {
            x.value += error_m;
        }
    });
    displacement_m
}

fn normal(random: &mut Pcg64) -> f64 {
    StandardNormal.sample(random)
}

/// The generator of one replica. Streams of a linear congruential generator that start from neighbouring states are related,
/// so seed and index are mixed (Steele, Lea and Flood's SplitMix finaliser) before they become a state.
fn generator(seed: u64, index: usize) -> Pcg64 {
    Pcg64::seed_from_u64(mixed(mixed(seed).wrapping_add(index as u64)))
}

fn mixed(number: u64) -> u64 {
    let z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::ErrorModes;
    use ndarray::array;

    fn motion() -> ChainMotion {
        let mut displacement_m = Array2::from_elem((2, 2), Some(Estimate::new(1.0, 0.5)));
        displacement_m[(1, 1)] = None;
        let mut modes = ErrorModes::default();
        modes.push("stage".into(), &array![[0.4, 0.4], [0.0, -0.8]]);
        ChainMotion {
            times_s: vec![0.0, 1.0],
            displacement_m,
            independent_sigma_m: array![[0.3, 0.3], [0.1, 0.0]],
            modes,
            n_trials: Array2::ones((2, 2)),
        }
    }

    #[test]
    fn replicas_scatter_as_stated() {
        let n = 20_000;
        let errors: Vec<[f64; 3]> = replicate(&motion(), n, 5)
            .map(|noisy| {
                let error = |place| noisy.displacement_m[place].unwrap().value - 1.0;
                [error((0, 0)), error((0, 1)), error((1, 0))]
            })
            .collect();
        let mean_product = |i: usize, j: usize| errors.iter().map(|e| e[i] * e[j]).sum::<f64>() / n as f64;
        // Sampling error of a variance is sqrt(2/n) = 1 % of it; five times that.
        assert!((mean_product(0, 0) / 0.25 - 1.0).abs() < 0.05);
        assert!((mean_product(0, 1) / 0.16 - 1.0).abs() < 0.10);
        assert!((mean_product(2, 2) / 0.01 - 1.0).abs() < 0.05);
        // Sampling error of a vanishing covariance: 0.5 * 0.1 / sqrt(n) = 3.5e-4.
        assert!(mean_product(0, 2).abs() < 1.8e-3);
    }

    #[test]
    fn replicas_that_are_drawn_together_are_those_drawn_one_by_one() {
        let alone: Vec<_> =
            replicate(&motion(), 2 * TOGETHER + 1, 9).map(|noisy| noisy.displacement_m).collect();
        for n_threads in [1, 3] {
            let n_threads = NonZero::new(n_threads).unwrap();
            let replicas = Replicas { n: alone.len(), seed: 9 };
            assert_eq!(over_replicas(&motion(), replicas, n_threads, |x_m| x_m), alone);
        }
    }

    #[test]
    fn lost_samples_stay_lost_and_the_stream_depends_on_seed_and_index_alone() {
        let few: Vec<ChainMotion> = replicate(&motion(), 2, 9).collect();
        let many: Vec<ChainMotion> = replicate(&motion(), 5, 9).collect();
        assert_eq!(few[..], many[..2]);
        assert!(few.iter().all(|noisy| noisy.displacement_m[(1, 1)].is_none()));
        assert_ne!(few[0], few[1]);
        assert_ne!(Some(&few[0]), replicate(&motion(), 1, 10).collect::<Vec<_>>().first());
    }
}
