use std::borrow::Cow;

use chainwave_measurement::Trajectory;
use pulp::{Simd, WithSimd};

use crate::{
    Chain, Change,
    contact::Spring,
    force_row::ForceRow,
    lanes::{padded, vectorised},
    model::Model,
    sensitivity::Seat,
    state::{State, row_length},
};

/// The variational equations along a motion: how displacements and velocities of all masses change with each of several changes.
///
/// m s_i'' = k_{i-1} (s_{i-1} - s_i) - k_i (s_i - s_{i+1}) + (the same for dashpots) - c_i s_i' + m g_i, with the gaps' tangent
/// stiffnesses k and what the change does to the acceleration at a given state, g. All changes share k, so they are stepped side by
/// side, one lane each, by the classical Runge-Kutta method; the motion between its samples is their Hermite interpolant.
pub(crate) struct Tangent<'a> {
    model: &'a Model<'a>,
    motion: &'a Trajectory,
    /// The spring of each gap of the row.
    springs: Vec<Cow<'a, Spring>>,
    sides: Vec<Sides<'a>>,
    n_lanes: usize,
    touching: bool,
    /// Derivatives of displacement and velocity, mass after mass, and a row for the wall.
    s: Vec<f64>,
    u: Vec<f64>,
    stages: [Stage; 4],
    trial: [Vec<f64>; 2],
    /// Coefficients at start, middle and end of a step.
    coefficients: [Coefficients; 3],
    /// Time for which the first of them stand.
    begun_s: Option<f64>,
    work: Work,
}

/// A chain on both sides of a change.
struct Sides<'a> {
    below: Model<'a>,
    above: Model<'a>,
    width: f64,
    seat: Seat,
}

/// Rates of a stage: those of s and of u.
#[derive(Clone)]
struct Stage {
    s: Vec<f64>,
    u: Vec<f64>,
}

/// What the equations hold at one time.
#[derive(Clone)]
struct Coefficients {
    /// Tangent stiffness and dashpot of the gap behind each mass.
    k_n_per_m: Vec<f64>,
    c_kg_per_s: Vec<f64>,
    /// g of each mass and change.
    forcing: Vec<f64>,
    /// Derivatives of displacement and velocity that an imposed motion gives mass 0, change after change.
    imposed: Option<[Vec<f64>; 2]>,
}

/// The motion at one time, its springs' forces, and rows for the accelerations of the two sides.
struct Work {
    state: State,
    springs_n: ForceRow,
    force_n: ForceRow,
    accelerations: [Vec<f64>; 2],
}

impl<'a> Tangent<'a> {
    /// At t = 0 of a motion of all the model's masses.
    pub(crate) fn new(
        chain: &Chain,
        model: &'a Model<'a>,
        motion: &'a Trajectory,
        changes: &'a [Change],
    ) -> Self {
        let sides: Vec<Sides<'a>> = changes.iter().map(Sides::new).collect();
        let (n, n_lanes) = (model.n_masses(), padded(changes.len()));
        let row = vec![0.0; (n + 1) * n_lanes];
        let stage = Stage { s: row.clone(), u: row.clone() };
        let coefficients = Coefficients {
            k_n_per_m: vec![0.0; n],
            c_kg_per_s: vec![0.0; n],
            forcing: row.clone(),
            imposed: model.is_imposed().then(|| [vec![0.0; n_lanes], vec![0.0; n_lanes]]),
        };
        let (mut s, mut u) = (row.clone(), row.clone());
        for (lane, (change, side)) in changes.iter().zip(&sides).enumerate() {
            let (below, above) =
                (side.below.initial_state(&change.below), side.above.initial_state(&change.above));
            for mass in 0..n {
                s[mass * n_lanes + lane] = (above.x_m[mass] - below.x_m[mass]) / change.width;
                u[mass * n_lanes + lane] = (above.v_m_per_s[mass] - below.v_m_per_s[mass]) / change.width;
            }
        }
        let state = model.initial_state(chain);
        let accelerations = [vec![0.0; row_length(n)], vec![0.0; row_length(n)]];
        Self {
            touching: state.touching,
            stages: [stage.clone(), stage.clone(), stage.clone(), stage],
            trial: [row.clone(), row],
            coefficients: [coefficients.clone(), coefficients.clone(), coefficients],
            begun_s: None,
            work: Work { state, springs_n: ForceRow::new(n), force_n: ForceRow::new(n), accelerations },
            springs: (0..n).map(|gap| model.spring(gap)).collect(),
            model,
            motion,
            sides,
            n_lanes,
            s,
            u,
        }
    }

    /// One step between two times, within which the striker's contact stays as it is.
    pub(crate) fn step(&mut self, start_s: f64, end_s: f64) {
        if end_s > start_s {
            vectorised(Stepping { tangent: self, start_s, end_s });
        }
    }

    /// Opens or closes the striker's contact.
    ///
    /// It opens where its force has come to zero, and nothing jumps. Where it closes its force J sets in at once, at an instant that moves
    /// by -(s_0 - s_1) over the rate of closing; the sooner, the longer it acts.
    pub(crate) fn switch(&mut self, time_s: f64) {
        self.touching = !self.touching;
        self.begun_s = None;
        self.work.place(self.motion, time_s, self.touching);
        let Some(contact) = self.model.striker.as_ref().filter(|_| self.touching) else { return };
        let state = &self.work.state;
        let closing_m_per_s = state.striker_closing_m_per_s();
        let push_n = contact.push_n(state.striker_overlap_m(), closing_m_per_s);
        if closing_m_per_s <= 0.0 {
            return;
        }
        let n = self.n_lanes;
        for lane in 0..self.sides.len() {
            let sooner_s = (self.s[lane] - self.s[n + lane]) / closing_m_per_s;
            self.u[lane] -= push_n * sooner_s * self.model.inverse_mass_per_kg[0];
            self.u[n + lane] += push_n * sooner_s * self.model.inverse_mass_per_kg[1];
        }
    }

    /// Writes the bodies' derivatives as output number `k`.
    pub(crate) fn record(&self, k: usize, derivatives: &mut [Trajectory]) {
        let first = self.model.first_gap();
        for (lane, derivative) in derivatives.iter_mut().enumerate() {
            let of_body = |row: &[f64], body: usize| row[(first + body) * self.n_lanes + lane];
            for body in 0..derivative.displacement_m.nrows() {
                derivative.displacement_m[(body, k)] = of_body(&self.s, body);
                derivative.velocity_m_per_s[(body, k)] = of_body(&self.u, body);
            }
        }
    }

    /// Works out the coefficients at a time.
    #[inline(always)]
    fn prepare<S: Simd>(&mut self, simd: S, which: usize, time_s: f64) {
        let Self { model, motion, springs, sides, work, touching, n_lanes, .. } = self;
        let Coefficients { k_n_per_m, c_kg_per_s, forcing, imposed } = &mut self.coefficients[which];
        work.place(motion, time_s, *touching);
        work.press(simd, model);
        let springs_n = work.springs_n.behind(work.state.active);
        for (gap, (k, c)) in k_n_per_m.iter_mut().zip(c_kg_per_s).enumerate() {
            let overlap_m = work.state.x_m[gap] - work.state.x_m[gap + 1];
            *k = match model.carries(gap, *touching) {
                true => springs[gap].stiffness_n_per_m(overlap_m, springs_n[gap]),
                false => 0.0,
            };
            *c = model.dashpot_kg_per_s(gap, *touching);
        }
        for (lane, side) in sides.iter().enumerate().filter(|(_, side)| side.seat != Seat::Drive) {
            let difference = work.difference(simd, side, model.n_masses());
            for (place, difference) in forcing[lane..].iter_mut().step_by(*n_lanes).zip(difference) {
                *place = difference / side.width;
            }
        }
        if let Some([s, u]) = imposed {
            for (lane, side) in sides.iter().enumerate() {
                let ends = [&side.below, &side.above].map(|model| {
                    let (mut x_m, mut v_m_per_s) = ([0.0], [0.0]);
                    model.impose(time_s, &mut x_m, &mut v_m_per_s);
                    [x_m[0], v_m_per_s[0]]
                });
                s[lane] = (ends[1][0] - ends[0][0]) / side.width;
                u[lane] = (ends[1][1] - ends[0][1]) / side.width;
            }
        }
    }

    /// Rates of stage number `stage` into its place, at the state that lies in `trial`.
    #[inline(always)]
    fn rates(&mut self, stage: usize) {
        let n_lanes = self.n_lanes;
        let Coefficients { k_n_per_m, c_kg_per_s, forcing, imposed } =
            &self.coefficients[COEFFICIENTS_OF_STAGE[stage]];
        let [s, u] = &mut self.trial;
        if let Some([s_0, u_0]) = imposed {
            s[..n_lanes].copy_from_slice(s_0);
            u[..n_lanes].copy_from_slice(u_0);
        }
        let rates = &mut self.stages[stage];
        let n_values = rates.s.len() - n_lanes;
        rates.s[..n_values].copy_from_slice(&u[..n_values]);
        let mut before = [0.0; WIDEST];
        for first in (0..n_lanes).step_by(WIDEST) {
            before.fill(0.0);
            for mass in 0..self.model.n_masses() {
                let (k, c) = (k_n_per_m[mass], c_kg_per_s[mass]);
                let ground = self.model.damping_kg_per_s[mass];
                let inverse_mass = self.model.inverse_mass_per_kg[mass];
                let here = mass * n_lanes + first;
                let there = here + n_lanes;
                let (s_i, s_j) = (&s[here..][..WIDEST], &s[there..][..WIDEST]);
                let (u_i, u_j) = (&u[here..][..WIDEST], &u[there..][..WIDEST]);
                let forcing = &forcing[here..][..WIDEST];
                let out = &mut rates.u[here..][..WIDEST];
                for lane in 0..WIDEST {
                    let behind = k * (s_i[lane] - s_j[lane]) + c * (u_i[lane] - u_j[lane]);
                    out[lane] = inverse_mass * (before[lane] - behind - ground * u_i[lane]) + forcing[lane];
                    before[lane] = behind;
                }
            }
        }
    }

    /// The state a part of a step along the rates of a stage, into `trial`.
    #[inline(always)]
    fn try_along(&mut self, stage: usize, part_s: f64) {
        let Stage { s, u } = &self.stages[stage];
        for (to, (from, rate)) in self.trial[0].iter_mut().zip(self.s.iter().zip(s)) {
            *to = from + part_s * rate;
        }
        for (to, (from, rate)) in self.trial[1].iter_mut().zip(self.u.iter().zip(u)) {
            *to = from + part_s * rate;
        }
    }

    #[inline(always)]
    fn finish(&mut self, h_s: f64) {
        let [first, second, third, last] = &self.stages;
        let sixth_s = h_s / 6.0;
        for i in 0..self.s.len() {
            self.s[i] += sixth_s * (first.s[i] + 2.0 * (second.s[i] + third.s[i]) + last.s[i]);
            self.u[i] += sixth_s * (first.u[i] + 2.0 * (second.u[i] + third.u[i]) + last.u[i]);
        }
        if let [_, _, Coefficients { imposed: Some([s, u]), .. }] = &self.coefficients {
            self.s[..self.n_lanes].copy_from_slice(s);
            self.u[..self.n_lanes].copy_from_slice(u);
        }
    }
}

/// Lanes that are stepped side by side: what the changes are padded to.
const WIDEST: usize = crate::lanes::PADDING;
/// Which coefficients each stage of the classical method sees.
const COEFFICIENTS_OF_STAGE: [usize; 4] = [0, 1, 1, 2];

struct Stepping<'a, 'b> {
    tangent: &'a mut Tangent<'b>,
    start_s: f64,
    end_s: f64,
}

impl WithSimd for Stepping<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tangent, start_s, end_s } = self;
        let h_s = end_s - start_s;
        match tangent.begun_s == Some(start_s) {
            true => tangent.coefficients.swap(0, 2),
            false => tangent.prepare(simd, 0, start_s),
        }
        tangent.prepare(simd, 1, start_s + 0.5 * h_s);
        tangent.prepare(simd, 2, end_s);
        tangent.begun_s = Some(end_s);
        tangent.try_along(0, 0.0);
        tangent.rates(0);
        for (stage, part) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            tangent.try_along(stage - 1, part * h_s);
            tangent.rates(stage);
        }
        tangent.finish(h_s);
    }
}

impl<'a> Sides<'a> {
    fn new(change: &'a Change) -> Self {
        let Change { below, above, width } = change;
        Self { below: Model::new(below), above: Model::new(above), width: *width, seat: change.seat() }
    }
}

impl Work {
    /// Puts the masses where the motion has them at a time.
    fn place(&mut self, motion: &Trajectory, time_s: f64, touching: bool) {
        let last_s = motion.times_s.last().copied().unwrap_or(0.0);
        let Some(moment) = motion.at(time_s.min(last_s)) else { return };
        self.state.touching = touching;
        moment.fill(&mut self.state.x_m, &mut self.state.v_m_per_s);
    }

    /// Works out the springs' forces.
    #[inline(always)]
    fn press<S: Simd>(&mut self, simd: S, model: &Model<'_>) {
        let State { x_m, touching, active, .. } = &self.state;
        model.spring_forces(simd, x_m, *touching, *active, &mut self.springs_n);
    }

    /// By how much the first `n` masses accelerate more above than below.
    #[inline(always)]
    fn difference<S: Simd>(&mut self, simd: S, sides: &Sides<'_>, n: usize) -> impl Iterator<Item = f64> {
        let Self { state, springs_n, force_n, accelerations } = self;
        for (model, acceleration) in [&sides.below, &sides.above].into_iter().zip(accelerations.iter_mut()) {
            match sides.seat {
                Seat::Contacts => model.rates(simd, state.place(), force_n, acceleration),
                _ => {
                    force_n.copy_from(springs_n);
                    model.rates_by_springs(simd, state.place(), force_n, acceleration)
                }
            };
        }
        let [low, high] = accelerations;
        high[..n].iter().zip(&low[..n]).map(|(high, low)| high - low)
    }
}
