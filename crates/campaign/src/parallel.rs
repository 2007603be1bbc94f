//! The same work on many items, on several threads; results in the order of the items whatever thread did what.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `work` on each of `items`, on at most `threads` threads. The first item, in their order, that fails is the result;
/// none is begun after a failure was seen.
///
/// # Errors
/// What `work` failed with.
pub fn map<I: Sync, O: Send, E: Send>(
    threads: usize,
    items: &[I],
    work: impl Fn(&I) -> Result<O, E> + Sync,
) -> Result<Vec<O>, E> {
    let (next, failed) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let slots: Vec<Mutex<Option<Result<O, E>>>> = items.iter().map(|_| Mutex::new(None)).collect();
    let run = || {
        while failed.load(Ordering::Relaxed) == 0 {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let (Some(item), Some(slot)) = (items.get(i), slots.get(i)) else { return };
            let result = work(item);
            if result.is_err() {
                failed.store(1, Ordering::Relaxed);
            }
            *slot.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(result);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, items.len().max(1)) {
            scope.spawn(run);
        }
    });
    let results = slots.into_iter().map(|slot| slot.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner));
    // Slots that nobody filled come after a failure.
    results.flatten().collect()
}

/// How many threads there is a core for.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items_however_many_threads_there_are() {
        let items: Vec<u64> = (0..100).collect();
        let square = |i: &u64| Ok::<u64, ()>(i * i);
        assert_eq!(map(1, &items, square), map(7, &items, square));
    }

    #[test]
    fn a_failure_is_the_result() {
        let items: Vec<u64> = (0..100).collect();
        assert_eq!(map(4, &items, |i| if *i == 50 { Err(*i) } else { Ok(*i) }), Err(50));
    }
}
