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
//! - Interpolation leaves a bias that follows from its kernel and the reference alone. It is foreseen for each subset and
//!   taken off, which makes the cheap kernels as good as the dear ones; a twentieth of it stays in sigma.
//!
//! Measured on analytic Gaussian speckle (autocorrelation 4.5 px wide at half height, 17 % contrast, 12 bit), subsets
//! of 33 x 33 px; `tests/ladder.rs` prints such tables on any machine, with the speed of each. Bias is peak to peak over
//! sub-pixel shifts without noise; the rest is at 2 % noise, where the noise floor is 10.1 mpx.
//!
//! | method | bias | std | in 1 sigma | in 95 % |
//! |---|---|---|---|---|
//! | opencv-lk | 24 mpx | 13.7 mpx | 70.0 % | 96.6 % |
//! | opencv-ecc | 19 mpx | 32.8 mpx | 65.2 % | 94.3 % |
//! | opencv-phase | 46 mpx | 241 mpx | 60.9 % | 98.3 % |
//! | template-parabola | 24 mpx | 14.1 mpx | 70.2 % | 95.3 % |
//! | icgn-linear-translation | 1.8 mpx | 10.6 mpx | 71.7 % | 96.4 % |
//! | icgn-linear-affine | 1.8 mpx | 10.7 mpx | 73.5 % | 96.9 % |
//! | icgn-cubic-translation | 0.05 mpx | 10.6 mpx | 67.7 % | 95.0 % |
//! | icgn-cubic-rigid | 0.05 mpx | 10.5 mpx | 68.3 % | 95.2 % |
//! | icgn-cubic-affine (default) | 0.04 mpx | 10.6 mpx | 69.5 % | 95.3 % |
//! | icgn-cubic-quadratic | 0.08 mpx | 21.0 mpx | 67.6 % | 94.5 % |
//! | icgn-cubic-moms-affine | 0.14 mpx | 10.7 mpx | 69.5 % | 95.4 % |
//! | icgn-quintic-affine | 0.05 mpx | 10.7 mpx | 69.3 % | 95.3 % |
//! | icgn-quintic-moms-affine | 0.05 mpx | 10.7 mpx | 69.3 % | 95.3 % |
//!
//! A quadratic shape function has twice the noise: its centre is told apart from its curvature. Of the biases below 0.1
//! mpx most is that of speckles that saturate; without them the quintic ones have 0.01 mpx. Linear interpolation smooths,
//! and counts what it smooths away as noise: its sigma is too large.
//!
//! Over two patterns the error of a translation is 1.00, 1.01 and 1.03 times the floor at 1, 2 and 5 % noise, where the
//! bound for a reference that is noisy too is 1.00, 1.01 and 1.02; that of the affine shape function 1.04, 1.04 and 1.07,
//! where the bound of these textures is 1.03 times the former. Intervals hold 68 +- 2 and 95 +- 1 % for every shape
//! function from 1 to 5 % noise, also where noise grows with the light; at 0.2 % they hold 70 to 72 and 96 %, at 10 % 67 and
//! 94 %, and there a subset in a hundred is refused or lost.
//!
//! `benches/matching.rs` times the parts. On one thread of an AVX-512 machine that had other work to do, in microseconds per
//! subset: the affine match (3 iterations) 5.3 by either cubic and 8.7 by either quintic, the translation (2 iterations)
//! 1.6 and 2.8; the coefficients of all of a window of the size that a tracker reads 2.1 (cubic), 3.2 (cubic MOMS), 3.7
//! (quintic) and 6.9 (quintic MOMS), of which a tracker leaves the margins out; a subset's preparation 30, and the gradients of
//! the whole reference once. Of the affine match 60 % is interpolation, bound by the weights and taps of 16 points at a time,
//! a fifth the sums. The instruction set is chosen at run time, and results have the same bits with each, for any number
//! of threads.
//!
//! Pixels of the reference that saturate, that are no numbers or that show dark ground are left out of a subset, with
//! those near them, and sigma grows with what that costs; how dark and how near, `mask.rs` says. The sharp edge of a marker
//! rings into subsets that come nearer to it than some 5 px where the ground is not dark enough to be left out: 1 to 2 mpx
//! at 3 px, half as much with each further one. So a marker should reach 5 px beyond its subset on each side. What a frame
//! alone does not show (glints, dead pixels, an obstacle) is left out of that match, and sigma says what it cost; where
//! too little is seen the subset is lost. A subset whose texture changes is prepared anew, with the uncertainty of its place.
//!
//! Pixel (0, 0) is the centre of the top left pixel; x points right, y down.

mod alias;
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
mod interpolation_energy;
mod kernel;
mod lagged;
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
