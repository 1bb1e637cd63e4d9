//! Replicas of a motion with one more draw of its stated errors: the parametric bootstrap.

use chainwave_measurement::{ChainMotion, Estimate};
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
    (0..n).map(move |index| ChainMotion { displacement_m: replica_m(motion, index, seed), ..motion.clone() })
}

/// Displacements of replica `index` of a motion, as [`replicate`] gives it.
pub(crate) fn replica_m(motion: &ChainMotion, index: usize, seed: u64) -> Array2<Option<Estimate>> {
    let mut random = generator(seed, index);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut error_m = Array2::<f64>::zeros(motion.displacement_m.dim());
    for mode in &motion.modes {
        error_m.scaled_add(normal(), &mode.displacement_m);
    }
    error_m.zip_mut_with(&motion.independent_sigma_m, |error_m, sigma_m| *error_m += sigma_m * normal());
    let mut displacement_m = motion.displacement_m.clone();
    displacement_m.zip_mut_with(&error_m, |x, error_m| {
        if let Some(x) = x {
            x.value += error_m;
        }
    });
    displacement_m
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
    use chainwave_measurement::ErrorMode;
    use ndarray::array;

    fn motion() -> ChainMotion {
        let mut displacement_m = Array2::from_elem((2, 2), Some(Estimate::new(1.0, 0.5)));
        displacement_m[(1, 1)] = None;
        let mode = ErrorMode { source: "stage".into(), displacement_m: array![[0.4, 0.4], [0.0, -0.8]] };
        ChainMotion {
            times_s: vec![0.0, 1.0],
            displacement_m,
            independent_sigma_m: array![[0.3, 0.3], [0.1, 0.0]],
            modes: vec![mode],
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
    fn lost_samples_stay_lost_and_the_stream_depends_on_seed_and_index_alone() {
        let few: Vec<ChainMotion> = replicate(&motion(), 2, 9).collect();
        let many: Vec<ChainMotion> = replicate(&motion(), 5, 9).collect();
        assert_eq!(few[..], many[..2]);
        assert!(few.iter().all(|noisy| noisy.displacement_m[(1, 1)].is_none()));
        assert_ne!(few[0], few[1]);
        assert_ne!(Some(&few[0]), replicate(&motion(), 1, 10).collect::<Vec<_>>().first());
    }
}
