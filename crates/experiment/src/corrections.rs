//! `corrections.csv`: what a reader of the pictures took out of the tracks, or told the tracker.

mod apply;
mod correction;
mod file;

pub use self::correction::{Correction, Remedy};
pub use self::file::{CORRECTIONS_FILE, Corrections, CorrectionsSource, corrections_csv};
