use chainwave_measurement::Trajectory;

use crate::{Chain, Drive, MechanicsError, Method, automatic, check};

/// When a simulation ends, when it reports, and how it steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// Length of the simulation in seconds. Outputs lie at all multiples of the interval up to it; the last is its end.
    pub duration_s: f64,
    /// Time between outputs, in seconds.
    pub output_interval_s: f64,
    /// Method and step.
    pub integration: Integration,
    /// Which bodies are integrated.
    pub bodies: Bodies,
}

/// How a simulation chooses its method and step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Integration {
    /// Method and steps as the scene asks for, to this accuracy: the error of displacements over the largest displacement.
    Automatic {
        /// Relative error of the displacements.
        accuracy: f64,
    },
    /// A given method, to this accuracy. A method without an error estimate of its own is run with halved steps until two runs
    /// agree.
    Accuracy {
        /// The method.
        method: Method,
        /// Relative error of the displacements.
        accuracy: f64,
    },
    /// A given method with constant steps.
    Steps {
        /// The method.
        method: Method,
        /// Largest time step in seconds; the step used is the next smaller one that divides the output interval.
        dt_s: f64,
    },
}

/// Which bodies are integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bodies {
    /// Those that the wave has reached, and some ahead of it.
    Reached,
    /// All, from the start.
    All,
}

impl Schedule {
    /// The accuracy that is asked for where nothing else is said.
    pub const ACCURACY: f64 = 1e-6;

    /// Method and steps chosen for an accuracy of [`Schedule::ACCURACY`].
    pub fn automatic(duration_s: f64, output_interval_s: f64) -> Self {
        let integration = Integration::Automatic { accuracy: Self::ACCURACY };
        Self { duration_s, output_interval_s, integration, bodies: Bodies::Reached }
    }

    /// Constant steps of a method.
    pub fn with_steps(duration_s: f64, output_interval_s: f64, method: Method, dt_s: f64) -> Self {
        let integration = Integration::Steps { method, dt_s };
        Self { integration, ..Self::automatic(duration_s, output_interval_s) }
    }
}

/// What the chain did.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Motion of bodies 1 to N at the output times.
    pub trajectory: Trajectory,
    /// Motion of the striker at the output times, where there is one.
    pub striker: Option<StrikerMotion>,
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
    /// Contact forces evaluated.
    pub force_evaluations: u64,
}

/// Motion of the striker at the output times.
#[derive(Debug, Clone, PartialEq)]
pub struct StrikerMotion {
    /// Displacement since it touched, in metres.
    pub displacement_m: Vec<f64>,
    /// Velocity in metres per second.
    pub velocity_m_per_s: Vec<f64>,
}

/// Stored displacements beyond which a simulation is refused (4 GB with the velocities).
const MAX_SAMPLES: f64 = 2.5e8;
/// Finest accuracy that the methods reach before their roundings add up.
const FINEST_ACCURACY: f64 = 1e-12;

/// Integrates the chain's motion from t = 0.
///
/// The striker's switches are located within a step and end it, so they cost no method its order.
///
/// # Errors
/// [`MechanicsError::NotPhysical`], [`MechanicsError::Length`] or [`MechanicsError::ImposedTooShort`] for input without
/// meaning; [`MechanicsError::StepTooLarge`] for a given step beyond the stability bound, at rest or at the stiffness
/// reached; [`MechanicsError::NotFor`], [`MechanicsError::OutOfReach`], [`MechanicsError::TooLarge`],
/// [`MechanicsError::NotFinite`] and [`MechanicsError::Chatter`] as they say.
pub fn simulate(chain: &Chain, schedule: &Schedule) -> Result<Simulation, MechanicsError> {
    chain.check()?;
    let n_outputs = schedule.check(chain)?;
    automatic::run(chain, schedule, n_outputs)
}

impl Schedule {
    /// Checks the schedule for a chain, and counts the outputs.
    fn check(&self, chain: &Chain) -> Result<usize, MechanicsError> {
        check::positive("duration_s", self.duration_s)?;
        check::positive("output_interval_s", self.output_interval_s)?;
        self.integration.check()?;
        // A duration that was meant as a multiple of the interval may lie a rounding below it.
        let n_intervals = (self.duration_s / self.output_interval_s * (1.0 + 1e-9)).floor();
        check::require(n_intervals >= 1.0, "duration_s", "at least one output_interval_s", self.duration_s)?;
        let n_samples = (n_intervals + 1.0) * chain.n_bodies() as f64;
        let hint = "a longer output_interval_s needs fewer";
        check::limit("outputs times bodies", MAX_SAMPLES, n_samples, hint)?;
        if let Drive::Imposed(motion) = &chain.drive {
            motion.check_covers(n_intervals * self.output_interval_s)?;
        }
        Ok(n_intervals as usize + 1)
    }
}

impl Integration {
    fn check(&self) -> Result<(), MechanicsError> {
        match *self {
            Self::Steps { dt_s, .. } => check::positive("dt_s", dt_s),
            Self::Automatic { accuracy } | Self::Accuracy { accuracy, .. } => check::require(
                (FINEST_ACCURACY..1.0).contains(&accuracy),
                "accuracy",
                "a number from 1e-12 to 1",
                accuracy,
            ),
        }
    }
}
