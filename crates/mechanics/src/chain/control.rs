//! Control of the steps of an integration: how long they are, and what their errors add up to.

use super::effort::{Asked, Effort};
use super::run_request::{Pacing, RunRequest};
use super::step_size::Pace;
use crate::check;
use crate::equations::model::ChainModel;
use crate::equations::state::{ChainState, Reach};
use crate::error::MechanicsError;
use crate::integrator::step::LocalError;

/// Steps times bodies beyond which a simulation is refused (minutes of computing).
const MAX_BODY_STEPS: f64 = 2e11;

/// Chooses the steps and adds up their errors.
#[derive(Debug)]
pub(super) struct Control {
    adaptive: Option<Tolerance>,
    /// Whether steps may pass outputs, which are then interpolated.
    pub(super) passes_outputs: bool,
    /// The constant step, or the next one.
    pub(super) h_s: f64,
    /// Steps between two outputs, where they are constant.
    n_between: f64,
    pub(super) least_s: f64,
    /// Largest displacement and velocity so far; at first those of the fastest oscillation.
    pub(super) x_m: f64,
    pub(super) v_m_per_s: f64,
    /// Largest displacement that bodies did reach so far.
    reached_m: f64,
    /// Sum of the steps' relative errors.
    error: f64,
    /// Of steps that are chosen on the way.
    pub(super) effort: Option<Effort>,
}

/// What adaptive steps are held to.
#[derive(Debug, Clone, Copy)]
struct Tolerance {
    /// Relative error for each second of the run.
    per_second: f64,
    /// Relative error that any step may make: short transients and corners need not be followed to the end.
    least: f64,
    /// Order of the error of a step, less one.
    order: f64,
    omega_rad_per_s: f64,
}

/// Share of the whole tolerance that any one step may take.
const LEAST_SHARE: f64 = 1e-4;
/// Part of the longest permissible step that the next one takes.
const SAFETY: f64 = 0.9;
/// Bounds of the next step over the last.
const CHANGE: [f64; 2] = [0.2, 3.0];
/// First step of an adaptive method, in radians of the fastest oscillation.
const FIRST_STEP_RAD: f64 = 0.05;
/// Shortest step of an adaptive method, in radians of the fastest oscillation at rest.
const LEAST_STEP_RAD: f64 = 1e-9;

impl Tolerance {
    /// Relative error that a step may make.
    fn of_step(&self, h_s: f64) -> f64 {
        (self.per_second * h_s).max(self.least)
    }
}

impl Control {
    pub(super) fn new(
        order: &RunRequest,
        pace: &Pace<'_>,
        model: &ChainModel<'_>,
        state: &ChainState,
    ) -> Result<Self, MechanicsError> {
        let omega_rad_per_s = pace.omega_at_rest();
        let Reach { x_m, v_m_per_s } = model.first_reach(state);
        let duration_s = order.output_interval_s * (order.n_outputs - 1) as f64;
        let scale_s = if omega_rad_per_s > 0.0 { omega_rad_per_s.recip() } else { duration_s };
        let mut control = Self {
            adaptive: None,
            passes_outputs: false,
            h_s: 0.0,
            n_between: 1.0,
            least_s: 0.0,
            x_m: x_m.max(v_m_per_s * scale_s),
            v_m_per_s: v_m_per_s.max(x_m / scale_s),
            reached_m: x_m,
            error: 0.0,
            effort: None,
        };
        match order.pacing {
            Pacing::Constant { dt_s } => {
                // A step that divides the interval but for rounding is taken as it is.
                control.n_between = (order.output_interval_s / dt_s * (1.0 - 1e-12)).ceil().max(1.0);
                control.h_s = order.output_interval_s / control.n_between;
                let n_steps = control.n_between * order.n_outputs as f64;
                let hint = "very strong damping or very stiff contacts need very small steps";
                let body_steps = n_steps * state.x_m.len() as f64;
                check::limit("time steps times bodies", MAX_BODY_STEPS, body_steps, hint)?;
            }
            Pacing::Adaptive { accuracy, room } => {
                let tolerance = accuracy / room;
                let RunRequest { method, n_outputs, .. } = *order;
                let asked = Asked { method, tolerance, duration_s, n_outputs, n_masses: model.n_masses() };
                control.effort = Some(Effort::new(asked, omega_rad_per_s)?);
                control.adaptive = Some(Tolerance {
                    per_second: tolerance / duration_s,
                    least: LEAST_SHARE * tolerance,
                    order: f64::from(order.method.error_order()) - 1.0,
                    omega_rad_per_s: scale_s.recip(),
                });
                control.passes_outputs = order.method.is_dense();
                control.h_s = (FIRST_STEP_RAD * scale_s).min(duration_s);
                control.least_s = LEAST_STEP_RAD * scale_s.min(duration_s);
            }
        }
        Ok(control)
    }

    /// Where the steps must stop next.
    pub(super) fn target_s(&self, time_s: f64, next_output: usize, order: &RunRequest) -> f64 {
        let interval_s = order.output_interval_s;
        if self.adaptive.is_none() {
            let start_s = (next_output - 1) as f64 * interval_s;
            let done = ((time_s - start_s) / self.h_s * (1.0 + 1e-9)).floor() + 1.0;
            return if done >= self.n_between {
                next_output as f64 * interval_s
            } else {
                start_s + done * self.h_s
            };
        }
        let output = if self.passes_outputs { order.n_outputs - 1 } else { next_output };
        output as f64 * interval_s
    }

    /// Length of the next step, `left_s` before it must stop.
    pub(super) fn step_s(&self, left_s: f64) -> f64 {
        match self.adaptive {
            // A rounding of the time must not make a new step length.
            None if (left_s - self.h_s).abs() < 1e-6 * self.h_s => self.h_s,
            None => left_s,
            // Two equal steps rather than a whole one and a tiny one.
            Some(_) if self.h_s < left_s && left_s < 2.0 * self.h_s => 0.5 * left_s,
            Some(_) => left_s.min(self.h_s),
        }
    }

    /// Whether a step's error is as small as it must be.
    pub(super) fn permits(&self, error: Option<LocalError>, h_s: f64) -> bool {
        let of_step = self.adaptive.zip(error);
        of_step.is_none_or(|(tolerance, error)| self.relative(error, tolerance) <= tolerance.of_step(h_s))
    }

    /// Accepts a step and sets the next one, or says how much shorter it must be.
    pub(super) fn judge(&mut self, error: Option<LocalError>, h_s: f64) -> Option<f64> {
        let (Some(tolerance), Some(error)) = (self.adaptive, error) else { return None };
        let relative = self.relative(error, tolerance);
        let ratio = relative / tolerance.of_step(h_s);
        let change = SAFETY * ratio.max(1e-30).powf(-1.0 / tolerance.order);
        if ratio > 1.0 || !ratio.is_finite() {
            let [least, _] = CHANGE;
            return Some(h_s * if change.is_finite() { change.clamp(least, SAFETY) } else { least });
        }
        self.error += relative;
        // A step that was cut short by a stop says nothing against a longer one.
        self.h_s =
            (h_s * change.clamp(CHANGE[0], CHANGE[1])).max(if h_s < self.h_s { self.h_s } else { 0.0 });
        None
    }

    /// Takes in the error of a step that is as short as it may be and passes a jump of the forces.
    pub(super) fn pass(&mut self, error: Option<LocalError>) {
        if let (Some(tolerance), Some(error)) = (self.adaptive, error) {
            self.error += self.relative(error, tolerance);
        }
        self.h_s = self.least_s;
    }

    /// A step's error over the largest displacement. Errors of the velocity count as displacements within a radian of the fastest
    /// oscillation; what has not moved has no error.
    fn relative(&self, error: LocalError, tolerance: Tolerance) -> f64 {
        let of_size = |error: f64, size: f64| if error == 0.0 { 0.0 } else { error / size };
        of_size(error.x_m, self.x_m).max(of_size(error.v_m_per_s, tolerance.omega_rad_per_s * self.x_m))
    }

    /// The error in metres that any one step may make.
    pub(super) fn least_error_m(&self) -> f64 {
        self.adaptive.map_or(0.0, |tolerance| tolerance.least * self.x_m)
    }

    /// Takes in a state's reach.
    pub(super) fn reach(&mut self, of_state: Reach) {
        self.x_m = self.x_m.max(of_state.x_m);
        self.reached_m = self.reached_m.max(of_state.x_m);
        self.v_m_per_s = self.v_m_per_s.max(of_state.v_m_per_s);
    }

    /// Sum of the steps' errors over the largest displacement that bodies reached, which may stay below the scale that the steps were
    /// held to.
    pub(super) fn error_over_motion(&self) -> f64 {
        if self.reached_m > 0.0 { self.error * (self.x_m / self.reached_m).max(1.0) } else { self.error }
    }

    pub(super) fn out_of_reach(&self, order: &RunRequest, time_s: f64, h_s: f64) -> MechanicsError {
        let Pacing::Adaptive { accuracy, .. } = order.pacing else {
            return MechanicsError::NotFinite { time_s };
        };
        MechanicsError::OutOfReach { method: order.method.name(), accuracy, time_s, h_s }
    }
}
