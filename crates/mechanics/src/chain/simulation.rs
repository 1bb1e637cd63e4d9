//! What a simulation found: motion, energies, peaks, and how it was integrated; group velocity of the leading pulse.

use chainwave_measurement::Trajectory;

/// What the chain did.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Motion of bodies 1 to N at the output times.
    pub trajectory: Trajectory,
    /// Motion of the striker at the output times, where there is one.
    pub striker: Option<StrikerMotion>,
    /// The same of the far striker.
    pub far_striker: Option<StrikerMotion>,
    /// Largest change, over at most some 500 of the outputs, of kinetic and potential energy plus what the dampers took (less
    /// what an imposed motion put in), relative to the initial energy (for an imposed motion: to the largest energy held).
    pub energy_drift: f64,
    /// Peak potential energy of each gap between bodies in joules, over all steps and between them.
    pub psi_max_j: Vec<f64>,
    /// When each of these gaps was closed the most, in seconds; none where it was not seen to open again.
    pub peak_times_s: Vec<Option<f64>>,
    /// Number of steps, those that end at a switch included and those refused left out.
    pub steps: u64,
    /// Time step in seconds; the mean one of an adaptive method.
    pub dt_s: f64,
    /// Name of the integrator.
    pub method: &'static str,
    /// Why that method and these steps.
    pub choice: String,
    /// Estimated error of the displacements over the largest displacement, where it was estimated.
    pub error_estimate: Option<f64>,
    /// Times a gap between bodies was pulled beyond its law's range.
    pub tension_events: u64,
    /// When the striker's contact opened, closed again and so on, in seconds.
    pub contact_switch_times_s: Vec<f64>,
    /// The same of the far striker's contact, which may begin open.
    pub far_contact_switch_times_s: Vec<f64>,
    /// Contact forces evaluated.
    pub force_evaluations: u64,
}

/// Motion of the striker at the output times.
#[derive(Debug, Clone, PartialEq)]
pub struct StrikerMotion {
    /// Displacement from where it touches the chain at rest, in metres.
    pub displacement_m: Vec<f64>,
    /// Velocity in metres per second.
    pub velocity_m_per_s: Vec<f64>,
}

/// Gaps near the striker whose pulse is still taking shape, left out of the group velocity.
const NEAR_GAPS: usize = 3;

impl Simulation {
    /// The leading pulse's velocity in metres per second, for a pitch in metres: the slope of a straight line through the
    /// places of the gaps against the times at which they were closed the most, from the fourth gap up to the first one
    /// that peaked before its neighbour, as gaps do that an echo closes more; none with fewer than two gaps.
    pub fn group_velocity_m_per_s(&self, pitch_m: f64) -> Option<f64> {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (gap, time_s) in self.peak_times_s.iter().enumerate().skip(NEAR_GAPS) {
            let (Some(time_s), last_s) = (*time_s, points.last().map_or(0.0, |(time_s, _)| *time_s)) else {
                break;
            };
            if time_s <= last_s {
                break;
            }
            points.push((time_s, gap as f64 * pitch_m));
        }
        let n = points.len() as f64;
        let mean_s = points.iter().map(|(time_s, _)| time_s).sum::<f64>() / n;
        let spread: f64 = points.iter().map(|(time_s, _)| (time_s - mean_s).powi(2)).sum();
        let slope: f64 = points.iter().map(|(time_s, place_m)| (time_s - mean_s) * place_m).sum();
        (points.len() > 1).then(|| slope / spread)
    }
}
