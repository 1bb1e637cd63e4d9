//! Local least-squares polynomials, smoothing and interpolation of one series with holes.

use chainwave_vectors::dispatch_loop;
use nalgebra::{SMatrix, SVector};

/// Coefficients of the local polynomial (order six). On the chain's skew pulses an order of four needs windows so short, for
/// a bias below the noise, that it is the noisier of the two.
const N_COEFFICIENTS: usize = 7;
/// Samples on each side that determine the polynomial.
pub(crate) const MIN_HALF_WINDOW: usize = N_COEFFICIENTS / 2;
/// Share of a window's samples that must be present for a local fit.
const MIN_PRESENT: f64 = 0.75;

type Normal = SMatrix<f64, N_COEFFICIENTS, N_COEFFICIENTS>;
type Powers = SVector<f64, N_COEFFICIENTS>;

/// The series smoothed by a local least-squares polynomial of order six over `half_window` samples on each side (Savitzky
/// and Golay, 1964); the first and last `half_window` samples take the values of the first and last full window's
/// polynomial. `None` where less than three quarters of the window is present.
pub(crate) fn smooth(series: &[Option<f64>], half_window: usize) -> Vec<Option<f64>> {
    let n = series.len();
    let width = (2 * half_window + 1).min(n);
    let kernel = centre_weights(half_window);
    let value_at =
        |polynomial: &Option<LocalPolynomial>, at: usize| Some(polynomial.as_ref()?.value(at as f64));
    let first = LocalPolynomial::fit(series, 0, width.saturating_sub(1));
    let last = LocalPolynomial::fit(series, n - width, n.saturating_sub(1));
    let full_windows = kernel.as_ref().map(|weights| full_windows(series, weights)).unwrap_or_default();
    let smoothed = |at: usize| {
        if at < half_window {
            return value_at(&first, at);
        }
        if at + half_window >= n {
            return value_at(&last, at);
        }
        let (from, to) = (at - half_window, at + half_window);
        let full = full_windows.get(from).copied().flatten();
        full.or_else(|| value_at(&LocalPolynomial::fit(series, from, to), at))
    };
    (0..n).map(smoothed).collect()
}

/// The weighted sum of each window of a series, by its first sample; `None` where the window has a hole.
fn full_windows(series: &[Option<f64>], weights: &[f64]) -> Vec<Option<f64>> {
    let values: Vec<f64> = series.iter().map(|value| value.unwrap_or(0.0)).collect();
    let mut sums = weighted_sums(&values, weights).into_iter();
    let mut n_missing = series.iter().take(weights.len()).filter(|value| value.is_none()).count();
    let leave_and_enter = series.iter().zip(series.iter().skip(weights.len()).map(Some).chain([None]));
    let window = |(leaves, enters): (&Option<f64>, Option<&Option<f64>>)| {
        let sum = sums.next().filter(|_| n_missing == 0);
        n_missing += usize::from(enters.is_some_and(Option::is_none));
        n_missing -= usize::from(leaves.is_none());
        sum
    };
    leave_and_enter.map(window).collect()
}

/// The weighted sum of each window of some values. Several windows go side by side, each with its sum in the order of the weights, so that no
/// sum depends on the width of vectors.
fn weighted_sums(values: &[f64], weights: &[f64]) -> Vec<f64> {
    /// As many as hide how long one addition takes.
    const TOGETHER: usize = 32;
    let n = (values.len() + 1).saturating_sub(weights.len());
    let mut sums = vec![0.0; n];
    dispatch_loop(
        #[inline(always)]
        || {
            let (blocks, rest) = sums.as_chunks_mut::<TOGETHER>();
            let n_done = blocks.len() * TOGETHER;
            for (first, block) in (0..).step_by(TOGETHER).zip(blocks) {
                let mut together = [0.0; TOGETHER];
                for (weight, values) in weights.iter().zip(values[first..].windows(TOGETHER)) {
                    for (sum, value) in together.iter_mut().zip(values) {
                        *sum += weight * value;
                    }
                }
                *block = together;
            }
            for (sum, values) in rest.iter_mut().zip(values[n_done..].windows(weights.len().max(1))) {
                *sum = weights.iter().zip(values).fold(0.0, |sum, (weight, value)| sum + weight * value);
            }
        },
    );
    sums
}

/// What smoothing over a full window leaves of independent noise.
pub(crate) fn smoothing_gain(half_window: usize) -> f64 {
    let weights = centre_weights(half_window);
    weights.map_or(1.0, |weights| weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt())
}

/// Weights that give the polynomial's value at the centre of a full window; `None` when it is too short.
fn centre_weights(half_window: usize) -> Option<Vec<f64>> {
    let half = half_window as f64;
    let powers: Vec<Powers> =
        (0..=2 * half_window).map(|at| powers_of((at as f64 - half) / half.max(1.0))).collect();
    let normal = normal_of(powers.iter().copied());
    let at_centre = normal.cholesky()?.solve(&powers_of(0.0));
    (half_window >= MIN_HALF_WINDOW).then(|| powers.iter().map(|power| power.dot(&at_centre)).collect())
}

fn powers_of(z: f64) -> Powers {
    let (z2, z3) = (z * z, z * z * z);
    Powers::from([1.0, z, z2, z3, z2 * z2, z2 * z3, z3 * z3])
}

/// The derivatives of these.
fn slopes_of_powers(z: f64) -> Powers {
    let powers = powers_of(z);
    Powers::from_fn(|power, _| power.checked_sub(1).map_or(0.0, |lower| power as f64 * powers[lower]))
}

/// The series between its samples, at a fractional index: the cubic through the two samples on each side, or the line
/// through the nearest two where an outer one is missing.
#[inline]
pub(crate) fn interpolate(series: &[Option<f64>], place: f64) -> Option<f64> {
    let last_index = series.len().checked_sub(2)?;
    if !(0.0..=(last_index + 1) as f64).contains(&place) {
        return None;
    }
    let at = (place as usize).min(last_index);
    let z = place - at as f64;
    let around = series.get(at.wrapping_sub(1)..).and_then(|series| series.first_chunk());
    if let Some([Some(before), Some(near), Some(far), Some(after)]) = around {
        let [w0, w1, w2, w3] = cubic_weights(z);
        return Some(w0 * before + w1 * near + w2 * far + w3 * after);
    }
    beside_a_hole(series, at, z)
}

/// The same where a sample beside the nearest two may be missing.
#[cold]
fn beside_a_hole(series: &[Option<f64>], at: usize, z: f64) -> Option<f64> {
    let (near, far) = (series[at]?, series[at + 1]?);
    let before = at.checked_sub(1).and_then(|before| series[before]);
    let after = series.get(at + 2).copied().flatten();
    let (Some(before), Some(after)) = (before, after) else {
        return Some(near + z * (far - near));
    };
    let [w0, w1, w2, w3] = cubic_weights(z);
    Some(w0 * before + w1 * near + w2 * far + w3 * after)
}

/// The series at a fractional index by the polynomial of order five through the three samples on each side; `None` where one of them is missing.
pub(crate) fn interpolate_by_six(series: &[Option<f64>], place: f64) -> Option<f64> {
    let first = (place as usize).checked_sub(2)?;
    let around: &[Option<f64>; 6] = series.get(first..)?.first_chunk()?;
    let mut joined = [0.0; 6];
    for (value, sample) in joined.iter_mut().zip(around) {
        *value = (*sample)?;
    }
    let z = place - (first + 2) as f64;
    // Aitken's scheme: each column joins polynomials through one sample more.
    for order in 1..joined.len() {
        for i in 0..joined.len() - order {
            let (low, high) = (i as f64 - 2.0, (i + order) as f64 - 2.0);
            joined[i] = ((high - z) * joined[i] + (z - low) * joined[i + 1]) / (high - low);
        }
    }
    Some(joined[0])
}

/// Lagrange's weights of four equally spaced values at -1, 0, 1, 2 for the place `z` in 0..=1.
#[inline]
pub(crate) fn cubic_weights(z: f64) -> [f64; 4] {
    [
        -z * (z - 1.0) * (z - 2.0) / 6.0,
        (z + 1.0) * (z - 1.0) * (z - 2.0) / 2.0,
        -(z + 1.0) * z * (z - 2.0) / 2.0,
        (z + 1.0) * z * (z - 1.0) / 6.0,
    ]
}

/// A least-squares polynomial of order six through samples around `centre`.
#[derive(Debug, Clone)]
pub(crate) struct LocalPolynomial {
    centre: f64,
    half_width: f64,
    coefficients: Powers,
}

impl LocalPolynomial {
    /// Fits the samples `first..=last` of a series, in the coordinate of the sample's index; `None` when less than three
    /// quarters of them are present or they do not determine it.
    pub(crate) fn fit(series: &[Option<f64>], first: usize, last: usize) -> Option<Self> {
        let window = series.get(first..=last)?;
        let (centre, half_width) = centre_and_half_width(first, last);
        let n_present = window.iter().flatten().count();
        if n_present < N_COEFFICIENTS || (n_present as f64) < MIN_PRESENT * window.len() as f64 {
            return None;
        }
        let (mut normal, mut right) = (Normal::zeros(), Powers::zeros());
        for (at, value) in (first..).zip(window) {
            let Some(value) = value else { continue };
            let powers = powers_of((at as f64 - centre) / half_width);
            add_product(&mut normal, &powers);
            right += powers * *value;
        }
        let coefficients = normal.cholesky()?.solve(&right);
        Some(Self { centre, half_width, coefficients })
    }

    /// The variance that independent noise of unit variance in each of the samples `first..=last` gives the slope of their polynomial.
    pub(crate) fn variance_of_slope(first: usize, last: usize, place: f64) -> Option<f64> {
        let (centre, half_width) = centre_and_half_width(first, last);
        let powers = (first..=last).map(|at| powers_of((at as f64 - centre) / half_width));
        let normal = normal_of(powers);
        let slopes = slopes_of_powers((place - centre) / half_width) / half_width;
        Some(slopes.dot(&normal.cholesky()?.solve(&slopes)))
    }

    /// Place (sample index) and value of the greatest interior maximum within the fitted window; `None` when the polynomial
    /// is greatest at the window's end.
    pub(crate) fn maximum(&self) -> Option<(f64, f64)> {
        const N_STEPS: i32 = 64;
        let z_of = |step: i32| 2.0 * f64::from(step) / f64::from(N_STEPS) - 1.0;
        let best = (0..=N_STEPS).max_by(|a, b| self.at_z(z_of(*a)).total_cmp(&self.at_z(z_of(*b))))?;
        if best == 0 || best == N_STEPS {
            return None;
        }
        let z = self.root_of_slope(z_of(best - 1), z_of(best + 1));
        Some((self.centre + self.half_width * z, self.at_z(z)))
    }

    /// The polynomial's value at a fractional sample index.
    pub(crate) fn value(&self, place: f64) -> f64 {
        self.at_z((place - self.centre) / self.half_width)
    }

    /// The polynomial's derivative by the sample index.
    pub(crate) fn slope(&self, place: f64) -> f64 {
        self.slope_at_z((place - self.centre) / self.half_width) / self.half_width
    }

    fn at_z(&self, z: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * z + coefficient)
    }

    fn slope_at_z(&self, z: f64) -> f64 {
        (1..N_COEFFICIENTS).rev().fold(0.0, |sum, power| sum * z + power as f64 * self.coefficients[power])
    }

    /// Bisection: the slope is positive at `low` and negative at `high`, which enclose one maximum.
    fn root_of_slope(&self, mut low: f64, mut high: f64) -> f64 {
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.slope_at_z(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// The lower triangle of the normal equations' matrix.
fn normal_of(powers: impl Iterator<Item = Powers>) -> Normal {
    let mut normal = Normal::zeros();
    powers.for_each(|powers| add_product(&mut normal, &powers));
    normal
}

/// Adds a vector's product with itself; the factorization asks for no more than the lower triangle.
fn add_product(normal: &mut Normal, powers: &Powers) {
    for column in 0..N_COEFFICIENTS {
        for row in column..N_COEFFICIENTS {
            normal[(row, column)] += powers[row] * powers[column];
        }
    }
}

fn centre_and_half_width(first: usize, last: usize) -> (f64, f64) {
    (0.5 * (first + last) as f64, (0.5 * (last - first) as f64).max(1.0))
}

/// A sample for comparisons, where a missing one is lower than all others.
pub(crate) fn level(series: &[Option<f64>], at: usize) -> f64 {
    series[at].unwrap_or(f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sextic(at: usize) -> f64 {
        let x = at as f64 - 7.3;
        2.0 - 0.3 * x * x + 0.01 * x * x * x - 0.002 * x.powi(4) - 1e-6 * x.powi(6)
    }

    #[test]
    fn six_samples_tell_a_quintic_and_no_sextic() {
        let quintic = |x: f64| 1.0 - 0.4 * x + 0.03 * x.powi(3) - 2e-3 * x.powi(5);
        let series: Vec<Option<f64>> = (0..8).map(|at| Some(quintic(f64::from(at) - 3.5))).collect();
        for place in [2.0, 2.3, 3.5, 4.9] {
            // Rounding alone.
            assert!((interpolate_by_six(&series, place).unwrap() - quintic(place - 3.5)).abs() < 1e-12);
        }
        assert_eq!(interpolate_by_six(&series, 1.5), None, "a sample is missing before it");
        assert_eq!(interpolate_by_six(&series, 5.5), None, "or behind it");
    }

    #[test]
    fn a_sextic_passes_unchanged_with_holes_and_at_the_ends() {
        let mut series: Vec<Option<f64>> = (0..16).map(|at| Some(sextic(at))).collect();
        series[5] = None;
        let smoothed = smooth(&series, 5);
        for (at, value) in smoothed.iter().enumerate() {
            // A fit of the true order leaves rounding alone, amplified by the extrapolated ends.
            assert!((value.unwrap() - sextic(at)).abs() < 1e-9, "sample {at}");
        }
    }

    #[test]
    fn windows_are_summed_one_by_one_or_side_by_side_to_the_same_bits() {
        let weights = centre_weights(5).unwrap();
        for n in [4, 11, 12, 27, 40, 43, 80] {
            let mut series: Vec<Option<f64>> = (0..n).map(|at| Some((0.7 * at as f64).sin())).collect();
            if n == 40 {
                series[22] = None;
            }
            let plain = |window: &[Option<f64>]| {
                let terms = weights.iter().zip(window).map(|(weight, value)| Some(weight * (*value)?));
                terms.sum::<Option<f64>>()
            };
            let expected: Vec<_> = series.windows(weights.len()).map(plain).collect();
            let found = full_windows(&series, &weights);
            assert_eq!(found[..expected.len()], expected);
            assert!(found[expected.len()..].iter().all(Option::is_none));
        }
    }

    #[test]
    fn a_window_with_a_wide_hole_is_lost() {
        let mut series: Vec<Option<f64>> = (0..40).map(|at| Some(sextic(at))).collect();
        series[18..24].fill(None);
        let smoothed = smooth(&series, 5);
        assert!(smoothed[20].is_none());
        assert!(smoothed[8].is_some());
        assert!(LocalPolynomial::fit(&series, 15, 27).is_none());
    }

    #[test]
    fn the_maximum_of_a_sextic_is_exact() {
        let series: Vec<Option<f64>> = (0..16).map(|at| Some(sextic(at))).collect();
        let (place, value) = LocalPolynomial::fit(&series, 2, 12).unwrap().maximum().unwrap();
        // Rounding alone: the slope at 7.3 is zero by construction.
        assert!((place - 7.3).abs() < 1e-9, "{place}");
        assert!((value - 2.0).abs() < 1e-12);
        assert!(LocalPolynomial::fit(&series, 0, 6).unwrap().maximum().is_none());
    }
}
