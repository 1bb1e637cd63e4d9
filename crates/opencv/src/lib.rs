//! OpenCV at the edge: it decodes videos, finds calibration boards, and brings methods of tracking to be measured against.
//!
//! This crate alone knows the crate `opencv`. What the inner crates would have done is said by their traits
//! ([`chainwave_camera::VisionLibrary`], [`chainwave_correlation::ForeignMethods`]); [`register`] brings it to them, for a whole process.
//! Programs that link OpenCV load some 250 libraries and take a fifth of a second to start, so the command `chainwave` is none of them: it
//! becomes this crate's program `chainwave-opencv`, the same command with OpenCV, where something takes it. Without the feature `opencv` the
//! crate is empty.

#[cfg(feature = "opencv")]
mod corners;
#[cfg(feature = "opencv")]
mod library;
#[cfg(feature = "opencv")]
mod methods;
#[cfg(feature = "opencv")]
mod video;

/// Brings OpenCV to the crates that open recordings and track, for the whole process. Once is enough, more do no harm.
#[cfg(feature = "opencv")]
pub fn register() {
    chainwave_camera::register_vision(&library::OpenCv);
    chainwave_correlation::register_foreign(&library::OpenCv);
}
