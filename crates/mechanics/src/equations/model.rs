//! Equations of motion: forces and accelerations of a row of masses from positions and velocities.

use std::borrow::Cow;

use pulp::Simd;

use super::{
    force_row::ForceRow,
    ground::Ground,
    imposed::ImposedMotion,
    parameters::{Chain, Drive},
    row::{MassRow, RowEnd},
    state::{ChainState, Reach, Touching, row_length},
};
use crate::{
    contact::{
        contacts::Contact,
        gaps::{Gaps, Idle},
        spring::Spring,
        striker::StrikerContact,
    },
    lanes::{self, PADDING, PartialSums, columns::Columns, padded, row::AlignedRow},
};

/// The chain as the integrators see it: masses in a row, strikers at its ends where there are any.
///
/// Gap `i` of the row lies behind mass `i`; the last one leads to the wall, or to nothing.
#[derive(Debug)]
pub(crate) struct ChainModel<'a> {
    pub(crate) gaps: Gaps,
    row: MassRow<'a>,
    /// That of all gaps, where they are the same.
    same_spring: Option<Spring>,
    /// Zero where the motion is imposed, so that the mass neither accelerates nor counts as energy.
    pub(crate) mass_kg: AlignedRow,
    pub(crate) inverse_mass_per_kg: AlignedRow,
    pub(crate) damping_kg_per_s: AlignedRow,
    /// Damping and inverse mass, as the loop over the row takes them.
    pub(crate) of_masses: Columns<2>,
    /// What holds masses to ground, where anything does.
    pub(crate) ground: Option<Ground>,
    /// The contacts of the strikers in front and at the far end, where there are any.
    pub(crate) strikers: [Option<StrikerContact>; 2],
    n_masses: usize,
    imposed: Option<&'a ImposedMotion>,
}

impl<'a> ChainModel<'a> {
    pub(crate) fn new(chain: &'a Chain) -> Self {
        let row = MassRow::of(chain);
        let n_masses = row.n_masses();
        let mass_kg = row.masses_kg();
        let aligned = |values: Vec<f64>| AlignedRow::padded(values, row_length(n_masses));
        let inverse_masses = mass_kg.iter().map(|&m| if m > 0.0 { m.recip() } else { 0.0 });
        let inverse_mass_per_kg = aligned(inverse_masses.collect());
        let damping_kg_per_s = aligned(row.ground_kg_per_s());
        let struck = |end: RowEnd| {
            let (gap, striker) = row.struck_gap(end).zip(row.striker(end))?;
            Some(StrikerContact::new(gap, row.contact(gap), striker.damping_kg_per_s))
        };
        Self {
            gaps: row_of_gaps(&row),
            same_spring: row.same_contact().map(Contact::spring),
            of_masses: Columns::new([&damping_kg_per_s, &inverse_mass_per_kg]),
            inverse_mass_per_kg,
            mass_kg: aligned(mass_kg),
            damping_kg_per_s,
            ground: Ground::of(chain, &row),
            strikers: RowEnd::BOTH.map(struck),
            n_masses,
            row,
            imposed: match &chain.drive {
                Drive::Imposed(motion) => Some(motion),
                Drive::Striker(_) | Drive::Free { .. } => None,
            },
        }
    }

    /// The state at t = 0; a striker in front touches, and one at the far end where no distance is left.
    pub(crate) fn initial_state(&self, chain: &Chain) -> ChainState {
        let mut state = ChainState::at_rest(self.n_masses);
        match &chain.drive {
            Drive::Striker(striker) => state.v_m_per_s[0] = striker.velocity_m_per_s,
            Drive::Imposed(_) => self.impose(0.0, &mut state.x_m, &mut state.v_m_per_s),
            Drive::Free { displacement_m, velocity_m_per_s } => {
                state.x_m[..chain.n_bodies()].copy_from_slice(displacement_m);
                state.v_m_per_s[..chain.n_bodies()].copy_from_slice(velocity_m_per_s);
            }
        }
        if let Some(far) = chain.far_striker() {
            state.x_m[self.n_masses - 1] = far.distance_m;
            state.v_m_per_s[self.n_masses - 1] = -far.striker.velocity_m_per_s;
        }
        let touches = |contact: &StrikerContact| state.overlap_m(contact.gap) >= 0.0;
        state.touching = self.strikers.each_ref().map(|contact| contact.as_ref().is_some_and(touches));
        state
    }

    /// The contact of a gap of the row that leads somewhere.
    pub(crate) fn contact(&self, gap: usize) -> Option<&Contact> {
        (gap < self.row.n_links()).then(|| self.row.contact(gap))
    }

    /// Bodies and strikers.
    pub(crate) fn n_masses(&self) -> usize {
        self.n_masses
    }

    /// The row's gap that is gap 1 of the chain, and its mass that is body 1.
    pub(crate) fn first_gap(&self) -> usize {
        self.row.first_body()
    }

    /// Gaps between bodies.
    pub(crate) fn n_gaps(&self) -> usize {
        self.n_masses - 1 - self.strikers.iter().flatten().count()
    }

    pub(crate) fn has_wall(&self) -> bool {
        self.row.has_wall()
    }

    pub(crate) fn is_imposed(&self) -> bool {
        self.imposed.is_some()
    }

    /// Whether a dashpot lies between neighbouring bodies.
    pub(crate) fn has_neighbours_coupled(&self) -> bool {
        self.gaps.dashpots.is_some()
    }

    /// Sets what is imposed at a time.
    #[inline]
    pub(crate) fn impose(&self, time_s: f64, x_m: &mut [f64], v_m_per_s: &mut [f64]) {
        if let Some(motion) = self.imposed {
            (x_m[0], v_m_per_s[0]) = motion.at(time_s);
        }
    }

    /// Fills `force_n` with the springs' forces of the gaps of the first `active` masses, as the ends allow them; what holds the masses to
    /// ground is not among them.
    #[inline(always)]
    pub(crate) fn gap_forces<S: Simd>(
        &self,
        simd: S,
        x_m: &[f64],
        touching: Touching,
        active: usize,
        force_n: &mut ForceRow,
    ) {
        self.gaps.forces(simd, x_m, self.idle(touching), force_n.behind(active));
        self.end(touching, force_n.behind(active));
    }

    /// [`ChainModel::gap_forces`] with what holds the masses to ground.
    #[inline(always)]
    pub(crate) fn spring_forces<S: Simd>(
        &self,
        simd: S,
        x_m: &[f64],
        touching: Touching,
        active: usize,
        force_n: &mut ForceRow,
    ) {
        self.gap_forces(simd, x_m, touching, active, force_n);
        force_n.hold(simd, self.ground.as_ref(), &x_m[..active]);
    }

    /// Stiffness of what holds a mass to ground, at a displacement, in newtons per metre.
    pub(crate) fn ground_n_per_m(&self, mass: usize, x_m: f64) -> f64 {
        self.ground.as_ref().map_or(0.0, |ground| ground.stiffness_n_per_m(mass, x_m))
    }

    #[inline(always)]
    fn idle(&self, touching: Touching) -> Idle {
        let open = |end: RowEnd| {
            let contact = self.strikers[end.index()].as_ref();
            contact.filter(|_| !touching[end.index()]).map(|contact| contact.gap)
        };
        let beyond = (!self.has_wall()).then_some(self.n_masses - 1);
        [open(RowEnd::Near), open(RowEnd::Far), beyond]
    }

    /// The contacts of strikers that touch.
    #[inline(always)]
    fn closed(&self, touching: Touching) -> impl Iterator<Item = &StrikerContact> {
        self.strikers
            .iter()
            .zip(touching)
            .filter_map(|(contact, touches)| contact.as_ref().filter(|_| touches))
    }

    /// Takes away what is not there.
    #[inline(always)]
    pub(crate) fn end(&self, touching: Touching, row: &mut [f64]) {
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
        self.gap_forces(simd, at.x_m, at.touching, at.active, force_n);
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
        let PhasePoint { x_m, v_m_per_s, active, .. } = at;
        let mut lost_w = self.damp(at, force_n.behind(active));
        if self.imposed.is_some() {
            lost_w -= force_n.behind(active)[0] * v_m_per_s[0];
        }
        force_n.hold(simd, self.ground.as_ref(), &x_m[..active]);
        lost_w + self.accelerate(simd, &v_m_per_s[..active], force_n, acceleration_m_per_s2)
    }

    /// Adds the forces of the gaps' dashpots to those of their springs; returns the power that they take, in watts.
    #[inline(always)]
    pub(crate) fn damp(&self, at: PhasePoint<'_>, force_n: &mut [f64]) -> f64 {
        let PhasePoint { x_m, v_m_per_s, touching, .. } = at;
        let dashpots = self.gaps.dashpots.as_ref();
        let mut lost_w = dashpots.map_or(0.0, |dashpots| dashpots.push(x_m, v_m_per_s, force_n));
        for contact in self.closed(touching) {
            // A far striker that rests against the last body is reached with the wave.
            let Some(force_n) = force_n.get_mut(contact.gap) else { continue };
            let closing = v_m_per_s[contact.gap] - v_m_per_s[contact.gap + 1];
            *force_n += contact.damping_kg_per_s * closing;
            lost_w += contact.damping_kg_per_s * closing * closing;
        }
        lost_w
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
        let n_blocks = n / PADDING;
        let [before, behind] = force_n.beside(n).map(|row| &row[..n_blocks]);
        let velocities = &lanes::blocks(v_m_per_s)[..n_blocks];
        let accelerations = &mut acceleration_m_per_s2[..n].as_chunks_mut::<PADDING>().0[..n_blocks];
        let mut lost = PartialSums::new(simd);
        self.of_masses.for_each_block(
            simd,
            n_blocks,
            #[inline(always)]
            |block, coefficients| {
                let (before, behind) = (S::as_simd_f64s(&before[block]).0, S::as_simd_f64s(&behind[block]).0);
                let v = S::as_simd_f64s(&velocities[block]).0;
                let accelerations = S::as_mut_simd_f64s(&mut accelerations[block]).0;
                for i in 0..PartialSums::<S>::VECTORS {
                    let [damping, inverse_mass] = coefficients[i];
                    let push = simd.sub_f64s(before[i], behind[i]);
                    let drag = simd.mul_f64s(damping, v[i]);
                    accelerations[i] = simd.mul_f64s(simd.sub_f64s(push, drag), inverse_mass);
                    lost.add_product(simd, i, drag, v[i]);
                }
            },
        );
        lost.total()
    }

    /// Acceleration of one mass by the gaps' forces and its dashpot to ground.
    pub(crate) fn acceleration_m_per_s2(&self, mass: usize, v_m_per_s: f64, force_n: &ForceRow) -> f64 {
        let drag_n = self.damping_kg_per_s[mass] * v_m_per_s;
        (force_n.net_n(mass) - drag_n) * self.inverse_mass_per_kg[mass]
    }

    /// That of the bodies, and of strikers while they touch, where that of all masses is `of_all`: what flies freely is no measure of the
    /// motion.
    pub(crate) fn reach_of_bodies(&self, state: &ChainState, of_all: Reach) -> Reach {
        let flies = |end: &RowEnd| !state.touching[end.index()];
        let flying = RowEnd::BOTH.into_iter().filter(flies).filter_map(|end| self.struck_by(end));
        let flying: Vec<usize> = flying.map(|[striker, _]| striker).collect();
        let leads = |mass: &usize| {
            state.x_m[*mass].abs() >= of_all.x_m || state.v_m_per_s[*mass].abs() >= of_all.v_m_per_s
        };
        if !flying.iter().any(leads) {
            return of_all;
        }
        let largest = |row: &[f64]| {
            let others = row.iter().enumerate().filter(|(mass, _)| !flying.contains(mass));
            others.fold(0.0_f64, |largest, (_, value)| largest.max(value.abs()))
        };
        Reach { x_m: largest(&state.x_m), v_m_per_s: largest(&state.v_m_per_s) }
    }

    /// A scale of the motion to come at t = 0: the largest displacement and velocity of a body, or that which one takes from a striker in
    /// an elastic blow.
    pub(crate) fn first_reach(&self, state: &ChainState) -> Reach {
        let strikers: Vec<[usize; 2]> =
            RowEnd::BOTH.into_iter().filter_map(|end| self.struck_by(end)).collect();
        let largest = |row: &[f64]| {
            let bodies = row.iter().enumerate().filter(|(mass, _)| strikers.iter().all(|[s, _]| s != mass));
            bodies.fold(0.0_f64, |largest, (_, value)| largest.max(value.abs()))
        };
        let given_m_per_s = strikers.iter().map(|[striker, body]| {
            let [striker_kg, body_kg] = [striker, body].map(|mass| self.mass_kg[*mass]);
            (2.0 * striker_kg / (striker_kg + body_kg)).min(1.0) * state.v_m_per_s[*striker].abs()
        });
        let v_m_per_s = given_m_per_s.fold(largest(&state.v_m_per_s), f64::max);
        Reach { x_m: largest(&state.x_m), v_m_per_s }
    }

    /// The masses of the row that are an end's striker and the body that it strikes, where there is a striker.
    fn struck_by(&self, end: RowEnd) -> Option<[usize; 2]> {
        let gap = self.strikers[end.index()].as_ref()?.gap;
        Some(match end {
            RowEnd::Near => [gap, gap + 1],
            RowEnd::Far => [gap + 1, gap],
        })
    }

    /// What an imposed motion adds to the rate at which a gap's rate of closing changes, at a time, in metres per second squared: no forces do.
    pub(crate) fn driven_m_per_s2(&self, time_s: f64, gap: usize) -> f64 {
        let imposed = self.imposed.filter(|_| gap == 0);
        imposed.map_or(0.0, |motion| motion.acceleration_m_per_s2(time_s))
    }

    /// Rate at which forces change a gap's rate of closing, in metres per second squared, in two states.
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
        let overlaps_m = of_gaps(&|state, gap| state.overlap_m(gap));
        let dashpots_n =
            of_gaps(&|state, gap| self.dashpot_kg_per_s(gap, state) * state.closing_m_per_s(gap));
        let springs_n = self.springs_n(gaps, overlaps_m);
        let force_n = |i: usize| springs_n[i] + dashpots_n[i];
        let drag_n = |state: &ChainState, mass: usize| {
            let damper_n = self.damping_kg_per_s[mass] * state.v_m_per_s[mass];
            match &self.ground {
                Some(ground) => damper_n + ground.force_n(mass, state.x_m[mass]),
                None => damper_n,
            }
        };
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
    pub(crate) fn carries(&self, gap: usize, touching: Touching) -> bool {
        gap < self.n_masses && !self.idle(touching).contains(&Some(gap))
    }

    /// Dashpot of a gap in a state in kilograms per second, that of a touching striker included.
    pub(crate) fn dashpot_kg_per_s(&self, gap: usize, state: &ChainState) -> f64 {
        match (self.closed(state.touching).find(|contact| contact.gap == gap), &self.gaps.dashpots) {
            (Some(contact), _) => contact.damping_kg_per_s,
            (None, Some(dashpots)) => dashpots.acting_kg_per_s(gap, state.overlap_m(gap)),
            (None, None) => 0.0,
        }
    }

    /// Whether a dashpot sets in or ends between two states because its contact closes or opens: there forces jump.
    pub(crate) fn gap_jumps(&self, from: &ChainState, to: &ChainState) -> bool {
        self.gaps.dashpots.as_ref().is_some_and(|dashpots| {
            (0..from.active.min(self.n_masses)).any(|gap| {
                dashpots.is_open(gap, from.overlap_m(gap)) != dashpots.is_open(gap, to.overlap_m(gap))
            })
        })
    }

    /// Fills a row with the dashpots of its gaps in a state in kilograms per second, those of touching strikers included.
    pub(crate) fn dashpots(&self, state: PhasePoint<'_>, row: &mut [f64]) {
        row.fill(0.0);
        if let Some(dashpots) = &self.gaps.dashpots {
            for (gap, dashpot) in row.iter_mut().enumerate().take(state.active) {
                *dashpot = dashpots.acting_kg_per_s(gap, state.x_m[gap] - state.x_m[gap + 1]);
            }
        }
        for contact in self.closed(state.touching) {
            if let Some(dashpot) = row.get_mut(contact.gap) {
                *dashpot = contact.damping_kg_per_s;
            }
        }
    }

    /// Stiffness of a gap in newtons per metre.
    pub(crate) fn stiffness_n_per_m(&self, gap: usize, state: &ChainState) -> f64 {
        if !self.carries(gap, state.touching) {
            return 0.0;
        }
        self.row.contact(gap).stiffness_n_per_m(state.overlap_m(gap))
    }

    /// The spring of one gap.
    pub(crate) fn spring(&self, gap: usize) -> Cow<'_, Spring> {
        match &self.same_spring {
            Some(spring) => Cow::Borrowed(spring),
            None => Cow::Owned(self.row.contact(gap).spring()),
        }
    }

    /// Opens or closes the contact of an end's striker. What its spring holds at that instant leaves with the dashpot that is let go,
    /// or comes back with it; without damping that is zero.
    pub(crate) fn switch_contact(&self, state: &mut ChainState, end: RowEnd) {
        let Some(contact) = &self.strikers[end.index()] else { return };
        let stored_j = contact.energy_j(state.overlap_m(contact.gap));
        let touching = &mut state.touching[end.index()];
        state.lost_j += if *touching { stored_j } else { -stored_j };
        *touching = !*touching;
    }
}

/// Where the rates are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhasePoint<'a> {
    pub(crate) x_m: &'a [f64],
    pub(crate) v_m_per_s: &'a [f64],
    pub(crate) touching: Touching,
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

/// The contacts behind each mass of the row and its padding; strikers' dashpots are not among them, nor one behind a free end.
fn row_of_gaps(row: &MassRow<'_>) -> Gaps {
    let undamped = |gap: usize| Contact { damping_kg_per_s: 0.0, ..row.contact(gap).clone() };
    let [near, far] = RowEnd::BOTH.map(|end| row.struck_gap(end));
    let of_strikers = [near, far].map(|gap| gap.map(undamped));
    let last = undamped(row.n_masses());
    let contacts: Vec<&Contact> = (0..padded(row.n_masses()))
        .map(|gap| match &of_strikers {
            [Some(contact), _] if near == Some(gap) => contact,
            [_, Some(contact)] if far == Some(gap) => contact,
            _ if gap < row.n_links() => row.contact(gap),
            _ => &last,
        })
        .collect();
    Gaps::new(&contacts)
}
