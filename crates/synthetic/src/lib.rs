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
//! as fractions of the sensor's range; the sensor adds noise and counts. Every effect of a real camera is off unless asked
//! for, and then costs nothing and changes no bit:
//!
//! - Motion blur is closed form too: a marker's and an edge's integrals over pixel and exposure are differences of second
//!   primitives.
//! - A lens or a tilted camera ([`Optics`]) gives each pixel its own parallelogram of an ideal picture. No closed form covers
//!   that, so each speckle is integrated over it by a Gauss-Legendre rule of 1e-6; again no image is interpolated.
//! - Light that drifts and flickers ([`Lighting`]) is a factor on what a frame collects.
//! - Rings of any [`Shapes`] take the place of the rigid ones, so that a ring model's motion can be filmed.
//! - A [`Cover`] hides a marker for a while, and [`FileFaults`] break the file itself.
//!
//! A frame's time stamp is the middle of its exposure.

mod backdrop;
mod canvas;
mod cine;
mod compression;
mod error;
mod film;
mod gaussian;
mod half_plane;
mod lighting;
mod marker;
mod motion;
mod optics;
mod p10;
mod packing;
mod ring;
mod rods;
mod sampled;
mod scene;
mod seed;
mod sensor;
mod settings;
mod shapes;
mod smear;
pub mod speckle;
pub mod trials;
mod view;

pub use compression::{CompressionTest, compression_curve};
pub use error::SyntheticError;
pub use film::{FileFaults, film};
pub use lighting::Lighting;
pub use optics::Optics;
pub use scene::Scene;
pub use settings::{Camera, Cover, Marker, Packing, Ring, Rods, Sensor, Shot, Specimen, Tones};
pub use shapes::Shapes;
