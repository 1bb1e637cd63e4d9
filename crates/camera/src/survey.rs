//! What a person wants to see of a recording before anything is tracked in it: noise, histogram, contact sheet.

mod frames;
mod histogram;
mod noise;
mod regression;
mod sheet;

pub(crate) use frames::whole_frame;
pub use histogram::{Histogram, Saturation, histogram};
pub use noise::{NoiseEstimate, noise};
pub use sheet::{ContactSheet, GrayFrame, SheetLayout, contact_sheet, gray_frame, gray_frames};
