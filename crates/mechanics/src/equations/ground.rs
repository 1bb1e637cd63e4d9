//! What holds the masses of the row to ground: springs, and a curve of force over displacement.

use std::ops::Range;

use pulp::Simd;

use super::{parameters::Chain, parameters::Drive, row::MassRow, state::row_length};
use crate::{contact::table::TableLaw, lanes::row::AlignedRow};

/// What holds the masses of the row to ground; strikers, and a body that is moved as given, are not held.
#[derive(Debug, Clone)]
pub(crate) struct Ground {
    springs_n_per_m: AlignedRow,
    curve: Option<Curve>,
}

/// A curve of force over displacement, and the masses that it holds.
#[derive(Debug, Clone)]
struct Curve {
    law: TableLaw,
    masses: Range<usize>,
    /// The largest slope, up or down.
    steepest_n_per_m: f64,
}

impl Ground {
    /// That of a chain; none where nothing holds it.
    pub(crate) fn of(chain: &Chain, row: &MassRow<'_>) -> Option<Self> {
        let springs = row.ground_n_per_m();
        let curve = chain.ground_law.clone().map(|law| Curve::new(law, chain, row));
        if springs.is_none() && curve.is_none() {
            return None;
        }
        let springs = springs.unwrap_or_else(|| vec![0.0; row.n_masses()]);
        Some(Self { springs_n_per_m: AlignedRow::padded(springs, row_length(row.n_masses())), curve })
    }

    /// The springs in newtons per metre.
    pub(crate) fn springs_n_per_m(&self) -> &AlignedRow {
        &self.springs_n_per_m
    }

    /// Whether a curve holds the masses.
    pub(crate) fn is_curved(&self) -> bool {
        self.curve.is_some()
    }

    /// Force against the displacement of a mass, in newtons.
    pub(crate) fn force_n(&self, mass: usize, x_m: f64) -> f64 {
        let spring_n = self.springs_n_per_m[mass] * x_m;
        self.curve(mass).map_or(spring_n, |curve| spring_n + curve.law.force_alone_n(x_m))
    }

    /// Energy that is held at a displacement of a mass, in joules.
    pub(crate) fn energy_j(&self, mass: usize, x_m: f64) -> f64 {
        let spring_j = 0.5 * self.springs_n_per_m[mass] * x_m * x_m;
        self.curve(mass).map_or(spring_j, |curve| spring_j + curve.law.evaluate(x_m).1)
    }

    /// Stiffness at a displacement of a mass, in newtons per metre.
    pub(crate) fn stiffness_n_per_m(&self, mass: usize, x_m: f64) -> f64 {
        let spring = self.springs_n_per_m[mass];
        self.curve(mass).map_or(spring, |curve| spring + curve.law.stiffness_n_per_m(x_m))
    }

    /// The largest stiffness, up or down, at any displacement of a mass, in newtons per metre.
    pub(crate) fn stiffest_n_per_m(&self, mass: usize) -> f64 {
        self.springs_n_per_m[mass] + self.curve(mass).map_or(0.0, |curve| curve.steepest_n_per_m)
    }

    fn curve(&self, mass: usize) -> Option<&Curve> {
        self.curve.as_ref().filter(|curve| curve.masses.contains(&mass))
    }

    /// Fills `held` with the forces `before` the first masses less what holds them to ground.
    #[inline(always)]
    pub(crate) fn hold<S: Simd>(&self, simd: S, x_m: &[f64], before: &[S::f64s], held_n: &mut [f64]) {
        let n = x_m.len();
        let springs = S::as_simd_f64s(&self.springs_n_per_m[..n]).0.iter().zip(S::as_simd_f64s(x_m).0);
        let held = S::as_mut_simd_f64s(held_n).0;
        for (held, (before, (k, x))) in held.iter_mut().zip(before.iter().zip(springs)) {
            *held = simd.sub_f64s(*before, simd.mul_f64s(*k, *x));
        }
        if let Some(Curve { law, masses, .. }) = &self.curve {
            for mass in masses.start.min(n)..masses.end.min(n) {
                held_n[mass] -= law.force_alone_n(x_m[mass]);
            }
        }
    }
}

impl Curve {
    fn new(law: TableLaw, chain: &Chain, row: &MassRow<'_>) -> Self {
        let first = row.first_body() + usize::from(matches!(chain.drive, Drive::Imposed(_)));
        let masses = first..row.first_body() + chain.n_bodies();
        Self { masses, steepest_n_per_m: law.steepest_n_per_m(), law }
    }
}
