//! How far chains are solved beside trial values for the derivatives of their motion, and how many at a time.

use crate::damping::N_DAMPINGS;

/// How far the chains on both sides of c_d and of c_s are from it, relative to critical: far from where the accelerations round, and
/// near enough for them to be straight in between.
pub(crate) const DAMPING_STEPS: [f64; N_DAMPINGS] = [1e-5, 1e-4];
/// The same of a factor on a quantity.
pub(crate) const FACTOR_STEP: f64 = 1e-4;
/// How far a force of dry friction is from the one beside it, in newtons: a body's own weight times a millionth or so.
pub(crate) const FRICTION_STEP_N: f64 = 1e-6;
/// Derivatives that go through one simulation: what fills a vector, so that many of them still share the cores.
pub(crate) const DERIVATIVES_TOGETHER: usize = 8;
