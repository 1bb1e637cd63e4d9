//! A line or a continuum: Thomson's F-test on multitaper spectra of the tails.

use std::f64::consts::PI;

use rustfft::num_complex::Complex;

use crate::measured_rates;
use crate::probability::chi_squared_beyond;
use crate::rule::{Rule, SIGNIFICANCE_LEVEL};
use crate::tail::Tail;
use crate::{LeadingPulse, Missing, StrainMap};

/// Tapers. Each gap's test then has 2 degrees of freedom against 2 (N_TAPERS - 1).
const N_TAPERS: usize = 5;

/// Whether a frequency of the tails is a line (an oscillation that keeps its frequency) or the crest of a continuum, as
/// dispersion alone makes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineTest {
    /// Probability that tails without a line look as much like one at the best of all resolved frequencies; a line is told
    /// where it is small.
    pub p_value: f64,
    /// Half width in hertz of the band in which the test takes the continuum for flat, for the longest tail.
    pub half_bandwidth_hz: f64,
    /// Gaps whose tails took part.
    pub n_gaps: usize,
}

/// Thomson's F-test (Proceedings of the IEEE 70, 1982, eq. 13.9) at one frequency, with the sine tapers of Riedel and Sidorenko
/// (IEEE Transactions on Signal Processing 43, 1995), which need no eigenvalue problem: five of them, so that the band is
/// `3/duration` wide on each side and leakage falls as the fourth power of the distance in power.
///
/// Every second gap takes part: two of them share no body, so their errors are independent. Their probabilities are joined by
/// Fisher's rule, and multiplied by the number of resolved frequencies (Bonferroni), as the frequency was chosen for its power.
///
/// # Errors
/// [`Missing::NoTail`] when no gap has a tail.
pub fn line_test(
    map: &StrainMap,
    pulses: &[Result<LeadingPulse, Missing>],
    frequency_hz: f64,
) -> Result<LineTest, Missing> {
    let tails = pulses.iter().flatten().step_by(2).filter_map(|pulse| Tail::of(map, pulse).ok());
    let tails: Vec<Tail> = tails.collect();
    let longest = tails.iter().map(|tail| tail.values.len()).max().ok_or(Missing::NoTail)?;
    let cycles = frequency_hz * map.interval_s();
    let p_values: Vec<f64> = tails.iter().map(|tail| p_value(&tail.values, cycles)).collect();
    let n_frequencies = 0.5 * longest as f64;
    Ok(LineTest {
        p_value: (n_frequencies * fisher(&p_values)).min(1.0),
        half_bandwidth_hz: 0.5 * (N_TAPERS + 1) as f64 / (longest as f64 * map.interval_s()),
        n_gaps: tails.len(),
    })
}

/// The rule by which a tail counts as a line.
pub fn line_rule() -> Rule {
    Rule {
        question: "what the tail is",
        text: format!(
            "a line where Thomson's F-test rejects a continuum at the dominant frequency ({} % level, all resolved frequencies allowed for)",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::LINE.to_vec(),
    }
}

/// Joint probability of so large an F in the tails of several gaps at a frequency in cycles a sample that nothing has chosen.
pub(crate) fn p_value_at(tails: &[Vec<f64>], cycles: f64) -> f64 {
    fisher(&tails.iter().map(|tail| p_value(tail, cycles)).collect::<Vec<_>>())
}

/// Probability of so large an F at a frequency in cycles a sample, without a line there: of an F with 2 and 2 (K - 1) degrees of
/// degrees of freedom, (1 + F/(K - 1))^-(K - 1).
fn p_value(values: &[f64], cycles: f64) -> f64 {
    let taper = |k: usize, at: usize| {
        let n = values.len() as f64 + 1.0;
        (2.0 / n).sqrt() * (PI * k as f64 * (at as f64 + 1.0) / n).sin()
    };
    let mut projections = [Complex::new(0.0, 0.0); N_TAPERS];
    let mut sums = [0.0; N_TAPERS];
    for (at, value) in values.iter().enumerate() {
        let turned = Complex::from_polar(*value, -2.0 * PI * cycles * at as f64);
        for k in 0..N_TAPERS {
            let weight = taper(k + 1, at);
            projections[k] += turned * weight;
            sums[k] += weight;
        }
    }
    let power: f64 = sums.iter().map(|sum| sum * sum).sum();
    let amplitude = projections.iter().zip(sums).map(|(y, sum)| y * sum).sum::<Complex<f64>>() / power;
    let left: f64 = projections.iter().zip(sums).map(|(y, sum)| (y - amplitude * sum).norm_sqr()).sum();
    let ratio = amplitude.norm_sqr() * power / left.max(f64::MIN_POSITIVE);
    (1.0 + ratio).powi(1 - N_TAPERS as i32)
}

/// Fisher's rule: minus twice the sum of the logarithms of n probabilities is chi squared with 2 n degrees of freedom.
fn fisher(p_values: &[f64]) -> f64 {
    let sum: f64 = p_values.iter().map(|p| -2.0 * p.max(f64::MIN_POSITIVE).ln()).sum();
    chi_squared_beyond(sum, 2.0 * p_values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    fn noise(random: &mut Pcg64, n: usize) -> Vec<f64> {
        (0..n).map(|_| StandardNormal.sample(random)).collect()
    }

    #[test]
    fn noise_passes_for_a_line_as_seldom_as_stated() {
        let mut random = Pcg64::seed_from_u64(3);
        let n = 2000;
        let mut counts = [0.0; 2];
        for _ in 0..n {
            let of_gaps: Vec<f64> = (0..6).map(|_| p_value(&noise(&mut random, 180), 0.07)).collect();
            counts[0] += f64::from(u8::from(of_gaps[0] < 0.05));
            counts[1] += f64::from(u8::from(fisher(&of_gaps) < 0.05));
        }
        for count in counts {
            // Binomial: 5 % of 2000 is 100 +- 10; four of them.
            assert!((count - 100.0_f64).abs() < 40.0, "{count} of {n}");
        }
    }

    #[test]
    fn a_line_is_found_in_noise_and_the_neighbouring_frequency_is_none() {
        let mut random = Pcg64::seed_from_u64(8);
        let n = 180;
        let mut line = noise(&mut random, n);
        // A line of half the noise's deviation stands 0.25 n / 4 = 11 above the noise in power.
        line.iter_mut().enumerate().for_each(|(at, x)| *x += 0.7 * (2.0 * PI * 0.07 * at as f64).cos());
        let p = |cycles: f64| fisher(&[p_value(&line, cycles)]);
        assert!(p(0.07) < 1e-3, "{}", p(0.07));
        assert!(p(0.13) > 1e-2, "{}", p(0.13));
    }

    #[test]
    fn fishers_rule_on_one_and_on_two_probabilities() {
        assert!((fisher(&[0.03]) - 0.03).abs() < 1e-15);
        // P(p1 p2 < q) = q (1 - ln q).
        let q: f64 = 0.2 * 0.1;
        assert!((fisher(&[0.2, 0.1]) - q * (1.0 - q.ln())).abs() < 1e-15);
    }
}
