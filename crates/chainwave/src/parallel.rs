//! How many threads a command may use.

use std::num::NonZero;

/// The threads that `--jobs` asks for: all cores when `None`.
pub(crate) fn threads(jobs: Option<u16>) -> NonZero<usize> {
    let all_cores = || std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    jobs.and_then(|jobs| NonZero::new(usize::from(jobs))).unwrap_or_else(all_cores)
}
