//! Bell for the sounds that are due by `crate::sound`: the terminal's from which the window was opened, where there is one.
//!
//! A window has no sound of its own, and no library for one is at hand: without a terminal alarms are drawn only, and
//! the alarms pane says so.

use std::io::{IsTerminal, Write};

use wire::time::Instant;

use crate::alarm::Priority;
use crate::shown::Shown;

/// The bell of one window.
#[derive(Debug)]
pub(super) struct Bell {
    terminal: bool,
    /// Time of the last picture.
    last: Option<Instant>,
}

impl Bell {
    /// The terminal's bell, if standard error is one.
    pub(super) fn new() -> Self {
        Self { terminal: std::io::stderr().is_terminal(), last: None }
    }

    /// True if it can be heard.
    pub(super) fn rings(&self) -> bool {
        self.terminal
    }

    /// Rings the sounds due since the last picture: three strokes for HIGH, two for MEDIUM. A recording is silent.
    pub(super) fn ring(&mut self, shown: &Shown) {
        let last = self.last.replace(shown.at).filter(|last| *last <= shown.at);
        let due =
            last.filter(|_| self.terminal && !shown.marks.replay).and_then(|last| shown.sound.due(last, shown.at));
        let Some(priority) = due else { return };
        let strokes = match priority {
            Priority::High => "\x07\x07\x07",
            Priority::Medium => "\x07\x07",
            Priority::Low => "\x07",
        };
        // A terminal that is gone rings no more.
        self.terminal = std::io::stderr().write_all(strokes.as_bytes()).is_ok();
    }
}
