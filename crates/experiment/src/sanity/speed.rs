//! Whether the wave runs about as fast as masses and contact law say.

use chainwave_measurement::Estimate;

use crate::chain::stated_motion::StatedMotion;
use crate::configuration::Experiment;
use crate::error::Error;
use crate::finding::Finding;

/// Shares of the speed that the stated chain has, between which nothing is said: friction, a striker that is not as stated and the like change it
/// by tenths.
const SLOWEST: f64 = 0.5;
const FASTEST: f64 = 1.6;

/// The masses or the contact law, where the measured group velocity is out of proportion.
///
/// # Errors
/// A contact law that makes no sense.
pub(crate) fn speed(
    experiment: &Experiment,
    stated: &StatedMotion,
    measured_m_per_s: Estimate,
) -> Result<Option<Finding>, Error> {
    let chain = &experiment.chain;
    let pitch_m = chain.mean_pitch_m();
    // Where no pulse leads, weak waves do.
    let expected = match stated.group_velocity_m_per_s(experiment) {
        Some(of_pulse) => of_pulse,
        None => experiment.linear_chain()?.sound_speed_m_per_s(pitch_m),
    };
    let ratio = measured_m_per_s.value / expected;
    Ok((!(SLOWEST..=FASTEST).contains(&ratio)).then(|| Finding {
        code: "speed",
        subject: "chain.mass_kg and contact".into(),
        text: format!(
            "the wave runs at {:.2} m/s, {ratio:.3} times as fast as it should with a mass of {} kg and this contact law, \
             {expected:.2} m/s (hint: are masses in grams, or is the scale wrong?)",
            measured_m_per_s.value,
            chain.mean_mass_kg()
        ),
    }))
}
