//! Positions and velocities of all masses at one time.

use crate::contact::striker::GapState;
use crate::lanes::{PADDING, padded, row::AlignedRow};

/// Where the masses are, how fast they move, and what has gone in or out.
///
/// The rows end in masses that never move, up to a whole number of vectors and one more, so that every gap of a vector has
/// a mass on each side.
#[derive(Debug, Clone)]
pub(crate) struct ChainState {
    pub(crate) x_m: AlignedRow,
    pub(crate) v_m_per_s: AlignedRow,
    /// Energy that the dampers took, less the work of an imposed motion.
    pub(crate) lost_j: f64,
    pub(crate) touching: Touching,
    /// Masses that are integrated, a multiple of the vectors' length; those beyond rest.
    pub(crate) active: usize,
}

/// How far masses are displaced and how fast they move, at most.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    pub(crate) x_m: f64,
    pub(crate) v_m_per_s: f64,
}

/// Whether the contacts of the strikers in front and at the far end are closed.
pub(crate) type Touching = [bool; 2];

/// Length of a row of `n` masses with what pads it.
pub(crate) fn row_length(n: usize) -> usize {
    padded(n) + PADDING
}

impl ChainState {
    pub(crate) fn at_rest(n_masses: usize) -> Self {
        let row = AlignedRow::zeros(row_length(n_masses));
        let active = padded(n_masses);
        Self { x_m: row.clone(), v_m_per_s: row, lost_j: 0.0, touching: [false; 2], active }
    }

    /// Overlap of a gap, in metres.
    pub(crate) fn overlap_m(&self, gap: usize) -> f64 {
        self.x_m[gap] - self.x_m[gap + 1]
    }

    /// Rate at which that overlap grows, in metres per second.
    pub(crate) fn closing_m_per_s(&self, gap: usize) -> f64 {
        self.v_m_per_s[gap] - self.v_m_per_s[gap + 1]
    }

    /// Both.
    pub(crate) fn gap(&self, gap: usize) -> GapState {
        GapState { overlap_m: self.overlap_m(gap), closing_m_per_s: self.closing_m_per_s(gap) }
    }
}
