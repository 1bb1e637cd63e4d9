//! A shadow whose soft edge crosses the picture.

use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_share};
use crate::gaussian::normal_share;

/// A shadow that lies on all columns before its edge, column x_e = start + speed t with t after the trigger: light there is
/// a factor 1 - depth, and between light and shadow the factor follows the normal distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shadow {
    /// Share of the light that is gone in the full shadow.
    pub depth: f64,
    /// Column of the edge's middle at the trigger.
    pub start_px: f64,
    /// Speed of the edge, in pixels a second; positive to the right.
    pub speed_px_per_s: f64,
    /// Softness: standard deviation of the normal distribution that the edge follows, in pixels.
    pub edge_sigma_px: f64,
}

impl Shadow {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        require_share("camera.effects.shadow.depth", self.depth)?;
        let start = self.start_px.abs() <= 1.0e9;
        require(start, "camera.effects.shadow.start_px", "within 1e9 pixels", self.start_px)?;
        let speed = self.speed_px_per_s.abs() <= 1.0e9;
        require(speed, "camera.effects.shadow.speed_px_per_s", "within 1e9", self.speed_px_per_s)?;
        let soft = self.edge_sigma_px >= 1.0 && self.edge_sigma_px <= 1.0e6;
        require(soft, "camera.effects.shadow.edge_sigma_px", "1 to 1e6 pixels", self.edge_sigma_px)
    }

    /// The factor on the light of a column at a time after the trigger.
    fn factor(&self, column: usize, stamp_s: f64) -> f64 {
        let before_px = self.start_px + self.speed_px_per_s * stamp_s - column as f64;
        1.0 - self.depth * normal_share(before_px / self.edge_sigma_px)
    }

    /// Lays the shadow over whole rows of tones.
    pub(crate) fn apply(&self, tones: &mut [f32], width_px: usize, stamp_s: f64) {
        let factors: Vec<f32> = (0..width_px).map(|column| self.factor(column, stamp_s) as f32).collect();
        for row in tones.chunks_exact_mut(width_px) {
            row.iter_mut().zip(&factors).for_each(|(tone, factor)| *tone *= factor);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_stands_where_its_speed_has_brought_it() {
        let shadow = Shadow { depth: 0.4, start_px: -100.0, speed_px_per_s: 5.0e4, edge_sigma_px: 20.0 };
        for (stamp_s, edge_px) in [(2.0e-3, 0), (5.0e-3, 150)] {
            let mut tones = vec![1.0_f32; 800];
            shadow.apply(&mut tones, 400, stamp_s);
            assert_eq!(tones[..400], tones[400..]);
            // Half the depth at the edge; 1 and 2 sigma away what tables of the normal distribution say; single precision.
            for (away_px, share) in [(0, 0.5), (20, 0.158_655_3), (40, 0.022_750_1), (200, 0.0)] {
                assert!((tones[edge_px + away_px] - (1.0 - 0.4 * share)).abs() < 1.0e-6);
            }
        }
        let mut passed = vec![1.0_f32; 400];
        shadow.apply(&mut passed, 400, 0.1);
        assert!(passed.iter().all(|tone| (tone - 0.6).abs() < 1.0e-6));
    }
}
