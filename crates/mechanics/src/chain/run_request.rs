//! What an integration is asked for.

use super::schedule::Bodies;
use crate::integrator::method::Method;

/// What a run is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunRequest {
    pub(crate) method: Method,
    pub(crate) pacing: Pacing,
    pub(crate) bodies: Bodies,
    pub(crate) output_interval_s: f64,
    pub(crate) n_outputs: usize,
    /// Of so many outputs one is kept, the first one and each that comes so many behind it.
    pub(crate) keep_every: usize,
    /// Whether the states of all masses at all outputs are held beside those that are kept.
    pub(crate) holds_steps: bool,
}

/// How a run finds its steps.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pacing {
    /// The largest step up to this one that divides the output interval.
    Constant { dt_s: f64 },
    /// Steps whose estimated errors add up to this accuracy over the run when they grow by the factor `room` on their way.
    Adaptive { accuracy: f64, room: f64 },
}
