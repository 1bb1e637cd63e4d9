//! Dashpots between neighbours, which act while their contact is closed.

use super::{contacts::Contact, tension::Tension};
use crate::lanes::{self, PADDING};

/// The dashpots of a row of gaps, gap `i` between masses `i` and `i + 1` of the row.
///
/// Where a contact detaches, its dashpot acts while it is closed: a force of c times the rate of closing sets in with the overlap, and ends
/// with it (as in A. Rosas, A. H. Romero, V. F. Nesterenko, K. Lindenberg, Phys. Rev. Lett. 98 (2007) 164301).
#[derive(Debug)]
pub(crate) struct Dashpots {
    kg_per_s: Vec<f64>,
    /// Overlap in metres below which a contact is open; minus infinity where it holds in tension.
    open_below_m: Vec<f64>,
}

impl Dashpots {
    /// Those of the gaps with these contacts, where there are any.
    pub(super) fn of(contacts: &[&Contact]) -> Option<Self> {
        let damped = contacts.iter().any(|contact| contact.damping_kg_per_s > 0.0);
        let open_below_m = |contact: &&Contact| match contact.tension {
            Tension::Detach => contact.limit_m(),
            Tension::Tangent { .. } => f64::NEG_INFINITY,
        };
        damped.then(|| Self {
            kg_per_s: contacts.iter().map(|contact| contact.damping_kg_per_s).collect(),
            open_below_m: contacts.iter().map(open_below_m).collect(),
        })
    }

    /// Whether a gap's contact is open at an overlap in metres.
    pub(crate) fn is_open(&self, gap: usize, overlap_m: f64) -> bool {
        overlap_m < self.open_below_m[gap]
    }

    /// The dashpot of a gap at an overlap in metres, in kilograms per second.
    #[inline(always)]
    pub(crate) fn acting_kg_per_s(&self, gap: usize, overlap_m: f64) -> f64 {
        if overlap_m < self.open_below_m[gap] { 0.0 } else { self.kg_per_s[gap] }
    }

    /// Adds the dashpots' forces to `force_n`, and returns the power in watts that they take.
    #[inline(always)]
    pub(crate) fn push(&self, x_m: &[f64], v_m_per_s: &[f64], force_n: &mut [f64]) -> f64 {
        let mut sums_w = [0.0; PADDING];
        for (block, forces_n) in force_n.as_chunks_mut::<PADDING>().0.iter_mut().enumerate() {
            for (i, (force_n, sum_w)) in forces_n.iter_mut().zip(&mut sums_w).enumerate() {
                let gap = block * PADDING + i;
                let rate_m_per_s = v_m_per_s[gap] - v_m_per_s[gap + 1];
                let dashpot_n = self.acting_kg_per_s(gap, x_m[gap] - x_m[gap + 1]) * rate_m_per_s;
                *force_n += dashpot_n;
                *sum_w += dashpot_n * rate_m_per_s;
            }
        }
        lanes::total(sums_w)
    }
}
