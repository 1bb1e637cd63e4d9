//! The variational equations along a motion, all parameters side by side.

mod along;

use chainwave_measurement::Trajectory;
use pulp::{Simd, WithSimd};

use super::{change::Asked, model::ChainModel, parameters::Chain, row::End};
use crate::lanes::{PADDING, padded, vectorised};
use along::{Along, Closing, Coefficients};

/// The variational equations along a motion: how displacements and velocities of all masses change with each of several changes.
///
/// m s_i'' = k_{i-1} (s_{i-1} - s_i) - k_i (s_i - s_{i+1}) + (the same for dashpots) - c_i s_i' + m g_i, with the gaps' tangent
/// stiffnesses k and what the change does to the acceleration at a given state, g. All changes share k, so they are stepped side by
/// side, one lane each, by the classical Runge-Kutta method.
pub(crate) struct Tangent<'a> {
    model: &'a ChainModel<'a>,
    along: Along<'a>,
    /// Forces of dry friction, in newtons, and the first of their lanes.
    frictions_n: &'a [f64],
    first_friction: usize,
    n_lanes: usize,
    here: Derivatives,
    trial: Derivatives,
    /// Rates of the four stages.
    stages: [Derivatives; 4],
    /// Coefficients at start, middle and end of a step.
    coefficients: [Coefficients; 3],
    /// Time for which the last of them stand, where the motion goes on from there.
    end_s: Option<f64>,
}

/// Derivatives of displacement and velocity, mass after mass and a row for the wall, or their rates.
#[derive(Debug, Clone)]
struct Derivatives {
    s: Vec<f64>,
    u: Vec<f64>,
}

impl<'a> Tangent<'a> {
    /// At t = 0 of a motion of all the model's masses.
    pub(crate) fn new(
        chain: &Chain,
        model: &'a ChainModel<'a>,
        motion: &'a Trajectory,
        asked: Asked<'a>,
    ) -> Self {
        let n_lanes = padded(asked.n());
        let row = vec![0.0; (model.n_masses() + 1) * n_lanes];
        let zero = Derivatives { s: row.clone(), u: row };
        let along = Along::new(chain, model, motion, asked);
        let mut here = zero.clone();
        for (lane, change) in along.changes_at_start(asked.changes).into_iter().enumerate() {
            for (mass, [s, u]) in change.into_iter().enumerate() {
                (here.s[mass * n_lanes + lane], here.u[mass * n_lanes + lane]) = (s, u);
            }
        }
        let coefficients = along.coefficients(n_lanes);
        Self {
            model,
            along,
            frictions_n: asked.frictions_n,
            first_friction: asked.changes.len(),
            n_lanes,
            here,
            stages: std::array::from_fn(|_| zero.clone()),
            trial: zero,
            coefficients: std::array::from_fn(|_| coefficients.clone()),
            end_s: None,
        }
    }

    /// One step between two times, within which strikers' contacts stay as they are.
    pub(crate) fn step(&mut self, start_s: f64, end_s: f64) {
        if end_s > start_s {
            vectorised(Stepping { tangent: self, start_s, end_s });
        }
    }

    /// Opens or closes the contact of an end's striker.
    ///
    /// It opens where its force has come to zero, and nothing jumps. Where it closes its force sets in at once, at an instant that moves by
    /// -(s_i - s_j) over the rate of closing of its two masses; the sooner, the longer it acts.
    pub(crate) fn switch(&mut self, end: End, time_s: f64) {
        self.end_s = None;
        let Some(Closing { gap, push_n, closing_m_per_s }) = self.along.switch(end, time_s) else { return };
        let Derivatives { s, u } = &mut self.here;
        let inverse_mass_per_kg = &self.model.inverse_mass_per_kg;
        let here = gap * self.n_lanes;
        for (left, right) in (here..here + self.n_lanes).zip(here + self.n_lanes..) {
            let sooner_s = (s[left] - s[right]) / closing_m_per_s;
            u[left] -= push_n * sooner_s * inverse_mass_per_kg[gap];
            u[right] += push_n * sooner_s * inverse_mass_per_kg[gap + 1];
        }
    }

    /// Writes the bodies' derivatives as output number `k`.
    pub(crate) fn record(&self, k: usize, derivatives: &mut [Trajectory]) {
        let first = self.model.first_gap();
        for (lane, derivative) in derivatives.iter_mut().enumerate() {
            for body in 0..derivative.displacement_m.nrows() {
                let place = (first + body) * self.n_lanes + lane;
                derivative.displacement_m[(body, k)] = self.here.s[place];
                derivative.velocity_m_per_s[(body, k)] = self.here.u[place];
            }
        }
    }

    /// Rates of a stage at the state that lies in `trial`.
    #[inline(always)]
    fn rates(&mut self, stage: usize) {
        let n_lanes = self.n_lanes;
        let coefficients = &self.coefficients[COEFFICIENTS_OF_STAGE[stage]];
        coefficients.impose(&mut self.trial.s, &mut self.trial.u);
        let Derivatives { s, u } = &self.trial;
        let rates = &mut self.stages[stage];
        // The wall's row stays at rest.
        let n_values = rates.s.len() - n_lanes;
        rates.s[..n_values].copy_from_slice(&u[..n_values]);
        for first in (0..n_lanes).step_by(PADDING) {
            let mut before_n = [0.0; PADDING];
            for mass in 0..self.model.n_masses() {
                let (k, c) = (coefficients.k_n_per_m[mass], coefficients.c_kg_per_s[mass]);
                let ground = self.model.damping_kg_per_s[mass];
                let inverse_mass = self.model.inverse_mass_per_kg[mass];
                let here = mass * n_lanes + first;
                let there = here + n_lanes;
                let (s_i, s_j) = (&s[here..][..PADDING], &s[there..][..PADDING]);
                let (u_i, u_j) = (&u[here..][..PADDING], &u[there..][..PADDING]);
                let forcing = &coefficients.forcing[here..][..PADDING];
                let out = &mut rates.u[here..][..PADDING];
                for lane in 0..PADDING {
                    let behind_n = k * (s_i[lane] - s_j[lane]) + c * (u_i[lane] - u_j[lane]);
                    let net_n = before_n[lane] - behind_n - ground * u_i[lane];
                    out[lane] = inverse_mass * net_n + forcing[lane];
                    before_n[lane] = behind_n;
                }
            }
        }
    }

    /// Adds dry friction to the rates of a stage at the state that lies in `trial`.
    ///
    /// Below a creeping speed it grows with speed, which stands for holding; the creeping is as slow as a step of `h_s` can follow.
    #[inline(always)]
    fn rub(&mut self, stage: usize, h_s: f64) {
        let v_m_per_s = &self.coefficients[COEFFICIENTS_OF_STAGE[stage]].v_m_per_s;
        for (k, force_n) in self.frictions_n.iter().enumerate() {
            let lane = self.first_friction + k;
            let masses = v_m_per_s.iter().zip(self.model.inverse_mass_per_kg.iter()).enumerate();
            let rubbed = masses.skip(self.model.first_gap()).take(self.model.n_gaps() + 1);
            for (mass, (driven_m_per_s, inverse_mass_per_kg)) in rubbed {
                let place = mass * self.n_lanes + lane;
                let most_m_per_s2 = force_n * inverse_mass_per_kg;
                let creeping_m_per_s = CREEPING_M_PER_S.max(most_m_per_s2 * h_s);
                let speed = (driven_m_per_s + self.trial.u[place]) / creeping_m_per_s;
                self.stages[stage].u[place] -= most_m_per_s2 * speed / (1.0 + speed * speed).sqrt();
            }
        }
    }

    /// The state a part of a step along the rates of a stage, into `trial`.
    #[inline(always)]
    fn try_along(&mut self, stage: usize, part_s: f64) {
        let Derivatives { s, u } = &self.stages[stage];
        for (to, (from, rate)) in self.trial.s.iter_mut().zip(self.here.s.iter().zip(s)) {
            *to = from + part_s * rate;
        }
        for (to, (from, rate)) in self.trial.u.iter_mut().zip(self.here.u.iter().zip(u)) {
            *to = from + part_s * rate;
        }
    }

    #[inline(always)]
    fn finish(&mut self, h_s: f64) {
        let [first, second, third, last] = &self.stages;
        let Derivatives { s, u } = &mut self.here;
        let sixth_s = h_s / 6.0;
        for i in 0..s.len() {
            s[i] += sixth_s * (first.s[i] + 2.0 * (second.s[i] + third.s[i]) + last.s[i]);
            u[i] += sixth_s * (first.u[i] + 2.0 * (second.u[i] + third.u[i]) + last.u[i]);
        }
        let [_, _, end] = &self.coefficients;
        end.impose(s, u);
    }
}

/// Bodies that friction holds creep more slowly than this: 0.1 um in 10 ms.
const CREEPING_M_PER_S: f64 = 1e-5;

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
        let Tangent { along, coefficients, .. } = tangent;
        let h_s = end_s - start_s;
        match tangent.end_s == Some(start_s) {
            true => coefficients.swap(0, 2),
            false => along.work_out(simd, start_s, &mut coefficients[0]),
        }
        along.work_out(simd, start_s + 0.5 * h_s, &mut coefficients[1]);
        along.work_out(simd, end_s, &mut coefficients[2]);
        tangent.end_s = Some(end_s);
        tangent.try_along(0, 0.0);
        tangent.rates(0);
        tangent.rub(0, h_s);
        for (stage, part) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            tangent.try_along(stage - 1, part * h_s);
            tangent.rates(stage);
            tangent.rub(stage, h_s);
        }
        tangent.finish(h_s);
    }
}
