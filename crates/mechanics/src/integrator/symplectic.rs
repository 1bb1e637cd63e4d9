use pulp::Simd;

use super::{Integrator, LocalError, Step};
use crate::{
    lanes::{self, PADDING},
    model::{ForceRow, Model},
    row::Row,
    state::{State, row_length},
};

/// A composition of drifts (positions move along the velocities) and kicks (velocities change by the forces).
///
/// Without dampers each part is the exact flow of a piece of the Hamiltonian, so the composition is symplectic, and its
/// energy error stays bounded. Dampers to ground and that of the striker's contact join the kick, whose flow stays exact.
#[derive(Debug)]
pub(crate) struct Composition {
    /// Drift, then kick, as fractions of the step.
    parts: &'static [[f64; 2]],
    last_drift: f64,
}

pub(crate) static EULER: Composition = Composition { parts: &[[0.0, 1.0]], last_drift: 1.0 };

/// L. Verlet, Phys. Rev. 159 (1967) 98-103.
pub(crate) static VERLET: Composition = Composition { parts: &[[0.0, 0.5], [1.0, 0.5]], last_drift: 0.0 };

/// S_6 of order 4: S. Blanes, P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313-330, table 2.
pub(crate) static FOURTH: Composition = Composition {
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

impl Composition {
    /// omega dt up to which the composition is stable for x'' = -omega^2 x: where the trace of its matrix leaves (-2, 2).
    pub(crate) fn stable_oscillation(&self) -> f64 {
        const STEP: f64 = 1e-3;
        let mut omega_dt = STEP;
        while self.trace(omega_dt).abs() <= 2.0 && omega_dt < 10.0 {
            omega_dt += STEP;
        }
        omega_dt - STEP
    }

    fn trace(&self, omega_dt: f64) -> f64 {
        let end = |mut x: f64, mut v: f64| {
            for [drift, kick] in self.parts {
                x += drift * omega_dt * v;
                v -= kick * omega_dt * x;
            }
            (x + self.last_drift * omega_dt * v, v)
        };
        end(1.0, 0.0).0 + end(0.0, 1.0).1
    }
}

/// A composition with its work space.
#[derive(Debug)]
pub(crate) struct Symplectic {
    composition: &'static Composition,
    /// Forces at the start and at the last kick.
    start_n: ForceRow,
    force_n: ForceRow,
    kicks: Vec<Kick>,
    before_m_per_s: Row,
    evaluations: u64,
}

impl Symplectic {
    pub(super) fn new(composition: &'static Composition, model: &Model<'_>) -> Self {
        let length = row_length(model.n_masses());
        Self {
            composition,
            start_n: ForceRow::new(model.n_masses()),
            force_n: ForceRow::new(model.n_masses()),
            kicks: composition.parts.iter().map(|_| Kick::default()).collect(),
            before_m_per_s: Row::zeros(length),
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
        let active = to.active;
        if kick.damped() {
            self.before_m_per_s[..active].copy_from_slice(&to.v_m_per_s[..active]);
        }
        kick.apply(simd, model, force_n, to);
        if kick.damped() {
            to.lost_j += kick.loss_j(model, &self.before_m_per_s, to);
        }
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
        to.x_m[..active].copy_from_slice(&from.x_m[..active]);
        to.v_m_per_s[..active].copy_from_slice(&from.v_m_per_s[..active]);
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
    /// Velocities keep this part; empty without dampers to ground.
    decay: Vec<f64>,
    /// Velocities gain this times the force: the integral of the decay over the mass; the time over the mass without
    /// dampers.
    gain_s_per_kg: Vec<f64>,
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
        let flows = masses.map(|(inverse_mass, c)| {
            let rate_per_s = inverse_mass * c;
            if rate_per_s.to_bits() != last.0.to_bits() {
                last = (rate_per_s, (-rate_per_s * tau_s).exp(), decayed_time_s(rate_per_s, tau_s));
            }
            (last.1, last.2 * inverse_mass)
        });
        (self.decay, self.gain_s_per_kg) = flows.unzip();
        if !damped {
            self.decay.clear();
        }
        let contact = model.striker.as_ref().filter(|contact| contact.damping_kg_per_s > 0.0);
        self.pair = contact.map(|contact| Pair::new(model, contact.damping_kg_per_s, tau_s));
    }

    fn damped(&self) -> bool {
        !self.decay.is_empty() || self.pair.is_some()
    }

    #[inline(always)]
    fn apply<S: Simd>(&self, simd: S, model: &Model<'_>, force_n: &ForceRow, state: &mut State) {
        let pair = self.pair.as_ref().filter(|_| state.touching);
        let net_n = [force_n.net_n(0), force_n.net_n(1)];
        let kicked = pair.map(|pair| pair.apply(model, [state.v_m_per_s[0], state.v_m_per_s[1]], net_n));
        let active = state.active;
        let (before, behind) = force_n.beside::<S>(active);
        let (gains, _) = S::as_simd_f64s(&self.gain_s_per_kg[..active]);
        let (velocities, _) = S::as_mut_simd_f64s(&mut state.v_m_per_s[..active]);
        let kicks = velocities.iter_mut().zip(gains).zip(before.iter().zip(behind));
        if self.decay.is_empty() {
            for ((v, gain), (before, behind)) in kicks {
                *v = simd.mul_add_f64s(simd.sub_f64s(*before, *behind), *gain, *v);
            }
        } else {
            let (decays, _) = S::as_simd_f64s(&self.decay[..active]);
            for (((v, gain), (before, behind)), decay) in kicks.zip(decays) {
                let left = simd.mul_f64s(*v, *decay);
                *v = simd.mul_add_f64s(simd.sub_f64s(*before, *behind), *gain, left);
            }
        }
        if let Some(kicked) = kicked {
            state.v_m_per_s[..2].copy_from_slice(&kicked);
        }
    }

    /// Energy that the dampers took while the velocities went from `before` to those of `state`, to second order in the
    /// decay within the kick.
    #[inline(always)]
    fn loss_j(&self, model: &Model<'_>, before: &[f64], state: &State) -> f64 {
        let third_s = self.tau_s / 3.0;
        let after = &state.v_m_per_s;
        let contact = model.striker.as_ref().filter(|_| state.touching);
        let at_contact_j = contact.map_or(0.0, |contact| {
            let (v, w) = (before[0] - before[1], after[0] - after[1]);
            third_s * contact.damping_kg_per_s * (v * v + v * w + w * w)
        });
        if self.decay.is_empty() {
            return at_contact_j;
        }
        let dampings = model.damping_kg_per_s.as_chunks::<PADDING>().0;
        let before = before[..state.active].as_chunks::<PADDING>().0;
        let after = after.as_chunks::<PADDING>().0;
        let mut sums = [0.0; PADDING];
        for (c, (v, w)) in dampings.iter().zip(before.iter().zip(after)) {
            for i in 0..PADDING {
                sums[i] += c[i] * (v[i] * v[i] + v[i] * w[i] + w[i] * w[i]);
            }
        }
        at_contact_j + third_s * lanes::total(sums)
    }
}

/// The integral of exp(-rate t) over a time.
fn decayed_time_s(rate_per_s: f64, tau_s: f64) -> f64 {
    if rate_per_s > 0.0 { -(-rate_per_s * tau_s).exp_m1() / rate_per_s } else { tau_s }
}

/// The flow of two masses with a dashpot between them and one to ground, v' = (F - D v) / m with constant F, as the
/// functions exp and its integral of M^(-1/2) D M^(-1/2), a symmetric matrix.
#[derive(Debug)]
struct Pair {
    decay: [[f64; 2]; 2],
    gain_s: [[f64; 2]; 2],
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
        Self { decay: of_matrix(|rate, tau| (-rate * tau).exp()), gain_s: of_matrix(decayed_time_s) }
    }

    fn apply(&self, model: &Model<'_>, v_m_per_s: [f64; 2], net_n: [f64; 2]) -> [f64; 2] {
        let roots = [model.mass_kg[0].sqrt(), model.mass_kg[1].sqrt()];
        let v: [f64; 2] = std::array::from_fn(|i| v_m_per_s[i] * roots[i]);
        let push: [f64; 2] = std::array::from_fn(|i| net_n[i] / roots[i]);
        std::array::from_fn(|i| {
            let row = (0..2).map(|j| self.decay[i][j] * v[j] + self.gain_s[i][j] * push[j]);
            row.sum::<f64>() / roots[i]
        })
    }
}
