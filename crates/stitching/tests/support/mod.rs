//! A motion that several tests read.

/// Displacement in metres of a travelling step, whose size, arrival and steepness depend on the drive as in a softening chain. It starts
/// with a finite acceleration, as under a striker.
pub(crate) fn step_m(body: usize, time_s: f64, drive: f64) -> f64 {
    let arrival_s = (body - 1) as f64 * 0.7e-3 * (1.0 + 0.1 * drive);
    let tau = ((time_s - arrival_s) / 3e-3).max(0.0);
    14e-3 * (1.0 + drive) * (1.0 - (-tau * tau).exp()) * (1.0 + 0.1 * drive * tau)
}
