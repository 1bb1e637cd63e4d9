//! Symplectic compositions: Euler, Verlet, and Blanes and Moan's of order 4 and 6.

use pulp::Simd;

use super::{
    kick::Kick,
    step::{Integrator, LocalError, TimeStep},
};
use crate::{
    equations::{force_row::ForceRow, model::ChainModel, state::ChainState},
    lanes::{self, PADDING},
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

impl Composition {
    /// The first part whose kick is as long as that of this one.
    fn first_of_length(&self, part: usize) -> usize {
        let [_, length] = self.parts[part];
        self.parts.iter().position(|[_, other]| other.to_bits() == length.to_bits()).unwrap_or(part)
    }
}

/// A composition with its work space.
#[derive(Debug)]
pub(crate) struct Symplectic {
    composition: &'static Composition,
    /// Forces at the start and at the last kick.
    start_n: ForceRow,
    force_n: ForceRow,
    /// Of each part of the composition that is the first with a kick of its length.
    kicks: Vec<Kick>,
    evaluations: u64,
}

impl Symplectic {
    pub(super) fn new(composition: &'static Composition, model: &ChainModel<'_>) -> Self {
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

    /// Kicks the velocities of `to`, or those that it starts from, and books what the dampers took.
    #[inline(always)]
    fn kick<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, at: KickAt<'_>, to: &mut ChainState) {
        let KickAt { part, time_s, tau_s, from } = at;
        let force_n = if part == 0 && self.starts_with_kick() { &self.start_n } else { &self.force_n };
        let kick = &mut self.kicks[self.composition.first_of_length(part)];
        kick.prepare(model, tau_s);
        to.lost_j += kick.apply(simd, model, force_n, from, to);
        if model.is_imposed() {
            model.impose(time_s, &mut to.x_m, &mut to.v_m_per_s);
            to.lost_j += tau_s * force_n.net_n(0) * to.v_m_per_s[0];
        }
    }
}

/// A kick's number among those of the composition, its time and length, and the velocities that it starts from where they are not
/// those that it changes.
#[derive(Clone, Copy)]
struct KickAt<'a> {
    part: usize,
    time_s: f64,
    tau_s: f64,
    from: Option<&'a [f64]>,
}

impl Integrator for Symplectic {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, from: &ChainState, continued: bool) {
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
    fn advance<S: Simd>(
        &mut self,
        simd: S,
        model: &ChainModel<'_>,
        from: &ChainState,
        step: TimeStep,
        to: &mut ChainState,
    ) {
        let TimeStep { time_s, h_s } = step;
        to.lost_j = from.lost_j;
        // The first drift and the first kick take over what they start from.
        let (mut x_m, mut v_m_per_s) = (Some(&*from.x_m), Some(&*from.v_m_per_s));
        let mut drifted = 0.0;
        for (part, &[drift, kick]) in self.composition.parts.iter().enumerate() {
            if part > 0 || !self.starts_with_kick() {
                drifted += drift;
                go(simd, x_m.take(), v_m_per_s, drift * h_s, to);
                model.impose(time_s + drifted * h_s, &mut to.x_m, &mut to.v_m_per_s);
                self.evaluations += 1;
                model.spring_forces(simd, &to.x_m, to.touching, from.active, &mut self.force_n);
            }
            let (time_s, tau_s) = (time_s + drifted * h_s, kick * h_s);
            self.kick(simd, model, KickAt { part, time_s, tau_s, from: v_m_per_s.take() }, to);
        }
        if !self.ends_with_kick() {
            go(simd, x_m, None, self.composition.last_drift * h_s, to);
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

/// The drift: the positions of `to`, or those that they start from, move on for a time, along its velocities or others.
#[inline(always)]
fn go<S: Simd>(simd: S, x_m: Option<&[f64]>, v_m_per_s: Option<&[f64]>, tau_s: f64, to: &mut ChainState) {
    let active = to.active;
    let velocities = lanes::blocks(&v_m_per_s.unwrap_or(&to.v_m_per_s)[..active]);
    let places = to.x_m[..active].as_chunks_mut::<PADDING>().0.iter_mut().zip(velocities);
    match x_m {
        Some(x_m) => {
            for ((x, v), from) in places.zip(lanes::blocks(&x_m[..active])) {
                go_block(simd, tau_s, from, v, x);
            }
        }
        None => {
            for (x, v) in places {
                let from = *x;
                go_block(simd, tau_s, &from, v, x);
            }
        }
    }
}

#[inline(always)]
fn go_block<S: Simd>(
    simd: S,
    tau_s: f64,
    from_m: &[f64; PADDING],
    v_m_per_s: &[f64; PADDING],
    to_m: &mut [f64; PADDING],
) {
    let tau = simd.splat_f64s(tau_s);
    let (from, v) = (S::as_simd_f64s(from_m).0, S::as_simd_f64s(v_m_per_s).0);
    for (i, to) in S::as_mut_simd_f64s(to_m).0.iter_mut().enumerate() {
        *to = simd.mul_add_f64s(tau, v[i], from[i]);
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
