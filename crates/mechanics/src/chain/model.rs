//! Equations of motion: accelerations and energies of a row of masses from positions and velocities.

use std::borrow::Cow;

use pulp::{Simd, WithSimd};

use super::{
    force_row::ForceRow,
    imposed::ImposedMotion,
    parameters::{Chain, Drive, FarEnd},
    state::{ChainState, row_length},
};
use crate::{
    contact::{
        contacts::{Contact, Contacts},
        gaps::{Gaps, Idle},
        spring::Spring,
        striker::StrikerContact,
    },
    lanes::{self, PADDING, PartialSums, padded, row::AlignedRow, vectorised},
};

/// The chain as the integrators see it: masses in a row, the striker first where there is one.
///
/// Gap `i` of the row lies behind mass `i`; the last one leads to the wall, or to nothing.
#[derive(Debug)]
pub(crate) struct ChainModel<'a> {
    pub(crate) gaps: Gaps,
    contacts: &'a Contacts,
    /// That of all gaps, where they are the same.
    same_spring: Option<Spring>,
    /// Zero where the motion is imposed, so that the mass neither accelerates nor counts as energy.
    pub(crate) mass_kg: AlignedRow,
    pub(crate) inverse_mass_per_kg: AlignedRow,
    pub(crate) damping_kg_per_s: AlignedRow,
    /// The striker's contact, where there is a striker.
    pub(crate) striker: Option<StrikerContact>,
    pub(crate) has_wall: bool,
    n_masses: usize,
    imposed: Option<&'a ImposedMotion>,
}

impl<'a> ChainModel<'a> {
    pub(crate) fn new(chain: &'a Chain) -> Self {
        let (mut mass_kg, mut damping_kg_per_s) = (chain.mass_kg.clone(), chain.damping_kg_per_s.clone());
        let (mut striker, mut imposed) = (None, None);
        match &chain.drive {
            Drive::Striker(body) => {
                mass_kg.insert(0, body.mass_kg);
                damping_kg_per_s.insert(0, 0.0);
                striker = Some(StrikerContact::new(chain.contact.of_striker(), body.damping_kg_per_s));
            }
            Drive::Imposed(motion) => {
                (mass_kg[0], damping_kg_per_s[0]) = (0.0, 0.0);
                imposed = Some(motion);
            }
            Drive::Free { .. } => {}
        }
        let n_masses = mass_kg.len();
        let row = |values: Vec<f64>| AlignedRow::padded(values, row_length(n_masses));
        let inverse_masses = mass_kg.iter().map(|&m| if m > 0.0 { m.recip() } else { 0.0 });
        let inverse_mass_per_kg = row(inverse_masses.collect());
        Self {
            gaps: row_of_gaps(chain, striker.is_some(), n_masses),
            contacts: &chain.contact,
            same_spring: match &chain.contact {
                Contacts::Same(contact) => Some(contact.spring()),
                Contacts::Each(_) | Contacts::Struck { .. } => None,
            },
            inverse_mass_per_kg,
            mass_kg: row(mass_kg),
            damping_kg_per_s: row(damping_kg_per_s),
            striker,
            has_wall: chain.far_end == FarEnd::Fixed,
            n_masses,
            imposed,
        }
    }

    /// The state at t = 0; a striker touches.
    pub(crate) fn initial_state(&self, chain: &Chain) -> ChainState {
        let mut state = ChainState { touching: self.striker.is_some(), ..ChainState::at_rest(self.n_masses) };
        match &chain.drive {
            Drive::Striker(striker) => state.v_m_per_s[0] = striker.velocity_m_per_s,
            Drive::Imposed(_) => self.impose(0.0, &mut state.x_m, &mut state.v_m_per_s),
            Drive::Free { displacement_m, velocity_m_per_s } => {
                state.x_m[..self.n_masses].copy_from_slice(displacement_m);
                state.v_m_per_s[..self.n_masses].copy_from_slice(velocity_m_per_s);
            }
        }
        state
    }

    /// Bodies, and the striker.
    pub(crate) fn n_masses(&self) -> usize {
        self.n_masses
    }

    /// The row's gap that is gap 1 of the chain.
    pub(crate) fn first_gap(&self) -> usize {
        usize::from(self.striker.is_some())
    }

    /// Gaps between bodies.
    pub(crate) fn n_gaps(&self) -> usize {
        self.n_masses - 1 - self.first_gap()
    }

    pub(crate) fn is_imposed(&self) -> bool {
        self.imposed.is_some()
    }

    /// Whether a dashpot lies between neighbouring bodies.
    pub(crate) fn has_neighbours_coupled(&self) -> bool {
        self.gaps.has_dashpots()
    }

    /// Sets what is imposed at a time.
    #[inline]
    pub(crate) fn impose(&self, time_s: f64, x_m: &mut [f64], v_m_per_s: &mut [f64]) {
        if let Some(motion) = self.imposed {
            (x_m[0], v_m_per_s[0]) = motion.at(time_s);
        }
    }

    /// Fills `force_n` with the springs' forces of the gaps of the first `active` masses, as the ends allow them.
    #[inline(always)]
    pub(crate) fn spring_forces<S: Simd>(
        &self,
        simd: S,
        x_m: &[f64],
        touching: bool,
        active: usize,
        force_n: &mut ForceRow,
    ) {
        self.gaps.forces(simd, x_m, self.idle(touching), force_n.behind(active));
        self.end(touching, force_n.behind(active));
    }

    #[inline(always)]
    fn idle(&self, touching: bool) -> Idle {
        let open = self.striker.is_some() && !touching;
        [open.then_some(0), (!self.has_wall).then_some(self.n_masses - 1)]
    }

    /// Takes away what is not there.
    #[inline(always)]
    fn end(&self, touching: bool, row: &mut [f64]) {
        for gap in self.idle(touching).into_iter().flatten() {
            if let Some(value) = row.get_mut(gap) {
                *value = 0.0;
            }
        }
    }

    /// Fills `acceleration_m_per_s2` at a state, using `force_n` for the gaps; returns the power lost, in watts.
    #[inline(always)]
    pub(crate) fn rates<S: Simd>(
        &self,
        simd: S,
        at: PhasePoint<'_>,
        force_n: &mut ForceRow,
        acceleration_m_per_s2: &mut [f64],
    ) -> f64 {
        self.spring_forces(simd, at.x_m, at.touching, at.active, force_n);
        self.rates_by_springs(simd, at, force_n, acceleration_m_per_s2)
    }

    /// [`ChainModel::rates`] where `force_n` holds the springs' forces already.
    #[inline(always)]
    pub(crate) fn rates_by_springs<S: Simd>(
        &self,
        simd: S,
        at: PhasePoint<'_>,
        force_n: &mut ForceRow,
        acceleration_m_per_s2: &mut [f64],
    ) -> f64 {
        let PhasePoint { v_m_per_s, touching, active, .. } = at;
        let mut lost_w = self.gaps.damp(v_m_per_s, force_n.behind(active));
        lost_w += self.damp_striker(v_m_per_s, touching, force_n.behind(active));
        if self.imposed.is_some() {
            lost_w -= force_n.behind(active)[0] * v_m_per_s[0];
        }
        lost_w + self.accelerate(simd, &v_m_per_s[..active], force_n, acceleration_m_per_s2)
    }

    #[inline(always)]
    fn damp_striker(&self, v_m_per_s: &[f64], touching: bool, force_n: &mut [f64]) -> f64 {
        let (Some(contact), true) = (&self.striker, touching) else { return 0.0 };
        let closing = v_m_per_s[0] - v_m_per_s[1];
        force_n[0] += contact.damping_kg_per_s * closing;
        contact.damping_kg_per_s * closing * closing
    }

    /// Accelerations from the gaps' forces and the dashpots to ground; returns the power that those take, in watts.
    #[inline(always)]
    fn accelerate<S: Simd>(
        &self,
        simd: S,
        v_m_per_s: &[f64],
        force_n: &ForceRow,
        acceleration_m_per_s2: &mut [f64],
    ) -> f64 {
        let n = v_m_per_s.len();
        let (velocities, _) = S::as_simd_f64s(v_m_per_s);
        let (dampings, _) = S::as_simd_f64s(&self.damping_kg_per_s[..n]);
        let (inverse_masses, _) = S::as_simd_f64s(&self.inverse_mass_per_kg[..n]);
        let (before, behind) = force_n.beside::<S>(n);
        let (accelerations, _) = S::as_mut_simd_f64s(&mut acceleration_m_per_s2[..n]);
        let n_vectors = PartialSums::<S>::VECTORS;
        let gaps = before.chunks_exact(n_vectors).zip(behind.chunks_exact(n_vectors));
        let masses = velocities.chunks_exact(n_vectors).zip(dampings.chunks_exact(n_vectors));
        let masses = masses.zip(inverse_masses.chunks_exact(n_vectors));
        let blocks = accelerations.chunks_exact_mut(n_vectors).zip(gaps).zip(masses);
        let mut lost = PartialSums::new(simd);
        for ((accelerations, (before, behind)), ((v, damping), inverse_mass)) in blocks {
            for i in 0..n_vectors {
                let push = simd.sub_f64s(before[i], behind[i]);
                let drag = simd.mul_f64s(damping[i], v[i]);
                accelerations[i] = simd.mul_f64s(simd.sub_f64s(push, drag), inverse_mass[i]);
                lost.add_product(simd, i, drag, v[i]);
            }
        }
        lost.total()
    }

    /// Rate at which a gap's rate of closing changes, in metres per second squared, in two states.
    pub(crate) fn closing_m_per_s2(&self, states: [&ChainState; 2], gap: usize) -> [f64; 2] {
        let gaps = [gap.wrapping_sub(1), gap, gap + 1];
        let of_gaps = |f: &dyn Fn(&ChainState, usize) -> f64| {
            let mut row = [0.0; PADDING];
            for (place, (state, gap)) in
                row.iter_mut().zip(states.into_iter().flat_map(|s| gaps.map(|g| (s, g))))
            {
                *place = if self.carries(gap, state.touching) { f(state, gap) } else { 0.0 };
            }
            row
        };
        let overlaps_m = of_gaps(&|state, gap| state.x_m[gap] - state.x_m[gap + 1]);
        let dashpots_n = of_gaps(&|state, gap| {
            let closing = state.v_m_per_s[gap] - state.v_m_per_s[gap + 1];
            self.dashpot_kg_per_s(gap, state.touching) * closing
        });
        let springs_n = self.springs_n(gaps, overlaps_m);
        let force_n = |i: usize| springs_n[i] + dashpots_n[i];
        let drag_n = |state: &ChainState, mass: usize| self.damping_kg_per_s[mass] * state.v_m_per_s[mass];
        [(states[0], 0), (states[1], 3)].map(|(state, i)| {
            let left_n = force_n(i) - force_n(i + 1) - drag_n(state, gap);
            let right_n = force_n(i + 1) - force_n(i + 2) - drag_n(state, gap + 1);
            left_n * self.inverse_mass_per_kg[gap] - right_n * self.inverse_mass_per_kg[gap + 1]
        })
    }

    /// Forces in newtons of three gaps' springs at two overlaps each; a gap that is none has no overlap.
    fn springs_n(&self, gaps: [usize; 3], overlaps_m: [f64; PADDING]) -> [f64; PADDING] {
        if let Some(spring) = &self.same_spring {
            return spring.forces_n(overlaps_m);
        }
        std::array::from_fn(|i| match overlaps_m[i] {
            0.0 => 0.0,
            overlap_m => self.spring(gaps[i % gaps.len()]).force_n(overlap_m),
        })
    }

    /// Whether a gap carries force: not that of a striker that has left, nor the one behind a free end.
    pub(crate) fn carries(&self, gap: usize, touching: bool) -> bool {
        let open = gap == 0 && self.striker.is_some() && !touching;
        gap < self.n_masses && !open && (gap + 1 < self.n_masses || self.has_wall)
    }

    /// Dashpot of a gap in kilograms per second, that of a touching striker included.
    pub(crate) fn dashpot_kg_per_s(&self, gap: usize, touching: bool) -> f64 {
        match &self.striker {
            Some(contact) if gap == 0 && touching => contact.damping_kg_per_s,
            _ => self.gaps.dashpot_kg_per_s(gap),
        }
    }

    /// Stiffness of a gap in newtons per metre.
    pub(crate) fn stiffness_n_per_m(&self, gap: usize, state: &ChainState) -> f64 {
        if !self.carries(gap, state.touching) {
            return 0.0;
        }
        let contact = self.contacts.behind(gap, self.first_gap());
        contact.stiffness_n_per_m(state.x_m[gap] - state.x_m[gap + 1])
    }

    /// The spring of one gap.
    pub(crate) fn spring(&self, gap: usize) -> Cow<'_, Spring> {
        match &self.same_spring {
            Some(spring) => Cow::Borrowed(spring),
            None => Cow::Owned(self.contacts.behind(gap, self.first_gap()).spring()),
        }
    }

    /// Potential and kinetic energy in joules.
    pub(crate) fn energy_j(&self, state: &ChainState) -> f64 {
        vectorised(Energy { model: self, state })
    }

    /// Opens or closes the striker's contact. What its spring holds at that instant leaves with the dashpot that is
    /// let go, or comes back with it; without damping that is zero.
    pub(crate) fn switch_contact(&self, state: &mut ChainState) {
        let Some(contact) = &self.striker else { return };
        let stored_j = contact.energy_j(state.striker_overlap_m());
        state.lost_j += if state.touching { stored_j } else { -stored_j };
        state.touching = !state.touching;
    }
}

/// Where the rates are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhasePoint<'a> {
    pub(crate) x_m: &'a [f64],
    pub(crate) v_m_per_s: &'a [f64],
    pub(crate) touching: bool,
    pub(crate) active: usize,
}

impl ChainState {
    #[inline(always)]
    pub(crate) fn place(&self) -> PhasePoint<'_> {
        PhasePoint {
            x_m: &self.x_m,
            v_m_per_s: &self.v_m_per_s,
            touching: self.touching,
            active: self.active,
        }
    }
}

/// The contacts behind each mass of the row and its padding; the striker's dashpot is not among them, nor one behind a free
/// end.
fn row_of_gaps(chain: &Chain, has_striker: bool, n_masses: usize) -> Gaps {
    let shift = usize::from(has_striker);
    let undamped = |contact: &Contact| Contact { damping_kg_per_s: 0.0, ..contact.clone() };
    let first = undamped(chain.contact.of_striker());
    let last = undamped(chain.contact.of_gap(n_masses));
    let contacts: Vec<&Contact> = (0..padded(n_masses))
        .map(|gap| match gap {
            0 if has_striker => &first,
            _ if gap + 1 < n_masses => chain.contact.of_gap(gap - shift),
            _ if gap + 1 == n_masses && chain.far_end == FarEnd::Fixed => chain.contact.of_gap(gap - shift),
            _ => &last,
        })
        .collect();
    Gaps::new(&contacts)
}

struct Energy<'a> {
    model: &'a ChainModel<'a>,
    state: &'a ChainState,
}

impl WithSimd for Energy<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { model, state } = self;
        let active = state.active;
        let mut energy_j = vec![0.0; active];
        model.gaps.energies(simd, &state.x_m, &mut energy_j);
        model.end(state.touching, &mut energy_j);
        let mut sums = [0.0; PADDING];
        let masses = model.mass_kg.as_chunks::<PADDING>().0;
        let velocities = state.v_m_per_s[..active].as_chunks::<PADDING>().0;
        let potential = energy_j.as_chunks::<PADDING>().0;
        for ((m, v), potential) in masses.iter().zip(velocities).zip(potential) {
            for i in 0..PADDING {
                sums[i] += 0.5 * m[i] * v[i] * v[i] + potential[i];
            }
        }
        lanes::total(sums)
    }
}
