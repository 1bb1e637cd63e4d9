//! The bias that interpolation leaves in a displacement, foreseen from the reference alone and taken off.
//!
//! A kernel of spectrum B turns a wave of angular frequency w, interpolated at the phase t between two pixels, into
//! `sum c_k(w) e^(2 pi i k t)` times what it should be, with `c_k(w) = B(w + 2 pi k) / sum_j B(w + 2 pi j)` (M. Unser,
//! A. Aldroubi, M. Eden, IEEE Trans. Signal Process. 41 (1993) 821-833). The aliases k and -k together leave the error
//! image
//!
//! `e = (cos(2 pi k t) - 1) (c_k + c_-k) f + i sin(2 pi k t) (c_k - c_-k) f`
//!
//! of the reference f, an even and an odd filter of it, along each axis. What a Gauss-Newton step makes of it, `M^-1 sum
//! Z' e` ([`crate::PreparedSubset`]), is the bias: the well-known sine over the phase (H. W. Schreier, J. R. Braasch, M.
//! A. Sutton, Opt. Eng. 39 (2000) 2915-2921; Y. Su et al., Opt. Express 23 (2015) 19242-19260), and what this very texture
//! adds to it. It consists of the correlations of `M^-1 Z'` and f at a few lags, so it is known once a subset is prepared,
//! and a match only looks it up.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use nalgebra::{DMatrix, DVector};

use crate::kernel::{BSpline, Kernel, Moms};
use crate::sample::Lattice;
use crate::search::Template;
use crate::warp::Warp;
use crate::{Interpolation, Reference};

/// Lags on each side at which the filters have taps.
const LAGS: usize = 5;
/// Aliases that count: the third adds a few percent of the bias of the linear kernel.
const N_HARMONICS: usize = 2;
/// The filters are fitted where the smallest usable speckles have their spectrum: `exp(-1.2 w^2)` is that of 4 px.
const SPECKLE_PX2: f64 = 1.2;
/// Share of all frequencies alike in the fit, so that noise is not amplified.
const WHITE_SHARE: f64 = 1e-6;

/// Share of the bias that is not foreseen. On speckles of 3.7 to 6.3 px, 0.02 (cubic) to 0.09 (linear, which has a third
/// alias) of it is left.
const UNFORESEEN_SHARE: f64 = 0.05;

/// The bias of a subset's position over the phases of interpolation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct InterpolationBias {
    /// Of the displacement along x and y (outer), by interpolation along x and y, by each alias: what `cos - 1` and `sin`
    /// are multiplied with, in pixels of the subset.
    amplitudes: [[[[f64; 2]; N_HARMONICS]; 2]; 2],
}

impl InterpolationBias {
    /// The bias of a subset whose first pixel is at `(column, row)` of the image; `steps` are the displacements along x
    /// and y that a unit of each pixel's grey value makes.
    pub(crate) fn new(
        reference: &Reference,
        [column, row]: [i64; 2],
        steps: &[Template; 2],
        interpolation: Interpolation,
    ) -> Self {
        let [width, height] = steps[0].size();
        let stride = width + 2 * LAGS;
        let mut scene = vec![0.0; stride * (height + 2 * LAGS)];
        for (line, y) in scene.chunks_exact_mut(stride).zip(row - LAGS as i64..) {
            reference.copy_row(column - LAGS as i64, y, line);
            line.iter_mut().for_each(|value| *value -= reference.level() as f32);
        }
        let filters = filters(interpolation);
        let of_axis = |step: &Template, spacing: usize| {
            let mut amplitudes = [[0.0; 2]; N_HARMONICS];
            for lag in 0..=2 * LAGS {
                // the tap at a lag takes the pixel so far before
                let start = LAGS * (stride + 1) + LAGS * spacing - lag * spacing;
                let correlation = step.correlate(stride, &scene[start..]);
                for (amplitude, taps) in amplitudes.iter_mut().zip(filters) {
                    let [even, odd] = taps[lag];
                    *amplitude = [amplitude[0] + even * correlation, amplitude[1] + odd * correlation];
                }
            }
            amplitudes
        };
        Self { amplitudes: steps.each_ref().map(|step| [of_axis(step, 1), of_axis(step, stride)]) }
    }

    /// The displacement of the subset's centre, in its own coordinates, that interpolation feigns under a warp.
    ///
    /// Where the subset is deformed the phase varies over it, and with it the bias: its mean over a texture that is the
    /// same everywhere is that of the sine and cosine.
    pub(crate) fn at(&self, warp: &Warp, lattice: Lattice) -> [f64; 2] {
        let (columns, rows) = (lattice.width as f64, lattice.height as f64);
        let [x, y] = lattice.first_px;
        let middle = warp.apply([x + (0.5 * columns).floor(), y + (0.5 * rows).floor()]);
        let slopes = [[warp.gradient[0], warp.gradient[1]], [warp.gradient[2], warp.gradient[3]]];
        let mut sum = [0.0; 2];
        for axis in 0..2 {
            let (sin, cos) = (TAU * middle[axis]).sin_cos();
            let waves = [[sin, cos], [2.0 * sin * cos, 2.0 * cos * cos - 1.0]];
            let [along, across] = slopes[axis];
            for (harmonic, [sin, cos]) in waves.into_iter().enumerate() {
                let order = (harmonic + 1) as f64;
                let evenness = sinc(order * along * columns) * sinc(order * across * rows);
                for (sum, amplitudes) in sum.iter_mut().zip(&self.amplitudes) {
                    let [even, odd] = amplitudes[axis][harmonic];
                    *sum += even * (evenness * cos - 1.0) + odd * evenness * sin;
                }
            }
        }
        sum
    }

    /// Standard uncertainty along x and y of what is taken off: a twentieth of its root mean square over all phases.
    pub(crate) fn sigma_px(&self) -> [f64; 2] {
        self.amplitudes.map(|of_axes| {
            // of cos - 1: 1/2 and the square of its mean
            let square = |[even, odd]: &[f64; 2]| 1.5 * even * even + 0.5 * odd * odd;
            UNFORESEEN_SHARE * of_axes.iter().flatten().map(square).sum::<f64>().sqrt()
        })
    }
}

/// sin(pi x)/(pi x).
fn sinc(x: f64) -> f64 {
    let angle = PI * x;
    let square = angle * angle;
    if square < 0.04 {
        // the next term is 1e-9
        return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
    }
    angle.sin() / angle
}

/// Taps of the even and odd filter at the lags from `-LAGS` on, for each alias.
type Filters = [[[f64; 2]; 2 * LAGS + 1]; N_HARMONICS];

fn filters(interpolation: Interpolation) -> &'static Filters {
    static TABLES: LazyLock<[Filters; 5]> = LazyLock::new(|| Interpolation::ALL.map(fit));
    &TABLES[interpolation as usize]
}

/// The filters of a few taps that differ least, over the spectrum of speckles, from the exact ones.
fn fit(interpolation: Interpolation) -> Filters {
    const N: usize = 256;
    let frequency = |i: usize| PI * (i as f64 + 0.5) / N as f64;
    let weight = |w: f64| ((-SPECKLE_PX2 * w * w).exp() + WHITE_SHARE).sqrt();
    let least_squares =
        |basis: &dyn Fn(f64, usize) -> f64, n: usize, exact: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let weighted = |i: usize, value: f64| weight(frequency(i)) * value;
            let columns = DMatrix::from_fn(N, n, |i, k| weighted(i, basis(frequency(i), k)));
            let target = DVector::from_fn(N, |i, _| weighted(i, exact(frequency(i))));
            let solved = columns.svd(true, true).solve(&target, 1e-9);
            solved.map_or_else(|_| vec![0.0; n], |taps| taps.iter().copied().collect())
        };
    std::array::from_fn(|harmonic| {
        let k = (harmonic + 1) as f64;
        let both = |w: f64, sign: f64| alias(interpolation, w, k) + sign * alias(interpolation, w, -k);
        let cosines = least_squares(&|w, lag| (w * lag as f64).cos(), LAGS + 1, &|w| both(w, 1.0));
        let sines = least_squares(&|w, lag| (w * (lag + 1) as f64).sin(), LAGS, &|w| both(w, -1.0));
        std::array::from_fn(|i| {
            let distance = i.abs_diff(LAGS);
            // i sin(w l) is half the difference of two taps, of which that before the pixel is added
            let odd = |sign: f64| -0.5 * sign * sines[distance - 1];
            match i.cmp(&LAGS) {
                Ordering::Equal => [cosines[0], 0.0],
                Ordering::Greater => [0.5 * cosines[distance], odd(1.0)],
                Ordering::Less => [0.5 * cosines[distance], odd(-1.0)],
            }
        })
    })
}

/// c_k(w): the share of the alias k in what interpolation makes of a wave.
fn alias(interpolation: Interpolation, w: f64, k: f64) -> f64 {
    let pole = |z: &f64| (1.0 - z).powi(2) / (1.0 - 2.0 * z * w.cos() + z * z);
    let prefilter: f64 = interpolation.poles().iter().map(pole).product();
    prefilter * spectrum(interpolation, w + TAU * k)
}

/// The kernel's spectrum: that of the B-spline, and of its second and fourth derivatives.
fn spectrum(interpolation: Interpolation, w: f64) -> f64 {
    let [second, fourth] = match interpolation {
        Interpolation::Linear => <BSpline as Kernel<2>>::DERIVATIVES,
        Interpolation::Cubic => <BSpline as Kernel<4>>::DERIVATIVES,
        Interpolation::CubicMoms => <Moms as Kernel<4>>::DERIVATIVES,
        Interpolation::Quintic => <BSpline as Kernel<6>>::DERIVATIVES,
        Interpolation::QuinticMoms => <Moms as Kernel<6>>::DERIVATIVES,
    };
    let square = w * w;
    sinc(w / TAU).powi(interpolation.n_taps() as i32) * (1.0 - second * square + fourth * square * square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PreparedSubset, Settings, Shape, Window, Workspace};
    use chainwave_measurement::{Region, Subset};

    #[test]
    fn aliases_sum_to_one() {
        for interpolation in Interpolation::ALL {
            for w in [0.1, 0.9, 2.5] {
                let sum: f64 = (-400..=400).map(|k| alias(interpolation, w, f64::from(k))).sum();
                // the linear kernel's fall as 1/k^2
                assert!((sum - 1.0).abs() < 1e-3, "{interpolation} at {w}: {sum}");
            }
        }
    }

    /// Waves that fall off with their frequency as those of speckles of 4.5 px do.
    fn waves([dx, dy]: [f64; 2]) -> Vec<f32> {
        let wave = |k: f64| {
            let [x, y] = [1.4 * (7.1 * k).sin(), 1.4 * (3.3 * k + 1.0).sin()];
            [x, y, k * k, 300.0 * (-0.9 * (x * x + y * y)).exp()]
        };
        let waves: Vec<[f64; 4]> = (0..60).map(|k| wave(f64::from(k))).collect();
        let at = |i: usize| {
            let (x, y) = ((i % 90) as f64 - dx, (i / 90) as f64 - dy);
            let sum: f64 = waves.iter().map(|[u, v, phase, size]| size * (u * x + v * y + phase).sin()).sum();
            (2000.0 + sum) as f32
        };
        (0..90 * 90).map(at).collect()
    }

    #[test]
    fn what_is_foreseen_is_what_a_match_without_it_is_off_by() {
        let whole = Region::whole(90, 90);
        let reference = Reference::new(whole, waves([0.0; 2]), 1).unwrap();
        let subset =
            Subset { name: "a".into(), x_px: 45.0, y_px: 44.0, half_width_px: 16, half_height_px: 14 };
        for interpolation in Interpolation::ALL {
            let settings =
                Settings { shape: Shape::Affine, interpolation, convergence_px: 1e-5, ..Settings::default() };
            let with = PreparedSubset::new(&reference, &subset, &settings).unwrap();
            let without = PreparedSubset { bias: InterpolationBias::default(), ..with.clone() };
            let errors = |subset: &PreparedSubset| {
                let error = |shift: [f64; 2]| {
                    let window = Window::new(whole, &waves(shift), interpolation).unwrap();
                    let start = [45.0 + shift[0], 44.0 + shift[1]];
                    let found = subset.match_in(&window, start, &mut Workspace::default()).unwrap().position;
                    (found.x_px.value - start[0]).hypot(found.y_px.value - start[1])
                };
                [[0.2, 0.1], [0.5, 0.3], [0.8, 0.4], [0.3, 0.9]].map(error).into_iter().fold(0.0, f64::max)
            };
            let [left, full] = [errors(&with), errors(&without)];
            println!("{interpolation}: {left:.2e} of {full:.2e}");
            // What is left is products of the two axes' errors, the third alias, and 0.1 to 0.2 mpx by the prefilter's cut-off sum.
            assert!(left < 0.1 * full + 2e-4, "{interpolation}: {left} of {full}");
        }
    }
}
