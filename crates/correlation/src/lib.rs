//! Digital image correlation: where a subset of a reference image lies in every frame of a recording, and how well
//! that is known.
//!
//! - A subset is **prepared once** ([`PreparedSubset`]): its intensities, the steepest descent images and the inverse
//!   of their Hessian depend on the reference alone, which is what makes the inverse-compositional Gauss-Newton
//!   method (IC-GN) fast. It is **matched often**, in a [`Window`] of B-spline coefficients that covers the predicted
//!   place and nothing else, so a recording costs what its subsets cost.
//! - The criterion is ZNSSD: an unknown gain and offset of the light are eliminated exactly, by making the steepest
//!   descent images orthogonal to a constant and to the reference.
//! - Noise enters the gradients as well as the grey values. The gradients here come from a filter that is chosen by
//!   the reference's own noise, and their noise is kept out of the Hessian, so that the estimate stays unbiased and
//!   close to the Cramer-Rao bound at several percent of noise.
//! - Every position has its standard uncertainty, from the residual and the Hessian, or the reason why there is none
//!   ([`chainwave_measurement::Lost`]). [`track`] predicts from the subset's own past and falls back to a search, also of
//!   turned and stretched bodies; [`correlate()`] grows a field from its most reliable points.
//! - A match is believed by **evidence** ([`Acceptance`]): it resembles the reference more than chance gives on its texture, and than
//!   anything else does where the body may be. What may as well be another place is [`chainwave_measurement::Lost::Ambiguous`].
//! - What a scene requires is found by evidence: the shape function by a test of what the matches would have to explain
//!   as noise ([`ShapeEvidence`]), the rung of the ladder by shifting the user's own reference and on the motion that the film shows
//!   ([`self_test()`], [`film_test`], [`cheapest_within`]), the subset's size by the noise floor and by chance
//!   ([`subset_size()`], [`ChosenGrid`]).
//!
//! - Interpolation leaves a bias that follows from its kernel and the reference alone. It is foreseen for each subset and
//!   taken off, which makes the cheap kernels nearly as good as the dear ones; 7 % of it stays in sigma. What OpenCV's
//!   methods and the template search leave between pixels is found on shifted pictures of each subset, taken off, and
//!   what is left of it stated.
//!
//! - Where a field bends, what the shape function leaves of it is foreseen from the neighbours, taken off, and what is left of it
//!   is part of sigma (`field/shape_error.rs`): with the shape function by evidence 95 % intervals
//!   hold 93 to 97 % of the errors at waves of two subsets' length and more.
//!
//! - Where subsets may go is proposed by the pictures, too: the **markers** of a row with their pitch and the sigma to expect
//!   ([`propose_markers`], [`expected_sigma`]).
//!
//! How near all of them come to the noise floor, how often their intervals hold, and what they cost stands in the book, "What image
//! correlation reaches" (`docs/src/measured/correlation.md`); `tests/ladder`, `benches/matching.rs` and the
//! tests of `chainwave-opencv` make its tables anew.
//! The instruction set is chosen at run time, and results have the same bits with each, for any number of threads.
//!
//! Pixels of the reference that saturate, that are no numbers or that show dark ground are left out of a subset, with
//! those near them, and sigma grows with what that costs; how dark and how near, `reference/mask.rs` says. The sharp edge of a marker
//! rings into subsets that come nearer to it than some 5 px where the ground is not dark enough to be left out: 1 to 2 mpx
//! at 3 px, half as much with each further one. [`sharp_edge`] finds such an edge. So a marker should reach 5 px beyond its
//! subset on each side. What a frame alone does not show (glints, dead pixels, an obstacle) is left out of that match, and sigma
//! says what it cost; where too little is seen the subset is lost. A subset whose texture changes is prepared anew, with the
//! uncertainty of its place.
//!
//! Pixel (0, 0) is the centre of the top left pixel; x points right, y down.
//!
//! ```
//! use chainwave_correlation::{ReferenceFrames, Settings, track};
//! use chainwave_measurement::Subset;
//! # use chainwave_measurement::MemoryRecording;
//! # // A texture of forty waves that moves right by an eighth of a pixel a frame.
//! # let frame = |k: u32| -> Vec<f32> {
//! #     let pixel = |i: u32| {
//! #         let (x, y) = (f64::from(i % 96) - 0.125 * f64::from(k), f64::from(i / 96));
//! #         let wave = |n: i32| (0.9 * f64::from(n).sin() * x + 0.9 * f64::from(2 * n + 1).sin() * y + f64::from(n * n)).sin();
//! #         (2000.0 + 150.0 * (1..=40).map(wave).sum::<f64>()) as f32
//! #     };
//! #     (0..96 * 80).map(pixel).collect()
//! # };
//! # let recording = MemoryRecording::new(96, 12, (0..9).map(frame).collect());
//!
//! let marker = Subset::new("marker", 45.0, 40.0, 16, 16);
//! let first = ReferenceFrames::Single(0);
//! let tracks = track(&recording, &[marker], &first, &Settings::default(), &|_| ())?;
//! for (frame, found) in tracks[0].positions.iter().enumerate() {
//!     match found {
//!         Ok(position) => println!("{frame}: {:.4} +- {:.4} px", position.x_px.value, position.x_px.sigma),
//!         Err(lost) => println!("{frame}: {}", lost.as_str()),
//!     }
//! }
//! # let last = tracks[0].positions[8].map_err(|lost| lost.as_str())?;
//! # // Interpolation of these waves errs by less than a hundredth of a pixel; rounding to counts is not even asked.
//! # assert!((last.x_px.value - 46.0).abs() < 0.01, "{last:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod acceptance;
mod cover;
mod error;
mod evidence;
mod expected;
mod field;
mod foreign;
mod grid_choice;
mod icgn;
mod interpolation_error;
mod markers;
mod method;
mod middle;
mod pixel_places;
mod prepared;
mod reference;
mod refine;
mod search;
mod self_test;
mod settings;
mod simd;
mod structure;
mod subset_size;
mod track;
mod uncertainty;
mod warp;
mod window;

pub use cover::{Cover, Uncovered};
pub use error::CorrelationError;
pub use error::no_markers::NoMarkers;
pub use evidence::ShapeEvidence;
pub use expected::{ExpectedSigma, expected_sigma};
pub use field::strain::{Strain, strains};
pub use field::{Field, FieldGrid, FieldPoint, correlate};
pub use foreign::{FlowSettings, ForeignMethods, GrayImage, has_foreign, register_foreign};
pub use grid_choice::{ChosenGrid, PicturePair};
pub use icgn::outcome::{Match, Workspace};
pub use markers::{Marker, MarkerRow, propose_markers};
pub use method::Method;
pub use prepared::PreparedSubset;
pub use reference::edge::{SharpEdge, Side, detected_edge, sharp_edge};
pub use reference::{Reference, mean_of_frames};
pub use self_test::{FilmError, RungError, cheapest_within, film_test, self_test};
pub use settings::{Acceptance, Interpolation, ReferenceFrames, Settings, Shape, ShapeChoice};
pub use subset_size::{SizeReason, SubsetSize, subset_size};
pub use track::{track, track_by_evidence, track_from};
pub use window::Window;

/// Version of the numbers that this crate finds: to be raised whenever the same pictures would give other tracks, which kept ones are then
/// not taken for. The golden tracks among the tests of the whole guard it.
pub const ALGORITHM_VERSION: u32 = 22;
