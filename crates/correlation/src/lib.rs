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
//!   turned bodies; [`correlate()`] grows a field from its most reliable points.
//! - What a scene requires is found by evidence: the shape function by a test of what the matches would have to explain
//!   as noise ([`ShapeEvidence`]), the rung of the ladder by shifting the user's own reference ([`self_test()`]), the
//!   subset's size by the noise floor ([`smallest_half_px`]).
//!
//! Measured on analytic Gaussian speckle (autocorrelation 4.5 px wide at half height, 17 % contrast, 12 bit), subsets
//! of 33 x 33 px; `tests/ladder.rs` prints such a table on any machine. Bias is peak to peak over sub-pixel shifts
//! without noise; the rest is at 2 % noise, where the noise floor is 10.1 mpx.
//!
//! | method | bias | std | in 1 sigma | in 95 % |
//! |---|---|---|---|---|
//! | opencv-lk | 24 mpx | 13.7 mpx | 69.5 % | 96.5 % |
//! | icgn-linear-affine | 25 mpx | 13.9 mpx | 57.4 % | 88.8 % |
//! | icgn-cubic-affine | 1.9 mpx | 10.5 mpx | 68.3 % | 95.2 % |
//! | icgn-cubic-moms-translation | 0.26 mpx | 10.4 mpx | 68.0 % | 94.8 % |
//! | icgn-cubic-moms-rigid | 0.26 mpx | 10.4 mpx | 68.3 % | 94.8 % |
//! | icgn-cubic-moms-affine (default) | 0.25 mpx | 10.5 mpx | 68.5 % | 95.0 % |
//! | icgn-cubic-moms-quadratic | 0.29 mpx | 20.7 mpx | 68.5 % | 94.4 % |
//! | icgn-quintic-affine | 0.17 mpx | 10.5 mpx | 68.6 % | 95.1 % |
//! | icgn-quintic-moms-affine | 0.06 mpx | 10.5 mpx | 68.6 % | 95.1 % |
//!
//! A quadratic shape function has twice the noise: its centre is told apart from its curvature.
//!
//! `benches/matching.rs` times the parts. On one thread of a busy AVX-512 machine, in microseconds per subset: the affine
//! match (3 iterations) 5.7 by either cubic and 8.7 by either quintic, the translation (2 iterations) 1.6 and 2.9; the
//! coefficients of all of a window of the size that a tracker reads 2.4 (cubic), 3.3 (cubic MOMS), 4.0 (quintic) and 7.0
//! (quintic MOMS), of which a tracker leaves the margins out; a subset's preparation 12, and the gradients of the whole
//! reference once. The instruction set is chosen at run time, and results have the same bits with each, for any number of
//! threads.
//!
//! Over two patterns with 30 draws of noise each, the affine quintic's error is 1.02 to 1.04 times the floor at 1 %,
//! 1.03 to 1.05 at 2 % and 1.05 to 1.08 at 5 % noise. Neither interpolation's bias nor a mismatch of the shape
//! function is in sigma: the intervals hold 68 +- 2 and 95 +- 1 % for quintic from 0.2 to 5 % noise and for cubic
//! from 1 to 5 %; for linear they do not hold. At 10 % noise they hold some 66 and 93 %.
//!
//! Pixels of the reference that saturate, that are no numbers or that show dark ground are left out of a subset, with
//! those near them, and sigma grows with what that costs; how dark and how near, `mask.rs` says. The sharp edge of a marker
//! rings into subsets that come nearer to it than some 5 px where the ground is not dark enough to be left out: 1 to 2 mpx
//! at 3 px, half as much with each further one. So a marker should reach 5 px beyond its subset on each side. What
//! saturates in a target frame alone is not left out.
//!
//! Pixel (0, 0) is the centre of the top left pixel; x points right, y down.

mod bias;
mod cardinal;
mod damped;
mod error;
mod evidence;
mod field;
mod field_queue;
mod field_seed;
mod field_strain;
mod filter;
mod fourier;
mod gradient;
mod icgn;
mod kernel;
#[cfg(feature = "opencv")]
mod lucas_kanade;
mod mask;
mod method;
mod moments;
mod normal;
#[cfg(feature = "opencv")]
mod opencv_refine;
mod part;
mod predict;
mod prefilter;
mod prepared;
mod reference;
mod refine;
mod renewal;
mod sample;
mod search;
mod self_test;
mod settings;
mod shift;
mod simd;
mod subset_size;
mod sums;
mod template;
mod track;
mod uncertainty;
mod visible;
mod warp;
mod window;

pub use error::CorrelationError;
pub use evidence::ShapeEvidence;
pub use field::{Field, FieldGrid, FieldPoint, correlate};
pub use field_strain::{Strain, strains};
pub use icgn::{Match, Workspace};
#[cfg(feature = "opencv")]
pub use lucas_kanade::track_lucas_kanade;
pub use method::{METHODS, Method};
pub use prepared::PreparedSubset;
pub use reference::{Reference, mean_of_frames};
pub use self_test::{RungError, cheapest_within, self_test};
pub use settings::{Interpolation, ReferenceFrames, Settings, Shape, ShapeChoice};
pub use subset_size::smallest_half_px;
pub use track::{track, track_by_evidence};
pub use window::Window;
