//! `[camera]`: how pictures map to the chain.

use std::path::PathBuf;

use chainwave_camera::RawGeometry;
use serde::{Deserialize, Serialize};

use super::{named, pair};
use crate::input::numbers::{NotNegative, Positive};

/// How pictures map to the chain: by exactly one of a magnification, a ruler, marks or a calibration.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Magnification.
    pub scale_px_per_m: Option<Positive>,
    /// Its standard uncertainty.
    pub scale_sigma_px_per_m: Option<NotNegative>,
    /// Standard deviation of the magnification from view to view, relative to it, where the camera was moved or focused anew between them.
    pub view_scale_sigma: Option<Positive>,
    /// A known length in the picture.
    pub ruler: Option<Ruler>,
    /// Bodies at rest in the picture, whose distance is the chain's pitch.
    pub marks: Option<Marks>,
    /// What `chainwave calibrate` wrote, beside this file.
    pub calibration: Option<PathBuf>,
    /// Column and row of body 1's marker at rest, with the stage at 0.
    #[serde(deserialize_with = "pair::two")]
    pub first_body_px: [f64; 2],
    /// Standard uncertainty of the stage's stated positions. With it, subsets are placed by the positions that bodies in two views
    /// give; without it, those are reported alone.
    pub stage_sigma_m: Option<NotNegative>,
    /// How much a lens that was not calibrated, or a camera that is turned, may change the scale from the middle of a picture to its edge, relative to it, as
    /// a standard deviation: 0.001 when left out, and 0 for none. Dampings contain it.
    pub geometry_sigma: Option<NotNegative>,
    /// Frames per second of recordings that do not state them, such as folders of images.
    pub rate_hz: Option<Positive>,
    /// Time from the exposure of one line of a picture to that of the next, of a camera with a rolling shutter, by which times are corrected.
    pub line_time_s: Option<NotNegative>,
    /// Geometry of recordings without a header, such as `1280x800x12le`.
    #[serde(default, with = "named::optional", skip_serializing_if = "Option::is_none")]
    pub raw: Option<RawGeometry>,
    /// Dark frames beside this file: a recording, a folder of images or one of them.
    pub dark: Option<PathBuf>,
    /// Frames of an evenly lit field, likewise.
    pub flat: Option<PathBuf>,
}

/// What nothing is known of: two tenths of a pixel at the edge of a picture of 400, a turn by a few tenths of a degree.
const USUAL_GEOMETRY: f64 = 1e-3;

impl Camera {
    /// Standard deviation of the scale at a picture's edge, relative to that in its middle, where no calibration tells it.
    pub(crate) fn geometry_sigma(&self) -> f64 {
        self.geometry_sigma.map_or(USUAL_GEOMETRY, NotNegative::get)
    }
}

/// A known length in the picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ruler {
    /// Column and row of both ends.
    #[serde(deserialize_with = "pair::two_of_two")]
    pub ends_px: [[f64; 2]; 2],
    /// Standard uncertainty of an end's place, in each direction.
    pub sigma_px: NotNegative,
    /// The length.
    pub length_m: Positive,
    /// Its standard uncertainty.
    pub length_sigma_m: NotNegative,
}

/// Bodies at rest in the picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marks {
    /// Numbers of the bodies.
    pub bodies: Vec<i32>,
    /// Column and row of the same point of each.
    #[serde(deserialize_with = "pair::each_of_two")]
    pub at_px: Vec<[f64; 2]>,
    /// Standard uncertainty of a point's place, in each direction.
    pub sigma_px: NotNegative,
}

/// The middle of a picture, in pixels.
pub(crate) fn middle_px(width_px: usize, height_px: usize) -> [f64; 2] {
    [0.5 * (width_px as f64 - 1.0), 0.5 * (height_px as f64 - 1.0)]
}
