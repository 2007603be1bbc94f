//! Progress of a long command, on stderr; and the user's request to stop.
//!
//! A bar on a terminal, no output elsewhere: a log file or a pipe has no use for it. Results never go through here.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Verbosity on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Talk {
    /// Failures only.
    Quiet,
    /// Progress and failures.
    Normal,
}

/// The progress of one batch; shared by its threads.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    /// Share of a step in the total.
    weight: u64,
}

impl Progress {
    /// A bar of `total` steps.
    pub fn new(label: &str, total: usize, talk: Talk) -> Self {
        Self { bar: is_shown(talk).then(|| bar(label, total as u64)), weight: 1 }
    }

    /// A line of text in place of a bar, for a command with its own estimate.
    pub fn line(talk: Talk) -> Self {
        let line = || {
            let style = ProgressStyle::with_template("{wide_msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_style(style)
        };
        Self { bar: is_shown(talk).then(line), weight: 1 }
    }

    /// Shows this text.
    pub fn show(&self, text: impl FnOnce() -> String) {
        if let Some(bar) = &self.bar {
            bar.set_message(text());
        }
    }

    /// A line for a part of the work under its own label, where a step counts for `weight` of the total.
    pub fn part(&self, label: &str, weight: u64) -> Self {
        if let Some(bar) = &self.bar {
            bar.set_message(label.to_owned());
        }
        Self { bar: self.bar.clone(), weight }
    }

    /// One step is done.
    pub fn step(&self) {
        if let Some(bar) = &self.bar {
            bar.inc(self.weight);
        }
    }

    /// Result of `work`, which writes to the terminal, with the bar out of its way.
    pub fn hide_while<T>(&self, work: impl FnOnce() -> T) -> T {
        match &self.bar {
            Some(bar) => bar.suspend(work),
            None => work(),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn is_shown(talk: Talk) -> bool {
    talk == Talk::Normal && std::io::stderr().is_terminal()
}

fn bar(label: &str, total: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{msg:32} {bar:30} {pos}/{len} {per_sec} {elapsed}, {eta} left");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.set_message(label.to_owned());
    bar
}

/// The user's request to stop; every clone sees it.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks everything that looks at it to stop.
    pub fn ask(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// True if it was made.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
