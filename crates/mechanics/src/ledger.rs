use crate::{
    model::{Model, State},
    rk4::Rk4,
};

/// What is booked at the start of every step: energies, their peaks, and how far the gaps were stretched.
#[derive(Debug)]
pub(crate) struct Ledger {
    /// Peak potential energy of each gap between bodies, in joules.
    pub(crate) psi_max_j: Vec<f64>,
    /// Times a gap between bodies passed beyond the law's range in tension.
    pub(crate) tension_events: u64,
    /// Smallest and largest overlap of any gap that carries force, in metres.
    pub(crate) overlap_range_m: [f64; 2],
    gaps: Vec<Gap>,
    initial_j: Option<f64>,
    largest_j: f64,
    drift_j: f64,
}

/// A gap at the step before: energy, its rate, and whether the tension limit was passed.
#[derive(Debug, Clone, Copy)]
struct Gap {
    energy_j: f64,
    power_w: f64,
    beyond_limit: bool,
}

impl Ledger {
    pub(crate) fn new(model: &Model) -> Self {
        Self {
            psi_max_j: vec![0.0; model.n_gaps()],
            tension_events: 0,
            overlap_range_m: [0.0; 2],
            gaps: vec![Gap { energy_j: 0.0, power_w: 0.0, beyond_limit: false }; model.n_gaps()],
            initial_j: None,
            largest_j: 0.0,
            drift_j: 0.0,
        }
    }

    /// Books the gaps at `state`, for which `rk4` holds forces and energies, `elapsed_s` after the last booking.
    pub(crate) fn book_gaps(&mut self, model: &Model, rk4: &Rk4, state: &State, elapsed_s: f64) {
        let first = model.first_gap();
        let limit_m = model.kernel.tension_limit_m();
        let [mut least, mut most] = self.overlap_range_m;
        let gaps = self.gaps.iter_mut().zip(&mut self.psi_max_j);
        for (g, (gap, psi_max)) in (first..).zip(gaps) {
            let overlap_m = state.x_m[g - 1] - state.x_m[g];
            let closing = state.v_m_per_s[g - 1] - state.v_m_per_s[g];
            least = least.min(overlap_m);
            most = most.max(overlap_m);
            let now = Gap {
                energy_j: rk4.energy_j[g],
                power_w: rk4.start.force_n[g] * closing,
                beyond_limit: overlap_m < limit_m,
            };
            self.tension_events += u64::from(now.beyond_limit && !gap.beyond_limit);
            *psi_max = psi_max.max(now.energy_j).max(peak_between(*gap, now, elapsed_s));
            *gap = now;
        }
        for overlap_m in model.outer_overlaps_m(state).into_iter().flatten() {
            least = least.min(overlap_m);
            most = most.max(overlap_m);
        }
        self.overlap_range_m = [least, most];
    }

    /// Books the whole energy at `state`, and returns what the masses and gaps hold, in joules.
    pub(crate) fn book_total(&mut self, model: &Model, rk4: &Rk4, state: &State) -> f64 {
        let kinetic: f64 = model.mass_kg.iter().zip(&state.v_m_per_s).map(|(m, v)| 0.5 * m * v * v).sum();
        let held_j = kinetic + rk4.energy_j.iter().sum::<f64>();
        let initial_j = *self.initial_j.get_or_insert(held_j);
        self.largest_j = self.largest_j.max(held_j);
        self.drift_j = self.drift_j.max((held_j + state.lost_j - initial_j).abs());
        held_j
    }

    /// Largest change of held and lost energy, over the largest energy held; the latter is the initial energy, except
    /// for an imposed motion, which feeds energy in.
    pub(crate) fn energy_drift(&self) -> f64 {
        if self.largest_j > 0.0 { self.drift_j / self.largest_j } else { self.drift_j }
    }
}

/// The maximum of the cubic through two bookings where the energy rises at the first and falls at the second, else the
/// first energy. It makes the peak independent of where the steps fall, to fourth order in the step.
fn peak_between(before: Gap, now: Gap, elapsed_s: f64) -> f64 {
    if before.power_w <= 0.0 || now.power_w >= 0.0 {
        return before.energy_j;
    }
    let (rise, fall) = (elapsed_s * before.power_w, elapsed_s * now.power_w);
    let change = now.energy_j - before.energy_j;
    let (a, b) = (3.0 * (rise + fall) - 6.0 * change, 6.0 * change - 4.0 * rise - 2.0 * fall);
    let s = 2.0 * rise / ((b * b - 4.0 * a * rise).max(0.0).sqrt() - b);
    before.energy_j + s * (rise + s * (0.5 * b + s * a / 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_of_a_cubic_is_found() {
        // e(t) = 1 + 2 t - t^2 - t^3 rises until t = (sqrt(7) - 1) / 3.
        let energy = |t: f64| 1.0 + t * (2.0 - t * (1.0 + t));
        let gap =
            |t: f64| Gap { energy_j: energy(t), power_w: 2.0 - t * (2.0 + 3.0 * t), beyond_limit: false };
        let peak = energy((7.0_f64.sqrt() - 1.0) / 3.0);
        assert!((peak_between(gap(0.0), gap(1.0), 1.0) - peak).abs() < 1e-15);
        assert!((peak_between(gap(0.5), gap(0.7), 0.2) - peak).abs() < 1e-15);
        assert!((peak_between(gap(0.0), gap(0.2), 0.2) - energy(0.0)).abs() == 0.0);
    }
}
