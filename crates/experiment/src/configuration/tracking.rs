//! `[tracking]`: how bodies are followed.

use chainwave_correlation::{Interpolation, Shape, ShapeChoice};
use serde::{Deserialize, Serialize};

use super::named;
use crate::configuration::outline;

/// How bodies are followed.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tracking {
    /// Columns of a subset on each side of its centre.
    pub half_width_px: usize,
    /// Rows of a subset above and below its centre.
    pub half_height_px: usize,
    /// Corners of a polygon within a subset, column and row in pixels from its centre, where the marker is no rectangle; the whole rectangle
    /// unless they are given.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "outline::of_key")]
    pub outline_px: Vec<[f64; 2]>,
    /// Shape function by name.
    #[serde(default = "Tracking::usual_shape", with = "named")]
    pub shape: ShapeChoice,
    /// Interpolation by name.
    #[serde(default = "Tracking::usual_interpolation", with = "named")]
    pub interpolation: Interpolation,
    /// Frames stamped before this time show the chain at rest, in seconds after the trigger.
    pub rest_until_s: f64,
    /// Recordings are looked at up to this time after the trigger, in seconds; to their ends unless it is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
}

impl Tracking {
    fn usual_shape() -> ShapeChoice {
        ShapeChoice::Named(Shape::Affine)
    }

    fn usual_interpolation() -> Interpolation {
        Interpolation::Quintic
    }
}
