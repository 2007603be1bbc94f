//! Parallel work on many items, on several threads; results in the order of the items, independent of threads. `progress` shows how far it
//! came, `paint` colours its classes.

pub mod paint;
pub mod progress;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Does `one` for each number below `count`, on at most `threads` threads.
///
/// # Errors
///
/// The failure of the least number that failed; no item is begun after a failure was seen.
pub fn each<E: Send>(threads: usize, count: usize, one: impl Fn(usize) -> Result<(), E> + Sync) -> Result<(), E> {
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(None::<(usize, E)>));
    let first = || failed.lock().unwrap_or_else(PoisonError::into_inner);
    let work = || {
        // What has been taken is done even so: else a later failure could be reported in place of an earlier one.
        while first().is_none() {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                return;
            }
            if let Err(failure) = one(i) {
                let mut first = first();
                if first.as_ref().is_none_or(|(index, _)| i < *index) {
                    *first = Some((i, failure));
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.min(count) {
            scope.spawn(work);
        }
        work();
    });
    failed.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), |(_, failure)| Err(failure))
}

/// Results of `work` on each of `items`.
///
/// # Errors
///
/// As [`each`].
pub fn map<I: Sync, O: Send, E: Send>(
    threads: usize,
    items: &[I],
    work: impl Fn(&I) -> Result<O, E> + Sync,
) -> Result<Vec<O>, E> {
    let slots: Vec<Mutex<Option<O>>> = items.iter().map(|_| Mutex::new(None)).collect();
    each(threads, items.len(), |i| {
        let done = work(&items[i])?;
        *slots[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
        Ok(())
    })?;
    Ok(slots.into_iter().filter_map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner)).collect())
}

/// Number of threads that have a core each.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_item_order_on_any_threads() {
        let items: Vec<u64> = (0..100).collect();
        let square = |i: &u64| Ok::<u64, ()>(i * i);
        assert_eq!(map(1, &items, square), map(7, &items, square));
    }

    #[test]
    fn of_several_failures_the_first_is_the_result() {
        let items: Vec<u64> = (0..100).collect();
        assert_eq!(map(4, &items, |i| if *i < 50 { Ok(*i) } else { Err(*i) }), Err(50));
    }
}
