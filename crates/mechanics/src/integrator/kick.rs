//! The kick of a symplectic splitting: forces that stand still, with the exact flow of the dampers.

use pulp::Simd;

use crate::{
    contact::striker::StrikerContact,
    equations::{force_row::ForceRow, model::ChainModel, state::ChainState},
    lanes::{self, PADDING, PartialSums, columns::Columns},
};

/// The flow of forces that stand still and dampers over a time, worked out for one time at a time.
#[derive(Debug, Default)]
pub(super) struct Kick {
    tau_s: f64,
    /// Velocities gain this times the force, in seconds per kilogram: the integral of the decay over the mass; the time over the
    /// mass without dampers.
    gain: Option<Columns<1>>,
    /// The same, the part that velocities keep, and the damping in kilograms per second, where there are dampers to ground.
    damped_gain: Option<Columns<3>>,
    /// Strikers and the bodies that they touch, where their contacts are damped.
    pairs: [Option<DampedPair>; 2],
}

impl Kick {
    pub(super) fn prepare(&mut self, model: &ChainModel<'_>, tau_s: f64) {
        let is_prepared = self.gain.is_some() || self.damped_gain.is_some();
        if is_prepared && self.tau_s.to_bits() == tau_s.to_bits() {
            return;
        }
        self.tau_s = tau_s;
        let flow = |[damping_kg_per_s, inverse_mass]: [f64; 2]| {
            let rate_per_s = inverse_mass * damping_kg_per_s;
            let gain_s_per_kg = decayed_time_s(rate_per_s, tau_s) * inverse_mass;
            [gain_s_per_kg, (-rate_per_s * tau_s).exp(), damping_kg_per_s]
        };
        let damped = model.damping_kg_per_s.iter().any(|&c| c > 0.0);
        self.gain = (!damped).then(|| model.of_masses.map(|mass| [flow(mass)[0]]));
        self.damped_gain = damped.then(|| model.of_masses.map(flow));
        self.pairs = model.strikers.each_ref().map(|contact| {
            let damped = contact.as_ref().filter(|contact| contact.damping_kg_per_s > 0.0)?;
            Some(DampedPair::new(model, damped, tau_s))
        });
    }

    /// Kicks the velocities of a state, or takes those of another time, `from`, and fills in what they are after it; returns what the
    /// dampers took, in joules.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(
        &self,
        simd: S,
        model: &ChainModel<'_>,
        force_n: &ForceRow,
        from: Option<&[f64]>,
        state: &mut ChainState,
    ) -> f64 {
        let is_reached = |pair: &&DampedPair| pair.first + 1 < state.active;
        let touching = self.pairs.iter().zip(state.touching);
        let mut pairs = touching.map(|(pair, touches)| pair.as_ref().filter(|_| touches).filter(is_reached));
        let pairs = [pairs.next().flatten(), pairs.next().flatten()];
        let velocities = from.unwrap_or(&state.v_m_per_s);
        let before = pairs.map(|pair| pair.map_or([0.0; 2], |pair| pair.velocities_m_per_s(velocities)));
        let mut lost_j = self.apply_to_row(simd, force_n, from, state);
        for (pair, before) in pairs.into_iter().zip(before) {
            let Some(pair) = pair else { continue };
            let after = pair.apply(before, [force_n.net_n(pair.first), force_n.net_n(pair.first + 1)]);
            for (i, before) in before.into_iter().enumerate() {
                let mass = pair.first + i;
                // The row's kick knows nothing of the pair's dashpot.
                let changes = [after[i], state.v_m_per_s[mass]].map(|after| mean_square(before, after));
                lost_j += self.tau_s * model.damping_kg_per_s[mass] * (changes[0] - changes[1]);
                state.v_m_per_s[mass] = after[i];
            }
            lost_j +=
                self.tau_s * pair.contact_kg_per_s * mean_square(before[0] - before[1], after[0] - after[1]);
        }
        lost_j
    }

    /// [`Kick::apply`] where only dashpots to ground act.
    #[inline(always)]
    fn apply_to_row<S: Simd>(
        &self,
        simd: S,
        force_n: &ForceRow,
        from: Option<&[f64]>,
        state: &mut ChainState,
    ) -> f64 {
        let active = state.active;
        let n_blocks = active / PADDING;
        let forces_n = force_n.beside(active).map(|row| &row[..n_blocks]);
        let velocities = &mut state.v_m_per_s[..active].as_chunks_mut::<PADDING>().0[..n_blocks];
        match from {
            Some(from) => {
                let from = &lanes::blocks(&from[..active])[..n_blocks];
                self.change_velocities::<S, true>(simd, forces_n, from, velocities)
            }
            None => self.change_velocities::<S, false>(simd, forces_n, &[], velocities),
        }
    }

    /// [`Kick::apply_to_row`] from the velocities themselves, or from those of another row that `TAKES` says to take.
    #[inline(always)]
    fn change_velocities<S: Simd, const TAKES: bool>(
        &self,
        simd: S,
        [before, behind]: [&[[f64; PADDING]]; 2],
        from: &[[f64; PADDING]],
        velocities: &mut [[f64; PADDING]],
    ) -> f64 {
        let n_blocks = velocities.len();
        let n_vectors = PartialSums::<S>::VECTORS;
        if let Some(gains) = &self.gain {
            gains.for_each_block(
                simd,
                n_blocks,
                #[inline(always)]
                |block, coefficients| {
                    let (before, behind) =
                        (S::as_simd_f64s(&before[block]).0, S::as_simd_f64s(&behind[block]).0);
                    let v = S::as_mut_simd_f64s(&mut velocities[block]).0;
                    for i in 0..n_vectors {
                        let [gain] = coefficients[i];
                        let old = if TAKES { S::as_simd_f64s(&from[block]).0[i] } else { v[i] };
                        v[i] = simd.mul_add_f64s(simd.sub_f64s(before[i], behind[i]), gain, old);
                    }
                },
            );
        }
        let mut lost = PartialSums::new(simd);
        if let Some(gains) = &self.damped_gain {
            gains.for_each_block(
                simd,
                n_blocks,
                #[inline(always)]
                |block, coefficients| {
                    let (before, behind) =
                        (S::as_simd_f64s(&before[block]).0, S::as_simd_f64s(&behind[block]).0);
                    let v = S::as_mut_simd_f64s(&mut velocities[block]).0;
                    for i in 0..n_vectors {
                        let [gain, decay, damping] = coefficients[i];
                        let old = if TAKES { S::as_simd_f64s(&from[block]).0[i] } else { v[i] };
                        let net_n = simd.sub_f64s(before[i], behind[i]);
                        let new = simd.mul_add_f64s(net_n, gain, simd.mul_f64s(old, decay));
                        let squares =
                            simd.mul_add_f64s(old, simd.add_f64s(old, new), simd.mul_f64s(new, new));
                        lost.add_product(simd, i, damping, squares);
                        v[i] = new;
                    }
                },
            );
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
struct DampedPair {
    /// The first of the two masses in the row.
    first: usize,
    contact_kg_per_s: f64,
    decay: [[f64; 2]; 2],
    gain_s_per_kg: [[f64; 2]; 2],
}

impl DampedPair {
    fn new(model: &ChainModel<'_>, contact: &StrikerContact, tau_s: f64) -> Self {
        let (first, contact_kg_per_s) = (contact.gap, contact.damping_kg_per_s);
        let [m_0, m_1] = [model.mass_kg[first], model.mass_kg[first + 1]];
        let a = (contact_kg_per_s + model.damping_kg_per_s[first]) / m_0;
        let b = -contact_kg_per_s / (m_0 * m_1).sqrt();
        let d = (contact_kg_per_s + model.damping_kg_per_s[first + 1]) / m_1;
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
            first,
            contact_kg_per_s,
            decay: each(&|i, j| decay[i][j] * roots[j] / roots[i]),
            gain_s_per_kg: each(&|i, j| gain_s[i][j] / (roots[i] * roots[j])),
        }
    }

    fn velocities_m_per_s(&self, of_row: &[f64]) -> [f64; 2] {
        [of_row[self.first], of_row[self.first + 1]]
    }

    fn apply(&self, v_m_per_s: [f64; 2], net_n: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|i| {
            let row = (0..2).map(|j| self.decay[i][j] * v_m_per_s[j] + self.gain_s_per_kg[i][j] * net_n[j]);
            row.sum()
        })
    }
}
