//! Recordings side by side.

use std::num::NonZero;

/// The threads that `jobs` asks for: all cores when `None`.
pub(crate) fn threads(jobs: Option<u16>) -> NonZero<usize> {
    let all_cores = || std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    jobs.and_then(|jobs| NonZero::new(usize::from(jobs))).unwrap_or_else(all_cores)
}

/// Applies `work` to every item on `jobs` threads (all cores when `None`); the results stand in the order of the items.
pub(crate) fn map_in_parallel<T: Sync, R: Send + Sync>(
    jobs: Option<u16>,
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    chainwave_measurement::map_in_parallel(items.len(), threads(jobs), |i| work(&items[i]))
}
