//! A scale that is not the one stated, for all views and from view to view.

use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::require;
use crate::trials::view_factor;

/// How the camera's true scale differs from `scale_px_per_m`, as factors on it.
///
/// The error common to all views leaves body 1 where it is at stage position 0. A view's own magnification acts about the
/// optical axis: the principal point, which is the frame's centre unless the optics have another.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScaleError {
    /// Relative error that all views share: the true scale is 1 + error times the stated one.
    pub error: f64,
    /// Standard deviation of a view's relative magnification (normal, drawn for each view).
    pub view_sigma: f64,
    /// Relative magnification of view 1, 2, ..., on top of what is drawn; 0 for views beyond the list.
    pub views: Vec<f64>,
}

impl ScaleError {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        let expected = "-0.2 to 0.2";
        require(self.error.abs() <= 0.2, "camera.effects.scale.error", expected, self.error)?;
        let narrow = (0.0..=0.04).contains(&self.view_sigma);
        require(narrow, "camera.effects.scale.view_sigma", "0 to 0.04", self.view_sigma)?;
        self.views.iter().try_for_each(|&magnified| {
            require(magnified.abs() <= 0.2, "camera.effects.scale.views", expected, magnified)
        })
    }

    /// The factor of a view, counted from 1, on what all views share.
    pub(crate) fn view_magnification(&self, seed: u64, view: u64) -> f64 {
        let listed = usize::try_from(view).ok().and_then(|view| self.views.get(view.checked_sub(1)?));
        (1.0 + listed.copied().unwrap_or(0.0)) * view_factor(seed, view, self.view_sigma)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_magnified_as_listed_and_as_drawn() {
        let listed = ScaleError { views: vec![0.02, -0.01], ..ScaleError::default() };
        for (view, factor) in [(0, 1.0), (1, 1.02), (2, 0.99), (3, 1.0)] {
            assert!((listed.view_magnification(5, view) - factor).abs() < 1.0e-15); // rounding
        }
        let drawn = ScaleError { view_sigma: 0.004, ..ScaleError::default() };
        let n = 4000;
        let square = |view| (drawn.view_magnification(5, view) - 1.0).powi(2);
        let variance = (1..=n).map(square).sum::<f64>() / n as f64;
        // Chi squared of 4000: 4.5 standard errors, sqrt(2/n).
        assert!((variance / 0.004_f64.powi(2) - 1.0).abs() < 4.5 * (2.0 / n as f64).sqrt());
    }
}
