//! The ring of the experiment, for tests and benches.

use chainwave_mechanics::Ring;

/// The centreline of the experiment's HEC; modulus and density as derived from the measured sound speed and mass.
pub(crate) fn paper_ring() -> Ring {
    Ring {
        semi_major_m: 14.8e-3,
        semi_minor_m: 8.8e-3,
        wall_m: 0.4e-3,
        width_m: 12e-3,
        young_pa: 2.888e9,
        poisson: 0.35,
        density_kg_per_m3: 1237.0,
        bond_width_m: 0.0,
    }
}
