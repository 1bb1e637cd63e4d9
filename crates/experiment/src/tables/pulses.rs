//! Pulses followed one by one as a table: a row a pulse and gap.

use chainwave_analysis::{Pass, Pulse, Pulses};
use chainwave_measurement::Estimate;

use crate::tables::result_table::{ResultTable, column};

/// Status of a passage at which another pulse is so near that the hump is both pulses'.
const MEETS: &str = "meets another";

/// The passages: `pulse, gap, direction, sense, t_s, t_sigma_s, strain, strain_sigma, hwhm_m, hwhm_sigma_m, speed_m_per_s,
/// speed_sigma_m_per_s, status`.
///
/// Pulses are numbered from 1 in the order in which they are first seen, and their rows stand in the order of their way.
pub fn pulse_table(pulses: &Pulses) -> ResultTable {
    let rows: Vec<(usize, &Pulse, &Pass)> = pulses
        .pulses
        .iter()
        .enumerate()
        .flat_map(|(index, pulse)| pulse.passes.iter().map(move |pass| (index + 1, pulse, pass)))
        .collect();
    let surely = |value: fn(&Pass) -> f64| rows.iter().map(|(.., pass)| value(pass)).collect::<Vec<_>>();
    let known = |sigma: fn(&Pass) -> f64| {
        let of_pass = |pass: &Pass| Some(sigma(pass)).filter(|sigma| sigma.is_finite());
        rows.iter().map(|(.., pass)| of_pass(pass)).collect::<Vec<_>>()
    };
    let perhaps = |value: fn(&Pass) -> Option<Estimate>, part: fn(Estimate) -> f64| {
        rows.iter().map(|(.., pass)| value(pass).map(part)).collect::<Vec<_>>()
    };
    let status = |pass: &Pass| if pass.collides { MEETS } else { "ok" };
    let columns = vec![
        column("pulse", rows.iter().map(|(number, ..)| *number as u32).collect::<Vec<_>>()),
        column("gap", rows.iter().map(|(.., pass)| pass.gap as u32).collect::<Vec<_>>()),
        column("direction", rows.iter().map(|(_, pulse, _)| pulse.direction.as_str()).collect::<Vec<_>>()),
        column("sense", rows.iter().map(|(_, pulse, _)| pulse.sense.as_str()).collect::<Vec<_>>()),
        column("t_s", surely(|pass| pass.t_s.value)),
        column("t_sigma_s", known(|pass| pass.t_s.sigma)),
        column("strain", surely(|pass| pass.strain.value)),
        column("strain_sigma", known(|pass| pass.strain.sigma)),
        column("hwhm_m", perhaps(|pass| pass.hwhm_m, |found| found.value)),
        column("hwhm_sigma_m", perhaps(|pass| pass.hwhm_m, |found| found.sigma)),
        column("speed_m_per_s", perhaps(|pass| pass.speed_m_per_s, |found| found.value)),
        column("speed_sigma_m_per_s", perhaps(|pass| pass.speed_m_per_s, |found| found.sigma)),
        column("status", rows.iter().map(|(.., pass)| status(pass)).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}
