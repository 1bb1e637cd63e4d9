//! What interpolation adds to an image: its aliases, as filters of a few taps.
//!
//! A kernel of spectrum B turns a wave of angular frequency w, interpolated at the phase t between two pixels, into
//! `sum c_k(w) e^(2 pi i k t)` times what it should be, with `c_k(w) = B(w + 2 pi k) / sum_j B(w + 2 pi j)` (M. Unser,
//! A. Aldroubi, M. Eden, IEEE Trans. Signal Process. 41 (1993) 821-833). The aliases k and -k together leave the error
//! image
//!
//! `e = (cos(2 pi k t) - 1) (c_k + c_-k) f + i sin(2 pi k t) (c_k - c_-k) f`
//!
//! of the reference f, an even and an odd filter of it, along each axis.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use nalgebra::{DMatrix, DVector};

use crate::Interpolation;
use crate::window::kernel::{BSpline, Kernel, Moms};

/// Lags on each side at which the filters have taps.
pub(crate) const LAGS: usize = 5;
/// Aliases that count: the third adds a few percent of the bias of the linear kernel.
pub(crate) const N_HARMONICS: usize = 2;
/// The filters are fitted where the smallest usable speckles have their spectrum: `exp(-1.2 w^2)` is that of 4 px.
const SPECKLE_PX2: f64 = 1.2;
/// Share of all frequencies alike in the fit, so that noise is not amplified.
const WHITE_SHARE: f64 = 1e-6;

/// Taps of an even and an odd filter at the lags from `-LAGS` on.
pub(crate) type Taps = [[f64; 2]; 2 * LAGS + 1];

/// The filters of each alias.
pub(crate) fn filters(interpolation: Interpolation) -> &'static [Taps; N_HARMONICS] {
    static TABLES: LazyLock<[[Taps; N_HARMONICS]; 5]> = LazyLock::new(|| {
        Interpolation::ALL.map(|interpolation| {
            std::array::from_fn(|harmonic| {
                let k = (harmonic + 1) as f64;
                fit(|w| {
                    let [of, against] = [k, -k].map(|k| alias(interpolation, w, k));
                    [of + against, of - against]
                })
            })
        })
    });
    &TABLES[interpolation as usize]
}

/// The filter of a few taps that differs least, over the spectrum of speckles, from one whose response to a wave of a
/// frequency is the first number and i times the second.
pub(crate) fn fit(response: impl Fn(f64) -> [f64; 2]) -> Taps {
    const N: usize = 256;
    let frequency = |i: usize| PI * (i as f64 + 0.5) / N as f64;
    let weight = |w: f64| ((-SPECKLE_PX2 * w * w).exp() + WHITE_SHARE).sqrt();
    let least_squares = |basis: &dyn Fn(f64, usize) -> f64, n: usize, parity: usize| -> Vec<f64> {
        let weighted = |i: usize, value: f64| weight(frequency(i)) * value;
        let columns = DMatrix::from_fn(N, n, |i, k| weighted(i, basis(frequency(i), k)));
        let target = DVector::from_fn(N, |i, _| weighted(i, response(frequency(i))[parity]));
        let solved = columns.svd(true, true).solve(&target, 1e-9);
        solved.map_or_else(|_| vec![0.0; n], |taps| taps.iter().copied().collect())
    };
    let cosines = least_squares(&|w, lag| (w * lag as f64).cos(), LAGS + 1, 0);
    let sines = least_squares(&|w, lag| (w * (lag + 1) as f64).sin(), LAGS, 1);
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
}

/// What interpolation at a phase makes of a wave of frequency w, over what it should be and less 1: all aliases at once, as
/// the real and the imaginary part.
pub(crate) fn error_response(interpolation: Interpolation, phase: f64, w: f64) -> [f64; 2] {
    let t = phase as f32;
    let weights: Vec<f32> = match interpolation {
        Interpolation::Linear => <BSpline as Kernel<2>>::WEIGHTS.at::<2>(t).into(),
        Interpolation::Cubic => <BSpline as Kernel<4>>::WEIGHTS.at::<4>(t).into(),
        Interpolation::CubicMoms => <Moms as Kernel<4>>::WEIGHTS.at::<4>(t).into(),
        Interpolation::Quintic => <BSpline as Kernel<6>>::WEIGHTS.at::<6>(t).into(),
        Interpolation::QuinticMoms => <Moms as Kernel<6>>::WEIGHTS.at::<6>(t).into(),
    };
    let gain = prefilter_gain(interpolation, w);
    let (mut real, mut imaginary) = (-1.0, 0.0);
    for (tap, weight) in weights.into_iter().enumerate() {
        let place = tap as f64 - interpolation.taps_before() as f64 - phase;
        real += gain * f64::from(weight) * (w * place).cos();
        imaginary += gain * f64::from(weight) * (w * place).sin();
    }
    [real, imaginary]
}

/// c_k(w): the share of the alias k in what interpolation makes of a wave.
fn alias(interpolation: Interpolation, w: f64, k: f64) -> f64 {
    prefilter_gain(interpolation, w) * spectrum(interpolation, w + TAU * k)
}

fn prefilter_gain(interpolation: Interpolation, w: f64) -> f64 {
    let pole = |z: &f64| (1.0 - z).powi(2) / (1.0 - 2.0 * z * w.cos() + z * z);
    interpolation.poles().iter().map(pole).product()
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

/// sin(pi x)/(pi x).
pub(crate) fn sinc(x: f64) -> f64 {
    let angle = PI * x;
    let square = angle * angle;
    if square < 0.04 {
        // the next term is 1e-9
        return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
    }
    angle.sin() / angle
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Waves that fall off with their frequency as those of speckles of 4.5 px do.
    pub(crate) fn waves([dx, dy]: [f64; 2]) -> Vec<f32> {
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
    fn aliases_sum_to_one() {
        for interpolation in Interpolation::ALL {
            for w in [0.1, 0.9, 2.5] {
                let sum: f64 = (-400..=400).map(|k| alias(interpolation, w, f64::from(k))).sum();
                // the linear kernel's fall as 1/k^2
                assert!((sum - 1.0).abs() < 1e-3, "{interpolation} at {w}: {sum}");
            }
        }
    }
}
