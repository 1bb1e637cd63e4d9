//! Why nothing could be tracked or correlated.

pub(crate) mod no_markers;

use std::path::PathBuf;

use chainwave_measurement::{ReadError, Region};

use crate::error::no_markers::NoMarkers;

/// Why a recording could not be tracked at all. A subset that is lost in some frames is no error: its track says so.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CorrelationError {
    /// The reference could not be read.
    #[error("reference frame: {0}")]
    Reference(#[from] ReadError),
    /// The reference frames do not exist.
    #[error("{}: reference: expected frames within 0..{n_frames}, found {first}..{end}", path.display())]
    NoSuchReference {
        /// The recording.
        path: PathBuf,
        /// First frame asked for.
        first: usize,
        /// One past the last frame asked for.
        end: usize,
        /// Frames in the recording.
        n_frames: usize,
    },
    /// A subset reaches outside the reference frame.
    #[error(
        "{}: subset {name:?} at ({x_px}, {y_px}): expected it inside {width_px} x {height_px} px, found it reaching \
         outside (hint: move it, or make its half width smaller)",
        path.display()
    )]
    SubsetOutside {
        /// The recording.
        path: PathBuf,
        /// The subset's name.
        name: String,
        /// Its centre's column.
        x_px: f64,
        /// Its centre's row.
        y_px: f64,
        /// Columns of a frame.
        width_px: usize,
        /// Rows of a frame.
        height_px: usize,
    },
    /// No subset of a field fits in the reference image.
    #[error(
        "reference image: expected at least {0} x {0} px for a subset of half size {half_px} px, found {width_px} x \
         {height_px} px (hint: a smaller half size)",
        2 * half_px + 7
    )]
    GridTooLarge {
        /// Columns and rows of a subset on each side of its centre.
        half_px: usize,
        /// Columns of the image.
        width_px: usize,
        /// Rows of the image.
        height_px: usize,
    },
    /// A reference image shows nothing that subsets could be told by.
    #[error(
        "reference image: expected texture, found none at any of {n_places} places over it (hint: is it the right picture, lit and in \
         focus?)"
    )]
    NoTexture {
        /// Places that were looked at.
        n_places: usize,
    },
    /// No markers can be proposed.
    #[error("{}: markers: expected speckled patches on plainer ground, found {reason}", path.display())]
    NoMarkers {
        /// The recording.
        path: PathBuf,
        /// What there is instead.
        reason: NoMarkers,
    },
    /// A buffer of pixels has not the size of its region.
    #[error("pixels of {region:?}: expected {} values, found {found}", region.n_pixels())]
    PixelCount {
        /// The region.
        region: Region,
        /// Values handed over.
        found: usize,
    },
    /// A name from the command line or a configuration is not known.
    #[error("{what}: expected one of {expected}, found {found:?}")]
    UnknownName {
        /// What is named.
        what: &'static str,
        /// The known names.
        expected: String,
        /// The name found.
        found: String,
    },
    /// No method is as accurate as was asked.
    #[error(
        "{}: accuracy: expected a method with an error of at most {asked_px} px on the shifted reference and the film, found {best} \
         (hint: {hint})",
        path.display()
    )]
    AccuracyNotReached {
        /// The recording.
        path: PathBuf,
        /// The error asked for, in pixels.
        asked_px: f64,
        /// The best that was found.
        best: String,
        /// What may help.
        hint: &'static str,
    },
    /// A setting has no meaning.
    #[error("setting {name}: expected {expected}, found {found}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// A method that takes rectangles, and a subset within an outline.
    #[error(
        "subset {name:?}: expected a rectangle for the method {method}, found an outline (hint: the methods `icgn-...` take outlines)"
    )]
    Outline {
        /// The method.
        method: String,
        /// The subset's name.
        name: String,
    },
    /// A method of OpenCV's, in a program that has brought none ([`crate::register_foreign`]).
    #[error(
        "method {method} takes OpenCV, which this program is without (hint: `cargo build --release -p chainwave-opencv` builds the command with it)"
    )]
    NeedsOpenCv {
        /// The method.
        method: String,
    },
    /// OpenCV refused.
    #[error("OpenCV: {0}")]
    OpenCv(String),
}
