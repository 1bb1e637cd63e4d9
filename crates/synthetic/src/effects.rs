//! What a real camera adds to the ideal picture, each effect off unless its key is there.

mod block_coding;
mod line_noise;
mod out_of_plane;
mod reflections;
mod scale_error;
mod sensor_map;
mod shadow;
mod shake;
mod vignetting;

use serde::{Deserialize, Serialize};

pub use self::line_noise::LineNoise;
pub use self::out_of_plane::OutOfPlane;
pub use self::reflections::Reflections;
pub use self::scale_error::ScaleError;
pub use self::sensor_map::{DefectivePixels, FixedPattern, HotPixel};
pub use self::shadow::Shadow;
pub use self::shake::{Shake, ShakeOnset};

pub(crate) use self::block_coding::BlockCoding;
pub(crate) use self::out_of_plane::AlongAxis;
pub(crate) use self::reflections::ReflectionMap;
pub(crate) use self::sensor_map::SensorMap;
pub(crate) use self::vignetting::vignette;

use crate::SyntheticError;
use crate::blur::MOST_DEFOCUS_PX;
use crate::check::{require, require_share};

/// Effects of a real camera, `[camera.effects]`. By default none, and none costs anything or changes a bit of the picture.
///
/// What is drawn at random is common to
///
/// - the sensor, so to all recordings: fixed pattern, hot and dead pixels, and reflections unless they are the view's; from
///   `seed`;
/// - the bodies: how they move out of the plane; from `seed`;
/// - a view: its magnification, and reflections `per_view`; from `seed` and the shot's `view`;
/// - a recording: the phases of a shake; from the shot's `noise_seed`;
/// - a frame: noise of rows and columns, and whether its lines are repeated; from the shot's `noise_seed` and the frame's place in the recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Effects {
    /// Seed of what belongs to the sensor and to the views.
    pub seed: u64,
    /// Offset and gain of each pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fixed_pattern: Option<FixedPattern>,
    /// Noise of rows and columns, new in each frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_noise: Option<LineNoise>,
    /// Hot and dead pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub defective_pixels: Option<DefectivePixels>,
    /// Glare and dirt on the window, at rest in the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflections: Option<Reflections>,
    /// A shadow that moves across the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow: Option<Shadow>,
    /// Vignetting: share of the light that the corners of the picture lack. It grows with the square of the distance from the
    /// middle, and stays where it is while bodies move through it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignetting: Option<f64>,
    /// Focus that is lost over the recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub defocus: Option<Defocus>,
    /// A camera that does not stand still.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shake: Option<Shake>,
    /// Bodies that move towards the camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out_of_plane: Option<OutOfPlane>,
    /// A scale that is not the stated one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<ScaleError>,
    /// Rolling shutter: how much later than the line above it a line is exposed, in seconds. The time stamp is the middle
    /// of the first line's exposure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_time_s: Option<f64>,
    /// Lossy compression: what the blocks of 8 x 8 pixels lose at this quality of a JPEG file, 1 to 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jpeg_quality: Option<u32>,
    /// Bits of a count that are kept, the highest ones: 8 of 12, say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stored_bits: Option<u32>,
    /// Interlaced dropouts: share of the frames in which each second line repeats the one above it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeated_lines: Option<f64>,
}

/// A Gaussian blur that changes evenly from the first frame to the last: standard deviations in pixels.
///
/// Speckles, edges and the wall behind are blurred in closed form, each layer for itself; where three layers meet within the
/// blur, the mean of their products is not the product of their means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Defocus {
    /// In the first frame.
    #[serde(default)]
    pub first_px: f64,
    /// In the last frame.
    pub last_px: f64,
}

impl Defocus {
    fn check(self) -> Result<(), SyntheticError> {
        for (name, sigma_px) in [
            ("camera.effects.defocus.first_px", self.first_px),
            ("camera.effects.defocus.last_px", self.last_px),
        ] {
            require((0.0..=MOST_DEFOCUS_PX).contains(&sigma_px), name, "0 to 5 pixels", sigma_px)?;
        }
        Ok(())
    }

    /// The standard deviation at a share of the recording.
    pub(crate) fn sigma_px(self, progress: f64) -> f64 {
        self.first_px + (self.last_px - self.first_px) * progress.clamp(0.0, 1.0)
    }
}

impl Effects {
    /// Whether nothing is asked for, not even a seed.
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }

    pub(crate) fn check(
        &self,
        bit_depth: u32,
        height_px: usize,
        interval_s: f64,
    ) -> Result<(), SyntheticError> {
        self.fixed_pattern.iter().try_for_each(FixedPattern::check)?;
        self.line_noise.iter().try_for_each(LineNoise::check)?;
        self.defective_pixels.iter().try_for_each(DefectivePixels::check)?;
        self.reflections.iter().try_for_each(Reflections::check)?;
        self.shadow.iter().try_for_each(Shadow::check)?;
        self.defocus.into_iter().try_for_each(Defocus::check)?;
        self.shake.iter().try_for_each(Shake::check)?;
        self.out_of_plane.iter().try_for_each(OutOfPlane::check)?;
        self.scale.iter().try_for_each(ScaleError::check)?;
        let line_time_s = self.line_time_s.unwrap_or(0.0);
        let in_time = line_time_s >= 0.0 && line_time_s * height_px as f64 <= interval_s;
        let expected = "at least 0, all lines within 1/rate_hz";
        require(in_time, "camera.effects.line_time_s", expected, line_time_s)?;
        let quality = self.jpeg_quality.unwrap_or(100);
        require((1..=100).contains(&quality), "camera.effects.jpeg_quality", "1 to 100", quality)?;
        let bits = self.stored_bits.unwrap_or(bit_depth);
        let expected = "1 to camera.sensor.bit_depth";
        require((1..=bit_depth).contains(&bits), "camera.effects.stored_bits", expected, bits)?;
        require_share("camera.effects.vignetting", self.vignetting.unwrap_or(0.0))?;
        let share = self.repeated_lines.unwrap_or(0.0);
        require_share("camera.effects.repeated_lines", share)
    }
}
