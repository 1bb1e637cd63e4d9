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
//! - Everything else that a real camera does ([`Effects`]: fixed pattern, defective pixels, reflections, a shadow, defocus, a
//!   shake, a wrong scale, rolling shutter, compression, dropped lines) is drawn from seeds; [`Scene::camera_truth`] and
//!   [`Scene::camera_pose`] tell what was drawn.
//!
//! A frame's time stamp is the middle of its exposure (under a rolling shutter, of its first line's).
//!
//! Apart from films of a chain, [`pictures`] makes pairs of pictures of a deformed texture with the displacement known in
//! closed form.
//!
//! # A moving texture in ten lines
//!
//! ```
//! use chainwave_measurement::Trajectory;
//! use chainwave_synthetic::{Camera, Scene, Shot, Specimen};
//! use ndarray::array;
//!
//! # let camera: Camera = toml::from_str(r#"
//! #     width_px = 120
//! #     height_px = 96
//! #     rate_hz = 25000.0
//! #     exposure_s = 10e-6
//! #     packing = "16"
//! #     scale_px_per_m = 5000.0
//! #     sensor = { bit_depth = 12, black_level = 64.0, read_noise_counts = 6.0, counts_per_electron = 0.2 }
//! # "#)?;
//! # let specimen: Specimen = toml::from_str(r#"
//! #     n_bodies = 1
//! #     pitch_m = 0.030
//! #     ring = { semi_major_m = 15e-3, semi_minor_m = 9e-3, wall_m = 0.4e-3 }
//! #     marker = { half_width_m = 5.5e-3, half_height_m = 5.5e-3, speckle_diameter_px = 4.5, seed = 9 }
//! #     rods = { diameter_m = 2.38e-3, below_axis_m = [] }
//! # "#)?;
//! # let shot: Shot = toml::from_str(r#"
//! #     stage_m = 0.0
//! #     first_body_px = [50.0, 47.5]
//! #     first_image = 0
//! #     n_frames = 10
//! #     trigger_delay_s = 0.0
//! #     frame_phase_s = 0.0
//! #     noise_seed = 1
//! # "#)?;
//! // One body that moves at 2 m/s, before a camera of 5 px/mm at 25 000 frames a second.
//! let motion = Trajectory {
//!     times_s: vec![0.0, 1.0e-3],
//!     displacement_m: array![[0.0, 2.0e-3]],
//!     velocity_m_per_s: array![[2.0, 2.0]],
//! };
//! let scene = Scene::new(&camera, &specimen, &shot, &motion)?;
//! let frames = (0..scene.n_frames()).map(|frame| scene.recorded_counts(frame)).collect::<Result<Vec<_>, _>>()?;
//! let path_px = scene.body_centres_px(9)?[0][0] - scene.body_centres_px(0)?[0][0];
//! assert!((path_px - 5000.0 * 2.0 * 9.0 / 25_000.0).abs() < 1e-9);
//! assert_ne!(frames[0], frames[9]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod backdrop;
mod blur;
mod canvas;
mod check;
mod cine;
mod compression;
mod effects;
mod error;
mod film;
mod gaussian;
mod half_plane;
mod layers;
mod lighting;
mod marker;
mod motion;
mod optics;
mod p10;
mod packing;
pub mod pictures;
mod recording_camera;
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
pub use effects::{
    DefectivePixels, Defocus, Effects, FixedPattern, HotPixel, LineNoise, OutOfPlane, Reflections,
    ScaleError, Shadow, Shake, ShakeOnset,
};
pub use error::SyntheticError;
pub use film::{FileFaults, film};
pub use lighting::Lighting;
pub use optics::Optics;
pub use recording_camera::{CameraPose, CameraTruth};
pub use scene::Scene;
pub use settings::{Camera, Cover, Marker, Packing, Ring, Rods, Sensor, Shot, Specimen, Tones};
pub use shapes::Shapes;
