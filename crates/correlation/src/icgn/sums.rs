//! The sums over a subset's pixels that a Gauss-Newton step needs: the innermost loop.

use pulp::Simd;

use crate::Shape;
use crate::prepared::linearised::Linearised;
use crate::prepared::moments::PARENTS;
use crate::simd::{InBlocks, LANES, total};
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
        // One vector of each block after the other: the sums of all would not stay in registers.
        for i in 0..VECTORS {
            let places = columns.iter().zip(rows);
            let slopes = slope_x.iter().zip(slope_y);
            let zero = simd.splat_f32s(0.0);
            let (mut sums_x, mut sums_y, mut sums) = ([zero; TERMS], [zero; TERMS], [zero; 3]);
            for (((g, f), (slope_x, slope_y)), (x, y)) in target.iter().zip(reference).zip(slopes).zip(places)
            {
                let (u, v) = (simd.mul_f32s(slope_x[i], g[i]), simd.mul_f32s(slope_y[i], g[i]));
                sums_x[0] = simd.add_f32s(sums_x[0], u);
                sums_y[0] = simd.add_f32s(sums_y[0], v);
                let (mut terms_x, mut terms_y) = ([u; TERMS], [v; TERMS]);
                for term in 1..TERMS {
                    let (before, axis) = const { PARENTS }[term];
                    let place = if axis == 0 { x[i] } else { y[i] };
                    terms_x[term] = simd.mul_f32s(terms_x[before], place);
                    terms_y[term] = simd.mul_f32s(terms_y[before], place);
                    sums_x[term] = simd.add_f32s(sums_x[term], terms_x[term]);
                    sums_y[term] = simd.add_f32s(sums_y[term], terms_y[term]);
                }
                sums[0] = simd.mul_add_f32s(f[i], g[i], sums[0]);
                sums[1] = simd.add_f32s(sums[1], g[i]);
                sums[2] = simd.mul_add_f32s(g[i], g[i], sums[2]);
            }
            for term in 0..TERMS {
                (along_x[term][i], along_y[term][i]) = (sums_x[term], sums_y[term]);
            }
            for (other, sum) in others.iter_mut().zip(sums) {
                other[i] = sum;
            }
            // So that they do not hold registers during the next pass.
            std::hint::black_box((&mut along_x, &mut along_y, &mut others));
        }
        let mut steepest = [0.0; MAX_PARAMETERS];
        for term in 0..TERMS {
            steepest[term] = total::<S, VECTORS>(&along_x[term]);
            steepest[TERMS + term] = total::<S, VECTORS>(&along_y[term]);
        }
        let [intensity, total, square] = others.each_ref().map(total::<S, VECTORS>);
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
    let samples = &samples[..subset.n_pixels().next_multiple_of(LANES)];
    Squares { subset, samples, mean, gain }.dispatch()
}

struct Squares<'a> {
    subset: &'a Linearised,
    samples: &'a [f32],
    mean: f32,
    gain: f32,
}

impl InBlocks for Squares<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) -> [f64; 2] {
        let (mean, gain) = (simd.splat_f32s(self.mean), simd.splat_f32s(self.gain));
        let zeros = [simd.splat_f32s(0.0); VECTORS];
        let (mut squares, mut by_light) = (zeros, zeros);
        let [target, reference, weights] = [self.samples, &self.subset.intensity, &self.subset.weights]
            .map(|values| S::as_simd_f32s(values).0.as_chunks::<VECTORS>().0);
        // Weights of 1 change nothing, and are not read; those of the filling are 0.
        let all_used = self.subset.n_used == self.subset.n_pixels();
        let n_plain = if all_used { self.subset.n_pixels() / LANES } else { 0 };
        let ones = [simd.splat_f32s(1.0); VECTORS];
        for (at, (g, f)) in target.iter().zip(reference).enumerate() {
            let weight = if at < n_plain { &ones } else { &weights[at] };
            for i in 0..VECTORS {
                let explained = simd.mul_f32s(gain, f[i]);
                let left = simd.sub_f32s(simd.sub_f32s(g[i], mean), explained);
                let difference = simd.mul_f32s(weight[i], left);
                let square = simd.mul_f32s(difference, difference);
                squares[i] = simd.add_f32s(squares[i], square);
                by_light[i] = simd.add_f32s(by_light[i], simd.mul_f32s(square, f[i]));
            }
        }
        [total::<S, VECTORS>(&squares), total::<S, VECTORS>(&by_light)]
    }
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
