//! Duration, outputs, method and step of a simulation.

use crate::equations::parameters::{Chain, Drive};
use crate::{check, error::MechanicsError, integrator::method::Method};

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

/// Finest accuracy that the methods reach before their roundings add up.
const FINEST_ACCURACY: f64 = 1e-12;

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

impl Schedule {
    /// Checks the schedule for a chain, of whose outputs one of so many is kept, and counts them all.
    pub(super) fn check(&self, chain: &Chain, keep_every: usize) -> Result<usize, MechanicsError> {
        check::positive("duration_s", self.duration_s)?;
        check::positive("output_interval_s", self.output_interval_s)?;
        self.integration.check()?;
        // A duration that was meant as a multiple of the interval may lie a rounding below it.
        let n_intervals = (self.duration_s / self.output_interval_s * (1.0 + 1e-9)).floor();
        check::require(n_intervals >= 1.0, "duration_s", "at least one output_interval_s", self.duration_s)?;
        let n_samples = (n_intervals / keep_every as f64 + 1.0) * chain.n_bodies() as f64;
        let hint = "a longer output_interval_s needs fewer";
        check::limit("outputs times bodies", check::MAX_STORED, n_samples, hint)?;
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
