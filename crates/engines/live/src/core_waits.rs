//! Waits of services for a core: time in which a service had work to do and the host ran another program, by the kernel's own count.
//!
//! The launcher's naps do not show them: on a busy host a sleeper is woken first, and a service with work to do shares the cores. A wait shows
//! that the host was busy, and no more; [`super::trial`] decides whether that alone made a run INVALID.

use std::collections::BTreeMap;
use std::fs;

use evidence::Micros;

/// Time between two looks, microseconds. A wait is measured over two of these intervals.
const INTERVAL_US: Micros = 100_000;
/// Least wait within two looks that is reported to an operator: half of what makes a run INVALID.
const REPORTED_US: Micros = super::OVERSLEPT_US / 2;
/// Most threads of a service that are read.
const MOST_THREADS: usize = 64;

/// The waits of all threads of a run's services so far.
#[derive(Debug, Default)]
pub(crate) struct CoreWaits {
    threads: BTreeMap<(u32, String), Thread>,
    looked_us: Micros,
    longest_us: Micros,
}

#[derive(Clone, Copy, Debug, Default)]
struct Thread {
    /// Sum of its waits since its start.
    total_us: Micros,
    /// Sum of its waits between the last two looks.
    recent_us: Micros,
}

impl CoreWaits {
    /// Reads the waits of the threads of these processes, at most once in an interval. Gives the longest wait since the look before the last,
    /// where it is to be reported.
    pub(crate) fn look(&mut self, now_us: Micros, processes: impl Iterator<Item = u32>) -> Option<Micros> {
        if now_us < self.looked_us + INTERVAL_US {
            return None;
        }
        self.looked_us = now_us;
        let mut longest_us = 0;
        for process in processes {
            for (thread, total_us) in read_waits(process) {
                longest_us = longest_us.max(self.record(process, thread, total_us));
            }
        }
        (longest_us >= REPORTED_US).then_some(longest_us)
    }

    /// The longest wait of one thread within two looks, microseconds.
    pub(crate) fn longest_us(&self) -> Micros {
        self.longest_us
    }

    /// Records the sum of a thread's waits, and gives its wait since the look before the last.
    fn record(&mut self, process: u32, thread: String, total_us: Micros) -> Micros {
        // Waits before a thread's first look belong to its start.
        let known = self.threads.entry((process, thread)).or_insert(Thread { total_us, recent_us: 0 });
        let recent_us = total_us.saturating_sub(known.total_us);
        let wait_us = known.recent_us + recent_us;
        *known = Thread { total_us, recent_us };
        self.longest_us = self.longest_us.max(wait_us);
        wait_us
    }
}

/// Each thread of a process, with all its waits for a core. Empty where the process ended, or the kernel does not count.
fn read_waits(process: u32) -> Vec<(String, Micros)> {
    let Ok(threads) = fs::read_dir(format!("/proc/{process}/task")) else { return Vec::new() };
    let read = |entry: fs::DirEntry| {
        let text = fs::read_to_string(entry.path().join("schedstat")).ok()?;
        Some((entry.file_name().to_string_lossy().into_owned(), parse_wait_us(&text)?))
    };
    threads.flatten().take(MOST_THREADS).filter_map(read).collect()
}

/// The second number of `schedstat`: nanoseconds on a run queue (Linux, Documentation/scheduler/sched-stats.rst).
fn parse_wait_us(text: &str) -> Option<Micros> {
    text.split_whitespace().nth(1)?.parse::<u64>().ok().map(|ns| ns / 1_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wait_is_the_second_number() {
        assert_eq!(parse_wait_us("8123456 98765432 17\n"), Some(98_765));
        assert_eq!((parse_wait_us("812"), parse_wait_us("1 many 2"), parse_wait_us("")), (None, None, None));
        assert!(!read_waits(std::process::id()).is_empty(), "this process has a thread");
    }

    #[test]
    fn longest_wait_spans_two_looks() {
        let mut waits = CoreWaits::default();
        let recorded = [500_000, 560_000, 620_000, 625_000].map(|total_us| waits.record(7, "7".to_owned(), total_us));
        assert_eq!((recorded, waits.longest_us()), ([0, 60_000, 120_000, 65_000], 120_000));
        assert_eq!(waits.record(7, "8".to_owned(), 900_000), 0, "waits before the first look do not count");
        assert_eq!(waits.longest_us(), 120_000);
    }
}
