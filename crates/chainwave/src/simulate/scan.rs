//! `chainwave simulate --scan`: a scene for many striker velocities.

use std::path::Path;
use std::str::FromStr;

use chainwave_mechanics::{Chain, Schedule, Simulation};

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::table::{self, column};

/// Striker velocities: `0.5,1,2.73`, or `FROM:TO:COUNT` evenly spaced with both ends.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Velocities(Vec<f64>);

impl FromStr for Velocities {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| {
            let found = part.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
            found.ok_or_else(|| format!("expected a velocity above 0 in m/s, found {part:?}"))
        };
        if let [from, to, count] = text.split(':').collect::<Vec<_>>()[..] {
            let (from, to) = (number(from)?, number(to)?);
            let count = count.trim().parse::<usize>().ok().filter(|count| (2..=1_000_000).contains(count));
            let count = count.ok_or("expected FROM:TO:COUNT with a count from 2 to 1000000")?;
            let velocity = |i: usize| from + (to - from) * i as f64 / (count - 1) as f64;
            return Ok(Self((0..count).map(velocity).collect()));
        }
        text.split(',').map(number).collect::<Result<_, _>>().map(Self)
    }
}

/// Simulates every member and writes a row for each gap of each.
pub(crate) fn scan(
    chain: &Chain,
    schedule: &Schedule,
    pitch_m: f64,
    velocities: &Velocities,
    arguments: &cli::Simulate,
) -> Result<Outcome, Error> {
    // Peaks are found between the steps, so no outputs are needed but the end.
    let schedule = Schedule { output_interval_s: schedule.duration_s, ..*schedule };
    let members = chainwave_mechanics::scan(chain, &velocities.0, &schedule, threads(arguments.jobs))?;
    let mut outcome = Outcome::default();
    let mut rows = Rows::default();
    for (velocity_m_per_s, member) in velocities.0.iter().zip(members) {
        match member {
            Ok(simulation) => rows.add(*velocity_m_per_s, pitch_m, &simulation),
            Err(failure) => outcome.fail(format!("striker at {velocity_m_per_s} m/s: {failure}")),
        }
    }
    rows.write(&arguments.out)?;
    Ok(outcome)
}

#[derive(Debug, Default)]
struct Rows {
    striker_m_per_s: Vec<f64>,
    group_m_per_s: Vec<Option<f64>>,
    gap: Vec<u32>,
    peak_s: Vec<Option<f64>>,
    psi_max_j: Vec<f64>,
    energy_drift: Vec<f64>,
    error_estimate: Vec<Option<f64>>,
    tension_events: Vec<u64>,
}

impl Rows {
    fn add(&mut self, velocity_m_per_s: f64, pitch_m: f64, simulation: &Simulation) {
        let group = simulation.group_velocity_m_per_s(pitch_m);
        let gaps = simulation.psi_max_j.iter().zip(&simulation.peak_times_s).enumerate();
        for (gap, (psi_max_j, peak_s)) in gaps {
            self.striker_m_per_s.push(velocity_m_per_s);
            self.group_m_per_s.push(group);
            self.gap.push(gap as u32 + 1);
            self.peak_s.push(*peak_s);
            self.psi_max_j.push(*psi_max_j);
            self.energy_drift.push(simulation.energy_drift);
            self.error_estimate.push(simulation.error_estimate);
            self.tension_events.push(simulation.tension_events);
        }
    }

    fn write(self, out: &Path) -> Result<(), Error> {
        table::write(
            out,
            vec![
                column("striker_velocity_m_per_s", self.striker_m_per_s),
                column("group_velocity_m_per_s", self.group_m_per_s),
                column("gap", self.gap),
                column("t_peak_s", self.peak_s),
                column("psi_max_j", self.psi_max_j),
                column("energy_drift", self.energy_drift),
                column("error_estimate", self.error_estimate),
                column("tension_events", self.tension_events),
            ],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_are_a_list_or_a_range() {
        assert_eq!("0.5, 1,2.73".parse(), Ok(Velocities(vec![0.5, 1.0, 2.73])));
        assert_eq!("1:2:5".parse(), Ok(Velocities(vec![1.0, 1.25, 1.5, 1.75, 2.0])));
        for wrong in ["", "0", "1,-2", "1:2", "1:2:1", "1:2:x", "nan"] {
            assert!(wrong.parse::<Velocities>().is_err(), "{wrong}");
        }
    }
}
