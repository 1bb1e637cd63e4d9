//! Work spread over threads, with results that do not depend on their number.

use std::num::NonZero;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The values of items 0 to n - 1 in their order, worked out on up to `n_threads` threads, each of which takes the next item
/// that none has taken.
///
/// An item's value depends on its number alone, so the result is the same for any number of threads. These are plain threads: a
/// worker of a thread pool that waits for a library's own pool takes up further items meanwhile, one inside the other, and
/// holds all their recordings open. A panic of an item goes on to the caller.
pub fn map_in_parallel<T: Send + Sync>(
    n_items: usize,
    n_threads: NonZero<usize>,
    value_of: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let n_threads = n_threads.get().min(n_items);
    if n_threads <= 1 {
        return (0..n_items).map(value_of).collect();
    }
    let values: Vec<OnceLock<T>> = (0..n_items).map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    let take_items = || {
        while let Some((i, value)) = {
            let i = next.fetch_add(1, Ordering::Relaxed);
            values.get(i).map(|value| (i, value))
        } {
            value.get_or_init(|| value_of(i));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..n_threads {
            scope.spawn(take_items);
        }
        take_items();
    });
    values.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// The values of two pieces of work, one beside the other where there are two threads or more.
///
/// Each may share its own work among as many threads, so that those of the one that ends first do not idle. A panic of either goes on to the
/// caller.
pub fn both_in_parallel<A: Send, B>(
    n_threads: NonZero<usize>,
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B,
) -> (A, B) {
    if n_threads.get() == 1 {
        return (first(), second());
    }
    std::thread::scope(|scope| {
        let beside = scope.spawn(first);
        let second = second();
        (beside.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), second)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_keep_the_order_of_the_items() {
        let squares: Vec<usize> = (0..100).map(|i| i * i).collect();
        for n_threads in [1, 3, 500] {
            assert_eq!(map_in_parallel(100, NonZero::new(n_threads).unwrap(), |i| i * i), squares);
        }
        assert!(map_in_parallel(0, NonZero::<usize>::MIN, |i| i).is_empty());
    }

    #[test]
    fn two_pieces_of_work_give_their_values_one_after_the_other_and_beside_each_other() {
        for n_threads in [1, 2, 7] {
            let both = both_in_parallel(NonZero::new(n_threads).unwrap(), || "first", || 2);
            assert_eq!(both, ("first", 2));
        }
    }

    #[test]
    #[should_panic(expected = "the first")]
    fn a_panic_beside_is_not_swallowed() {
        both_in_parallel(NonZero::new(2).unwrap(), || panic!("the first"), || ());
    }

    #[test]
    #[should_panic(expected = "scoped thread panicked")]
    fn a_panic_of_an_item_is_not_swallowed() {
        // The caller's own thread waits, so that another one meets the item.
        let caller = std::thread::current().id();
        let value_of = |_| match std::thread::current().id() == caller {
            true => std::thread::sleep(std::time::Duration::from_millis(20)),
            false => panic!("an item"),
        };
        map_in_parallel(2, NonZero::new(2).unwrap(), value_of);
    }
}
