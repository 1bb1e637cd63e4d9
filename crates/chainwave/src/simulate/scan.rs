//! `chainwave simulate --scan`: a scene for many striker velocities.

use std::path::Path;

use chainwave_analysis::{MeasureSettings, Spacing, exact_motion, measure};
use chainwave_mechanics::{Chain, Drive, Schedule, Simulation, Striker, ensemble};

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::table::{self, column};
use crate::terminal::say;

use crate::cli::Velocities;

/// Simulates every member and writes a row for each gap of each. The group velocity is that of `run`: the same analysis of the motion at
/// the scene's output interval, over the gaps that it chooses.
pub(crate) fn scan(
    chain: &Chain,
    schedule: &Schedule,
    spacing: &Spacing,
    velocities: &Velocities,
    arguments: &cli::Simulate,
) -> Result<Outcome, Error> {
    let Drive::Striker(striker) = &chain.drive else {
        let message =
            "--scan: expected a drive of kind \"striker\", found another one, which has no velocity to scan";
        return Err(Error::configuration(&arguments.scene, message.into()));
    };
    let struck = |velocity_m_per_s: &f64| {
        let drive = Drive::Striker(Striker { velocity_m_per_s: *velocity_m_per_s, ..*striker });
        Chain { drive, ..chain.clone() }
    };
    let chains: Vec<Chain> = velocities.0.iter().map(struck).collect();
    let members =
        ensemble(&chains, schedule, threads(arguments.jobs), |_, simulation| Member::of(simulation, spacing));
    let mut outcome = Outcome::default();
    let mut rows = ScanRows::default();
    for (velocity_m_per_s, member) in velocities.0.iter().zip(members) {
        match member {
            Ok(member) => rows.add(*velocity_m_per_s, &member),
            Err(failure) => outcome.fail(format!("striker at {velocity_m_per_s} m/s: {failure}")),
        }
    }
    rows.write(&arguments.out)?;
    say!("wrote {}: striker velocities asked for: {}", arguments.out.display(), velocities.0.len());
    Ok(outcome)
}

/// What is kept of a simulation.
struct Member {
    group_m_per_s: Option<f64>,
    /// How much the speed varies along the gaps, relative to it.
    variation: Option<f64>,
    psi_max_j: Vec<f64>,
    peak_times_s: Vec<Option<f64>>,
    energy_drift: f64,
    error_estimate: Option<f64>,
    tension_events: u64,
}

impl Member {
    /// The motion itself is long, there may be many members, and it is not kept.
    fn of(simulation: Simulation, spacing: &Spacing) -> Self {
        let motion = exact_motion(&simulation.trajectory);
        let measured = measure(&motion, &MeasureSettings::new(spacing.clone(), 0), None);
        let found = measured.ok().and_then(|measured| measured.group_velocity.ok());
        Self {
            group_m_per_s: found.as_ref().map(|found| found.velocity_m_per_s.value),
            variation: found.and_then(|found| found.relative_variation).map(|variation| variation.value),
            psi_max_j: simulation.psi_max_j,
            peak_times_s: simulation.peak_times_s,
            energy_drift: simulation.energy_drift,
            error_estimate: simulation.error_estimate,
            tension_events: simulation.tension_events,
        }
    }
}

#[derive(Debug, Default)]
struct ScanRows {
    striker_m_per_s: Vec<f64>,
    group_m_per_s: Vec<Option<f64>>,
    variation: Vec<Option<f64>>,
    gap: Vec<u32>,
    peak_s: Vec<Option<f64>>,
    psi_max_j: Vec<f64>,
    energy_drift: Vec<f64>,
    error_estimate: Vec<Option<f64>>,
    tension_events: Vec<u64>,
}

impl ScanRows {
    fn add(&mut self, velocity_m_per_s: f64, member: &Member) {
        let gaps = member.psi_max_j.iter().zip(&member.peak_times_s).enumerate();
        for (gap, (psi_max_j, peak_s)) in gaps {
            self.striker_m_per_s.push(velocity_m_per_s);
            self.group_m_per_s.push(member.group_m_per_s);
            self.variation.push(member.variation);
            self.gap.push(gap as u32 + 1);
            self.peak_s.push(*peak_s);
            self.psi_max_j.push(*psi_max_j);
            self.energy_drift.push(member.energy_drift);
            self.error_estimate.push(member.error_estimate);
            self.tension_events.push(member.tension_events);
        }
    }

    fn write(self, out: &Path) -> Result<(), Error> {
        table::write(
            out,
            vec![
                column("striker_velocity_m_per_s", self.striker_m_per_s),
                column("group_velocity_m_per_s", self.group_m_per_s),
                column("group_velocity_variation", self.variation),
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
