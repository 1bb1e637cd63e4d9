//! What is known of a field while it grows: its grid, what is compared, and what has been found so far.

use crate::Shape;
use crate::field::pair::{ImagePair, Settled};
use crate::warp::Warp;

/// Columns and rows around the expected place that are searched first.
pub(crate) const NEAR_PX: usize = 24;

/// A field on its way.
pub(crate) struct Known<'g, 'a> {
    pub(crate) pair: &'g ImagePair<'a>,
    pub(crate) places: &'g [[f64; 2]],
    pub(crate) n_columns: usize,
    pub(crate) step_px: f64,
    pub(crate) settled: &'g [Option<Settled>],
}

impl Known<'_, '_> {
    /// Whether a point has been found.
    pub(crate) fn is_found(&self, point: usize) -> bool {
        matches!(self.settled[point], Some((Ok(_), _)))
    }

    /// Where a point is expected by the place and deformation of another.
    pub(crate) fn start_from(&self, warp: &Warp, from: usize, to: usize) -> Warp {
        let (there, here) = (self.places[to], self.places[from]);
        let (x, y) = (there[0] - here[0], there[1] - here[1]);
        let [uxx, uxy, uyy, vxx, vxy, vyy] = warp.curvature;
        let bend = [
            2.0 * uxx * x + uxy * y,
            uxy * x + 2.0 * uyy * y,
            2.0 * vxx * x + vxy * y,
            vxy * x + 2.0 * vyy * y,
        ];
        // A curvature is not carried further than the subset it was fitted to.
        let carried = self.step_px <= self.pair.half_px as f64;
        let warp = if carried { *warp } else { Warp { curvature: [0.0; 6], ..*warp } };
        let gradient = std::array::from_fn(|i| warp.gradient[i] + if carried { bend[i] } else { 0.0 });
        let (curvature, gradient) = match self.pair.first_shape() {
            Shape::Quadratic => (warp.curvature, gradient),
            Shape::Translation => ([0.0; 6], [0.0; 4]),
            _ => ([0.0; 6], gradient),
        };
        Warp { position_px: warp.apply([x, y]), gradient, curvature }
    }
}

/// The points left, right, above and below of one in a grid.
pub(crate) fn neighbours(point: usize, n_columns: usize, n_points: usize) -> impl Iterator<Item = usize> {
    let column = point % n_columns;
    let left = (column > 0).then(|| point - 1);
    let right = (column + 1 < n_columns).then_some(point + 1);
    let above = point.checked_sub(n_columns);
    let below = (point + n_columns < n_points).then_some(point + n_columns);
    [left, right, above, below].into_iter().flatten()
}
