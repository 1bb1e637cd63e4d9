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
//!   taken off, which makes the cheap kernels nearly as good as the dear ones; 7 % of it stays in sigma. What OpenCV's
//!   methods and the template search leave between pixels is found on shifted pictures of each subset, taken off, and
//!   what is left of it stated.
//!
//! Measured on analytic Gaussian speckle (autocorrelation 4.5 px wide at half height, 17 % contrast, 12 bit), subsets
//! of 33 x 33 px; `tests/ladder.rs` prints this table on any machine. Bias is peak to peak over sub-pixel shifts without noise. The
//! rest is at 2 % noise, from 24 000 positions in six films whose references have fresh noise (which tell std to 1 %), over the noise
//! floor of 10.1 mpx. The speed is that of tracking a whole film, references and windows included, on one thread of a busy
//! machine; methods that give no covariance spend most of such short films on finding their errors on each subset first.
//!
//! | method | bias | std | std/floor | in 1 sigma | in 95 % | positions/s |
//! |---|---|---|---|---|---|---|
//! | opencv-lk | 0.8 mpx | 10.0 mpx | 0.99 | 70.2 % | 96.0 % | 1 600 |
//! | opencv-ecc | 3.0 mpx | 10.4 mpx | 1.02 | 68.4 % | 96.2 % | 800 |
//! | opencv-phase | 2.6 mpx | 20.7 mpx | 2.04 | 70.7 % | 95.8 % | 1 100 |
//! | template-parabola | 12.8 mpx | 10.9 mpx | 1.07 | 73.6 % | 96.8 % | 1 100 |
//! | icgn-linear-translation | 1.1 mpx | 10.2 mpx | 1.01 | 70.3 % | 96.0 % | 83 000 |
//! | icgn-linear-affine | 1.1 mpx | 10.4 mpx | 1.02 | 70.5 % | 96.0 % | 62 000 |
//! | icgn-cubic-translation | 0.03 mpx | 10.2 mpx | 1.00 | 69.8 % | 95.8 % | 70 000 |
//! | icgn-cubic-rigid | 0.03 mpx | 10.2 mpx | 1.00 | 69.9 % | 95.9 % | 53 000 |
//! | icgn-cubic-affine (default) | 0.03 mpx | 10.3 mpx | 1.02 | 70.3 % | 96.0 % | 49 000 |
//! | icgn-cubic-quadratic | 0.07 mpx | 20.4 mpx | 2.01 | 68.7 % | 95.3 % | 32 000 |
//! | icgn-cubic-moms-affine | 0.13 mpx | 10.3 mpx | 1.02 | 70.2 % | 95.9 % | 44 000 |
//! | icgn-quintic-affine | 0.04 mpx | 10.3 mpx | 1.02 | 70.2 % | 95.9 % | 36 000 |
//! | icgn-quintic-moms-affine | 0.05 mpx | 10.3 mpx | 1.02 | 70.3 % | 95.9 % | 35 000 |
//!
//! A quadratic shape function has twice the noise: its centre is told apart from its curvature. Of the biases below 0.1
//! mpx most is that of speckles that saturate; without them the quintic ones have 0.01 mpx. As OpenCV gives them, before
//! what is found on pictures is taken off, Lucas-Kanade and the template search have a bias of 24 mpx.
//!
//! From 0.2 to 10 % noise the intervals of every shape function hold 67.5 to 69.7 % and 94.8 to 95.4 % of 9600 errors, also where
//! noise grows with the light; at 10 % a subset in a hundred is refused or lost. What interpolation leaves in the residual is
//! foreseen and not taken for noise. The linear kernel holds 66 to 70 and 94 to 96 % from 1 % noise on; at 0.2 %, where its
//! bias was eight times the noise, 73 and 97 %.
//!
//! The other methods' intervals hold 66 to 73 and 94 to 96 % of 2900 errors from 1 to 5 % noise (the template search 77 at
//! 1 %), and at 10 %, where sigma is overstated by a twentieth, 72 to 75 and 96 to 97 %. At 0.2 % what is left of their biases
//! has long tails: Lucas-Kanade 76 and 97 % (8 bits round as much as that noise), ECC 76 and 96 %, the template search 89 and
//! 95 %; those of phase correlation hold 61 and 84 %, too few.
//!
//! On light and dark spots spread evenly, as printed patterns are, with 20 % contrast, the error of a translation at 1, 2 and 5 % noise
//! is 0.999, 1.002 and 1.017 times the noise floor of a rigid shift, and that of the affine shape function 0.996, 1.000 and 1.016 times
//! its Cramer-Rao bound, itself 1.014 times that floor (38 720 errors each, which tell 0.4 %; each over its own subset's bound). The
//! bound takes the texture for known; of two noisy pictures of an unknown one it is 1.001, 1.004 and 1.016 times as high (C. H.
//! Knapp, G. C. Carter, IEEE Trans. Acoust. Speech Signal Process. 24 (1976) 320-327), so nothing is left to gain. On random light
//! spots with 14 % contrast, some of them as dark as their noise is wide, a translation has 1.007, 1.013 and 1.038 times the floor, and
//! the affine shape function 1.002, 1.009 and 1.037 times its bound, which is 1.033 times the floor there (116 000 errors each); two
//! noisy pictures of it allow 1.002, 1.007 and 1.025 times.
//!
//! `benches/matching.rs` times the parts, each next to the textbook's loops of one pixel after the other
//! (`tests/support/plain.rs`). On one thread of an AVX-512 machine that had other work to do, in microseconds per subset: the
//! affine match (3 iterations) 6.0 by either cubic and 7.7 by either quintic (the loops: 125); the translation (2 iterations)
//! 2.3 and 2.5; a subset's preparation 13 (the loops: 46); the coefficients of all of a window of the size that a tracker reads
//! 2.2 (cubic), 3.0 (cubic MOMS), 3.8 (quintic) and 5.7 (quintic MOMS), of which a tracker leaves the margins out. Of the affine
//! match 60 % is interpolation, bound by the weights and taps of 16 points at a time, a fifth the sums. The instruction set is
//! chosen at run time, and results have the same bits with each, for any number of threads.
//!
//! In the same minutes, on the same pictures of 420 x 420 px: OpenCorr's cubic IC-GN (commit 44532cc, its preparation of each
//! subset included) made 14 800 affine subsets/s where these matches make 164 000 (11 times) and the quintic ones 126 000 (8.5
//! times); with the preparation of each subset, as between two pictures, it is 53 000 (3.6 times). OpenCV's pyramidal
//! Lucas-Kanade (4.6, four levels) made 99 000 points/s where translations make 374 000 (3.8 times), and 288 000 (1.3 times)
//! without its pyramid, from a start 0.1 px off. `benches/follow.rs` of the command follows 26 bodies through a .cine of 512 x
//! 512 px: 5 900 frames/s by cubic translation, reading and filtering included, where OpenCV made 2 900 from memory (9 800
//! without its pyramid).
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

mod error;
mod evidence;
mod field;
mod icgn;
mod method;
mod prepared;
mod reference;
mod refine;
mod search;
mod self_test;
mod settings;
mod simd;
mod subset_size;
mod track;
mod uncertainty;
mod warp;
mod window;

pub use error::CorrelationError;
pub use evidence::ShapeEvidence;
pub use field::strain::{Strain, strains};
pub use field::{Field, FieldGrid, FieldPoint, correlate};
pub use icgn::{Match, Workspace};
pub use method::{METHODS, Method};
pub use prepared::PreparedSubset;
pub use reference::edge::{SharpEdge, Side, sharp_edge};
pub use reference::{Reference, mean_of_frames};
#[cfg(feature = "opencv")]
pub use refine::lucas_kanade::track_lucas_kanade;
pub use self_test::{RungError, cheapest_within, self_test};
pub use settings::{Interpolation, ReferenceFrames, Settings, Shape, ShapeChoice};
pub use subset_size::smallest_half_px;
pub use track::{track, track_by_evidence};
pub use window::Window;

/// Version of the numbers that this crate finds: to be raised whenever the same pictures would give other tracks, which kept ones are then
/// not taken for. The golden tracks among the tests of the whole guard it.
pub const ALGORITHM_VERSION: u32 = 3;
