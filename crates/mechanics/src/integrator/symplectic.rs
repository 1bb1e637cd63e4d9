use pulp::Simd;

use super::{Integrator, LocalError, Step};
use crate::{
    lanes::{self, PartialSums},
    model::{ForceRow, Model},
    row::Row,
    state::State,
};

/// A composition of drifts (positions move along the velocities) and kicks (velocities change by the forces).
///
/// Without dampers each part is the exact flow of a piece of the Hamiltonian, so the composition is symplectic, and its
/// energy error stays bounded. Dampers to ground and that of the striker's contact join the kick, whose flow stays exact.
#[derive(Debug)]
pub(crate) struct Composition {
    /// omega dt up to which it is stable for x'' = -omega^2 x: where the trace of its matrix leaves (-2, 2).
    pub(crate) stable_oscillation: f64,
    /// Drift, then kick, as fractions of the step.
    parts: &'static [[f64; 2]],
    last_drift: f64,
}

pub(crate) static EULER: Composition =
    Composition { stable_oscillation: 2.0, parts: &[[0.0, 1.0]], last_drift: 1.0 };

/// L. Verlet, Phys. Rev. 159 (1967) 98-103.
pub(crate) static VERLET: Composition =
    Composition { stable_oscillation: 2.0, parts: &[[0.0, 0.5], [1.0, 0.5]], last_drift: 0.0 };

/// S_6 of order 4: S. Blanes, P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313-330, table 2.
pub(crate) static FOURTH: Composition = Composition {
    stable_oscillation: 3.132,
    parts: &[
        [A4[0], B4[0]],
        [A4[1], B4[1]],
        [A4[2], 0.5 - B4[0] - B4[1]],
        [1.0 - 2.0 * (A4[0] + A4[1] + A4[2]), 0.5 - B4[0] - B4[1]],
        [A4[2], B4[1]],
        [A4[1], B4[0]],
    ],
    last_drift: A4[0],
};
const A4: [f64; 3] = [0.079_203_696_431_195_7, 0.353_172_906_049_774, -0.042_065_080_357_719_5];
const B4: [f64; 2] = [0.209_515_106_613_362, -0.143_851_773_179_818];

/// S_10 of order 6, from the same table.
pub(crate) static SIXTH: Composition = Composition {
    stable_oscillation: 3.134,
    parts: &[
        [A6[0], B6[0]],
        [A6[1], B6[1]],
        [A6[2], B6[2]],
        [A6[3], B6[3]],
        [A6[4], 0.5 - B6[0] - B6[1] - B6[2] - B6[3]],
        [1.0 - 2.0 * (A6[0] + A6[1] + A6[2] + A6[3] + A6[4]), 0.5 - B6[0] - B6[1] - B6[2] - B6[3]],
        [A6[4], B6[3]],
        [A6[3], B6[2]],
        [A6[2], B6[1]],
        [A6[1], B6[0]],
    ],
    last_drift: A6[0],
};
const A6: [f64; 5] = [
    0.050_262_764_400_392_2,
    0.413_514_300_428_344,
    0.045_079_889_794_397_7,
    -0.188_054_853_819_569,
    0.541_960_678_450_780,
];
const B6: [f64; 4] =
    [0.148_816_447_901_042, -0.132_385_865_767_784, 0.067_307_604_692_185, 0.432_666_402_578_175];

/// A composition with its work space.
#[derive(Debug)]
pub(crate) struct Symplectic {
    composition: &'static Composition,
    /// Forces at the start and at the last kick.
    start_n: ForceRow,
    force_n: ForceRow,
    kicks: Vec<Kick>,
    evaluations: u64,
}

impl Symplectic {
    pub(super) fn new(composition: &'static Composition, model: &Model<'_>) -> Self {
        Self {
            composition,
            start_n: ForceRow::new(model.n_masses()),
            force_n: ForceRow::new(model.n_masses()),
            kicks: composition.parts.iter().map(|_| Kick::default()).collect(),
            evaluations: 0,
        }
    }

    /// Whether the forces at the start of a step are those at its first kick.
    fn starts_with_kick(&self) -> bool {
        self.composition.parts[0][0] == 0.0
    }

    fn ends_with_kick(&self) -> bool {
        self.composition.last_drift == 0.0
    }

    /// Kicks the velocities of `to`, and books what the dampers took.
    #[inline(always)]
    fn kick<S: Simd>(&mut self, simd: S, model: &Model<'_>, part: usize, tau_s: f64, to: &mut State) {
        let force_n = if part == 0 && self.starts_with_kick() { &self.start_n } else { &self.force_n };
        let kick = &mut self.kicks[part];
        kick.prepare(model, tau_s);
        if model.is_imposed() {
            to.lost_j += tau_s * force_n.net_n(0) * to.v_m_per_s[0];
        }
        to.lost_j += kick.apply(simd, model, force_n, to);
    }
}

impl Integrator for Symplectic {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, continued: bool) {
        if !self.starts_with_kick() {
            return;
        }
        if continued && self.ends_with_kick() {
            std::mem::swap(&mut self.start_n, &mut self.force_n);
            return;
        }
        self.evaluations += 1;
        model.spring_forces(simd, &from.x_m, from.touching, from.active, &mut self.start_n);
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, model: &Model<'_>, from: &State, step: Step, to: &mut State) {
        let Step { time_s, h_s } = step;
        let active = from.active;
        lanes::copy(simd, &from.x_m[..active], &mut to.x_m[..active]);
        lanes::copy(simd, &from.v_m_per_s[..active], &mut to.v_m_per_s[..active]);
        to.lost_j = from.lost_j;
        let mut drifted = 0.0;
        for (part, &[drift, kick]) in self.composition.parts.iter().enumerate() {
            if part > 0 || !self.starts_with_kick() {
                drifted += drift;
                go(simd, to, drift * h_s);
                model.impose(time_s + drifted * h_s, &mut to.x_m, &mut to.v_m_per_s);
                self.evaluations += 1;
                model.spring_forces(simd, &to.x_m, to.touching, active, &mut self.force_n);
            }
            self.kick(simd, model, part, kick * h_s, to);
        }
        if !self.ends_with_kick() {
            go(simd, to, self.composition.last_drift * h_s);
        }
        model.impose(time_s + h_s, &mut to.x_m, &mut to.v_m_per_s);
    }

    fn local_error(&self) -> Option<LocalError> {
        None
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

/// The drift: positions move on for a time.
#[inline(always)]
fn go<S: Simd>(simd: S, state: &mut State, tau_s: f64) {
    let active = state.active;
    let tau = simd.splat_f64s(tau_s);
    let (velocities, _) = S::as_simd_f64s(&state.v_m_per_s[..active]);
    let (places, _) = S::as_mut_simd_f64s(&mut state.x_m[..active]);
    for (x, v) in places.iter_mut().zip(velocities) {
        *x = simd.mul_add_f64s(tau, *v, *x);
    }
}

/// The flow of forces that stand still and dampers over a time, worked out for one time at a time.
#[derive(Debug, Default)]
struct Kick {
    tau_s: f64,
    /// Velocities keep this part, where there are dampers to ground.
    decay: Option<Row>,
    /// Velocities gain this times the force: the integral of the decay over the mass; the time over the mass without
    /// dampers.
    gain_s_per_kg: Row,
    /// The striker and the body that it touches, where their contact is damped.
    pair: Option<Pair>,
}

impl Kick {
    fn prepare(&mut self, model: &Model<'_>, tau_s: f64) {
        if self.tau_s.to_bits() == tau_s.to_bits() && !self.gain_s_per_kg.is_empty() {
            return;
        }
        self.tau_s = tau_s;
        let masses = model.inverse_mass_per_kg.iter().zip(model.damping_kg_per_s.iter());
        let damped = model.damping_kg_per_s.iter().any(|&c| c > 0.0);
        let mut last = (f64::NAN, 0.0, 0.0);
        let flows: Vec<(f64, f64)> = masses
            .map(|(inverse_mass, c)| {
                let rate_per_s = inverse_mass * c;
                if rate_per_s.to_bits() != last.0.to_bits() {
                    last = (rate_per_s, (-rate_per_s * tau_s).exp(), decayed_time_s(rate_per_s, tau_s));
                }
                (last.1, last.2 * inverse_mass)
            })
            .collect();
        self.gain_s_per_kg = Row::padded(flows.iter().map(|flow| flow.1), flows.len());
        self.decay = damped.then(|| Row::padded(flows.iter().map(|flow| flow.0), flows.len()));
        let contact = model.striker.as_ref().filter(|contact| contact.damping_kg_per_s > 0.0);
        self.pair = contact.map(|contact| Pair::new(model, contact.damping_kg_per_s, tau_s));
    }

    /// Kicks the velocities; returns what the dampers took, in joules.
    #[inline(always)]
    fn apply<S: Simd>(&self, simd: S, model: &Model<'_>, force_n: &ForceRow, state: &mut State) -> f64 {
        let pair = self.pair.as_ref().filter(|_| state.touching);
        let Some(pair) = pair else { return self.apply_to_row(simd, model, force_n, state) };
        let before = [state.v_m_per_s[0], state.v_m_per_s[1]];
        let net_n = [force_n.net_n(0), force_n.net_n(1)];
        let mut lost_j = self.apply_to_row(simd, model, force_n, state);
        let after = pair.apply(before, net_n);
        for (i, before) in before.into_iter().enumerate() {
            // The row's kick knows nothing of the pair's dashpot.
            let changes = [after[i], state.v_m_per_s[i]].map(|after| mean_square(before, after));
            lost_j += self.tau_s * model.damping_kg_per_s[i] * (changes[0] - changes[1]);
            state.v_m_per_s[i] = after[i];
        }
        lost_j + self.tau_s * pair.contact_kg_per_s * mean_square(before[0] - before[1], after[0] - after[1])
    }

    /// [`Kick::apply`] where only dashpots to ground act.
    #[inline(always)]
    fn apply_to_row<S: Simd>(
        &self,
        simd: S,
        model: &Model<'_>,
        force_n: &ForceRow,
        state: &mut State,
    ) -> f64 {
        let active = state.active;
        let (before, behind) = force_n.beside::<S>(active);
        let (gains, _) = S::as_simd_f64s(&self.gain_s_per_kg[..active]);
        let (velocities, _) = S::as_mut_simd_f64s(&mut state.v_m_per_s[..active]);
        let kicks = velocities.iter_mut().zip(gains).zip(before.iter().zip(behind));
        let Some(decay) = &self.decay else {
            for ((v, gain), (before, behind)) in kicks {
                *v = simd.mul_add_f64s(simd.sub_f64s(*before, *behind), *gain, *v);
            }
            return 0.0;
        };
        let (decays, _) = S::as_simd_f64s(&decay[..active]);
        let (dampings, _) = S::as_simd_f64s(&model.damping_kg_per_s[..active]);
        let mut lost = PartialSums::new(simd);
        for (i, (((v, gain), (before, behind)), (decay, damping))) in
            kicks.zip(decays.iter().zip(dampings)).enumerate()
        {
            let old = *v;
            *v = simd.mul_add_f64s(simd.sub_f64s(*before, *behind), *gain, simd.mul_f64s(old, *decay));
            let squares = simd.mul_add_f64s(old, simd.add_f64s(old, *v), simd.mul_f64s(*v, *v));
            lost.add_product(simd, i, *damping, squares);
        }
        self.tau_s / 3.0 * lost.total()
    }
}

/// Mean of the square of a velocity that changes evenly.
fn mean_square(before: f64, after: f64) -> f64 {
    (before * before + before * after + after * after) / 3.0
}

/// The integral of exp(-rate t) over a time.
fn decayed_time_s(rate_per_s: f64, tau_s: f64) -> f64 {
    if rate_per_s > 0.0 { -(-rate_per_s * tau_s).exp_m1() / rate_per_s } else { tau_s }
}

/// The flow of two masses with a dashpot between them and one to ground, v' = (F - D v) / m with constant F: with A = M^-1 D,
/// v(t) = exp(-A t) v + (integral of exp(-A s)) M^-1 F. Both are worked out for M^(-1/2) D M^(-1/2), a symmetric matrix.
#[derive(Debug)]
struct Pair {
    contact_kg_per_s: f64,
    decay: [[f64; 2]; 2],
    gain_s_per_kg: [[f64; 2]; 2],
}

impl Pair {
    fn new(model: &Model<'_>, contact_kg_per_s: f64, tau_s: f64) -> Self {
        let [m_0, m_1] = [model.mass_kg[0], model.mass_kg[1]];
        let a = (contact_kg_per_s + model.damping_kg_per_s[0]) / m_0;
        let b = -contact_kg_per_s / (m_0 * m_1).sqrt();
        let d = (contact_kg_per_s + model.damping_kg_per_s[1]) / m_1;
        let angle = 0.5 * (2.0 * b).atan2(a - d);
        let (sine, cosine) = angle.sin_cos();
        let middle = 0.5 * (a + d);
        let half = (0.25 * (a - d) * (a - d) + b * b).sqrt();
        // The smaller rate by the determinant, for the difference would cancel.
        let large = middle + half;
        let rates_per_s = [large, (a * d - b * b).max(0.0) / large];
        let of_matrix = |f: fn(f64, f64) -> f64| {
            let [large, small] = rates_per_s.map(|rate| f(rate, tau_s));
            let cross = (large - small) * sine * cosine;
            [
                [large * cosine * cosine + small * sine * sine, cross],
                [cross, large * sine * sine + small * cosine * cosine],
            ]
        };
        let (decay, gain_s) = (of_matrix(|rate, tau| (-rate * tau).exp()), of_matrix(decayed_time_s));
        let roots = [m_0.sqrt(), m_1.sqrt()];
        let each = |value: &dyn Fn(usize, usize) -> f64| {
            std::array::from_fn(|i| std::array::from_fn(|j| value(i, j)))
        };
        Self {
            contact_kg_per_s,
            decay: each(&|i, j| decay[i][j] * roots[j] / roots[i]),
            gain_s_per_kg: each(&|i, j| gain_s[i][j] / (roots[i] * roots[j])),
        }
    }

    fn apply(&self, v_m_per_s: [f64; 2], net_n: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|i| {
            let row = (0..2).map(|j| self.decay[i][j] * v_m_per_s[j] + self.gain_s_per_kg[i][j] * net_n[j]);
            row.sum()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the matrix of a step of x'' = -omega^2 x.
    fn trace(of: &Composition, omega_dt: f64) -> f64 {
        let end = |mut x: f64, mut v: f64| {
            for [drift, kick] in of.parts {
                x += drift * omega_dt * v;
                v -= kick * omega_dt * x;
            }
            (x + of.last_drift * omega_dt * v, v)
        };
        end(1.0, 0.0).0 + end(0.0, 1.0).1
    }

    #[test]
    fn compositions_are_stable_up_to_their_bound() {
        for composition in [&EULER, &VERLET, &FOURTH, &SIXTH] {
            let bound = composition.stable_oscillation;
            // Thousandths of the bound, and a thousandth beyond it.
            assert!((1..=1000).all(|i| trace(composition, 1e-3 * f64::from(i) * bound).abs() <= 2.0 + 1e-12));
            assert!(trace(composition, bound + 1e-3).abs() > 2.0, "{bound}");
        }
    }
}
