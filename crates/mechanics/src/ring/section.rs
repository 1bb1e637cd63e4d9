//! A ring's dimensions and material, and the stiffnesses of its cross-section.

use crate::{check, error::MechanicsError};

/// Shear correction factor of a solid rectangular section.
const SHEAR_CORRECTION: f64 = 5.0 / 6.0;

/// What a beam's cross-section resists with, and weighs, per unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Bending stiffness EI in newton square metres.
    pub bending_nm2: f64,
    /// Axial stiffness EA in newtons.
    pub axial_n: f64,
    /// Shear stiffness in newtons; infinite for a section that does not shear.
    pub shear_n: f64,
    /// Mass per length in kilograms per metre.
    pub mass_kg_per_m: f64,
}

/// One hollow elliptical cylinder: an elliptical ring of rectangular section, its major axis along the chain.
///
/// The modulus acts as in plane stress: a narrow ring takes the material's own, a wide one (width far above the wall and
/// the radius of curvature times the wall) up to E / (1 - nu^2), which the user states as `young_pa`. Rotary inertia of
/// the section is left out; against its translation it counts (wall / wavelength)^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Semi-axis of the centreline along the chain, in metres.
    pub semi_major_m: f64,
    /// Semi-axis of the centreline across the chain, in metres.
    pub semi_minor_m: f64,
    /// Wall thickness in metres.
    pub wall_m: f64,
    /// Width of the cylinder, out of the plane, in metres.
    pub width_m: f64,
    /// Effective Young's modulus in pascals.
    pub young_pa: f64,
    /// Poisson's ratio; it sets the shear modulus alone.
    pub poisson: f64,
    /// Density in kilograms per cubic metre.
    pub density_kg_per_m3: f64,
    /// Height of the bond with a neighbour, across the chain, in metres: within it the wall moves with the joint. Zero
    /// for a bond along a line.
    pub bond_width_m: f64,
}

impl Ring {
    /// The paper's hollow elliptical cylinder: its centreline and wall as printed, its modulus from the measured sound speed (54 m/s), its
    /// density from the measured mass (0.455 g).
    pub const PAPER: Self = Self {
        semi_major_m: 14.8e-3,
        semi_minor_m: 8.8e-3,
        wall_m: 0.4e-3,
        width_m: 12e-3,
        young_pa: 2.888e9,
        poisson: 0.35,
        density_kg_per_m3: 1237.0,
        bond_width_m: 0.0,
    };

    /// The wall's cross-section.
    pub fn section(&self) -> Section {
        let area_m2 = self.wall_m * self.width_m;
        let shear_pa = self.young_pa / (2.0 * (1.0 + self.poisson));
        Section {
            bending_nm2: self.young_pa * area_m2 * self.wall_m * self.wall_m / 12.0,
            axial_n: self.young_pa * area_m2,
            shear_n: SHEAR_CORRECTION * shear_pa * area_m2,
            mass_kg_per_m: self.density_kg_per_m3 * area_m2,
        }
    }

    /// Refuses a ring that cannot be built, or whose wall is no beam.
    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        check::positive("ring semi_major_m", self.semi_major_m)?;
        check::positive("ring semi_minor_m", self.semi_minor_m)?;
        check::positive("ring wall_m", self.wall_m)?;
        check::positive("ring width_m", self.width_m)?;
        check::positive("ring young_pa", self.young_pa)?;
        check::positive("ring density_kg_per_m3", self.density_kg_per_m3)?;
        let poisson = self.poisson;
        check::require(
            (-1.0..=0.5).contains(&poisson) && poisson > -1.0,
            "ring poisson",
            "above -1, up to 0.5",
            poisson,
        )?;
        check::not_negative("ring bond_width_m", self.bond_width_m)?;
        let tightest_m = self.tightest_radius_m();
        check::require(
            self.wall_m < tightest_m,
            "ring wall_m",
            "less than the tightest radius of curvature of the centreline, min(b^2 / a, a^2 / b)",
            self.wall_m,
        )?;
        check::require(
            self.bond_width_m < self.semi_minor_m,
            "ring bond_width_m",
            "less than the semi-minor axis",
            self.bond_width_m,
        )
    }

    /// Smallest radius of curvature of the centreline, in metres.
    fn tightest_radius_m(&self) -> f64 {
        let (a, b) = (self.semi_major_m, self.semi_minor_m);
        (b * b / a).min(a * a / b)
    }
}
