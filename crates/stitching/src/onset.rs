//! The onset of the struck body, from which the drives' scale and the delay by the drive are read.

use crate::drive_scatter::contradicted;
use crate::error::StitchingError;
use crate::fitted::smooth_velocities;
use crate::gauge::{Gauge, Onset, OnsetTells, ReadingErrors, noise_that_counts};
use crate::rest::Displacement;
use crate::settings::FirstBody;
use crate::state::{AlignmentState, Scale};

impl AlignmentState<'_> {
    /// The exchange of drives and offsets that the onset asks for, with the stated scatter where there is one.
    pub(crate) fn gauge(&self, scatter: Option<f64>) -> Result<OnsetTells<Gauge>, StitchingError> {
        Ok(match self.onset()? {
            OnsetTells::Of(onset) => Gauge::told_by(onset, &self.drive, scatter),
            OnsetTells::Nothing => OnsetTells::Nothing,
            OnsetTells::NothingButNoise => OnsetTells::NothingButNoise,
        })
    }

    /// The onset of the first body that three recordings saw.
    fn onset(&self) -> Result<OnsetTells<Onset>, StitchingError> {
        let seen = |row: usize| {
            let of_row = |one: &&Vec<Displacement>| one.iter().any(|displacement| displacement.row == row);
            self.displacements.iter().filter(of_row).count()
        };
        let Some(row) = (0..self.settings.n_bodies).find(|row| seen(*row) > 2) else {
            return Ok(OnsetTells::Nothing);
        };
        let mut of_body = self.responses_of(row)?;
        // What is prescribed is body 1's motion, and nobody else's.
        let first_body = if row == 0 { self.settings.first_body } else { FirstBody::Free };
        // Before the gauge is fixed once velocities are those of single times, whose noise may hide what those of several tell.
        let mut smoothed = of_body.clone();
        if self.scale != Scale::True {
            smooth_velocities(&mut smoothed);
        }
        let noise = noise_that_counts(&smoothed, first_body, self.end_of_rest());
        if noise.is_some() {
            of_body = smoothed;
        }
        let of_recording = |displacements: &Vec<Displacement>| {
            let own = displacements.iter().find(|displacement| displacement.row == row);
            own.map_or(0.0, |displacement| displacement.rest_sigma_m)
        };
        let rest_sigma_m: Vec<f64> = self.displacements.iter().map(of_recording).collect();
        let scatter_ratio = self.scatter_ratio(&of_body, |_| true).max(1.0);
        let errors = ReadingErrors { rest_sigma_m: &rest_sigma_m, scatter_ratio, noise };
        let model = self.settings.stated_responses.get(row);
        Ok(Onset::read((&of_body, first_body), model, &self.drive, &errors, self.frame_interval_s))
    }

    /// What the reader should know where the first body's onset contradicts the stated scatter of the drives. It tells that at the gauge that it fixed:
    /// before, offsets may have taken up so much of the drives that it reads no scale.
    pub(crate) fn contradiction_of_scatter(&self, stated: f64) -> Result<Option<String>, StitchingError> {
        let found = self.onset()?.ok().and_then(|onset| contradicted(&self.drive, stated, onset.scale()));
        Ok(found.map(|found| {
            format!(
                "the drives scatter by {:.1} % by the first body's onset and by {:.1} % as stated: the stated scatter was left out",
                100.0 * found.abs(),
                100.0 * stated
            )
        }))
    }
}
