//! Whether bodies move across the chain: block means against the noise between neighbouring frames.

use chainwave_measurement::Estimate;

use crate::departure::Departure;
use crate::measured_rates;
use crate::probability::chi_squared_beyond;
use crate::rule::{Rule, SIGNIFICANCE_LEVEL};

/// Frames whose mean stands for a slow excursion.
const BLOCK: usize = 16;
/// Blocks that a track needs.
const MIN_BLOCKS: usize = 4;

/// Whether bodies move across the chain: means of 16 frames about each track's own, against the noise that neighbouring frames differ
/// by. `tracks` hold positions across the chain frame by frame, in metres; lost frames count as missing. `None` where no track is
/// long enough.
///
/// The noise is taken from the tracks themselves, so that a stated uncertainty that is a few per cent off is no motion. The size is the
/// standard deviation of the blocks beyond noise, in metres.
pub fn motion_across(tracks: &[Vec<Option<f64>>]) -> Option<Departure> {
    let (mut chi_squared, mut degrees_of_freedom, mut excess_m2, mut noise_m2) = (0.0, 0, 0.0, 0.0);
    let (mut expected, mut variance) = (0.0, 0.0);
    for track in tracks {
        let seen: Vec<f64> = track.iter().flatten().copied().collect();
        let blocks: Vec<f64> = seen.chunks_exact(BLOCK).map(mean).collect();
        if blocks.len() < MIN_BLOCKS {
            continue;
        }
        let of_mean = half_mean_square_step(&seen) / BLOCK as f64;
        let middle = mean(&blocks);
        let squares: f64 = blocks.iter().map(|block| (block - middle).powi(2)).sum();
        chi_squared += squares / of_mean.max(f64::MIN_POSITIVE);
        let n = blocks.len() - 1;
        let of_ratio = VarianceRatio { above: n as f64, below: freedom_of_steps(seen.len()) };
        expected += of_ratio.mean();
        variance += of_ratio.variance();
        degrees_of_freedom += n;
        excess_m2 += squares - of_mean * n as f64;
        noise_m2 += of_mean * n as f64;
    }
    (degrees_of_freedom > 0).then(|| {
        let n = degrees_of_freedom as f64;
        let deviation_m = (excess_m2.max(0.0) / n).sqrt();
        // The standard error of a variance from n values, over twice the deviation; of none, what would stand out.
        let total_m2 = (excess_m2.max(0.0) + noise_m2) / n;
        let error_m2 = total_m2 * (2.0 / n).sqrt();
        let sigma_m = 0.5 * error_m2 / deviation_m.max((0.5 * error_m2).sqrt());
        // A sum of ratios whose noise is itself known from each track alone: a scaled chi squared of the same mean and variance.
        let scale = 0.5 * variance / expected;
        let p_value = chi_squared_beyond(chi_squared / scale, expected / scale);
        Departure { size: Estimate::new(deviation_m, sigma_m), chi_squared, degrees_of_freedom, p_value }
    })
}

/// The rule by which bodies count as moving across the chain.
pub fn motion_across_rule() -> Rule {
    Rule {
        question: "dimensions of the motion",
        text: format!(
            "1-D unless means of {BLOCK} frames across the chain scatter by more than noise lets them (chi squared, {} % level)",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::MOTION_ACROSS.to_vec(),
    }
}

/// A sum of squares in units of a variance that is itself estimated: `above` times an F of `above` and `below` degrees of freedom.
struct VarianceRatio {
    above: f64,
    below: f64,
}

impl VarianceRatio {
    fn mean(&self) -> f64 {
        self.above * self.below / (self.below - 2.0)
    }

    fn variance(&self) -> f64 {
        let Self { above, below } = self;
        2.0 * above * below * below * (above + below - 2.0) / ((below - 2.0).powi(2) * (below - 4.0))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Variance of independent noise under slow motion (von Neumann, Kent, Bellinson and Hart 1941).
fn half_mean_square_step(values: &[f64]) -> f64 {
    let squares: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    0.5 * squares / (values.len() - 1) as f64
}

/// From how many degrees of freedom that variance is known: its relative variance is (3 n - 4) / (n - 1)^2 (same source).
fn freedom_of_steps(n: usize) -> f64 {
    let n = n as f64;
    2.0 * (n - 1.0).powi(2) / (3.0 * n - 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    /// 30 bodies over 500 frames with noise of 0.3 um, swinging by `swing_m`.
    fn tracks(random: &mut Pcg64, swing_m: f64) -> Vec<Vec<Option<f64>>> {
        let mut position = |k: usize| {
            let noise: f64 = StandardNormal.sample(random);
            Some(0.3e-6 * noise + swing_m * (k as f64 / 80.0).sin())
        };
        (0..30).map(|_| (0..500).map(&mut position).collect()).collect()
    }

    #[test]
    fn rest_is_seldom_taken_for_motion_and_motion_never_for_rest() {
        let mut random = Pcg64::seed_from_u64(4);
        let p = |tracks: &[Vec<Option<f64>>]| motion_across(tracks).unwrap().p_value;
        let n_false = (0..400).filter(|_| p(&tracks(&mut random, 0.0)) < 0.05).count();
        // 5 % of 400 is 20 +- 4.4: four standard errors.
        assert!((3..=37).contains(&n_false), "{n_false} of 400");
        let swinging = motion_across(&tracks(&mut random, 0.1e-6)).unwrap();
        assert!(swinging.p_value < 1e-9, "{swinging:?}");
        // A sine's deviation is its amplitude over the root of 2.
        assert!((swinging.size.value - 0.07e-6).abs() < 4.0 * swinging.size.sigma, "{swinging:?}");
        assert!(motion_across(&[vec![None; 500]]).is_none());
    }
}
