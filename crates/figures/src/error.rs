//! Why a figure was not drawn or not written.

use std::path::PathBuf;

/// Why a figure was not drawn or not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// Two inputs that belong together have different lengths.
    #[error("{figure}: {what}: expected {expected} values, found {found}")]
    Length {
        /// The figure.
        figure: &'static str,
        /// The input.
        what: String,
        /// The length that it must have.
        expected: usize,
        /// The length that it has.
        found: usize,
    },
    /// An input cannot be drawn as it is.
    #[error("{figure}: {what}: expected {expected}, found {found}")]
    Value {
        /// The figure.
        figure: &'static str,
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
    /// The values of a figure could not be read.
    #[error("{}: expected the values of a figure as a run keeps them, found {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// An image could not be encoded.
    #[error("a figure cannot be encoded: {reason}")]
    Encode {
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
