//! What blurs a picture: a body's path during the exposure, and defocus.

/// A path below this many pixels is none: what it would change is path^2/24 of a second derivative, 4e-10.
pub(crate) const LEAST_PATH_PX: f64 = 1.0e-4;

/// A defocus below this many pixels is none: what it would change is defocus^2/2 of a speckle's second derivative, 8e-7 of
/// its depth.
const LEAST_DEFOCUS_PX: f64 = 2.0e-3;

/// No lens that still shows a marker is farther out of focus.
pub(crate) const MOST_DEFOCUS_PX: f64 = 5.0;

/// Standard deviations after which a blurred edge is taken for whole: 1e-9 of it lies beyond.
pub(crate) const REACH_SIGMA: f64 = 6.0;

/// Outer node of the three-point Gauss-Legendre rule on [-1, 1], and the weights of the outer and the middle node (they
/// add up to 1).
pub(crate) const NODE: f64 = 0.774_596_669_241_483_4;
pub(crate) const WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];

/// What blurs a body, in pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Blur {
    /// How far the body moves along the chain during the exposure, of either sign.
    pub(crate) path_px: f64,
    /// Standard deviation of the Gaussian that a point is shown as.
    pub(crate) defocus_px: f64,
}

impl Blur {
    /// How far an edge is spread to either side.
    pub(crate) fn reach_px(self) -> f64 {
        let defocus_px = if self.is_focused() { 0.0 } else { REACH_SIGMA * self.defocus_px };
        self.path_px.abs() / 2.0 + defocus_px
    }

    /// Whether the lens shows a point as a point.
    pub(crate) fn is_focused(self) -> bool {
        self.defocus_px < LEAST_DEFOCUS_PX
    }

    /// Whether the body rests during the exposure.
    pub(crate) fn is_still(self) -> bool {
        self.path_px.abs() < LEAST_PATH_PX
    }

    /// Standard deviation and height of a Gaussian of the height 1, once it is out of focus: variances add, and along each
    /// axis its area stays.
    pub(crate) fn widened(self, sigma_px: f64) -> (f64, f64) {
        if self.is_focused() {
            return (sigma_px, 1.0);
        }
        let widened_px = (sigma_px * sigma_px + self.defocus_px * self.defocus_px).sqrt();
        (widened_px, sigma_px / widened_px)
    }

    /// The mean of `value` over shifts along the path: Gauss-Legendre in pieces of at most a pixel.
    pub(crate) fn mean_over_path(path_px: f64, value: impl Fn(f64) -> f64) -> f64 {
        if path_px.abs() < LEAST_PATH_PX {
            return value(0.0);
        }
        let n_pieces = path_px.abs().ceil();
        let piece_px = path_px / n_pieces;
        let middle_px = |piece: usize| (piece as f64 + 0.5) * piece_px - path_px / 2.0;
        let nodes = |at_px: f64| [-1.0, 0.0, 1.0].map(|node| at_px + 0.5 * NODE * node * piece_px);
        let mean = |piece: usize| {
            let shifts_px = nodes(middle_px(piece));
            WEIGHTS.iter().zip(shifts_px).map(|(weight, shift_px)| weight * value(shift_px)).sum::<f64>()
        };
        (0..n_pieces as usize).map(mean).sum::<f64>() / n_pieces
    }
}
