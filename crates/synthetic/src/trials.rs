//! What differs from trial to trial: striker speed, trigger, the camera's phase, noise.

use rand::RngExt;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::seed::{Purpose, stream};
use crate::settings::{require, require_not_negative, require_positive};

/// How much trials differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Mean striker speed.
    pub striker_velocity_m_per_s: f64,
    /// Standard deviation of the striker speed (normal).
    pub striker_velocity_sigma_m_per_s: f64,
    /// Standard deviation of the trigger's instant around the impact (normal, mean 0: a constant latency would only
    /// move the origin of time).
    pub trigger_jitter_s: f64,
    /// Frame rate; the camera runs freely, so a frame's phase against the trigger is uniform in a frame interval.
    pub rate_hz: f64,
}

/// One trial.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draw {
    /// Striker speed at the impact.
    pub striker_velocity_m_per_s: f64,
    /// Instant of the trigger after the impact, in seconds.
    pub trigger_delay_s: f64,
    /// Time stamp of image 0 after the trigger, in seconds, in `[0, 1/rate)`.
    pub frame_phase_s: f64,
    /// Seed of the sensor's noise, below 2^53 so that every table format holds it.
    pub noise_seed: u64,
}

/// Draws `n` trials. Trial k depends on the seed and k alone, so more trials may be added without changing the first.
///
/// # Errors
/// [`SyntheticError::Setting`] when the scatter is not a usable one.
pub fn draw(seed: u64, n: usize, scatter: &Scatter) -> Result<Vec<Draw>, SyntheticError> {
    require_positive("scatter.striker_velocity_m_per_s", scatter.striker_velocity_m_per_s)?;
    let sigma = scatter.striker_velocity_sigma_m_per_s;
    // Beyond a fifth of the mean, a normal speed could come out at zero or below.
    let narrow = (0.0..=0.2 * scatter.striker_velocity_m_per_s).contains(&sigma);
    require(narrow, "scatter.striker_velocity_sigma_m_per_s", "0 to a fifth of the mean speed", sigma)?;
    require_not_negative("scatter.trigger_jitter_s", scatter.trigger_jitter_s)?;
    require_positive("scatter.rate_hz", scatter.rate_hz)?;
    Ok((0..n as u64).map(|trial| draw_one(seed, trial, scatter)).collect())
}

fn draw_one(seed: u64, trial: u64, scatter: &Scatter) -> Draw {
    let mut random = stream(Purpose::Trial, seed, trial);
    let speed_deviate: f64 = random.sample(StandardNormal);
    let trigger_deviate: f64 = random.sample(StandardNormal);
    Draw {
        striker_velocity_m_per_s: scatter.striker_velocity_m_per_s
            + scatter.striker_velocity_sigma_m_per_s * speed_deviate.clamp(-4.5, 4.5),
        trigger_delay_s: scatter.trigger_jitter_s * trigger_deviate,
        frame_phase_s: random.random::<f64>() / scatter.rate_hz,
        noise_seed: random.random::<u64>() >> 11,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCATTER: Scatter = Scatter {
        striker_velocity_m_per_s: 2.73,
        striker_velocity_sigma_m_per_s: 0.05,
        trigger_jitter_s: 8.0e-6,
        rate_hz: 25_000.0,
    };

    #[test]
    fn trials_follow_from_the_seed_and_their_number() {
        let trials = draw(3, 25, &SCATTER).unwrap();
        assert_eq!(draw(3, 5, &SCATTER).unwrap(), trials[..5]);
        assert_ne!(draw(4, 5, &SCATTER).unwrap(), trials[..5]);
    }

    #[test]
    fn trials_scatter_as_stated() {
        let trials = draw(1, 10_000, &SCATTER).unwrap();
        let deviation = |of: &dyn Fn(&Draw) -> f64| {
            let mean = trials.iter().map(of).sum::<f64>() / 1.0e4;
            (mean, (trials.iter().map(|trial| (of(trial) - mean).powi(2)).sum::<f64>() / 1.0e4).sqrt())
        };
        // Standard errors: of a mean sigma/100, of a deviation sigma/141; 4.5 of them.
        let (mean, sigma) = deviation(&|trial| trial.striker_velocity_m_per_s);
        assert!((mean - 2.73).abs() < 0.045 * 0.05 && (sigma / 0.05 - 1.0).abs() < 0.032);
        let (mean, sigma) = deviation(&|trial| trial.trigger_delay_s);
        assert!(mean.abs() < 0.045 * 8.0e-6 && (sigma / 8.0e-6 - 1.0).abs() < 0.032);
        let (mean, sigma) = deviation(&|trial| trial.frame_phase_s * 25_000.0);
        let uniform = (1.0_f64 / 12.0).sqrt();
        assert!((mean - 0.5).abs() < 0.045 * uniform && (sigma / uniform - 1.0).abs() < 0.032);
        assert!(trials.iter().all(|trial| (0.0..4.0e-5).contains(&trial.frame_phase_s)));
        assert!(trials.iter().all(|trial| trial.noise_seed < 1 << 53));
    }

    #[test]
    fn an_impossible_scatter_is_refused_by_name() {
        let scatter = Scatter { striker_velocity_sigma_m_per_s: f64::NAN, ..SCATTER };
        let message = draw(1, 1, &scatter).unwrap_err().to_string();
        assert!(message.contains("striker_velocity_sigma_m_per_s") && message.contains("NaN"), "{message}");
    }
}
