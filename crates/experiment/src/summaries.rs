//! What is said of recordings and of simulations beside their tables, with the keys that others rely on.

use chainwave_measurement::RecordingInfo;
use chainwave_mechanics::Simulation;
use serde::Serialize;

/// What a recording says of itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingSummary<'a> {
    format: &'a str,
    width_px: usize,
    height_px: usize,
    n_frames: usize,
    bit_depth: u32,
    rate_hz: Option<f64>,
    first_time_s: Option<f64>,
    last_time_s: Option<f64>,
    first_image: i64,
    camera: Option<&'a str>,
    exposure_s: Option<f64>,
    warnings: &'a [String],
}

impl<'a> From<&'a RecordingInfo> for RecordingSummary<'a> {
    fn from(info: &'a RecordingInfo) -> Self {
        // Without a rate times count frames, which are no seconds.
        let time_s = |time: Option<&f64>| time.copied().filter(|_| info.rate_hz.is_some());
        Self {
            format: &info.format,
            width_px: info.width_px,
            height_px: info.height_px,
            n_frames: info.n_frames,
            bit_depth: info.bit_depth,
            rate_hz: info.rate_hz,
            first_time_s: time_s(info.times_s.first()),
            last_time_s: time_s(info.times_s.last()),
            first_image: info.first_image,
            camera: info.camera.as_deref(),
            exposure_s: info.exposure_s,
            warnings: &info.warnings,
        }
    }
}

/// How a chain's motion was computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationSummary<'a> {
    energy_drift: f64,
    psi_max_j: &'a [f64],
    steps: u64,
    dt_s: f64,
    method: &'a str,
    choice: &'a str,
    error_estimate: Option<f64>,
    tension_events: u64,
    contact_switches: usize,
    far_contact_switches: usize,
    force_evaluations: u64,
    wall_s: f64,
}

impl<'a> SimulationSummary<'a> {
    /// Of a simulation that took so many seconds.
    pub fn of(simulation: &'a Simulation, wall_s: f64) -> Self {
        Self {
            energy_drift: simulation.energy_drift,
            psi_max_j: &simulation.psi_max_j,
            steps: simulation.steps,
            dt_s: simulation.dt_s,
            method: simulation.method,
            choice: &simulation.choice,
            error_estimate: simulation.error_estimate,
            tension_events: simulation.tension_events,
            contact_switches: simulation.contact_switch_times_s.len(),
            far_contact_switches: simulation.far_contact_switch_times_s.len(),
            force_evaluations: simulation.force_evaluations,
            wall_s,
        }
    }
}
