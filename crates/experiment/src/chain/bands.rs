//! The bands of the chain that an experiment states.

use std::f64::consts::PI;

use chainwave_mechanics::UnitCell;

use crate::configuration::Experiment;
use crate::error::Error;

impl Experiment {
    /// The bodies and gaps that the chain repeats; none where it repeats none, as a graded one does not.
    ///
    /// # Errors
    /// Masses or contact laws that make no sense.
    pub fn unit_cell(&self) -> Result<Option<UnitCell>, Error> {
        let n_bodies = self.chain.n_bodies;
        let ground_n_per_m = self.ground_at_rest_n_per_m()?;
        Ok(UnitCell::of(&self.chain.masses_kg()?, &self.contact.contacts(n_bodies)?, &ground_n_per_m))
    }

    /// Dispersion curves of small waves, one for each band, at phases from body to body: those of the cell that the chain repeats, or else of
    /// its mean ([`Experiment::linear_chain`]).
    ///
    /// # Errors
    /// As [`Experiment::unit_cell`].
    pub fn bands(&self, kappa_rad: &[f64]) -> Result<Vec<Vec<(f64, f64)>>, Error> {
        let at = |kappa: &f64, of: &dyn Fn(f64) -> f64| (*kappa, of(*kappa));
        let Some(cell) = self.unit_cell()? else {
            let mean = self.linear_chain()?;
            return Ok(vec![
                kappa_rad.iter().map(|kappa| at(kappa, &|rad| mean.frequency_hz(rad))).collect(),
            ]);
        };
        let frequencies: Vec<Vec<f64>> = kappa_rad.iter().map(|kappa| cell.frequencies_hz(*kappa)).collect();
        let band = |index: usize| {
            kappa_rad.iter().zip(&frequencies).map(|(kappa, all)| (*kappa, all[index])).collect()
        };
        Ok((0..cell.n_bodies()).map(band).collect())
    }

    /// Stiffness of what holds each body to ground, where it rests, in newtons per metre.
    ///
    /// # Errors
    /// A list of another length than there are bodies, and a curve that makes no sense.
    fn ground_at_rest_n_per_m(&self) -> Result<Vec<f64>, Error> {
        let by_curve = self.ground_law()?.map_or(0.0, |law| law.stiffness_n_per_m(0.0));
        let springs = self.chain.ground_n_per_m()?;
        Ok((0..self.chain.n_bodies)
            .map(|body| springs.get(body).copied().unwrap_or(0.0) + by_curve)
            .collect())
    }

    /// Upper edge of the highest band in hertz: no small wave of a higher frequency runs down the chain. Of a chain that repeats nothing
    /// it is that of the uniform chain of its fastest body with the stiffer of its gaps, which lies above.
    ///
    /// # Errors
    /// As [`Experiment::unit_cell`].
    pub fn band_edge_hz(&self) -> Result<f64, Error> {
        if let Some(cell) = self.unit_cell()? {
            return Ok(cell.highest_hz());
        }
        let (masses_kg, contacts) = (self.chain.masses_kg()?, self.contact.contacts(self.chain.n_bodies)?);
        let ground_n_per_m = self.ground_at_rest_n_per_m()?;
        let stiffness = |gap: usize| contacts.of_gap(gap).stiffness_n_per_m(0.0);
        let edge_hz = |(body, mass_kg): (usize, &f64)| {
            let stiffer =
                stiffness(body.saturating_sub(1)).max(stiffness(body.min(masses_kg.len().saturating_sub(2))));
            ((4.0 * stiffer + ground_n_per_m[body]) / mass_kg).sqrt() / (2.0 * PI)
        };
        Ok(masses_kg.iter().enumerate().map(edge_hz).fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = include_str!("../../../../tests/small-experiment/experiment.toml");

    fn with_masses(masses: &str) -> Experiment {
        toml::from_str(&SMALL.replace("mass_kg = 0.455e-3", &format!("mass_kg = {masses}"))).unwrap()
    }

    #[test]
    fn a_uniform_chain_has_the_band_of_its_linear_chain() {
        let uniform = with_masses("0.455e-3");
        let linear = uniform.linear_chain().unwrap();
        // Rounding of roots.
        assert!((uniform.band_edge_hz().unwrap() / linear.band_edge_hz() - 1.0).abs() < 1e-12);
        let bands = uniform.bands(&[-1.0, 0.5]).unwrap();
        assert_eq!(bands.len(), 1);
        assert!((bands[0][1].1 / linear.frequency_hz(0.5) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_diatomic_chain_has_two_bands_and_a_graded_one_its_mean() {
        let diatomic = with_masses("{ repeat = [0.455e-3, 1.365e-3] }");
        assert_eq!(diatomic.bands(&[0.0, 0.4]).unwrap().len(), 2);
        // sqrt(2 k (1/m + 1/M)) of the optical band's top, where the mean chain ends at 2 sqrt(k / mean mass).
        let k = diatomic.linear_chain().unwrap().stiffness_n_per_m;
        let expected_hz = (2.0 * k * (0.455e-3_f64.recip() + 1.365e-3_f64.recip())).sqrt() / (2.0 * PI);
        assert!((diatomic.band_edge_hz().unwrap() / expected_hz - 1.0).abs() < 1e-12);

        let graded = with_masses("{ grade = [0.6e-3, 0.3e-3] }");
        assert_eq!(graded.bands(&[0.4]).unwrap().len(), 1);
        let lightest_hz = (k / 0.3e-3).sqrt() / PI;
        assert!((graded.band_edge_hz().unwrap() / lightest_hz - 1.0).abs() < 1e-12);
    }
}
