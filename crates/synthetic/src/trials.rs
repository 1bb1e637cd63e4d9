//! What differs from trial to trial: striker speed, trigger, the camera's phase, noise.

use rand::RngExt;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_not_negative, require_positive};
use crate::seed::{Purpose, stream};

/// How much trials differ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Mean striker speed.
    pub striker_velocity_m_per_s: f64,
    /// Standard deviation of the striker speed (normal).
    pub striker_velocity_sigma_m_per_s: f64,
    /// Standard deviation of the trigger's instant around the impact (normal, mean 0: a constant latency would only
    /// move the origin of time).
    pub trigger_jitter_s: f64,
    /// Standard deviation of what the trigger's instant gains from trial to trial and keeps (a random walk that starts at 0
    /// with the first): a drifting sensor.
    #[serde(default)]
    pub trigger_walk_s: f64,
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

/// Draws trials, each with its own scatter. Trial k depends on the seed, k and its own scatter alone (and the walk on those
/// before it), so more trials may be added without changing the first.
///
/// # Errors
/// [`SyntheticError::Setting`] when the scatter is not a usable one.
pub fn draw(seed: u64, scatters: &[Scatter]) -> Result<Vec<Draw>, SyntheticError> {
    scatters.iter().try_for_each(Scatter::check)?;
    let mut walked_s = 0.0;
    let walk = |(trial, scatter): (u64, &Scatter)| {
        let here_s = walked_s;
        walked_s += scatter.trigger_walk_s * deviate(Purpose::Walk, seed, trial);
        let mut draw = draw_one(seed, trial, scatter);
        draw.trigger_delay_s += here_s;
        draw
    };
    Ok((0..).zip(scatters).map(walk).collect())
}

impl Scatter {
    fn check(&self) -> Result<(), SyntheticError> {
        require_positive("scatter.striker_velocity_m_per_s", self.striker_velocity_m_per_s)?;
        let sigma = self.striker_velocity_sigma_m_per_s;
        // Beyond a fifth of the mean, a normal speed could come out at zero or below.
        let narrow = (0.0..=0.2 * self.striker_velocity_m_per_s).contains(&sigma);
        require(narrow, "scatter.striker_velocity_sigma_m_per_s", "0 to a fifth of the mean speed", sigma)?;
        require_not_negative("scatter.trigger_jitter_s", self.trigger_jitter_s)?;
        require_not_negative("scatter.trigger_walk_s", self.trigger_walk_s)?;
        require_positive("scatter.rate_hz", self.rate_hz)
    }
}

/// How far the stage stands from where it was told to in a view, in metres: normal, the same for every trial of the view.
///
/// # Errors
/// [`SyntheticError::Setting`] when the standard deviation is negative or no number.
pub fn stage_error_m(seed: u64, view: u64, sigma_m: f64) -> Result<f64, SyntheticError> {
    require_not_negative("stage_sigma_m", sigma_m)?;
    Ok(sigma_m * deviate(Purpose::Stage, seed, view))
}

/// How much later the triggers of a view fire than those of others, in seconds: normal, the same for every trial of the view.
///
/// # Errors
/// [`SyntheticError::Setting`] when the standard deviation is negative or no number.
pub fn view_trigger_s(seed: u64, view: u64, sigma_s: f64) -> Result<f64, SyntheticError> {
    require_not_negative("trigger_view_s", sigma_s)?;
    Ok(sigma_s * deviate(Purpose::ViewTrigger, seed, view))
}

/// The factor of a view's magnification: normal around 1, the same for every trial of the view.
pub(crate) fn view_factor(seed: u64, view: u64, sigma: f64) -> f64 {
    1.0 + sigma * deviate(Purpose::Magnification, seed, view)
}

/// How much bodies differ: one factor a body, normal around 1, the same in every trial. `what` tells quantities apart that
/// scatter independently.
///
/// # Errors
/// [`SyntheticError::Setting`] when the relative standard deviation is not within 0 to 0.2 (beyond, a factor could come out
/// at zero or below).
pub fn body_factors(
    seed: u64,
    what: BodyQuantity,
    n_bodies: usize,
    sigma: f64,
) -> Result<Vec<f64>, SyntheticError> {
    require((0.0..=0.2).contains(&sigma), "body scatter", "0 to 0.2", sigma)?;
    let counter = |body: usize| (body as u64) << 8 | what as u64;
    let factor = |body: usize| 1.0 + sigma * deviate(Purpose::Body, seed, counter(body));
    Ok((1..=n_bodies).map(factor).collect())
}

/// What of a body scatters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyQuantity {
    /// Its mass.
    Mass = 1,
    /// Its stiffness.
    Stiffness = 2,
}

/// A standard normal number within 4.5 standard deviations.
fn deviate(purpose: Purpose, seed: u64, counter: u64) -> f64 {
    stream(purpose, seed, counter).sample::<f64, _>(StandardNormal).clamp(-4.5, 4.5)
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
        trigger_walk_s: 0.0,
        rate_hz: 25_000.0,
    };

    #[test]
    fn trials_follow_from_the_seed_and_their_number() {
        let trials = draw(3, &[SCATTER; 25]).unwrap();
        assert_eq!(draw(3, &[SCATTER; 5]).unwrap(), trials[..5]);
        assert_ne!(draw(4, &[SCATTER; 5]).unwrap(), trials[..5]);
    }

    #[test]
    fn trials_scatter_as_stated() {
        let trials = draw(1, &vec![SCATTER; 10_000]).unwrap();
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
    fn the_walk_adds_to_the_jitter_and_to_nothing_else() {
        let still = draw(5, &vec![SCATTER; 4000]).unwrap();
        let walking = draw(5, &vec![Scatter { trigger_walk_s: 2.0e-6, ..SCATTER }; 4000]).unwrap();
        let drift_s: Vec<f64> = still
            .iter()
            .zip(&walking)
            .map(|(one, other)| other.trigger_delay_s - one.trigger_delay_s)
            .collect();
        assert!(drift_s[0] == 0.0);
        let squares = drift_s.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>();
        // 4.5 standard errors of a deviation from 3999 steps, 1/sqrt(2 n) = 1.1 %.
        assert!(((squares / 3999.0).sqrt() / 2.0e-6 - 1.0).abs() < 0.05);
        assert!(still.iter().zip(&walking).all(|(one, other)| {
            Draw { trigger_delay_s: 0.0, ..*one } == Draw { trigger_delay_s: 0.0, ..*other }
        }));
    }

    #[test]
    fn stages_triggers_and_bodies_scatter_as_stated_and_independently() {
        let n = 4000;
        let rms = |values: &[f64]| (values.iter().map(|x| x * x).sum::<f64>() / n as f64).sqrt();
        let stages: Vec<f64> = (0..n as u64).map(|view| stage_error_m(1, view, 2.0e-5).unwrap()).collect();
        let triggers: Vec<f64> = (0..n as u64).map(|view| view_trigger_s(1, view, 6.0e-5).unwrap()).collect();
        let off = |what| body_factors(1, what, n, 0.013).unwrap().iter().map(|factor| factor - 1.0).collect();
        let (masses, stiffnesses): (Vec<f64>, Vec<f64>) =
            (off(BodyQuantity::Mass), off(BodyQuantity::Stiffness));
        // 4.5 standard errors: 1.1 % of a deviation, 1/sqrt(n) = 1.6 % of a correlation.
        assert!((rms(&stages) / 2.0e-5 - 1.0).abs() < 0.05);
        assert!((rms(&triggers) / 6.0e-5 - 1.0).abs() < 0.05);
        let together = stages.iter().zip(&triggers).map(|(m, s)| m * s).sum::<f64>() / n as f64;
        assert!((together / (2.0e-5 * 6.0e-5)).abs() < 0.072);
        assert!((rms(&masses) / 0.013 - 1.0).abs() < 0.05 && (rms(&stiffnesses) / 0.013 - 1.0).abs() < 0.05);
        let products = masses.iter().zip(&stiffnesses).map(|(m, k)| m * k).sum::<f64>() / n as f64;
        assert!((products / (0.013 * 0.013)).abs() < 0.072);
        assert_eq!(
            body_factors(1, BodyQuantity::Mass, 5, 0.013).unwrap()[..],
            body_factors(1, BodyQuantity::Mass, 9, 0.013).unwrap()[..5]
        );
        assert!(
            body_factors(1, BodyQuantity::Mass, 3, 0.0)
                .unwrap()
                .iter()
                .all(|factor| (factor - 1.0).abs() < 1.0e-15)
        ); // rounding
    }

    #[test]
    fn an_impossible_scatter_is_refused_by_name() {
        let scatter = Scatter { striker_velocity_sigma_m_per_s: f64::NAN, ..SCATTER };
        let message = draw(1, &[scatter]).unwrap_err().to_string();
        assert!(message.contains("striker_velocity_sigma_m_per_s") && message.contains("NaN"), "{message}");
    }
}
