//! `[synthetic.rings]`: bodies that bend in the picture.

use serde::{Deserialize, Serialize};

use crate::input::numbers::Positive;

/// `[synthetic.rings]`: bodies move, and bend in the picture, as the ring model says. Their axes and wall are those of
/// `[synthetic.specimen.ring]`, the rest is here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmedRings {
    /// Width of a ring, out of the plane.
    pub(crate) width_m: Positive,
    /// Modulus of elasticity of the material.
    pub(crate) young_pa: Positive,
    /// Its Poisson ratio.
    pub(crate) poisson: f64,
    /// Its density.
    pub(crate) density_kg_per_m3: Positive,
    /// Beam elements around a ring.
    pub(crate) elements_per_ring: usize,
    /// Stiffness of the striker's contact.
    pub(crate) contact_stiffness_n_per_m: Positive,
}
