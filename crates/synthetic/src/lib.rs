//! A camera of known motion: it films a chain of hollow elliptical cylinders whose motion is prescribed, and writes
//! Phantom .cine files that stand in for the real ones.
//!
//! The recordings are the truth against which the rest of chainwave is tested, so nothing in a picture may depend on
//! the methods under test:
//!
//! - A marker's speckles are Gaussians integrated in closed form over each pixel ([`speckle`]). Sub-pixel motion is
//!   therefore exact; no image is ever interpolated, and this crate does not know how images are correlated.
//! - The .cine files are written from the format's description, not from chainwave's reader, so that the two check
//!   each other.
//! - The motion between samples of a [`Trajectory`](chainwave_measurement::Trajectory) is the cubic Hermite
//!   interpolant of displacement and velocity. Its error is at most h^4/384 max|x''''|: for samples 10 us apart and the
//!   chain's highest frequency (572 Hz) 5e-9 of the oscillation's amplitude.
//! - Every random number comes from a seed and a counter (recording, frame, body), never from the order of the work,
//!   so the same settings give the same bytes for any number of threads.
//!
//! The picture has layers, from back to front: backdrop, rings, markers, rods. [`Scene`] composes them in linear light,
//! as fractions of the sensor's range; the sensor adds noise and counts. What later makes the camera more realistic
//! (motion blur, lens distortion, a tilted view, flicker) changes where [`Scene`] draws, or what it passes to the sensor.
//!
//! A frame's time stamp is the middle of its exposure.

mod backdrop;
mod cine;
mod compression;
mod error;
mod film;
mod gaussian;
mod motion;
mod p10;
mod packing;
mod ring;
mod rods;
mod scene;
mod seed;
mod sensor;
mod settings;
pub mod speckle;
pub mod trials;

pub use compression::{CompressionTest, compression_curve};
pub use error::SyntheticError;
pub use film::film;
pub use scene::Scene;
pub use settings::{Camera, Marker, Packing, Ring, Rods, Sensor, Shot, Specimen, Tones};
