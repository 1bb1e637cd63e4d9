//! Recordings side by side.

use std::num::NonZero;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Applies `work` to every item on `jobs` threads (all cores when `None`); the results stand in the order of the items.
///
/// These are plain threads: a worker of a thread pool that waits for the table library's own pool takes up further items
/// meanwhile, one inside the other, and holds all their recordings open.
pub(crate) fn map_in_parallel<T: Sync, R: Send + Sync>(
    jobs: Option<u16>,
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let all_cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
    let n_threads = jobs.map_or_else(all_cores, usize::from).min(items.len());
    let results: Vec<OnceLock<R>> = items.iter().map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    let take_items = || {
        while let Some((item, result)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            items.get(index).zip(results.get(index))
        } {
            result.get_or_init(|| work(item));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..n_threads {
            scope.spawn(take_items);
        }
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_items() {
        let items: Vec<u64> = (0..100).collect();
        for jobs in [Some(1), Some(3), Some(500), None] {
            let squares = map_in_parallel(jobs, &items, |item| item * item);
            assert_eq!(squares, items.iter().map(|item| item * item).collect::<Vec<_>>());
        }
        assert!(map_in_parallel(None, &[0_u8; 0], |item| *item).is_empty());
    }
}
