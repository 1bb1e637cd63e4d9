//! Explicit Runge-Kutta methods: RK4, and DOP853 with its error estimate and interpolation.

use pulp::{Simd, WithSimd};

use super::{
    rows::StageRates,
    step::{Integrator, LocalError, TimeStep},
    tableau::{Extra, Tableau},
};
use crate::{
    equations::{
        force_row::ForceRow,
        model::{ChainModel, PhasePoint},
        state::{ChainState, row_length},
    },
    lanes::{self, row::AlignedRow},
};

/// An explicit Runge-Kutta method with its work space.
#[derive(Debug)]
pub(crate) struct RungeKutta {
    tableau: &'static Tableau,
    /// Velocities and accelerations of the stages, those at the result and for the interpolation included.
    velocity: StageRates,
    acceleration: StageRates,
    lost_w: Vec<f64>,
    stage_x_m: AlignedRow,
    force_n: ForceRow,
    local_error: Option<LocalError>,
    /// Whether the interpolation's stages belong to the last step.
    dense: bool,
    evaluations: u64,
}

impl RungeKutta {
    pub(super) fn new(tableau: &'static Tableau, model: &ChainModel<'_>) -> Self {
        let length = row_length(model.n_masses());
        let n_stages = tableau.stages.len() + 1;
        let n_rows = n_stages + tableau.extra.map_or(0, |extra| 1 + extra.stages.len());
        Self {
            tableau,
            velocity: StageRates::new(n_rows, length),
            acceleration: StageRates::new(n_rows, length),
            lost_w: vec![0.0; n_rows],
            stage_x_m: AlignedRow::zeros(length),
            force_n: ForceRow::new(model.n_masses()),
            local_error: None,
            dense: false,
            evaluations: 0,
        }
    }

    /// The stage of the rates at the result.
    fn last(&self) -> usize {
        self.tableau.stages.len() + 1
    }

    /// Places stage `i` by its terms, and evaluates its rates.
    #[inline(always)]
    fn stage<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, from: &ChainState, at: StageAt<'_>) {
        let StageAt { stage, time_s, h_s, terms } = at;
        let active = from.active;
        self.velocity.combine(simd, &from.x_m, h_s, terms, &mut self.stage_x_m[..active]);
        let velocity = self.velocity.row_mut(stage);
        self.acceleration.combine(simd, &from.v_m_per_s, h_s, terms, &mut velocity[..active]);
        model.impose(time_s, &mut self.stage_x_m, velocity);
        self.evaluations += 1;
        let place = PhasePoint { x_m: &self.stage_x_m, v_m_per_s: velocity, touching: from.touching, active };
        self.lost_w[stage] = model.rates(simd, place, &mut self.force_n, self.acceleration.row_mut(stage));
        self.leave_imposed(model, stage);
    }

    /// An imposed motion is no result of the rates, and its samples' unrest is no error of theirs.
    #[inline(always)]
    fn leave_imposed(&mut self, model: &ChainModel<'_>, stage: usize) {
        if model.is_imposed() {
            self.velocity.row_mut(stage)[0] = 0.0;
        }
    }

    /// Evaluates the rates at the result, and the errors that the embedded results tell: Hairer, Norsett and Wanner's
    /// combination of the estimates of order 5 and 3, which is of order 7 in the step (II.10, eq. 10.17).
    #[inline(always)]
    fn estimate<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, to: &ChainState, h_s: f64) {
        let Some(extra) = self.tableau.extra else { return };
        let last = self.last();
        lanes::copy(simd, &to.v_m_per_s[..to.active], &mut self.velocity.row_mut(last)[..to.active]);
        self.evaluations += 1;
        self.lost_w[last] = model.rates(simd, to.place(), &mut self.force_n, self.acceleration.row_mut(last));
        self.leave_imposed(model, last);
        self.local_error = Some(LocalError {
            x_m: h_s * combined_error(simd, &self.velocity, to.active, extra),
            v_m_per_s: h_s * combined_error(simd, &self.acceleration, to.active, extra),
        });
    }
}

/// The two estimates of the error as one, for each second of the step.
#[inline(always)]
fn combined_error<S: Simd>(simd: S, rates: &StageRates, active: usize, extra: &Extra) -> f64 {
    let fifth = rates.largest(simd, active, extra.errors[0]);
    let third = rates.largest(simd, active, extra.errors[1]);
    let scale = (fifth * fifth + 0.01 * third * third).sqrt();
    if scale > 0.0 { fifth * fifth / scale } else { fifth }
}

/// Which stage stands where.
#[derive(Clone, Copy)]
struct StageAt<'a> {
    stage: usize,
    time_s: f64,
    h_s: f64,
    terms: &'a [(usize, f64)],
}

impl Integrator for RungeKutta {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, from: &ChainState, continued: bool) {
        let active = from.active;
        lanes::copy(simd, &from.v_m_per_s[..active], &mut self.velocity.row_mut(0)[..active]);
        self.leave_imposed(model, 0);
        if continued && self.tableau.extra.is_some() {
            let last = self.last();
            let (first_row, others) = self.acceleration.first_and(last);
            lanes::copy(simd, &others[..active], &mut first_row[..active]);
            self.lost_w[0] = self.lost_w[last];
            return;
        }
        self.evaluations += 1;
        self.lost_w[0] = model.rates(simd, from.place(), &mut self.force_n, self.acceleration.row_mut(0));
    }

    #[inline(always)]
    fn advance<S: Simd>(
        &mut self,
        simd: S,
        model: &ChainModel<'_>,
        from: &ChainState,
        step: TimeStep,
        to: &mut ChainState,
    ) {
        let TimeStep { time_s, h_s } = step;
        let tableau = self.tableau;
        for (i, (node, terms)) in tableau.nodes.iter().zip(tableau.stages).enumerate() {
            let time_s = time_s + node * h_s;
            self.stage(simd, model, from, StageAt { stage: i + 1, time_s, h_s, terms });
        }
        let active = from.active;
        self.velocity.combine(simd, &from.x_m, h_s, tableau.weights, &mut to.x_m[..active]);
        self.acceleration.combine(simd, &from.v_m_per_s, h_s, tableau.weights, &mut to.v_m_per_s[..active]);
        let lost_w: f64 = tableau.weights.iter().map(|&(j, weight)| weight * self.lost_w[j]).sum();
        to.lost_j = from.lost_j + h_s * lost_w;
        model.impose(time_s + h_s, &mut to.x_m, &mut to.v_m_per_s);
        self.dense = false;
        self.estimate(simd, model, to, h_s);
    }

    fn local_error(&self) -> Option<LocalError> {
        self.local_error
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

/// A state within the last step of a method with interpolation.
pub(super) struct Interpolate<'a> {
    pub(super) rung: &'a mut RungeKutta,
    pub(super) model: &'a ChainModel<'a>,
    pub(super) ends: [&'a ChainState; 2],
    pub(super) step: TimeStep,
    pub(super) fraction: f64,
    pub(super) at: &'a mut ChainState,
}

impl WithSimd for Interpolate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rung, model, ends: [from, to], step: TimeStep { time_s, h_s }, fraction, at } = self;
        let Some(extra) = rung.tableau.extra else { return };
        if !rung.dense {
            for (i, (node, terms)) in extra.nodes.iter().zip(extra.stages).enumerate() {
                let stage = rung.last() + 1 + i;
                rung.stage(simd, model, from, StageAt { stage, time_s: time_s + node * h_s, h_s, terms });
            }
            rung.dense = true;
        }
        let weights = dense_weights(extra.dense, rung.last(), fraction);
        let active = from.active;
        (at.touching, at.active) = (from.touching, active);
        let rows = [
            (&rung.velocity, &from.x_m, &to.x_m, &mut at.x_m),
            (&rung.acceleration, &from.v_m_per_s, &to.v_m_per_s, &mut at.v_m_per_s),
        ];
        for (rates, from, to, at) in rows {
            blend(simd, from, to, weights.of_end, &mut at[..active]);
            rates.add(simd, h_s, &weights.of_rates, &mut at[..active]);
        }
        let lost_w: f64 = weights.of_rates.iter().map(|&(j, weight)| weight * rung.lost_w[j]).sum();
        at.lost_j = from.lost_j + weights.of_end * (to.lost_j - from.lost_j) + h_s * lost_w;
        model.impose(time_s + fraction * h_s, &mut at.x_m, &mut at.v_m_per_s);
    }
}

/// The interpolant as weights: of the result against the start, and of the stages' rates times the step.
struct DenseWeights {
    of_end: f64,
    of_rates: [(usize, f64); 16],
}

/// With s the fraction and r = 1 - s, the interpolant is
/// y_0 + s (F_0 + r (F_1 + s (F_2 + r (F_3 + s (F_4 + r (F_5 + s F_6)))))), where F_0 = y_1 - y_0, F_1 = h f_0 - F_0,
/// F_2 = 2 F_0 - h (f_0 + f_1), and F_3 to F_6 are sums over the stages (Hairer, Norsett, Wanner, II.6).
fn dense_weights(dense: [&[(usize, f64)]; 4], last: usize, s: f64) -> DenseWeights {
    let r = 1.0 - s;
    let (second, third) = (s * r, s * r * s);
    let mut factor = third;
    let mut of_rates = std::array::from_fn(|j| (j, 0.0));
    of_rates[0].1 += second - third;
    of_rates[last].1 -= third;
    for (i, terms) in dense.into_iter().enumerate() {
        factor *= if i % 2 == 0 { r } else { s };
        for &(j, weight) in terms {
            of_rates[j].1 += factor * weight;
        }
    }
    DenseWeights { of_end: s - second + 2.0 * third, of_rates }
}

/// `out = from + weight (to - from)`.
#[inline(always)]
fn blend<S: Simd>(simd: S, from: &[f64], to: &[f64], weight: f64, out: &mut [f64]) {
    let weight = simd.splat_f64s(weight);
    let n = out.len();
    let ends = S::as_simd_f64s(&from[..n]).0.iter().zip(S::as_simd_f64s(&to[..n]).0);
    for (out, (from, to)) in S::as_mut_simd_f64s(out).0.iter_mut().zip(ends) {
        *out = simd.mul_add_f64s(weight, simd.sub_f64s(*to, *from), *from);
    }
}
