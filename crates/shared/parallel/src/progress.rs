//! Progress of a long command, in one live line on stderr; and the user's request to stop.
//!
//! On a terminal the line has the done and the total steps, the time left, and how many trials ended in which class so far. Elsewhere there is
//! no output: a log file or a pipe has no use for it. Results never go through here; text beside the line goes through [`beside`].

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle, WeakProgressBar};

use crate::paint::{Colour, Stream, is_dumb, painted};

/// Time after which the line is drawn anew where no step ends.
const TICK: Duration = Duration::from_millis(500);
/// Characters of a label, at most.
const MAX_LABEL: usize = 24;

/// Verbosity on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Talk {
    /// Failures only.
    Quiet,
    /// Progress and failures.
    Normal,
}

/// Trials by class: the attention that its colour asks for, its rank among those, and its name.
type Counts = BTreeMap<(u8, usize, &'static str), u64>;

/// The progress of one batch; shared by its threads. The line goes with the last of its owners.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    /// Share of a step in the total.
    weight: u64,
    counts: Mutex<Counts>,
}

impl Progress {
    /// A line of `total` steps.
    pub fn new(label: &str, total: usize, talk: Talk) -> Self {
        // Work without a step is no progress: everything was there already.
        let bar =
            (total > 0 && is_shown(talk)).then(|| shown("{prefix} {bar:12} {pos}/{len}{left}  {wide_msg}", total));
        bar.iter().for_each(|bar| {
            bar.set_prefix(short(label));
            bar.enable_steady_tick(TICK);
        });
        Self::of_bar(bar, 1)
    }

    /// A line of text in place of the steps, for a command with its own estimate.
    pub fn line(talk: Talk) -> Self {
        Self::of_bar(is_shown(talk).then(|| shown("{wide_msg}", 0)), 1)
    }

    fn of_bar(bar: Option<ProgressBar>, weight: u64) -> Self {
        Self { bar, weight, counts: Mutex::default() }
    }

    /// Shows this text, and the counted classes behind it.
    pub fn show(&self, text: impl FnOnce() -> String) {
        if let Some(bar) = &self.bar {
            let counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
            bar.set_message(format!("{}  {}", text(), painted(&listed(&counts), Stream::Stderr)));
        }
    }

    /// A line for a part of the work under its own label, where a step counts for `weight` of the total.
    pub fn part(&self, label: &str, weight: u64) -> Self {
        if let Some(bar) = &self.bar {
            bar.set_prefix(short(label));
            bar.set_message("");
        }
        Self::of_bar(self.bar.clone(), weight)
    }

    /// One trial ended in the class of this name. Those that ask for attention stand first, where no terminal cuts them off, and then
    /// the others, each in the order of their ranks.
    pub fn count(&self, rank: usize, class: &'static str) {
        let Some(bar) = &self.bar else { return };
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        *counts.entry((urgency(class), rank, class)).or_default() += 1;
        // A text in place of the steps comes with the counts when it is shown.
        if bar.length().is_some_and(|steps| steps > 0) {
            bar.set_message(painted(&listed(&counts), Stream::Stderr));
        }
    }

    /// One step is done.
    pub fn step(&self) {
        if let Some(bar) = &self.bar {
            bar.inc(self.weight);
        }
    }

    /// Takes the line away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// The line that is on the terminal.
static SHOWN: Mutex<Option<WeakProgressBar>> = Mutex::new(None);

thread_local! {
    /// True while this thread has the line out of its way.
    static IS_HIDDEN: Cell<bool> = const { Cell::new(false) };
}

/// Result of `work`, which writes to the terminal, with the line out of its way.
pub fn beside<T>(work: impl FnOnce() -> T) -> T {
    let bar = SHOWN.lock().unwrap_or_else(PoisonError::into_inner).as_ref().and_then(WeakProgressBar::upgrade);
    match bar.filter(|bar| !bar.is_finished() && !IS_HIDDEN.get()) {
        Some(bar) => bar.suspend(|| {
            IS_HIDDEN.set(true);
            let done = work();
            IS_HIDDEN.set(false);
            done
        }),
        None => work(),
    }
}

fn is_shown(talk: Talk) -> bool {
    talk == Talk::Normal && std::io::stderr().is_terminal() && !is_dumb()
}

/// A line on the terminal, in place of the one before.
fn shown(template: &str, total: usize) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("left", write_left).progress_chars("━━─"));
    }
    let bar = bar.with_finish(ProgressFinish::AndClear);
    *SHOWN.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.downgrade());
    bar
}

/// The estimated time left, or the time so far before the first step, which estimates it.
fn write_left(state: &ProgressState, line: &mut dyn Write) {
    let (time, what) = match state.pos() {
        0 => (state.elapsed(), "so far"),
        _ => (state.eta(), "left"),
    };
    // There is no remedy for a line that takes no text.
    let _undrawn = write!(line, ", {} {what}", duration(time.as_secs_f64()));
}

/// A duration in one or two units, to the second.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..120 => format!("{whole} s"),
        120..7_200 => format!("{} min {} s", whole / 60, whole % 60),
        7_200.. => format!("{} h {} min", whole / 3_600, whole / 60 % 60),
    }
}

fn urgency(class: &str) -> u8 {
    match Colour::of_word(class) {
        Some(Colour::Alarm) => 0,
        Some(Colour::Caution) => 1,
        None => 2,
    }
}

fn listed(counts: &Counts) -> String {
    counts.iter().map(|((_, _, class), n)| format!("{class} {n}")).collect::<Vec<_>>().join(", ")
}

fn short(label: &str) -> String {
    label.chars().take(MAX_LABEL).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_that_ask_for_attention_stand_first() {
        let counts: Counts = [(5, "HOLD_SAFE"), (8, "UNDETECTED"), (2, "INVALID"), (0, "UNSAFE")]
            .map(|(rank, class)| ((urgency(class), rank, class), 3))
            .into();
        assert_eq!(listed(&counts), "UNSAFE 3, UNDETECTED 3, INVALID 3, HOLD_SAFE 3");
    }

    #[test]
    fn duration_has_units_of_its_size() {
        let texts = [0.04, 12.4, 200.0, 7_300.0].map(duration);
        assert_eq!(texts, ["0 s", "12 s", "3 min 20 s", "2 h 1 min"]);
    }

    #[test]
    fn work_beside_a_hidden_line_may_be_nested() {
        assert_eq!(beside(|| beside(|| 7)), 7);
    }
}
