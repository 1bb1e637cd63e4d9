use pulp::Simd;

use super::{Integrator, LocalError, Step, rows::Rows};
use crate::{
    model::{ForceRow, Model},
    state::{State, row_length},
};

/// ARK4(3)6L\[2\]SA: an additive Runge-Kutta method of order 4 that takes the dampers implicitly, L-stable, and the springs
/// explicitly (C. A. Kennedy, M. H. Carpenter, Appl. Numer. Math. 44 (2003) 139-181, appendix C).
///
/// Velocities solve a linear system with one damper between neighbours and one to ground, so a stage costs one elimination
/// along the chain. Positions follow the implicit coefficients too: stages see velocities that the dampers have already
/// tamed.
#[derive(Debug)]
pub(crate) struct Imex {
    /// Stages' velocities, and accelerations by springs and by dampers.
    velocity: Rows,
    by_springs: Rows,
    by_dampers: Rows,
    lost_w: [f64; STAGES],
    x_m: Vec<f64>,
    force_n: ForceRow,
    system: System,
    local_error: Option<LocalError>,
    evaluations: u64,
}

const STAGES: usize = 6;
/// The diagonal of the implicit coefficients.
const DIAGONAL: f64 = 0.25;
const NODES: [f64; STAGES] = [0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];
type Terms = &'static [(usize, f64)];
const EXPLICIT: [Terms; STAGES] = [
    &[],
    &[(0, 0.5)],
    &[(0, 13_861.0 / 62_500.0), (1, 6_889.0 / 62_500.0)],
    &[
        (0, -116_923_316_275.0 / 2_393_684_061_468.0),
        (1, -2_731_218_467_317.0 / 15_368_042_101_831.0),
        (2, 9_408_046_702_089.0 / 11_113_171_139_209.0),
    ],
    &[
        (0, -451_086_348_788.0 / 2_902_428_689_909.0),
        (1, -2_682_348_792_572.0 / 7_519_795_681_897.0),
        (2, 12_662_868_775_082.0 / 11_960_479_115_383.0),
        (3, 3_355_817_975_965.0 / 11_060_851_509_271.0),
    ],
    &[
        (0, 647_845_179_188.0 / 3_216_320_057_751.0),
        (1, 73_281_519_250.0 / 8_382_639_484_533.0),
        (2, 552_539_513_391.0 / 3_454_668_386_233.0),
        (3, 3_354_512_671_639.0 / 8_306_763_924_573.0),
        (4, 4_040.0 / 17_871.0),
    ],
];
/// Without the diagonal.
const IMPLICIT: [Terms; STAGES] = [
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
    [82_889.0 / 524_892.0, 0.0, 15_625.0 / 83_664.0, 69_875.0 / 102_672.0, -2_260.0 / 8_211.0, 0.25];
/// Result less the embedded result of order 3.
const ERROR: Terms = &[
    (0, WEIGHTS[0] - 4_586_570_599.0 / 29_645_900_160.0),
    (2, WEIGHTS[2] - 178_811_875.0 / 945_068_544.0),
    (3, WEIGHTS[3] - 814_220_225.0 / 1_159_782_912.0),
    (4, WEIGHTS[4] + 3_700_637.0 / 11_593_932.0),
    (5, WEIGHTS[5] - 61_727.0 / 225_920.0),
];

impl Imex {
    pub(super) fn new(model: &Model<'_>) -> Self {
        let length = row_length(model.n_masses());
        let rows = Rows::new(STAGES, length);
        Self {
            velocity: rows.clone(),
            by_springs: rows.clone(),
            by_dampers: rows,
            lost_w: [0.0; STAGES],
            x_m: vec![0.0; length],
            force_n: ForceRow::new(model.n_masses()),
            system: System::new(length),
            local_error: None,
            evaluations: 0,
        }
    }

    /// Places stage `i` (from 1), solves for its velocities, and evaluates its rates.
    #[inline(always)]
    fn stage<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, step: Step, i: usize) {
        let Step { time_s, h_s } = step;
        let active = from.active;
        let known = self.by_dampers.row_mut(i);
        self.by_springs.combine(simd, &from.v_m_per_s, h_s, EXPLICIT[i], &mut known[..active]);
        self.by_dampers.add_to_row(simd, h_s, IMPLICIT[i], i, active);
        self.velocity.combine(simd, &from.x_m, h_s, IMPLICIT[i], &mut self.x_m[..active]);
        let velocity = self.velocity.row_mut(i);
        let known = self.by_dampers.row_mut(i);
        model.impose(time_s + NODES[i] * h_s, &mut self.x_m, velocity);
        if model.is_imposed() {
            known[0] = velocity[0];
        }
        self.system.solve(model, &known[..active], &mut velocity[..active]);
        let implicit_s = DIAGONAL * h_s;
        let first = usize::from(model.is_imposed());
        for ((x, v), known) in
            self.x_m[first..active].iter_mut().zip(&velocity[first..]).zip(&mut known[first..])
        {
            *x += implicit_s * v;
            *known = (v - *known) / implicit_s;
        }
        self.finish(simd, model, from, i);
    }

    /// Accelerations by the springs at the stage's place, and the power lost.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, i: usize) {
        let active = from.active;
        self.evaluations += 1;
        model.spring_forces(simd, &self.x_m, from.touching, active, &mut self.force_n);
        let force_n = &self.force_n;
        let accelerations = self.by_springs.row_mut(i);
        for (mass, acceleration) in accelerations[..active].iter_mut().enumerate() {
            *acceleration = force_n.net_n(mass) * model.inverse_mass_per_kg[mass];
        }
        let velocity = self.velocity.row_mut(i);
        self.lost_w[i] = self.system.power_w(model, velocity, from.active);
        if model.is_imposed() {
            let dashpot_n = self.system.dashpots[0] * (velocity[0] - velocity[1]);
            self.lost_w[i] -= (dashpot_n - force_n.net_n(0)) * velocity[0];
            // An imposed motion is no result of the rates.
            velocity[0] = 0.0;
            self.by_dampers.row_mut(i)[0] = 0.0;
        }
    }
}

impl Integrator for Imex {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, _continued: bool) {
        let active = from.active;
        self.system.set_dashpots(model, from);
        self.x_m[..active].copy_from_slice(&from.x_m[..active]);
        self.velocity.row_mut(0)[..active].copy_from_slice(&from.v_m_per_s[..active]);
        self.system.accelerate(model, &from.v_m_per_s, &mut self.by_dampers.row_mut(0)[..active]);
        self.finish(simd, model, from, 0);
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, step: Step, to: &mut State) {
        let Step { time_s, h_s } = step;
        self.system.factor(model, from.active, DIAGONAL * h_s);
        for i in 1..STAGES {
            self.stage(simd, model, from, step, i);
        }
        let active = from.active;
        let weights: [(usize, f64); STAGES] = std::array::from_fn(|j| (j, WEIGHTS[j]));
        self.velocity.combine(simd, &from.x_m, h_s, &weights, &mut to.x_m[..active]);
        self.by_springs.combine(simd, &from.v_m_per_s, h_s, &weights, &mut to.v_m_per_s[..active]);
        self.by_dampers.add(simd, h_s, &weights, &mut to.v_m_per_s[..active]);
        to.lost_j =
            from.lost_j + h_s * weights.iter().map(|&(j, weight)| weight * self.lost_w[j]).sum::<f64>();
        model.impose(time_s + h_s, &mut to.x_m, &mut to.v_m_per_s);
        // The springs' part alone: where the dampers are stiff, theirs would count errors that they have damped away.
        self.local_error = Some(LocalError {
            x_m: h_s * self.velocity.largest(simd, active, ERROR),
            v_m_per_s: h_s * self.by_springs.largest(simd, active, ERROR),
        });
    }

    fn local_error(&self) -> Option<LocalError> {
        self.local_error
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

/// The dampers' linear system (1 + s M^-1 D) v = known, with D tridiagonal, factored for one s at a time.
#[derive(Debug)]
struct System {
    /// Dashpot behind each mass, that of a touching striker included.
    dashpots: Vec<f64>,
    /// Elimination from the left: what of the row before is taken, what of the row behind remains, one over the pivot.
    lower: Vec<f64>,
    upper: Vec<f64>,
    inverse_pivot: Vec<f64>,
}

impl System {
    fn new(length: usize) -> Self {
        let row = vec![0.0; length];
        Self { dashpots: row.clone(), lower: row.clone(), upper: row.clone(), inverse_pivot: row }
    }

    fn set_dashpots(&mut self, model: &Model<'_>, state: &State) {
        for (gap, dashpot) in self.dashpots[..state.active].iter_mut().enumerate() {
            *dashpot = model.gaps.dashpot_kg_per_s(gap);
        }
        if let Some(contact) = &model.striker {
            self.dashpots[0] = if state.touching { contact.damping_kg_per_s } else { 0.0 };
        }
    }

    fn factor(&mut self, model: &Model<'_>, active: usize, s: f64) {
        let mut before = 0.0;
        let mut carried = 0.0;
        for i in 0..active {
            let scale = s * model.inverse_mass_per_kg[i];
            let behind = self.dashpots[i];
            let lower = -scale * before;
            let pivot = 1.0 + scale * (model.damping_kg_per_s[i] + before + behind) - lower * carried;
            self.lower[i] = lower;
            self.inverse_pivot[i] = pivot.recip();
            carried = -scale * behind * self.inverse_pivot[i];
            self.upper[i] = carried;
            before = behind;
        }
    }

    #[inline(always)]
    fn solve(&self, model: &Model<'_>, known: &[f64], v_m_per_s: &mut [f64]) {
        let n = known.len();
        let coupled = model.has_neighbours_coupled();
        // Without dashpots between bodies only the striker and the body that it touches are coupled.
        let last = if coupled { n } else { 2.min(n) };
        let mut before = 0.0;
        for i in 0..last {
            before = (known[i] - self.lower[i] * before) * self.inverse_pivot[i];
            v_m_per_s[i] = before;
        }
        for i in last..n {
            v_m_per_s[i] = known[i] * self.inverse_pivot[i];
        }
        for i in (0..last.saturating_sub(1)).rev() {
            v_m_per_s[i] -= self.upper[i] * v_m_per_s[i + 1];
        }
    }

    /// Accelerations by the dampers.
    fn accelerate(&self, model: &Model<'_>, v_m_per_s: &[f64], accelerations: &mut [f64]) {
        let mut before_n = 0.0;
        for (i, acceleration) in accelerations.iter_mut().enumerate() {
            let behind_n = self.dashpots[i] * (v_m_per_s[i] - v_m_per_s[i + 1]);
            let drag_n = model.damping_kg_per_s[i] * v_m_per_s[i];
            *acceleration = (before_n - behind_n - drag_n) * model.inverse_mass_per_kg[i];
            before_n = behind_n;
        }
    }

    /// Power that the dampers take, in watts.
    fn power_w(&self, model: &Model<'_>, v_m_per_s: &[f64], active: usize) -> f64 {
        (0..active)
            .map(|i| {
                let closing = v_m_per_s[i] - v_m_per_s[i + 1];
                model.damping_kg_per_s[i] * v_m_per_s[i] * v_m_per_s[i] + self.dashpots[i] * closing * closing
            })
            .sum()
    }
}
