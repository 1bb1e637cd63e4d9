//! The gaps' contact forces in a row, aligned for vectors.

use pulp::Simd;

use super::state::row_length;
use crate::lanes::{PADDING, row::AlignedRow};

/// Forces of the gaps in newtons, positive in compression; in front of them stands the force on the free side of the first
/// mass, zero.
#[derive(Debug, Clone)]
pub(crate) struct ForceRow {
    /// The gaps' forces begin a line of the cache, one vector behind the start.
    force_n: AlignedRow,
}

impl ForceRow {
    pub(crate) fn new(n_masses: usize) -> Self {
        Self { force_n: AlignedRow::zeros(row_length(n_masses)) }
    }

    /// Takes over the forces behind the first `n` masses of another row.
    #[inline(always)]
    pub(crate) fn copy_from(&mut self, other: &Self, n: usize) {
        self.behind(n).copy_from_slice(&other.force_n[PADDING..PADDING + n]);
    }

    /// The forces behind the first `n` masses.
    #[inline(always)]
    pub(crate) fn behind(&mut self, n: usize) -> &mut [f64] {
        &mut self.force_n[PADDING..PADDING + n]
    }

    /// The forces before and behind the first `n` masses, as vectors.
    #[inline(always)]
    pub(crate) fn beside<S: Simd>(&self, n: usize) -> (&[S::f64s], &[S::f64s]) {
        let (before, behind) = (&self.force_n[PADDING - 1..][..n], &self.force_n[PADDING..][..n]);
        (S::as_simd_f64s(before).0, S::as_simd_f64s(behind).0)
    }

    /// The net force on a mass.
    #[inline(always)]
    pub(crate) fn net_n(&self, mass: usize) -> f64 {
        self.force_n[PADDING - 1 + mass] - self.force_n[PADDING + mass]
    }
}
