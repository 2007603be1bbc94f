//! Ctrl-C: the first requests a clean end, the second ends the process at once.
//!
//! The signals are blocked and read from a descriptor by one thread, so no handler runs in the middle of anything.
//! Children that the live launcher starts get an empty mask from the standard library.

use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::SignalFd;
use parallel::progress::{Stop, beside};

use crate::failure::Exit;
use crate::out;

/// Starts to watch; to be called before any other thread exists, since later threads inherit the blocked signals.
pub(crate) fn watch() -> Stop {
    let stop = Stop::default();
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGINT);
    signals.add(Signal::SIGTERM);
    if let Err(error) = signals.thread_block() {
        tracing::warn!(%error, "Ctrl-C ends the run at once");
        return stop;
    }
    match SignalFd::new(&signals) {
        Ok(descriptor) => {
            let watched = stop.clone();
            std::thread::spawn(move || wait(&descriptor, &watched));
        }
        Err(error) => {
            tracing::warn!(%error, "Ctrl-C ends the run at once");
            if let Err(error) = signals.thread_unblock() {
                tracing::warn!(%error, "signals stay blocked");
            }
        }
    }
    stop
}

fn wait(descriptor: &SignalFd, stop: &Stop) {
    loop {
        match descriptor.read_signal() {
            // The line of progress does not stay behind.
            Ok(Some(_)) if stop.is_requested() => beside(|| std::process::exit(i32::from(Exit::Interrupted.code()))),
            Ok(Some(_)) => {
                out::note("stopping; once more to end at once");
                stop.ask();
            }
            Ok(None) => {}
            Err(error) => {
                tracing::warn!(%error, "Ctrl-C is no longer watched");
                return;
            }
        }
    }
}
