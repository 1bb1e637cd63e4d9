//! A drive that is not as strong as stated, in all recordings alike.

use chainwave_inference::TrackFit;
use chainwave_measurement::Estimate;

use crate::finding::Finding;
use crate::wording::estimate;

/// Standard uncertainties beyond which the drive is not the stated one: one sound experiment in two million.
const BEYOND_DOUBT: f64 = 5.0;

/// What recordings tell of the strength of their drive, which contradicts the stated one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DriveOff {
    /// Mean over the recordings: of strikers in metres per second, of a chain that is let go its state over the stated one.
    pub(crate) found: Estimate,
    /// As it is stated, with its scatter from trial to trial.
    stated: Estimate,
    /// How far they are apart, in standard uncertainties of the stated mean.
    sigmas: f64,
    is_struck: bool,
}

impl DriveOff {
    /// What a fit that explains the tracks tells, where it contradicts the stated strength.
    pub(crate) fn of(fit: &TrackFit, stated: Estimate) -> Option<Self> {
        let found = fit.striker_velocity_m_per_s;
        // What was stated beforehand draws the mean to itself as far as tracks leave it open, so that it is off by no more than this by chance.
        let of_mean = stated.sigma / (fit.recordings.len().max(1) as f64).sqrt();
        let sigmas = (found.value - stated.value).abs() / of_mean;
        let is_struck = !fit.model.is_let_go();
        (sigmas > BEYOND_DOUBT).then_some(Self { found, stated, sigmas, is_struck })
    }

    /// Why a fit that assumes the stated strength does not hold.
    pub(crate) fn refusal(&self) -> String {
        format!(
            "it assumes the drive as stated, and the tracks tell {} where {} are stated, {:.1} sigma apart",
            estimate(self.found),
            estimate(self.stated),
            self.sigmas
        )
    }

    /// What the reader should know.
    pub(crate) fn finding(&self) -> Finding {
        let (of, unit, key) = match self.is_struck {
            true => ("strikers", " m/s", "striker.velocity_m_per_s"),
            false => ("states over the stated one", "", "drive"),
        };
        let text = format!(
            "the tracks tell {of} of {}{unit} in the mean, and {}{unit} are stated with their scatter from trial to trial, {:.1} sigma apart: the fit to \
             the tracks takes the drive as it finds it. If that is not how the chain was driven, the masses, the contacts or the scale are not as stated \
             (hint: {key}, and its scatter)",
            estimate(self.found),
            estimate(self.stated),
            self.sigmas
        );
        Finding { code: "drive_strength", subject: key.into(), text }
    }
}
