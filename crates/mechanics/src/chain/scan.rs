//! Many simulations on several threads: striker velocities, or any chains.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

use super::{schedule::Schedule, simulate::simulate, simulation::Simulation};
use crate::equations::parameters::{Chain, Drive, Striker};
use crate::error::MechanicsError;

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
