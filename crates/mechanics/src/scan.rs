use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

use crate::{Chain, Drive, MechanicsError, Schedule, Simulation, Striker, simulate};

/// Simulates a chain for several striker velocities (metres per second), on `n_threads` threads.
///
/// The members come in the order of the velocities, each as [`simulate`] alone would give it, whatever the number of threads.
///
/// # Errors
/// [`MechanicsError::NotFor`] for a chain that no striker drives. A member that fails is an error of its own.
pub fn scan(
    chain: &Chain,
    velocities_m_per_s: &[f64],
    schedule: &Schedule,
    n_threads: NonZero<usize>,
) -> Result<Vec<Result<Simulation, MechanicsError>>, MechanicsError> {
    let Drive::Striker(striker) = &chain.drive else {
        let what = "a drive other than a striker";
        return Err(MechanicsError::NotFor { method: "scan of striker velocities", what });
    };
    let member = |i: usize| {
        let drive = Drive::Striker(Striker { velocity_m_per_s: velocities_m_per_s[i], ..*striker });
        simulate(&Chain { drive, ..chain.clone() }, schedule)
    };
    Ok(map_in_parallel(velocities_m_per_s.len(), n_threads, member))
}

/// Simulates many chains on `n_threads` threads, as fits and resampling ask for, and keeps of each what `read` takes from it.
///
/// They come in their order, each as [`simulate`] alone would give it, whatever the number of threads; no more long motions than
/// threads lie in memory at a time. A chain fills its vectors with its own bodies (27 of 32 lanes for the experiment's 26 and their
/// striker), so chains share the cores and not the vectors.
pub fn ensemble<T: Send + Sync>(
    chains: &[Chain],
    schedule: &Schedule,
    n_threads: NonZero<usize>,
    read: impl Fn(usize, Simulation) -> T + Sync,
) -> Vec<Result<T, MechanicsError>> {
    map_in_parallel(chains.len(), n_threads, |i| Ok(read(i, simulate(&chains[i], schedule)?)))
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
