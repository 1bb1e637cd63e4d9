//! The sums over a subset's pixels that a Gauss-Newton step needs: the innermost loop.

use pulp::Simd;

use crate::Shape;
use crate::prepared::Linearised;
use crate::prepared::moments::PARENTS;
use crate::simd::{InBlocks, LANES, sum_of_lanes};
use crate::warp::{MAX_PARAMETERS, Step};

/// Sums over the pixels of a sampled target g with the subset's prepared images.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Sums {
    /// Z_p g, in the order of the parameters.
    steepest: [f64; MAX_PARAMETERS],
    /// f g.
    intensity: f64,
    /// g.
    total: f64,
    /// g^2.
    square: f64,
}

/// Sums `samples` (the subset's pixels row by row, then zeros up to whole vectors).
pub(crate) fn sum(subset: &Linearised, samples: &[f32]) -> Sums {
    match subset.settings.shape {
        Shape::Translation => Summation::<1> { subset, samples }.dispatch(),
        Shape::Rigid | Shape::Affine => Summation::<3> { subset, samples }.dispatch(),
        Shape::Quadratic => Summation::<6> { subset, samples }.dispatch(),
    }
}

/// The sums with the first `TERMS` of the shape function's terms. A lane's f32 sum is of a few dozen terms, so it is
/// good to 2e-7, which is that part of a pixel in the step.
///
/// Written in explicit vectors, for compilers keep the sums of an array's lanes in memory.
struct Summation<'a, const TERMS: usize> {
    subset: &'a Linearised,
    samples: &'a [f32],
}

impl<const TERMS: usize> InBlocks for Summation<'_, TERMS> {
    type Output = Sums;

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> Sums {
        let zeros = [simd.splat_f32s(0.0); VECTORS];
        let (mut along_x, mut along_y, mut others) = ([zeros; TERMS], [zeros; TERMS], [zeros; 3]);
        let Linearised { intensity, gradient_x, gradient_y, columns, rows, .. } = self.subset;
        let [target, reference, slope_x, slope_y, columns, rows] =
            [self.samples, intensity, gradient_x, gradient_y, columns, rows]
                .map(|values| S::as_simd_f32s(values).0.as_chunks::<VECTORS>().0);
        let places = columns.iter().zip(rows);
        let slopes = slope_x.iter().zip(slope_y);
        for (((g, f), (slope_x, slope_y)), (x, y)) in target.iter().zip(reference).zip(slopes).zip(places) {
            for i in 0..VECTORS {
                let add = |sum: &mut S::f32s, a, b| *sum = simd.mul_add_f32s(a, b, *sum);
                let (u, v) = (simd.mul_f32s(slope_x[i], g[i]), simd.mul_f32s(slope_y[i], g[i]));
                along_x[0][i] = simd.add_f32s(along_x[0][i], u);
                along_y[0][i] = simd.add_f32s(along_y[0][i], v);
                let (mut terms_x, mut terms_y) = ([u; TERMS], [v; TERMS]);
                for term in 1..TERMS {
                    let (before, axis) = const { PARENTS }[term];
                    let place = if axis == 0 { x[i] } else { y[i] };
                    terms_x[term] = simd.mul_f32s(terms_x[before], place);
                    terms_y[term] = simd.mul_f32s(terms_y[before], place);
                    along_x[term][i] = simd.add_f32s(along_x[term][i], terms_x[term]);
                    along_y[term][i] = simd.add_f32s(along_y[term][i], terms_y[term]);
                }
                add(&mut others[0][i], f[i], g[i]);
                others[1][i] = simd.add_f32s(others[1][i], g[i]);
                add(&mut others[2][i], g[i], g[i]);
            }
        }
        let total = |vectors: &[S::f32s; VECTORS]| {
            let mut lanes = [0.0; LANES];
            lanes.copy_from_slice(pulp::bytemuck::cast_slice(vectors));
            sum_of_lanes(lanes)
        };
        let mut steepest = [0.0; MAX_PARAMETERS];
        for term in 0..TERMS {
            steepest[term] = total(&along_x[term]);
            steepest[TERMS + term] = total(&along_y[term]);
        }
        let [intensity, total, square] = others.each_ref().map(total);
        Sums { steepest, intensity, total, square }
    }
}

/// Sum of squares of what a target that is sampled as above, with this mean and gain, differs from the reference; and the
/// same with each pixel's square times the reference there.
///
/// The first number follows from the sums, yet where the images are nearly free of noise only as the difference of two
/// that agree to all digits of f32.
pub(crate) fn squares(subset: &Linearised, samples: &[f32], mean: f64, gain: f64) -> [f64; 2] {
    let (mean, gain) = (mean as f32, gain as f32);
    let target = samples[..subset.intensity.len()].as_chunks::<LANES>().0;
    let (reference, weights) =
        (subset.intensity.as_chunks::<LANES>().0, subset.weights.as_chunks::<LANES>().0);
    chainwave_vectors::dispatch_loop(
        #[inline(always)]
        || {
            let (mut lanes, mut by_light) = ([0.0; LANES], [0.0; LANES]);
            for ((g, f), weight) in target.iter().zip(reference).zip(weights) {
                for i in 0..LANES {
                    let difference = weight[i] * (g[i] - mean - gain * f[i]);
                    let square = difference * difference;
                    lanes[i] += square;
                    by_light[i] += square * f[i];
                }
            }
            [sum_of_lanes(lanes), sum_of_lanes(by_light)]
        },
    )
}

/// How well a sampled target fits, and the step to a better place.
pub(crate) struct Evaluation {
    /// Zero-normalised cross-correlation.
    pub(crate) zncc: f64,
    /// Gain of the target over the reference.
    pub(crate) gain: f64,
    /// Mean of the samples.
    pub(crate) mean: f64,
    /// Z' g.
    pub(crate) slopes: [f64; MAX_PARAMETERS],
    pub(crate) step: Step,
}

/// Contrast of the target over that of the reference below which the target is uniform but for rounding.
const LEAST_GAIN: f64 = 1e-3;

impl Sums {
    /// The step of [`Linearised`]'s normal equations; `None` when the target has no contrast of the same sign.
    pub(crate) fn evaluate(&self, subset: &Linearised) -> Option<Evaluation> {
        let variation = self.square - self.total * self.total / subset.n_used as f64;
        let gain = self.intensity / subset.signal_energy;
        let usable = gain > LEAST_GAIN && variation > 0.0 && gain.is_finite() && variation.is_finite();
        if !usable {
            return None;
        }
        let mut orthogonal = self.steepest;
        for (sum, [mean, slope]) in orthogonal.iter_mut().zip(subset.projections) {
            *sum -= mean * self.total + slope * self.intensity;
        }
        let n_sums = 2 * subset.settings.shape.n_terms();
        let mut parameters = [0.0; MAX_PARAMETERS];
        for (parameter, row) in parameters.iter_mut().zip(&subset.inverse).take(n_sums) {
            let products = row.iter().zip(&orthogonal).take(n_sums).map(|(inverse, sum)| inverse * sum);
            *parameter = products.sum::<f64>() / gain;
        }
        Some(Evaluation {
            // rounding takes that of equal images above 1
            zncc: (self.intensity / (subset.energy * variation).sqrt()).min(1.0),
            gain,
            mean: self.total / subset.n_used as f64,
            slopes: orthogonal,
            step: Step::new(subset.settings.shape, &parameters),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Interpolation, PreparedSubset, Reference, Settings};
    use chainwave_measurement::{Region, Subset};

    #[test]
    fn vectors_sum_as_plain_loops_do_and_with_the_same_bits_everywhere() {
        let region = Region::whole(70, 70);
        let wave = |i: usize| {
            let (x, y) = ((i % 70) as f32, (i / 70) as f32);
            1000.0 + 300.0 * (0.7 * x + 0.2 * y).sin() + 200.0 * (0.3 * x - 0.5 * y).cos()
        };
        let pixels = (0..region.n_pixels()).map(wave).collect();
        let reference = Reference::new(region, pixels, 1).unwrap();
        let centre = Subset::new("a", 35.0, 35.0, 16, 15);
        let settings = Settings { interpolation: Interpolation::Cubic, ..Settings::default() };
        let subset = PreparedSubset::new(&reference, &centre, &settings).unwrap();
        let mut samples: Vec<f32> = (0..subset.n_pixels()).map(|i| 1.1 * wave(i) - 1000.0).collect();
        samples.resize(subset.intensity.len(), 0.0);
        let found = sum(&subset, &samples);
        assert_eq!(found, Summation::<3> { subset: &subset, samples: &samples }.scalar());
        let plain = |of: &dyn Fn(usize) -> f32| -> [f64; 2] {
            let terms = (0..subset.n_pixels()).map(|i| f64::from(of(i)) * f64::from(samples[i]));
            terms.fold([0.0; 2], |[sum, size], term| [sum + term, size + term.abs()])
        };
        let x_slope = |i: usize| subset.gradient_x[i] * subset.columns[i];
        let y_slope = |i: usize| subset.gradient_y[i] * subset.rows[i];
        for (found, [sum, size]) in [
            (found.steepest[0], plain(&|i| subset.gradient_x[i])),
            (found.steepest[1], plain(&x_slope)),
            (found.steepest[5], plain(&y_slope)),
            (found.intensity, plain(&|i| subset.intensity[i])),
            (found.total, plain(&|_| 1.0)),
            (found.square, plain(&|i| samples[i])),
        ] {
            assert!((found - sum).abs() < 1e-6 * size, "f32 sums of 70 terms: {found} {sum}");
        }
    }
}
