//! Whether the wave runs about as fast as masses and contact law say.

use chainwave_measurement::Estimate;

use crate::configuration::Experiment;
use crate::error::Error;
use crate::finding::Finding;

/// Softening under a hard strike slows a wave down to this share of the speed of weak waves, or less.
const SLOWEST: f64 = 0.25;
/// Stiffening laws are not among those known; nothing else makes a wave faster than this many times the speed of weak ones.
const FASTEST: f64 = 1.6;

/// The masses or the contact law, where the measured group velocity is out of proportion.
///
/// # Errors
/// A contact law that makes no sense.
pub(crate) fn speed(experiment: &Experiment, measured_m_per_s: Estimate) -> Result<Option<Finding>, Error> {
    let chain = &experiment.chain;
    let expected = experiment.linear_chain()?.sound_speed_m_per_s(chain.mean_pitch_m());
    let ratio = measured_m_per_s.value / expected;
    Ok((!(SLOWEST..=FASTEST).contains(&ratio)).then(|| Finding {
        code: "speed",
        subject: "chain.mass_kg and contact".into(),
        text: format!(
            "the wave runs at {:.2} m/s, {ratio:.3} times as fast as weak waves should with a mass of {} kg and this contact law \
             ({expected:.2} m/s; hint: are masses in grams, or is the scale wrong?)",
            measured_m_per_s.value,
            chain.mean_mass_kg()
        ),
    }))
}
