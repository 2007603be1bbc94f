//! Outbox of every adversary, beside its plan: its log, its next outputs, and the order to stop.

use std::collections::VecDeque;

use config::setup::Setup;
use ground_truth::{Action, Note};
use minicbor::Encode;
use wire::audit::Journal;
use wire::core::{Input, Output, Side};
use wire::event::{Event, wire_hash};
use wire::time::{Instant, Span};

use crate::opening::Opening;

/// Log and outputs of an adversary.
#[derive(Clone, Debug)]
pub(crate) struct Outbox {
    quiet: bool,
    journal: Journal,
    out: VecDeque<Output>,
}

impl Outbox {
    /// An outbox with a log that begins at `now`.
    pub(crate) fn new(setup: &Setup, now: Instant) -> Self {
        let journal = Journal::new(setup.node, setup.boot, Some(setup.key()));
        let mut outbox = Self { quiet: false, journal, out: VecDeque::new() };
        outbox.write(now, Event::Started);
        outbox
    }

    /// True once the run is over, or about to be.
    pub(crate) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Notes the end of a run: `Quiesce` stops the actions, `Finish` has the log signed. True once the run is finished.
    pub(crate) fn heed(&mut self, now: Instant, input: &Input) -> bool {
        let ended = matches!(input, Input::Finish);
        self.quiet |= ended || matches!(input, Input::Quiesce);
        if ended {
            self.journal.sign(now, &mut self.out);
        }
        ended
    }

    /// Writes to the log.
    pub(crate) fn write(&mut self, now: Instant, event: impl Encode<()>) {
        self.journal.write(now, event, &mut self.out);
    }

    /// Logs the action on these very bytes on their way towards `side`. Logged first and then done, so that no effect
    /// is logged before its cause.
    pub(crate) fn attack(&mut self, now: Instant, action: Action, side: Side, bytes: &[u8], delay: Span) {
        let length = u16::try_from(bytes.len()).unwrap_or(u16::MAX);
        self.write(now, Note::Attack { action, side, length, hash: wire_hash(bytes), delay });
    }

    /// Says or does something.
    pub(crate) fn put(&mut self, output: Output) {
        self.out.push_back(output);
    }

    /// The next output.
    pub(crate) fn next(&mut self) -> Option<Output> {
        self.out.pop_front()
    }

    /// Actions see that something passes towards a side, and hear which step is called.
    pub(crate) fn notice(&mut self, openings: &mut [Opening], now: Instant, input: &Input, passes: Option<Side>) {
        for opening in openings.iter_mut() {
            if let Some(side) = passes {
                opening.passes(now, side);
            }
            if let Input::Cue { step } = input {
                opening.cue(now, step.as_str());
            }
        }
        self.settle(openings.iter_mut(), now);
    }

    /// Brings actions up to `now`: ended silences begin actions, and beginnings and ends are logged.
    pub(crate) fn settle<'o>(&mut self, openings: impl Iterator<Item = &'o mut Opening>, now: Instant) {
        for opening in openings {
            opening.silence(now);
            while let Some((step, begun)) = opening.next_boundary(now) {
                self.write(now, Note::Step { step, begun });
            }
        }
    }
}
