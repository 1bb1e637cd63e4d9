//! What a match gives, why there is none, and the buffers that it reuses.

use chainwave_measurement::{Estimate, Lost, Position};

use crate::search::light::Light;
use crate::search::rivals::PlaceMatch;
use crate::warp::Warp;

/// Where a subset was found, and how it is deformed there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// The centre, with its uncertainty.
    pub position: Position,
    /// Displacement gradient du/dx, du/dy, dv/dx, dv/dy; zero for a translation.
    pub gradient: [f64; 4],
    /// Coefficients of x^2, xy and y^2 in u, then in v, per pixel; zero but for the quadratic shape function.
    pub curvature: [f64; 6],
    /// Variance of the residuals over what the reference's noise explains: about 1 where the frame shows nothing else.
    pub noise_ratio: f64,
    /// Whether the whole subset was matched; else what saturates, is no number or hides it was left out.
    pub is_whole: bool,
    /// Share of the subset's pixels that were matched.
    pub(crate) share_seen: f64,
    /// How bright it is.
    pub(crate) light: Light,
}

impl Match {
    pub(crate) fn warp(&self) -> Warp {
        let Position { x_px, y_px, .. } = self.position;
        let position_px = [x_px.value, y_px.value];
        Warp { position_px, gradient: self.gradient, curvature: self.curvature }
    }

    pub(crate) fn place(&self) -> PlaceMatch {
        let light = self.is_whole.then_some(self.light);
        PlaceMatch { warp: self.warp(), zncc: self.position.zncc, share_seen: self.share_seen, light }
    }

    /// Whether its residuals are no more than noise leaves of so many pixels, where those of matches of the whole are so many times what noise
    /// explains.
    pub(crate) fn is_noise(&self, usual: f64, n_pixels: f64) -> bool {
        /// Standard deviations by which a mean square of noise is more than usual.
        const UNUSUAL: f64 = 3.0;
        /// Share by which residuals vary from texture to texture besides.
        const OF_TEXTURE: f64 = 0.1;
        self.noise_ratio < usual * (1.0 + OF_TEXTURE + UNUSUAL * (2.0 / n_pixels).sqrt())
    }

    /// The same with an error of so many pixels along x and y in its sigmas.
    pub(crate) fn with_error(mut self, error_px: [f64; 2]) -> Self {
        let Position { x_px, y_px, .. } = &mut self.position;
        for (estimate, error_px) in [x_px, y_px].into_iter().zip(error_px) {
            *estimate = Estimate::new(estimate.value, estimate.sigma.hypot(error_px));
        }
        self
    }
}

/// Buffers that a match reuses, so that it allocates nothing.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    pub(crate) samples: Vec<f32>,
    pub(crate) rows: Vec<f32>,
}

/// Why an iteration stopped without a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stop {
    /// The subset left the window for this place.
    Escaped(Warp),
    /// It is lost.
    Lost(Lost),
}
