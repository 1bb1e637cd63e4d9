//! ESDIRK4(3)6L\[2\]SA: implicit Runge-Kutta for stiff dampers, with a tridiagonal Newton step.

use pulp::Simd;

use super::{
    rows::StageRates,
    step::{Integrator, LocalError, TimeStep},
};
use crate::equations::{
    force_row::ForceRow,
    model::{ChainModel, PhasePoint},
    state::{ChainState, row_length},
};

/// ESDIRK4(3)6L\[2\]SA: a Runge-Kutta method of order 4 with one implicit equation in each stage, L-stable and stiffly accurate
/// (C. A. Kennedy, M. H. Carpenter, Appl. Numer. Math. 44 (2003) 139-181, appendix C, the implicit part).
///
/// However strong the dampers, steps follow the motion that they leave. A stage's velocities solve a system with couplings
/// between neighbours only, so Newton's method costs one elimination along the chain; its matrix is set up once for each
/// step. Taking the dampers alone implicitly would not do: where velocities are slaves of the forces, explicit and implicit
/// stages then disagree to first order in the step.
#[derive(Debug)]
pub(crate) struct Implicit {
    /// Stages' velocities and accelerations.
    velocity: StageRates,
    acceleration: StageRates,
    lost_w: [f64; STAGES],
    /// Power that the gaps' dashpots take where `force_n` was worked out last.
    dashpots_w: f64,
    /// What a stage knows before it is solved, and the residual of its equation.
    known_x_m: Vec<f64>,
    known_v_m_per_s: Vec<f64>,
    residual: Vec<f64>,
    x_m: Vec<f64>,
    force_n: ForceRow,
    system: System,
    local_error: Option<LocalError>,
    evaluations: u64,
}

const STAGES: usize = 6;
const DIAGONAL: f64 = 0.25;
const NODES: [f64; STAGES] = [0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];
type Terms = &'static [(usize, f64)];
/// Coefficients before the diagonal; the last stage is the result.
const BEFORE: [Terms; STAGES] = [
    &[],
    &[(0, 0.25)],
    &[(0, 8_611.0 / 62_500.0), (1, -1_743.0 / 31_250.0)],
    &[(0, 5_012_029.0 / 34_652_500.0), (1, -654_441.0 / 2_922_500.0), (2, 174_375.0 / 388_108.0)],
    &[
        (0, 15_267_082_809.0 / 155_376_265_600.0),
        (1, -71_443_401.0 / 120_774_400.0),
        (2, 730_878_875.0 / 902_184_768.0),
        (3, 2_285_395.0 / 8_070_912.0),
    ],
    &[(0, WEIGHTS[0]), (2, WEIGHTS[2]), (3, WEIGHTS[3]), (4, WEIGHTS[4])],
];
const WEIGHTS: [f64; STAGES] =
    [82_889.0 / 524_892.0, 0.0, 15_625.0 / 83_664.0, 69_875.0 / 102_672.0, -2_260.0 / 8_211.0, DIAGONAL];
/// Result less the embedded result of order 3.
const ERROR: Terms = &[
    (0, WEIGHTS[0] - 4_586_570_599.0 / 29_645_900_160.0),
    (2, WEIGHTS[2] - 178_811_875.0 / 945_068_544.0),
    (3, WEIGHTS[3] - 814_220_225.0 / 1_159_782_912.0),
    (4, WEIGHTS[4] + 3_700_637.0 / 11_593_932.0),
    (5, WEIGHTS[5] - 61_727.0 / 225_920.0),
];
/// Iterations of a stage's equation after which the step counts as too long.
const MAX_ITERATIONS: u32 = 12;
/// A correction of the velocities, over the largest one, at which a stage counts as solved.
const SOLVED: f64 = 1e-13;

impl Implicit {
    pub(super) fn new(model: &ChainModel<'_>) -> Self {
        let length = row_length(model.n_masses());
        let row = vec![0.0; length];
        Self {
            velocity: StageRates::new(STAGES, length),
            acceleration: StageRates::new(STAGES, length),
            lost_w: [0.0; STAGES],
            dashpots_w: 0.0,
            known_x_m: row.clone(),
            known_v_m_per_s: row.clone(),
            residual: row.clone(),
            x_m: row,
            force_n: ForceRow::new(model.n_masses()),
            system: System::new(length),
            local_error: None,
            evaluations: 0,
        }
    }

    /// Solves stage `i` (from 1); returns whether that succeeded.
    #[inline(always)]
    fn stage<S: Simd>(
        &mut self,
        simd: S,
        model: &ChainModel<'_>,
        from: &ChainState,
        step: TimeStep,
        i: usize,
    ) -> bool {
        let TimeStep { time_s, h_s } = step;
        let active = from.active;
        self.velocity.combine(simd, &from.x_m, h_s, BEFORE[i], &mut self.known_x_m[..active]);
        self.acceleration.combine(simd, &from.v_m_per_s, h_s, BEFORE[i], &mut self.known_v_m_per_s[..active]);
        // The stage before is the first guess.
        self.velocity.copy_row(i - 1, i);
        model.impose(time_s + NODES[i] * h_s, &mut self.x_m, self.velocity.row_mut(i));
        let solved = (0..MAX_ITERATIONS).any(|_| self.correct(simd, model, from, h_s, i));
        self.place(model, active, h_s, i);
        let implicit_s = DIAGONAL * h_s;
        let velocity = self.velocity.row_mut(i);
        let known = self.known_v_m_per_s[..active].iter();
        for ((a, v), known) in self.acceleration.row_mut(i)[..active].iter_mut().zip(&*velocity).zip(known) {
            *a = (v - known) / implicit_s;
        }
        self.finish(model, active, i);
        solved
    }

    /// Positions of stage `i` by its velocities.
    #[inline(always)]
    fn place(&mut self, model: &ChainModel<'_>, active: usize, h_s: f64, i: usize) {
        let first = usize::from(model.is_imposed());
        let places = self.x_m[first..active].iter_mut().zip(&self.known_x_m[first..active]);
        for ((x, known), v) in places.zip(&self.velocity.row(i)[first..active]) {
            *x = known + DIAGONAL * h_s * v;
        }
    }

    /// One step of Newton's method for stage `i`; returns whether it changed nothing any more.
    #[inline(always)]
    fn correct<S: Simd>(
        &mut self,
        simd: S,
        model: &ChainModel<'_>,
        from: &ChainState,
        h_s: f64,
        i: usize,
    ) -> bool {
        let active = from.active;
        let implicit_s = DIAGONAL * h_s;
        self.place(model, active, h_s, i);
        self.push(simd, model, from, i);
        let velocity = self.velocity.row(i);
        for (mass, residual) in self.residual[..active].iter_mut().enumerate() {
            let change = implicit_s * model.acceleration_m_per_s2(mass, velocity[mass], &self.force_n);
            *residual = self.known_v_m_per_s[mass] + change - velocity[mass];
        }
        if model.is_imposed() {
            self.residual[0] = 0.0;
        }
        self.system.solve(&mut self.residual[..active]);
        let velocity = &mut self.velocity.row_mut(i)[..active];
        let (mut largest, mut correction) = (0.0_f64, 0.0_f64);
        for (v, change) in velocity.iter_mut().zip(&self.residual) {
            *v += change;
            largest = largest.max(v.abs());
            correction = correction.max(change.abs());
        }
        correction <= SOLVED * largest
    }

    /// Works out the forces of all gaps at stage `i`, with what holds the masses to ground.
    #[inline(always)]
    fn push<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, from: &ChainState, i: usize) {
        let (touching, active) = (from.touching, from.active);
        self.evaluations += 1;
        model.gap_forces(simd, &self.x_m, touching, active, &mut self.force_n);
        let at = PhasePoint { x_m: &self.x_m, v_m_per_s: self.velocity.row(i), touching, active };
        self.dashpots_w = model.damp(at, self.force_n.behind(active));
        self.force_n.hold(simd, model.ground.as_ref(), &self.x_m[..active]);
    }

    /// The power lost, and what an imposed motion takes out of the books.
    fn finish(&mut self, model: &ChainModel<'_>, active: usize, i: usize) {
        let velocity = self.velocity.row_mut(i);
        let dampers = model.damping_kg_per_s[..active].iter().zip(&*velocity);
        self.lost_w[i] = self.dashpots_w + dampers.map(|(c, v)| c * v * v).sum::<f64>();
        if model.is_imposed() {
            self.lost_w[i] += self.force_n.net_n(0) * velocity[0];
            // An imposed motion is no result of the rates.
            velocity[0] = 0.0;
            self.acceleration.row_mut(i)[0] = 0.0;
        }
    }

    /// The error of the velocities goes through the step's system once more, as L. F. Shampine does (Comput. Math. Appl. 10
    /// (1984) 203-209): where the dampers are stiff, they damp it away.
    #[inline(always)]
    fn estimate<S: Simd>(&mut self, simd: S, active: usize, h_s: f64) {
        let error = &mut self.residual[..active];
        error.fill(0.0);
        self.acceleration.add(simd, h_s, ERROR, error);
        self.system.solve(error);
        let largest = error.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let finite = error.iter().all(|value| value.is_finite());
        self.local_error = Some(LocalError {
            x_m: h_s * self.velocity.largest(simd, active, ERROR),
            v_m_per_s: if finite { largest } else { f64::INFINITY },
        });
    }
}

impl Integrator for Implicit {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, from: &ChainState, _continued: bool) {
        let active = from.active;
        self.x_m[..active].copy_from_slice(&from.x_m[..active]);
        self.velocity.row_mut(0)[..active].copy_from_slice(&from.v_m_per_s[..active]);
        self.system.set_gaps(model, from);
        self.push(simd, model, from, 0);
        for mass in 0..active {
            self.acceleration.row_mut(0)[mass] =
                model.acceleration_m_per_s2(mass, from.v_m_per_s[mass], &self.force_n);
        }
        self.finish(model, active, 0);
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
        let active = from.active;
        self.system.factor(model, active, DIAGONAL * h_s);
        let mut solved = true;
        for i in 1..STAGES {
            solved &= self.stage(simd, model, from, step, i);
        }
        to.x_m[..active].copy_from_slice(&self.x_m[..active]);
        to.v_m_per_s[..active].copy_from_slice(&self.velocity.row(STAGES - 1)[..active]);
        let lost_w: f64 = WEIGHTS.iter().zip(self.lost_w).map(|(weight, lost_w)| weight * lost_w).sum();
        to.lost_j = from.lost_j + h_s * lost_w;
        model.impose(time_s + h_s, &mut to.x_m, &mut to.v_m_per_s);
        self.estimate(simd, active, h_s);
        if !solved {
            self.local_error = Some(LocalError { x_m: f64::INFINITY, v_m_per_s: f64::INFINITY });
        }
    }

    fn local_error(&self) -> Option<LocalError> {
        self.local_error
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

/// The matrix 1 + s M^-1 (D + s K), with dampers D and stiffnesses K tridiagonal, factored for one s at a time.
#[derive(Debug)]
struct System {
    /// Dashpot and stiffness behind each mass, those of a touching striker included.
    dashpots: Vec<f64>,
    stiffnesses: Vec<f64>,
    /// Stiffness of what holds each mass to ground.
    grounds: Vec<f64>,
    /// Elimination from the left: what of the row before is taken, what of the row behind remains, one over the pivot.
    lower: Vec<f64>,
    upper: Vec<f64>,
    inverse_pivot: Vec<f64>,
}

impl System {
    fn new(length: usize) -> Self {
        let row = vec![0.0; length];
        Self {
            dashpots: row.clone(),
            stiffnesses: row.clone(),
            grounds: row.clone(),
            lower: row.clone(),
            upper: row.clone(),
            inverse_pivot: row,
        }
    }

    /// Takes in what lies in the gaps and holds the masses in a state.
    fn set_gaps(&mut self, model: &ChainModel<'_>, state: &ChainState) {
        for gap in 0..state.active {
            self.dashpots[gap] = model.dashpot_kg_per_s(gap, state);
            self.stiffnesses[gap] = model.stiffness_n_per_m(gap, state);
            self.grounds[gap] = model.ground_n_per_m(gap, state.x_m[gap]);
        }
    }

    fn factor(&mut self, model: &ChainModel<'_>, active: usize, s: f64) {
        let (mut before, mut carried) = (0.0, 0.0);
        for i in 0..active {
            let scale = s * model.inverse_mass_per_kg[i];
            let behind = self.dashpots[i] + s * self.stiffnesses[i];
            let lower = -scale * before;
            let to_ground = model.damping_kg_per_s[i] + s * self.grounds[i];
            let pivot = 1.0 + scale * (to_ground + before + behind) - lower * carried;
            self.lower[i] = lower;
            self.inverse_pivot[i] = pivot.recip();
            carried = -scale * behind * self.inverse_pivot[i];
            self.upper[i] = carried;
            before = behind;
        }
    }

    /// Replaces the right hand side by the solution.
    fn solve(&self, row: &mut [f64]) {
        let mut before = 0.0;
        for ((value, lower), inverse_pivot) in row.iter_mut().zip(&self.lower).zip(&self.inverse_pivot) {
            before = (*value - lower * before) * inverse_pivot;
            *value = before;
        }
        let mut behind = 0.0;
        for (value, upper) in row.iter_mut().zip(&self.upper).rev() {
            behind = *value - upper * behind;
            *value = behind;
        }
    }
}
