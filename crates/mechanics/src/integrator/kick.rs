//! The kick of a symplectic splitting: forces that stand still, with the exact flow of the dampers.

use pulp::Simd;

use crate::{
    chain::{force_row::ForceRow, model::ChainModel, state::ChainState},
    contact::striker::StrikerContact,
    lanes::{PartialSums, row::AlignedRow},
};

/// The flow of forces that stand still and dampers over a time, worked out for one time at a time.
#[derive(Debug, Default)]
pub(super) struct Kick {
    tau_s: f64,
    /// Velocities keep this part, where there are dampers to ground.
    decay: Option<AlignedRow>,
    /// Velocities gain this times the force: the integral of the decay over the mass; the time over the mass without
    /// dampers.
    gain_s_per_kg: AlignedRow,
    /// Strikers and the bodies that they touch, where their contacts are damped.
    pairs: [Option<DampedPair>; 2],
}

impl Kick {
    pub(super) fn prepare(&mut self, model: &ChainModel<'_>, tau_s: f64) {
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
        self.gain_s_per_kg = AlignedRow::padded(flows.iter().map(|flow| flow.1), flows.len());
        self.decay = damped.then(|| AlignedRow::padded(flows.iter().map(|flow| flow.0), flows.len()));
        self.pairs = model.strikers.each_ref().map(|contact| {
            let damped = contact.as_ref().filter(|contact| contact.damping_kg_per_s > 0.0)?;
            Some(DampedPair::new(model, damped, tau_s))
        });
    }

    /// Kicks the velocities; returns what the dampers took, in joules.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(
        &self,
        simd: S,
        model: &ChainModel<'_>,
        force_n: &ForceRow,
        state: &mut ChainState,
    ) -> f64 {
        let is_reached = |pair: &&DampedPair| pair.first + 1 < state.active;
        let touching = self.pairs.iter().zip(state.touching);
        let mut pairs = touching.map(|(pair, touches)| pair.as_ref().filter(|_| touches).filter(is_reached));
        let pairs = [pairs.next().flatten(), pairs.next().flatten()];
        let before = pairs.map(|pair| pair.map_or([0.0; 2], |pair| pair.velocities_m_per_s(state)));
        let mut lost_j = self.apply_to_row(simd, model, force_n, state);
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
        model: &ChainModel<'_>,
        force_n: &ForceRow,
        state: &mut ChainState,
    ) -> f64 {
        let active = state.active;
        let (before, behind) = force_n.beside::<S>(active);
        let (gains, _) = S::as_simd_f64s(&self.gain_s_per_kg[..active]);
        let (velocities, _) = S::as_mut_simd_f64s(&mut state.v_m_per_s[..active]);
        let Some(decay) = &self.decay else {
            let gaps = before.iter().zip(behind);
            for ((v, gain), (before, behind)) in velocities.iter_mut().zip(gains).zip(gaps) {
                *v = simd.mul_add_f64s(simd.sub_f64s(*before, *behind), *gain, *v);
            }
            return 0.0;
        };
        let (decays, _) = S::as_simd_f64s(&decay[..active]);
        let (dampings, _) = S::as_simd_f64s(&model.damping_kg_per_s[..active]);
        let n_vectors = PartialSums::<S>::VECTORS;
        let gaps = before.chunks_exact(n_vectors).zip(behind.chunks_exact(n_vectors));
        let dampers = decays.chunks_exact(n_vectors).zip(dampings.chunks_exact(n_vectors));
        let kicks = velocities.chunks_exact_mut(n_vectors).zip(gains.chunks_exact(n_vectors));
        let mut lost = PartialSums::new(simd);
        for (((v, gain), (before, behind)), (decay, damping)) in kicks.zip(gaps).zip(dampers) {
            for i in 0..n_vectors {
                let (old, net_n) = (v[i], simd.sub_f64s(before[i], behind[i]));
                v[i] = simd.mul_add_f64s(net_n, gain[i], simd.mul_f64s(old, decay[i]));
                let squares = simd.mul_add_f64s(old, simd.add_f64s(old, v[i]), simd.mul_f64s(v[i], v[i]));
                lost.add_product(simd, i, damping[i], squares);
            }
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

    fn velocities_m_per_s(&self, state: &ChainState) -> [f64; 2] {
        [state.v_m_per_s[self.first], state.v_m_per_s[self.first + 1]]
    }

    fn apply(&self, v_m_per_s: [f64; 2], net_n: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|i| {
            let row = (0..2).map(|j| self.decay[i][j] * v_m_per_s[j] + self.gain_s_per_kg[i][j] * net_n[j]);
            row.sum()
        })
    }
}
