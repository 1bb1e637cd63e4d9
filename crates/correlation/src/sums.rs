//! The sums over a subset's pixels that a Gauss-Newton step needs: the innermost loop.

use crate::PreparedSubset;
use crate::Shape;
use crate::prepared::LANES;
use crate::uncertainty::Residual;
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

/// Sums `samples` (rows of the subset's stride, zero beyond its width).
pub(crate) fn sum(subset: &PreparedSubset, samples: &[f32]) -> Sums {
    match subset.settings.shape {
        Shape::Translation => sum_rows::<false>(subset, samples),
        Shape::Affine => sum_rows::<true>(subset, samples),
    }
}

fn sum_rows<const AFFINE: bool>(subset: &PreparedSubset, samples: &[f32]) -> Sums {
    let mut sums = Sums::default();
    let stride = subset.stride;
    let rows = samples.chunks_exact(stride).zip(subset.intensity.chunks_exact(stride));
    let gradients = subset.gradient_x.chunks_exact(stride).zip(subset.gradient_y.chunks_exact(stride));
    for (y, ((g, f), (zx, zy))) in rows.zip(gradients).enumerate() {
        let row = Row { g, f, zx, zy, x: &subset.columns };
        let [u, ux, v, vx, intensity, total, square] = row.sum::<AFFINE>();
        if AFFINE {
            let y = subset.first_px[1] + y as f64;
            let terms = [u, ux, y * u, v, vx, y * v];
            sums.steepest.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        } else {
            sums.steepest[0] += u;
            sums.steepest[1] += v;
        }
        sums.intensity += intensity;
        sums.total += total;
        sums.square += square;
    }
    sums
}

struct Row<'a> {
    g: &'a [f32],
    f: &'a [f32],
    zx: &'a [f32],
    zy: &'a [f32],
    x: &'a [f32],
}

impl Row<'_> {
    /// zx g, zx x g, zy g, zy x g, f g, g, g^2 over the row. The f32 sums are of a few terms in each lane.
    #[inline(always)]
    fn sum<const AFFINE: bool>(&self) -> [f64; 7] {
        let mut lanes = [[0.0_f32; LANES]; 7];
        let [target, reference, slope_x, slope_y, column] =
            [self.g, self.f, self.zx, self.zy, self.x].map(|row| row.as_chunks::<LANES>().0);
        let slopes = slope_x.iter().zip(slope_y).zip(column);
        for ((g, f), ((zx, zy), x)) in target.iter().zip(reference).zip(slopes) {
            for i in 0..LANES {
                let (along_x, along_y) = (zx[i] * g[i], zy[i] * g[i]);
                lanes[0][i] += along_x;
                lanes[2][i] += along_y;
                if AFFINE {
                    lanes[1][i] += along_x * x[i];
                    lanes[3][i] += along_y * x[i];
                }
                lanes[4][i] += f[i] * g[i];
                lanes[5][i] += g[i];
                lanes[6][i] += g[i] * g[i];
            }
        }
        lanes.map(|lane| lane.iter().map(|&value| f64::from(value)).sum())
    }
}

/// How well a sampled target fits, and the step to a better place.
pub(crate) struct Evaluation {
    /// Zero-normalised cross-correlation.
    pub(crate) zncc: f64,
    pub(crate) residual: Residual,
    pub(crate) step: Step,
}

/// Contrast of the target over that of the reference below which the target is uniform but for rounding.
const LEAST_GAIN: f64 = 1e-3;

impl Sums {
    /// The step of [`PreparedSubset`]'s normal equations; `None` when the target has no contrast of the same sign.
    pub(crate) fn evaluate(&self, subset: &PreparedSubset) -> Option<Evaluation> {
        let variation = self.square - self.total * self.total / subset.n_pixels() as f64;
        let gain = self.intensity / subset.signal_energy;
        let usable = gain > LEAST_GAIN && variation > 0.0 && gain.is_finite() && variation.is_finite();
        if !usable {
            return None;
        }
        let mut orthogonal = self.steepest;
        for (sum, [mean, slope]) in orthogonal.iter_mut().zip(subset.projections) {
            *sum -= mean * self.total + slope * self.intensity;
        }
        let solve = |row: &[f64; MAX_PARAMETERS]| -> f64 {
            row.iter().zip(orthogonal).map(|(inverse, sum)| inverse * sum).sum::<f64>() / gain
        };
        let parameters = subset.inverse.each_ref().map(solve);
        let sum_of_squares = variation - gain * (2.0 * self.intensity - gain * subset.energy);
        Some(Evaluation {
            zncc: self.intensity / (subset.energy * variation).sqrt(),
            residual: Residual { gain, sum_of_squares: sum_of_squares.max(0.0) },
            step: Step::new(subset.settings.shape, &parameters),
        })
    }
}
