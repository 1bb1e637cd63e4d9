//! The pulses of a run, and where they meet, in `results.json`; its table is the library's.

use chainwave_analysis::{Collision, Pulse, Pulses};
use chainwave_measurement::Estimate;
use serde_json::{Value, json};

/// Each pulse in a few numbers; pulses and gaps are counted from 1.
pub(crate) fn pulses_as_json(pulses: &Pulses) -> Value {
    pulses.pulses.iter().enumerate().map(|(index, pulse)| pulse_as_json(index + 1, pulse)).collect()
}

fn pulse_as_json(number: usize, pulse: &Pulse) -> Value {
    let gaps = || pulse.passes.iter().map(|pass| pass.gap);
    let (speed, strain, hwhm) = (pulse.speed_m_per_s, pulse.strain, pulse.hwhm_m);
    let particle = pulse.particle_velocity_m_per_s;
    json!({
        "pulse": number,
        "direction": pulse.direction.as_str(),
        "sense": pulse.sense.as_str(),
        "first_gap": gaps().next(),
        "last_gap": gaps().next_back(),
        "n_gaps": pulse.passes.len(),
        "first_seen_s": pulse.passes.first().map(|pass| pass.t_s.value),
        "last_seen_s": pulse.passes.last().map(|pass| pass.t_s.value),
        "speed_m_per_s": value(speed),
        "speed_sigma": sigma(speed),
        "strain": value(strain),
        "strain_sigma": sigma(strain),
        "hwhm_m": value(hwhm),
        "hwhm_sigma_m": sigma(hwhm),
        "particle_velocity_m_per_s": value(particle),
        "particle_velocity_sigma": sigma(particle),
        "reflected_from": pulse.reflected_from.map(|index| index + 1),
    })
}

/// Each meeting of two pulses, by their numbers.
pub(crate) fn collisions_as_json(pulses: &Pulses) -> Value {
    let of = |one: &Collision| {
        json!({
            "pulses": one.pulses.map(|index| index + 1),
            "kind": if one.is_head_on { "head on" } else { "overtaking" },
            "t_s": one.t_s,
            "gap": one.gap,
            "shift_pitches": one.shifts.map(value),
            "shift_sigma_pitches": one.shifts.map(sigma),
        })
    };
    pulses.collisions.iter().map(of).collect()
}

fn value(estimate: Option<Estimate>) -> Option<f64> {
    estimate.map(|estimate| estimate.value)
}

fn sigma(estimate: Option<Estimate>) -> Option<f64> {
    estimate.map(|estimate| estimate.sigma)
}
