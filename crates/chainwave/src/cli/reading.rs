//! Arguments that say how recordings are read.

use chainwave_camera::{OpenOptions, RawGeometry};
use clap::Args;

use super::positive::positive;

/// How fast recordings were taken whose files do not say.
#[derive(Debug, Args)]
pub(crate) struct FrameRate {
    /// Frames per second of recordings that do not state their frame rate, such as folders of images.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) rate_hz: Option<f64>,
}

/// How recordings are read.
#[derive(Debug, Args)]
pub(crate) struct Reading {
    /// Treat recordings as headerless raw pixels of this geometry, such as 1280x800x12le: columns, rows, bits, and le
    /// (two bytes a pixel, low byte first), be (high byte first) or p (10 or 12 bits packed).
    #[arg(long, value_name = "WxHxBITS[le|be|p]")]
    pub(crate) raw: Option<RawGeometry>,
    /// Take the whole frames of a recording that was cut short, and say how many they are.
    #[arg(long)]
    pub(crate) partial: bool,
}

impl Reading {
    /// The same for the camera, with a frame rate where one is known.
    pub(crate) fn options(&self, rate_hz: Option<f64>) -> OpenOptions {
        OpenOptions { rate_hz, partial: self.partial, raw: self.raw, ..OpenOptions::default() }
    }
}
