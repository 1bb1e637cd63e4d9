//! Where searches begin: at the model's own dampings, at one that another fit found, or where a poorer problem has its minimum.

use nalgebra::DVector;

use super::{NO_STRIKER_DAMPING, TrackResiduals};
use crate::damping::{N_DAMPINGS, STARTS, critical_kg_per_s, mean_damping_kg_per_s};
use crate::error::FitError;
use crate::least_squares::{Own, Unknowns};
use crate::quantity::Quantity;

impl TrackResiduals<'_> {
    /// Where a search begins: factors on the model's c_d and c_s, and first guesses of the impacts.
    pub(in crate::tracks) fn start(
        &self,
        impact_times_s: &[f64],
        factors: [f64; N_DAMPINGS],
    ) -> Result<Unknowns, FitError> {
        let stated = [mean_damping_kg_per_s(&self.model.chain), self.striker_damping_kg_per_s()?];
        let of_striker = if self.model.is_let_go() { 1.0 } else { factors[1] };
        Ok(self.start_from(impact_times_s, [factors[0] * stated[0], of_striker * stated[1]]))
    }

    /// Every usual start, by first guesses of the impacts.
    pub(in crate::tracks) fn starts(&self, impact_times_s: &[f64]) -> Result<Vec<Unknowns>, FitError> {
        STARTS.into_iter().map(|factors| self.start(impact_times_s, factors)).collect()
    }

    /// As [`Self::start`], at a c_d in kilograms per second, which the model may state as none, and its own c_s.
    pub(in crate::tracks) fn start_at_c_d(
        &self,
        impact_times_s: &[f64],
        c_d_kg_per_s: f64,
    ) -> Result<Unknowns, FitError> {
        Ok(self.start_from(impact_times_s, [c_d_kg_per_s, self.striker_damping_kg_per_s()?]))
    }

    /// The stated damping of the striker's contact; what stands for it where there is no striker.
    fn striker_damping_kg_per_s(&self) -> Result<f64, FitError> {
        match self.model.is_let_go() {
            true => Ok(NO_STRIKER_DAMPING * critical_kg_per_s(&self.model.chain)),
            false => Ok(self.model.striker()?.damping_kg_per_s),
        }
    }

    fn start_from(&self, impact_times_s: &[f64], dampings_kg_per_s: [f64; N_DAMPINGS]) -> Unknowns {
        let mut shared = dampings_kg_per_s.to_vec();
        shared.extend(self.quantities().map(Quantity::usual));
        let velocity_m_per_s = self.model.striker_velocity_m_per_s.value;
        let impact = |r: usize| impact_times_s.get(r).copied().unwrap_or(0.0);
        let own = (0..self.observations.len()).map(|r| Own::new(velocity_m_per_s, impact(r))).collect();
        Unknowns { shared: DVector::from_vec(shared), own }
    }

    /// Values of a poorer problem's unknowns as this one has them, of so many quantities that are known and so many that are asked for; what is new
    /// stands behind its like, at its usual value.
    pub(in crate::tracks) fn extended(&self, at: &Unknowns, (n_known, n_asked): (usize, usize)) -> Unknowns {
        let mut before = at.shared.iter().copied();
        let mut shared: Vec<f64> = before.by_ref().take(N_DAMPINGS + n_known).collect();
        shared.extend(self.model.priors.iter().skip(n_known).map(|prior| prior.quantity.usual()));
        shared.extend(before);
        shared.extend(self.asked.iter().skip(n_asked).map(|quantity| quantity.usual()));
        Unknowns { shared: DVector::from_vec(shared), own: at.own.clone() }
    }
}
