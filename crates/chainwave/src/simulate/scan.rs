//! `chainwave simulate --scan`: a scene for many striker velocities.

use std::path::Path;

use chainwave_mechanics::{Chain, Schedule, Simulation};

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::table::{self, column};

use super::velocities::Velocities;

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
