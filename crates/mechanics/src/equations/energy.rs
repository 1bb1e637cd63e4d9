//! Energy of a row of masses and its gaps.

use pulp::{Simd, WithSimd};

use super::{model::ChainModel, state::ChainState};
use crate::lanes::{self, PADDING};

impl ChainModel<'_> {
    /// Potential and kinetic energy in joules.
    pub(crate) fn energy_j(&self, state: &ChainState) -> f64 {
        chainwave_vectors::dispatch(Energy { model: self, state })
    }
}

struct Energy<'a> {
    model: &'a ChainModel<'a>,
    state: &'a ChainState,
}

impl WithSimd for Energy<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { model, state } = self;
        let active = state.active;
        let mut energy_j = vec![0.0; active];
        model.gaps.energies(simd, &state.x_m, &mut energy_j);
        model.end(state.touching, &mut energy_j);
        if let Some(ground) = &model.ground {
            let places = energy_j.iter_mut().zip(state.x_m.iter()).enumerate();
            places.for_each(|(mass, (energy, x))| *energy += ground.energy_j(mass, *x));
        }
        let mut sums = [0.0; PADDING];
        let masses = model.mass_kg.as_chunks::<PADDING>().0;
        let velocities = state.v_m_per_s[..active].as_chunks::<PADDING>().0;
        let potential = energy_j.as_chunks::<PADDING>().0;
        for ((m, v), potential) in masses.iter().zip(velocities).zip(potential) {
            for i in 0..PADDING {
                sums[i] += 0.5 * m[i] * v[i] * v[i] + potential[i];
            }
        }
        lanes::total(sums)
    }
}
