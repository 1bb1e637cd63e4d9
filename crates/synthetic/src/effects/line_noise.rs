//! Noise that the pixels of a row or a column have in common, new in each frame, as the amplifiers of a CMOS sensor make it.

use rand::RngExt;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::require;
use crate::seed::{Purpose, stream};

/// Standard deviations of normal numbers, new in each frame, as fractions of the range from black to white.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LineNoise {
    /// Of what all pixels of a row have in common.
    pub row_sigma: f64,
    /// Of what all pixels of a column have in common.
    pub column_sigma: f64,
}

impl LineNoise {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        for (name, sigma) in [
            ("camera.effects.line_noise.row_sigma", self.row_sigma),
            ("camera.effects.line_noise.column_sigma", self.column_sigma),
        ] {
            require((0.0..=0.2).contains(&sigma), name, "0 to 0.2", sigma)?;
        }
        Ok(())
    }

    /// Lays the noise of a frame over its expected counts, `width_px` a row, given the counts of the range from black to white.
    pub(crate) fn apply(&self, counts: &mut [f32], width_px: usize, range: f64, seed: u64, frame: usize) {
        let mut random = stream(Purpose::LineNoise, seed, frame as u64);
        let mut normal = |sigma: f64| (sigma * range * random.sample::<f64, _>(StandardNormal)) as f32;
        let columns: Vec<f32> = (0..width_px).map(|_| normal(self.column_sigma)).collect();
        for row in counts.chunks_mut(width_px) {
            let of_row = normal(self.row_sigma);
            row.iter_mut().zip(&columns).for_each(|(count, of_column)| *count += of_row + of_column);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_and_a_column_have_their_noise_in_common_and_each_frame_its_own() {
        let noise = LineNoise { row_sigma: 0.002, column_sigma: 0.001 };
        let frame = |frame: usize| {
            let mut counts = vec![0.0_f32; 300 * 200];
            noise.apply(&mut counts, 300, 4000.0, 5, frame);
            counts
        };
        let (first, second) = (frame(0), frame(1));
        // what is left of two pixels of a row is the columns' alone, and the same in all rows
        let steps: Vec<f32> = first.chunks(300).map(|row| row[7] - row[3]).collect();
        assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-4), "{steps:?}");
        let rms = |values: &[f32]| {
            (values.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
        };
        // 200 rows of 8 counts tell their standard deviation to 1/sqrt(400), and 300 columns of 4 the rest: within 4.5 of both together.
        let expected = 8.0_f64.hypot(4.0);
        assert!((rms(&first) / expected - 1.0).abs() < 4.5 / 400.0_f64.sqrt(), "{}", rms(&first));
        assert!(first.iter().zip(&second).any(|(a, b)| (a - b).abs() > 1.0));
    }
}
