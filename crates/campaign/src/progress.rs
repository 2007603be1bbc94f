//! How far a long command has come, on stderr; and whether the user wants it to stop.
//!
//! On a terminal a bar, elsewhere a line now and then. Results never go through here.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How many lines a run without a terminal prints.
const SPARSE_LINES: u64 = 10;

/// How much is said on stderr.
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
    label: String,
    total: u64,
    since_us: u64,
    done: AtomicU64,
    bar: Option<ProgressBar>,
    talk: Talk,
}

impl Progress {
    /// Of `total` steps.
    pub fn new(label: &str, total: usize, talk: Talk) -> Self {
        let total = total as u64;
        let bar = (talk == Talk::Normal && std::io::stderr().is_terminal()).then(|| bar(label, total));
        Self { label: label.to_owned(), total, since_us: link::clock::trace_us(), done: AtomicU64::new(0), bar, talk }
    }

    /// One step is done.
    pub fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let every = self.total.div_ceil(SPARSE_LINES).max(1);
        match (&self.bar, self.talk) {
            (Some(bar), _) => bar.inc(1),
            (None, Talk::Normal) if done.is_multiple_of(every) || done == self.total => {
                let each = link::clock::trace_us().saturating_sub(self.since_us) as f64 / 1e6 / done as f64;
                let left = each * (self.total - done) as f64;
                let (label, total, rate) = (&self.label, self.total, each.recip());
                eprintln!("{label}: {done} of {total}, {rate:.1} a second, about {left:.0} s left");
            }
            (None, Talk::Normal | Talk::Quiet) => {}
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
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

/// Whether the user wants to stop; every clone sees it.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks everything that looks at it to stop.
    pub fn ask(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether to stop.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
