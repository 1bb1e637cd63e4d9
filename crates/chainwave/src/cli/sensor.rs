//! What is known of the sensor.

use std::path::PathBuf;

use clap::Args;

/// What is known of the sensor.
#[derive(Debug, Args)]
pub(crate) struct Sensor {
    /// Dark frames of the same camera, exposure and part of the sensor: a recording, a folder of images or one of them. Their
    /// mean is subtracted, and hot pixels are filled from their neighbours.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) dark: Option<PathBuf>,
    /// Frames of an evenly lit field, likewise: differences of gain are corrected, and dead pixels filled.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) flat: Option<PathBuf>,
}
