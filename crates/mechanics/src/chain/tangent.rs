//! The variational equations along a motion, all parameters side by side.

mod along;

use chainwave_measurement::Trajectory;
use pulp::{Simd, WithSimd};

use super::change::{DerivativeRequest, Resistance};
use super::front::MARGIN;
use crate::equations::{model::ChainModel, parameters::Chain, row::RowEnd};
use crate::lanes::{self};
use along::{Along, Closing, Coefficients};

/// The variational equations along a motion: how displacements and velocities of all masses change with each of several changes.
///
/// m s_i'' = k_{i-1} (s_{i-1} - s_i) - k_i (s_i - s_{i+1}) + (the same for dashpots) - c_i s_i' - k_g s_i + m g_i, with the gaps' tangent
/// stiffnesses k, that of what holds a body to ground, k_g, and what the change does to the acceleration at a given state, g. All changes share k, so they are stepped side by
/// side, one lane of a vector each, by the classical Runge-Kutta method.
pub(crate) struct Tangent<'a> {
    model: &'a ChainModel<'a>,
    along: Along<'a>,
    /// What resists the bodies, and the first of its lanes.
    resistances: &'a [Resistance],
    first_resistance: usize,
    /// Changes and resistances, up to whole vectors.
    n_lanes: usize,
    here: Derivatives,
    /// Derivatives of the displacement at which a stage is evaluated; those of the velocity are the stage's rates of them.
    trial_s: Vec<f64>,
    /// Rates of the four stages.
    stages: [Derivatives; 4],
    /// Coefficients at start, middle and end of a step.
    coefficients: [Coefficients; 3],
    /// Time for which the last of them stand, where the motion goes on from there.
    end_s: Option<f64>,
    /// Whether all derivatives are zero still.
    sleeps: bool,
    /// Masses that the wave has come to, or that a change moves at the start, and a margin ahead of them: the others have no derivatives.
    awake: usize,
}

/// Derivatives of displacement and velocity, mass after mass and a row for the wall, or their rates.
#[derive(Debug, Clone)]
struct Derivatives {
    s: Vec<f64>,
    u: Vec<f64>,
}

impl<'a> Tangent<'a> {
    /// At t = 0.
    pub(crate) fn new(chain: &Chain, model: &'a ChainModel<'a>, asked: DerivativeRequest<'a>) -> Self {
        let n_lanes = asked.n().next_multiple_of(lanes::width());
        let row = vec![0.0; (model.n_masses() + 1) * n_lanes];
        let zero = Derivatives { s: row.clone(), u: row.clone() };
        let along = Along::new(chain, model, asked);
        let mut here = zero.clone();
        for (lane, change) in along.changes_at_start(asked.changes).into_iter().enumerate() {
            for (mass, [s, u]) in change.into_iter().enumerate() {
                (here.s[mass * n_lanes + lane], here.u[mass * n_lanes + lane]) = (s, u);
            }
        }
        let coefficients = along.coefficients(n_lanes);
        let is_zero = |values: &[f64]| values.iter().all(|value| *value == 0.0);
        let sleeps = asked.resistances.is_empty() && is_zero(&here.s) && is_zero(&here.u);
        let mut tangent = Self {
            model,
            along,
            resistances: asked.resistances,
            first_resistance: asked.changes.len(),
            n_lanes,
            here,
            trial_s: row,
            stages: std::array::from_fn(|_| zero.clone()),
            coefficients: std::array::from_fn(|_| coefficients.clone()),
            end_s: None,
            sleeps,
            awake: 0,
        };
        let moves = |mass: &usize| {
            let lanes = mass * n_lanes..(mass + 1) * n_lanes;
            tangent.along.moves_at_start(*mass)
                || !is_zero(&tangent.here.s[lanes.clone()])
                || !is_zero(&tangent.here.u[lanes])
        };
        let last = (0..model.n_masses()).rev().find(moves);
        tangent.awake = (last.map_or(0, |last| last + 1) + MARGIN).min(model.n_masses());
        tangent
    }

    /// Takes in the masses that the wave has come to at a sample of the motion of all masses.
    fn wake(&mut self, motion: &Trajectory, sample: usize) {
        let rows = [&motion.displacement_m, &motion.velocity_m_per_s];
        let moves = |mass: &usize| rows.iter().any(|row| row[(*mass, sample)] != 0.0);
        while let Some(last) = (self.awake.saturating_sub(MARGIN)..self.awake).rev().find(moves) {
            let awake = (last + 1 + MARGIN).min(self.model.n_masses());
            if awake == self.awake {
                break;
            }
            self.awake = awake;
        }
    }

    /// Whether nothing happens up to a sample of the motion of all masses: the wave has not come to any mass that feels a change.
    pub(crate) fn sleeps_until(&mut self, motion: &Trajectory, sample: usize) -> bool {
        self.sleeps = self.sleeps && self.along.rests(motion, sample);
        self.sleeps
    }

    /// One step along a motion of all masses between two times, before a sample of it, within which strikers' contacts stay as they are.
    pub(crate) fn step(&mut self, motion: &Trajectory, sample: usize, [start_s, end_s]: [f64; 2]) {
        self.wake(motion, sample);
        if end_s > start_s {
            chainwave_vectors::dispatch(Stepping { tangent: self, motion, start_s, end_s });
        }
    }

    /// Opens or closes the contact of an end's striker.
    ///
    /// It opens where its force has come to zero, and nothing jumps. Where it closes its force sets in at once, at an instant that moves by
    /// -(s_i - s_j) over the rate of closing of its two masses; the sooner, the longer it acts.
    pub(crate) fn switch(&mut self, motion: &Trajectory, end: RowEnd, time_s: f64) {
        self.end_s = None;
        let Some(Closing { gap, push_n, closing_m_per_s }) = self.along.switch(motion, end, time_s) else {
            return;
        };
        let Derivatives { s, u } = &mut self.here;
        let inverse_mass_per_kg = &self.model.inverse_mass_per_kg;
        let here = gap * self.n_lanes;
        for (left, right) in (here..here + self.n_lanes).zip(here + self.n_lanes..) {
            let sooner_s = (s[left] - s[right]) / closing_m_per_s;
            u[left] -= push_n * sooner_s * inverse_mass_per_kg[gap];
            u[right] += push_n * sooner_s * inverse_mass_per_kg[gap + 1];
        }
    }

    /// Takes in the dashpots that set in or ended within the step because their contact closed or opened: the force jumps by c times the rate
    /// of closing, at an instant that moves by the change of the overlap over that rate.
    fn jump(&mut self) {
        let [before, _, after] = &self.coefficients;
        let Derivatives { s, u } = &mut self.here;
        let gaps = before.c_kg_per_s.iter().zip(&after.c_kg_per_s).take(self.awake).enumerate();
        for (gap, (before_kg_per_s, after_kg_per_s)) in gaps {
            let change_kg_per_s = after_kg_per_s - before_kg_per_s;
            if change_kg_per_s == 0.0 {
                continue;
            }
            let [left_per_kg, right_per_kg] = [gap, gap + 1].map(|mass| self.model.inverse_mass_per_kg[mass]);
            let here = gap * self.n_lanes;
            for (left, right) in (here..here + self.n_lanes).zip(here + self.n_lanes..) {
                let kick_kg_m_per_s = change_kg_per_s * (s[left] - s[right]);
                u[left] -= kick_kg_m_per_s * left_per_kg;
                u[right] += kick_kg_m_per_s * right_per_kg;
            }
        }
    }

    /// Writes the bodies' derivatives as output number `k`.
    pub(crate) fn record(&self, k: usize, derivatives: &mut [Trajectory]) {
        let first = self.model.first_gap() * self.n_lanes;
        let Derivatives { s, u } = &self.here;
        for (lane, derivative) in derivatives.iter_mut().enumerate() {
            for (row, all) in [(&mut derivative.displacement_m, s), (&mut derivative.velocity_m_per_s, u)] {
                let of_bodies = all[first + lane..].iter().step_by(self.n_lanes);
                row.column_mut(k).iter_mut().zip(of_bodies).for_each(|(place, value)| *place = *value);
            }
        }
    }

    /// The state that a stage is evaluated at: a part of a step along the rates of the stage before, or where the step starts.
    #[inline(always)]
    fn place<S: Simd>(&mut self, simd: S, stage: usize, part_s: f64) {
        let Self { here, trial_s, stages, coefficients, .. } = self;
        let n = self.awake * self.n_lanes;
        let (before, from_here) = stages.split_at_mut(stage);
        let Some(Derivatives { s: trial_u, .. }) = from_here.first_mut() else { return };
        match before.last() {
            None => {
                trial_s[..n].copy_from_slice(&here.s[..n]);
                trial_u[..n].copy_from_slice(&here.u[..n]);
            }
            Some(rates) => {
                go(simd, (&here.s[..n], &rates.s[..n]), part_s, &mut trial_s[..n]);
                go(simd, (&here.u[..n], &rates.u[..n]), part_s, &mut trial_u[..n]);
            }
        }
        coefficients[COEFFICIENTS_OF_STAGE[stage]].impose(trial_s, trial_u);
    }

    /// Rates of the velocities' derivatives at the state of a stage.
    #[inline(always)]
    fn rates<S: Simd>(&mut self, simd: S, stage: usize) {
        let Self { model, trial_s, n_lanes, awake, .. } = self;
        let coefficients = &self.coefficients[COEFFICIENTS_OF_STAGE[stage]];
        let Derivatives { s: trial_u, u: rates } = &mut self.stages[stage];
        let n_vectors = *n_lanes / S::F64_LANES;
        let (s, u) = (S::as_simd_f64s(trial_s).0, S::as_simd_f64s(trial_u).0);
        let (forcing, rates) = (S::as_simd_f64s(&coefficients.forcing).0, S::as_mut_simd_f64s(rates).0);
        let springs = coefficients.k_n_per_m.iter().zip(&coefficients.c_kg_per_s).take(*awake);
        let masses = model.damping_kg_per_s.iter().zip(model.inverse_mass_per_kg.iter());
        for first in 0..n_vectors {
            let mut before_n = simd.splat_f64s(0.0);
            let (mut s_i, mut u_i) = (s[first], u[first]);
            for (mass, ((k, c), (ground, inverse_mass))) in springs.clone().zip(masses.clone()).enumerate() {
                let here = mass * n_vectors + first;
                let (s_j, u_j) = (s[here + n_vectors], u[here + n_vectors]);
                let by_spring = simd.mul_f64s(simd.splat_f64s(*k), simd.sub_f64s(s_i, s_j));
                let by_dashpot = simd.mul_f64s(simd.splat_f64s(*c), simd.sub_f64s(u_i, u_j));
                let behind_n = simd.add_f64s(by_spring, by_dashpot);
                let drag_n = simd.mul_f64s(simd.splat_f64s(*ground), u_i);
                let net_n = simd.sub_f64s(simd.sub_f64s(before_n, behind_n), drag_n);
                let answer = simd.mul_f64s(simd.splat_f64s(*inverse_mass), net_n);
                rates[here] = simd.add_f64s(answer, forcing[here]);
                (before_n, s_i, u_i) = (behind_n, s_j, u_j);
            }
        }
    }

    /// Takes from the rates of a stage what holds the masses to ground at its state.
    #[inline(always)]
    fn hold<S: Simd>(&mut self, simd: S, stage: usize) {
        let ground_n_per_m = &self.coefficients[COEFFICIENTS_OF_STAGE[stage]].ground_n_per_m;
        if ground_n_per_m.is_empty() {
            return;
        }
        let rates = S::as_mut_simd_f64s(&mut self.stages[stage].u).0;
        let n_vectors = self.n_lanes / S::F64_LANES;
        let springs = ground_n_per_m.iter().zip(self.model.inverse_mass_per_kg.iter());
        let derivatives = S::as_simd_f64s(&self.trial_s).0.chunks_exact(n_vectors);
        let masses = rates.chunks_exact_mut(n_vectors).zip(derivatives).zip(springs);
        for ((rates, s), (k_n_per_m, inverse_mass)) in masses.take(self.awake) {
            let square_per_s2 = simd.splat_f64s(k_n_per_m * inverse_mass);
            for (rate, s) in rates.iter_mut().zip(s) {
                *rate = simd.sub_f64s(*rate, simd.mul_f64s(square_per_s2, *s));
            }
        }
    }

    /// Adds dry friction and drag to the rates of a stage at its state.
    ///
    /// Below a creeping speed friction grows with speed, which stands for holding; the creeping is as slow as a step of `h_s` can follow.
    #[inline(always)]
    fn rub(&mut self, stage: usize, h_s: f64) {
        let v_m_per_s = &self.coefficients[COEFFICIENTS_OF_STAGE[stage]].v_m_per_s;
        let first_body = self.model.first_gap();
        for (k, resistance) in self.resistances.iter().enumerate() {
            let Resistance { friction_n, drag_kg_per_m, striker_friction_n } = *resistance;
            let lane = self.first_resistance + k;
            let masses = v_m_per_s.iter().zip(self.model.inverse_mass_per_kg.iter()).enumerate();
            for (mass, (driven_m_per_s, inverse_mass_per_kg)) in
                masses.take(first_body + self.model.n_gaps() + 1)
            {
                let [friction_n, drag_kg_per_m] =
                    if mass < first_body { [striker_friction_n, 0.0] } else { [friction_n, drag_kg_per_m] };
                let place = mass * self.n_lanes + lane;
                let most_m_per_s2 = friction_n * inverse_mass_per_kg;
                let creeping_m_per_s = CREEPING_M_PER_S.max(most_m_per_s2 * h_s);
                let Derivatives { s: trial_u, u: rates } = &mut self.stages[stage];
                let v_m_per_s = driven_m_per_s + trial_u[place];
                let speed = v_m_per_s / creeping_m_per_s;
                rates[place] -= most_m_per_s2 * speed / (1.0 + speed * speed).sqrt()
                    + drag_kg_per_m * inverse_mass_per_kg * v_m_per_s * v_m_per_s.abs();
            }
        }
    }

    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S, h_s: f64) {
        let n = self.awake * self.n_lanes;
        let Derivatives { s, u } = &mut self.here;
        let sixth_s = h_s / 6.0;
        add_up(simd, self.stages.each_ref().map(|stage| &stage.s[..n]), sixth_s, &mut s[..n]);
        add_up(simd, self.stages.each_ref().map(|stage| &stage.u[..n]), sixth_s, &mut u[..n]);
        let [_, _, end] = &self.coefficients;
        end.impose(s, u);
    }
}

/// `to = from + part_s rate`.
#[inline(always)]
fn go<S: Simd>(simd: S, (from, rates): (&[f64], &[f64]), part_s: f64, to: &mut [f64]) {
    let part = simd.splat_f64s(part_s);
    let terms = S::as_simd_f64s(from).0.iter().zip(S::as_simd_f64s(rates).0);
    for (to, (from, rate)) in S::as_mut_simd_f64s(to).0.iter_mut().zip(terms) {
        *to = simd.add_f64s(*from, simd.mul_f64s(part, *rate));
    }
}

/// Adds a whole step of the classical method by its four rates.
#[inline(always)]
fn add_up<S: Simd>(simd: S, rates: [&[f64]; 4], sixth_s: f64, to: &mut [f64]) {
    let (sixth, two) = (simd.splat_f64s(sixth_s), simd.splat_f64s(2.0));
    let [first, second, third, last] = rates.map(|row| S::as_simd_f64s(row).0);
    let rates = first.iter().zip(second).zip(third.iter().zip(last));
    for (to, ((first, second), (third, last))) in S::as_mut_simd_f64s(to).0.iter_mut().zip(rates) {
        let middle = simd.mul_f64s(two, simd.add_f64s(*second, *third));
        let sum = simd.add_f64s(simd.add_f64s(*first, middle), *last);
        *to = simd.add_f64s(*to, simd.mul_f64s(sixth, sum));
    }
}

/// Bodies that friction holds creep more slowly than this: 0.1 um in 10 ms.
const CREEPING_M_PER_S: f64 = 1e-5;

/// Which coefficients each stage of the classical method sees.
const COEFFICIENTS_OF_STAGE: [usize; 4] = [0, 1, 1, 2];

struct Stepping<'a, 'b> {
    tangent: &'a mut Tangent<'b>,
    motion: &'a Trajectory,
    start_s: f64,
    end_s: f64,
}

impl WithSimd for Stepping<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tangent, motion, start_s, end_s } = self;
        let Tangent { along, coefficients, awake, .. } = tangent;
        along.reach(*awake);
        let h_s = end_s - start_s;
        match tangent.end_s == Some(start_s) {
            true => coefficients.swap(0, 2),
            false => along.work_out(simd, motion, start_s, &mut coefficients[0]),
        }
        along.work_out(simd, motion, start_s + 0.5 * h_s, &mut coefficients[1]);
        along.work_out(simd, motion, end_s, &mut coefficients[2]);
        tangent.end_s = Some(end_s);
        for (stage, part) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            tangent.place(simd, stage, part * h_s);
            tangent.rates(simd, stage);
            tangent.hold(simd, stage);
            tangent.rub(stage, h_s);
        }
        tangent.finish(simd, h_s);
        tangent.jump();
    }
}
