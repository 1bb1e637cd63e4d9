//! The vocabulary of chainwave: the types that two or more crates use, with their units and conventions.
//!
//! No algorithm and no input or output lives here, but for tools that every crate may need: [`map_in_parallel`], the one way in which
//! work is spread over threads, as it is what makes results the same for any number of them, and the [`median`] of numbers and what it tells of their scatter. Conventions
//! that hold everywhere:
//!
//! - Pixel (0, 0) is the *centre* of the top left pixel; x points right and y down; a [`Region`] is half open.
//! - Images are `f32` arrays of shape `[height, width]` in linear counts as recorded; everything else is `f64`.
//! - SI units; the unit stands last in a name. Positions in images are in pixels (`_px`).
//! - The chain's x points away from the striker. Bodies are numbered from 1 (the struck one); row `i` of an array over
//!   bodies is body `i + 1`. Gap n lies between bodies n and n + 1.
//! - t = 0 is the trigger.
//! - A value that was not measured is `None`, or an error that names the reason; never a sentinel.
//!
//! ```
//! use chainwave_measurement::Estimate;
//!
//! let strain = Estimate::new(-0.052, 0.0002);
//! let in_per_cent = strain.scaled(100.0);
//! assert_eq!(in_per_cent, Estimate::new(-5.2, 0.02));
//! // The truth lies within 1.96 standard deviations of an estimate in 95 of 100 cases.
//! assert!(strain.covers_95(-0.0517) && !strain.covers_95(-0.0515));
//! ```

mod error_modes;
mod error_source;
mod estimate;
mod head;
mod median;
mod memory_recording;
mod motion;
mod observation;
mod parallel;
mod recording;
mod region;
mod shared_reading_error;
mod track;

pub use error_modes::{ErrorModes, ErrorPattern};
pub use error_source::ErrorSource;
pub use estimate::Estimate;
pub use head::Head;
pub use median::{median, median_and_robust_sigma, median_interval_s, robust_sigma_about_zero};
pub use memory_recording::{Excerpt, MemoryRecording};
pub use motion::{ChainMotion, SampleWeights, Trajectory, TrajectoryAt, samples_until};
pub use observation::{BodyTrack, Observation};
pub use parallel::{both_in_parallel, map_in_parallel};
pub use recording::{PlainFrame, ReadError, Recording, RecordingInfo};
pub use region::Region;
pub use shared_reading_error::{SharedReadingError, TrackDeviation};
pub use track::{Lost, Position, Subset, Track};
