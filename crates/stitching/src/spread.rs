//! Scatter of readings within a trial, and of the motion from trial to trial.

use ndarray::Array2;

use crate::body_response::BodyResponse;
use crate::fitted::Fitted;
use crate::state::AlignmentState;

/// What scatters within a trial and what from trial to trial: standard deviations in metres, shape `[body, time]`, zero where nothing
/// was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Of one reading about its own trial's motion: the trackers' noise, or what the residuals make of it where they are larger.
    pub within_m: Array2<f64>,
    /// Of all trials' motions about their mean, each from its own trigger: how well the drive repeats.
    pub between_m: Array2<f64>,
}

impl AlignmentState<'_> {
    /// The spread of readings and of trials; `ratios` are the residuals' rms over what the trackers' sigma lets expect, by body.
    pub(crate) fn spread(&self, field: &Fitted, ratios: &[f64]) -> Spread {
        let shape = (field.len(), self.times_s.len());
        let within_m = |(row, i): (usize, usize)| {
            ratios[row] * rms(field[row].at(i).contributions.iter().map(|one| one.read.sigma))
        };
        Spread {
            within_m: Array2::from_shape_fn(shape, within_m),
            between_m: Array2::from_shape_fn(shape, |(row, i)| self.between_m(field[row].at(i).response)),
        }
    }

    fn between_m(&self, response: &BodyResponse) -> f64 {
        let n = self.drive.len() as f64;
        let from_mean_m = self.drive.iter().map(|s| response.at(*s) - response.motion_m);
        rms(from_mean_m) * (n / (n - 1.0).max(1.0)).sqrt()
    }
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len().max(1) as f64;
    (values.map(|value| value * value).sum::<f64>() / n).sqrt()
}
