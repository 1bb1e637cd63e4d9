//! Whether the wave runs about as fast as masses and contact law say.

use chainwave_measurement::Estimate;
use chainwave_mechanics::{Schedule, simulate};

use crate::configuration::Experiment;
use crate::error::Error;
use crate::finding::Finding;

/// Shares of the speed that the stated chain has, between which nothing is said: friction, a striker that is not as stated and the like change it
/// by tenths.
const SLOWEST: f64 = 0.5;
const FASTEST: f64 = 1.6;
/// Times to a weak wave's arrival at the far end for which the chain is solved, and samples of that.
const CROSSINGS: f64 = 1.5;
const SAMPLES: f64 = 500.0;

/// The masses or the contact law, where the measured group velocity is out of proportion.
///
/// # Errors
/// A chain that cannot be solved.
pub(crate) fn speed(experiment: &Experiment, measured_m_per_s: Estimate) -> Result<Option<Finding>, Error> {
    let chain = &experiment.chain;
    let expected = stated(experiment)?;
    let ratio = measured_m_per_s.value / expected;
    Ok((!(SLOWEST..=FASTEST).contains(&ratio)).then(|| Finding {
        code: "speed",
        subject: "chain.mass_kg and contact".into(),
        text: format!(
            "the wave runs at {:.2} m/s, {ratio:.3} times as fast as it should with a mass of {} kg and this contact law \
             ({expected:.2} m/s; hint: are masses in grams, or is the scale wrong?)",
            measured_m_per_s.value,
            chain.mean_mass_kg()
        ),
    }))
}

/// The leading pulse's speed in the chain as it is stated and driven, in metres per second; that of weak waves where it has none.
fn stated(experiment: &Experiment) -> Result<f64, Error> {
    let (linear, pitch_m) = (experiment.linear_chain()?, experiment.chain.mean_pitch_m());
    let duration_s = experiment.crossings_s(CROSSINGS)?;
    let chain = experiment.chain_model_until(duration_s)?;
    let found = simulate(&chain, &Schedule::automatic(duration_s, duration_s / SAMPLES))?;
    Ok(found.group_velocity_m_per_s(pitch_m).unwrap_or_else(|| linear.sound_speed_m_per_s(pitch_m)))
}
