//! Any contact law with its rule in tension, worked out for many evaluations.

use super::{linear::LinearLaw, power_kernel::PowerKernel, table::TableLaw};
use crate::lanes::PADDING;

/// A law with its rule in tension.
#[derive(Debug, Clone)]
pub(crate) enum Spring {
    Power(PowerKernel),
    /// Below `least_m` the force stays as it is there.
    Linear {
        law: LinearLaw,
        least_m: f64,
    },
    /// Below `least_m` the force stays as it is there.
    Table {
        law: TableLaw,
        least_m: f64,
    },
}

impl Spring {
    /// Force in newtons at an overlap in metres.
    pub(crate) fn force_n(&self, overlap_m: f64) -> f64 {
        match self {
            Self::Power(kernel) => kernel.force_n(overlap_m),
            Self::Table { law, least_m } => law.force_alone_n(overlap_m.max(*least_m)),
            _ => self.force_and_energy(overlap_m).0,
        }
    }

    /// Forces in newtons at overlaps in metres.
    pub(crate) fn forces_n(&self, overlaps_m: [f64; PADDING]) -> [f64; PADDING] {
        match self {
            Self::Power(kernel) => kernel.forces_n(overlaps_m),
            _ => overlaps_m.map(|overlap_m| self.force_n(overlap_m)),
        }
    }

    /// Stiffness in newtons per metre at an overlap in metres with its force in newtons.
    #[inline(always)]
    pub(crate) fn stiffness_n_per_m(&self, overlap_m: f64, force_n: f64) -> f64 {
        match self {
            Self::Power(kernel) => kernel.stiffness_n_per_m(overlap_m, force_n),
            Self::Linear { least_m, .. } | Self::Table { least_m, .. } if overlap_m < *least_m => 0.0,
            Self::Linear { law, .. } => law.k_n_per_m,
            Self::Table { law, .. } => law.stiffness_n_per_m(overlap_m),
        }
    }

    /// The greatest energy, in joules, between two overlaps: it grows with the distance from zero, but for curves that fall.
    pub(crate) fn most_energy_j(&self, least_m: f64, most_m: f64) -> f64 {
        let energy_j = |overlap_m: f64| self.force_and_energy(overlap_m).1;
        let of_ends = energy_j(least_m).max(energy_j(most_m));
        match self {
            Self::Table { law, .. } => law.barriers_m(least_m, most_m).map(energy_j).fold(of_ends, f64::max),
            _ => of_ends,
        }
    }

    /// Force in newtons and energy in joules at an overlap in metres.
    pub(crate) fn force_and_energy(&self, overlap_m: f64) -> (f64, f64) {
        match self {
            Self::Power(kernel) => kernel.force_and_energy(overlap_m),
            Self::Linear { law, least_m } => {
                let closed_m = overlap_m.max(*least_m);
                (law.k_n_per_m * closed_m, 0.5 * law.k_n_per_m * closed_m * closed_m)
            }
            Self::Table { law, least_m } => {
                let closed_m = overlap_m.max(*least_m);
                let (force_n, energy_j) = law.evaluate(closed_m);
                (force_n, energy_j + force_n * (overlap_m - closed_m))
            }
        }
    }
}
