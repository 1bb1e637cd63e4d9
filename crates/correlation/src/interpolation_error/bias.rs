//! The bias that interpolation leaves in a displacement, foreseen from the reference alone and taken off.
//!
//! What a Gauss-Newton step makes of the error image of an alias ([`crate::interpolation_error::alias`]), `M^-1 sum Z' e`
//! ([`crate::PreparedSubset`]), is the bias: the well-known sine over the phase (H. W. Schreier, J. R. Braasch, M.
//! A. Sutton, Opt. Eng. 39 (2000) 2915-2921; Y. Su et al., Opt. Express 23 (2015) 19242-19260), and what this very texture
//! adds to it. It consists of the correlations of `M^-1 Z'` and f at a few lags, so it is known once a subset is prepared,
//! and a match only looks it up.

use std::f64::consts::TAU;

use crate::Interpolation;
use crate::interpolation_error::alias::{LAGS, N_HARMONICS, filters, sinc};
use crate::interpolation_error::energy::Foreseen;
use crate::interpolation_error::lagged::Correlations;
use crate::warp::Warp;
use crate::window::sample::Lattice;

/// Share of the bias that is not foreseen: 0.02 (cubic) to 0.075 (linear, which has a third alias) of it is left on speckles of
/// 3 to 6 px.
const UNFORESEEN_SHARE: f64 = 0.07;

/// The bias of a subset's position over the phases of interpolation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct InterpolationBias {
    /// Of the displacement along x and y (outer), by interpolation along x and y, by each alias: what `cos - 1` and `sin`
    /// are multiplied with, in pixels of the subset.
    amplitudes: [[[[f64; 2]; N_HARMONICS]; 2]; 2],
}

impl InterpolationBias {
    /// The bias of a subset in its surroundings, whose steps are the displacements along x and y that a unit of each pixel's
    /// grey value makes.
    pub(crate) fn new(correlations: &Correlations, interpolation: Interpolation) -> Self {
        let filters = filters(interpolation);
        let of_axis = |correlations: &[f64; 2 * LAGS + 1]| {
            filters.each_ref().map(|taps| {
                let terms = taps.iter().zip(correlations);
                terms.fold([0.0; 2], |[e, o], ([even, odd], c)| [e + even * c, o + odd * c])
            })
        };
        Self { amplitudes: correlations.steps.each_ref().map(|axes| axes.each_ref().map(of_axis)) }
    }

    /// The displacement of the subset's centre, in its own coordinates, that interpolation feigns under a warp.
    ///
    /// Where the subset is deformed the phase varies over it, and with it the bias: its mean over a texture that is the
    /// same everywhere is that of the sine and cosine. Interpolation along an axis leaves but a part of the contrast
    /// of the gradients, so the same error displaces so much farther; that along the other axis takes as much of the error.
    pub(crate) fn at(&self, warp: &Warp, lattice: Lattice, foreseen: &Foreseen) -> [f64; 2] {
        let (columns, rows) = (lattice.width as f64, lattice.height as f64);
        let middle = warp.apply(lattice.middle_px());
        let slopes = [[warp.gradient[0], warp.gradient[1]], [warp.gradient[2], warp.gradient[3]]];
        let mut sum = [0.0; 2];
        for axis in 0..2 {
            let (sin, cos) = (TAU * middle[axis]).sin_cos();
            let waves = [[sin, cos], [2.0 * sin * cos, 2.0 * cos * cos - 1.0]];
            let [along, across] = slopes[axis];
            for (harmonic, [sin, cos]) in waves.into_iter().enumerate() {
                let order = (harmonic + 1) as f64;
                let evenness = sinc(order * along * columns) * sinc(order * across * rows);
                for (along, (sum, amplitudes)) in sum.iter_mut().zip(&self.amplitudes).enumerate() {
                    let contrast = if along == axis { foreseen.slopes[axis] } else { foreseen.greys[axis] };
                    let [even, odd] = amplitudes[axis][harmonic];
                    *sum += (even * (evenness * cos - 1.0) + odd * evenness * sin) / contrast;
                }
            }
        }
        sum
    }

    /// Standard uncertainty along x and y of what is taken off, by its root mean square over all phases.
    pub(crate) fn sigma_px(&self) -> [f64; 2] {
        self.amplitudes.map(|of_axes| {
            // of cos - 1: 1/2 and the square of its mean
            let square = |[even, odd]: &[f64; 2]| 1.5 * even * even + 0.5 * odd * odd;
            UNFORESEEN_SHARE * of_axes.iter().flatten().map(square).sum::<f64>().sqrt()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation_error::alias::tests::waves;
    use crate::{PreparedSubset, Reference, Settings, Shape, Window, Workspace};
    use chainwave_measurement::{Region, Subset};

    #[test]
    fn what_is_foreseen_is_what_a_match_without_it_is_off_by() {
        let whole = Region::whole(90, 90);
        let reference = Reference::new(whole, waves([0.0; 2]), 1).unwrap();
        let subset = Subset::new("a", 45.0, 44.0, 16, 14);
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
