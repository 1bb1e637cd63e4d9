//! Duration, outputs, step and threads of a ring simulation.

/// When a simulation ends, when it reports, its step and its threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingSchedule {
    /// Length of the simulation in seconds. Outputs lie at all multiples of the interval up to it.
    pub duration_s: f64,
    /// Time between outputs, in seconds.
    pub output_interval_s: f64,
    /// Largest time step in seconds; the step used is the next smaller one that divides the output interval. `None`: 0.9
    /// of the largest stable one.
    pub dt_s: Option<f64>,
    /// Whether the rings' shapes are wanted.
    pub shapes: bool,
    /// Threads; the result does not depend on them.
    pub n_threads: usize,
}
