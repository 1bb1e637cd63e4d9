//! The gaps' contact forces in a row, aligned for vectors.

use pulp::Simd;

use super::{ground::Ground, state::row_length};
use crate::lanes::{self, PADDING, row::AlignedRow};

/// Forces of the gaps in newtons, positive in compression; in front of them stands the force on the free side of the first
/// mass, zero.
#[derive(Debug, Clone)]
pub(crate) struct ForceRow {
    /// The gaps' forces begin a line of the cache, one vector behind the start.
    force_n: AlignedRow,
    /// The force before each mass with the push of what holds it to ground, where anything does.
    held_n: AlignedRow,
    is_held: bool,
}

impl ForceRow {
    pub(crate) fn new(n_masses: usize) -> Self {
        let force_n = AlignedRow::zeros(row_length(n_masses));
        Self { held_n: force_n.clone(), force_n, is_held: false }
    }

    /// Takes in what holds the first masses to ground, where anything does, once the gaps' forces stand.
    #[inline(always)]
    pub(crate) fn hold<S: Simd>(&mut self, simd: S, ground: Option<&Ground>, x_m: &[f64]) {
        self.is_held = ground.is_some();
        let Some(ground) = ground else { return };
        let n = x_m.len();
        let (before, _) = S::as_simd_f64s(&self.force_n[PADDING - 1..][..n]);
        ground.hold(simd, x_m, before, &mut self.held_n[..n]);
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

    /// The forces before and behind the first `n` masses, block by block; what holds them to ground pushes from before.
    #[inline(always)]
    pub(crate) fn beside(&self, n: usize) -> [&[[f64; PADDING]]; 2] {
        let gaps = &self.force_n[PADDING - 1..][..n];
        let before = if self.is_held { &self.held_n[..n] } else { gaps };
        let behind = &self.force_n[PADDING..][..n];
        [before, behind].map(lanes::blocks)
    }

    /// The net force on a mass.
    #[inline(always)]
    pub(crate) fn net_n(&self, mass: usize) -> f64 {
        let before_n = if self.is_held { self.held_n[mass] } else { self.force_n[PADDING - 1 + mass] };
        before_n - self.force_n[PADDING + mass]
    }
}
