//! How far chains are solved beside trial values for the derivatives of their motion, and how many at a time.

use chainwave_mechanics::Chain;

use crate::damping::{N_DAMPINGS, critical_kg_per_s};

/// How far the chains on both sides of c_d and of c_s are from it, relative to critical: far from where the accelerations round, and
/// near enough for them to be straight in between.
pub(crate) const DAMPING_STEPS: [f64; N_DAMPINGS] = [1e-5, 1e-4];
/// The same of a factor on a quantity.
pub(crate) const FACTOR_STEP: f64 = 1e-4;
/// Derivatives that go through one simulation: what fills a vector, so that many of them still share the cores.
pub(crate) const DERIVATIVES_TOGETHER: usize = 8;

/// A step down and a step up in a damping of some value; down it goes no farther than to none.
pub(crate) fn beside_damping(step: f64, value: f64) -> [f64; 2] {
    [-step.min(value), step]
}

/// The same of c_d where no striker's damping stands beside it.
pub(crate) fn beside_c_d(chain: &Chain, c_d_kg_per_s: f64) -> [f64; 2] {
    beside_damping(DAMPING_STEPS[0] * critical_kg_per_s(chain), c_d_kg_per_s)
}

/// The same in a factor on a quantity.
pub(crate) const BESIDE_FACTOR: [f64; 2] = [-FACTOR_STEP, FACTOR_STEP];
