use std::path::PathBuf;

/// Why a figure was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// The figure was given no panel at all.
    #[error("{}: expected at least one panel, found none", stem.display())]
    NoPanels {
        /// Path of the figure without its ending.
        stem: PathBuf,
    },
    /// Two inputs that belong together have different lengths.
    #[error("{}: {what}: expected {expected} values, found {found}", stem.display())]
    Length {
        /// Path of the figure without its ending.
        stem: PathBuf,
        /// The input.
        what: String,
        /// The length that it must have.
        expected: usize,
        /// The length that it has.
        found: usize,
    },
    /// An input cannot be drawn as it is.
    #[error("{}: {what}: expected {expected}, found {found}", stem.display())]
    Value {
        /// Path of the figure without its ending.
        stem: PathBuf,
        /// The input.
        what: String,
        /// What it must be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// A file could not be written or renamed.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The drawing library refused an image.
    #[error("{}: cannot be drawn: {reason}", path.display())]
    Draw {
        /// The file.
        path: PathBuf,
        /// The library's reason.
        reason: String,
    },
    /// The built-in typeface could not be read.
    #[error("the built-in typeface cannot be read: {reason}")]
    Typeface {
        /// The font library's reason.
        reason: String,
    },
}
