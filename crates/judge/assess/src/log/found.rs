//! Findings about a file besides its messages: places that were lost, the place where reading stopped, and notes.

use std::fmt::Display;

use super::End;

/// Most places that are listed one by one.
const MAX_LISTED: usize = 16;
/// Most of them that one sentence names.
const MAX_NAMED: usize = 3;

/// A stretch of a file that could not be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Its first byte.
    pub from: u64,
    /// The first byte that was read again.
    pub to: u64,
    /// Reason.
    pub why: String,
}

/// Findings about a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Found {
    /// The first stretches that could not be read.
    gaps: Vec<Gap>,
    /// The number of all of them.
    lost: u32,
    /// Offset and reason of an early end.
    stopped: Option<(u64, String)>,
    /// Sentences without a full stop.
    pub(super) notes: Vec<String>,
    /// Time that a ULog's logger lost by its own account, milliseconds.
    pub(super) dropouts_ms: u64,
}

impl Found {
    /// Stretches lost so far.
    pub(super) fn lost(&self) -> u32 {
        self.lost
    }

    pub(super) fn is_whole(&self) -> bool {
        self.lost == 0 && self.stopped.is_none()
    }

    /// Leaves out a stretch. One that follows on the last becomes a part of it.
    pub(super) fn lose(&mut self, from: usize, to: usize, reason: &dyn Display) {
        let (from, to) = (from as u64, to as u64);
        match self.gaps.last_mut().filter(|gap| gap.to == from) {
            Some(gap) => gap.to = to,
            None => {
                self.lost = self.lost.saturating_add(1);
                if self.gaps.len() < MAX_LISTED {
                    self.gaps.push(Gap { from, to, why: reason.to_string() });
                }
            }
        }
    }

    pub(super) fn stop(&mut self, at: usize, reason: String) {
        self.stopped = Some((at as u64, reason));
    }

    pub(super) fn note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// The findings of a file that another one follows: its early end becomes a lost stretch like others.
    pub(super) fn followed(mut self, length: usize) -> Self {
        if let Some((offset, reason)) = self.stopped.take() {
            self.lose(usize::try_from(offset).unwrap_or(length), length, &reason);
        }
        self
    }

    /// Adds the findings in a file that begins at this offset of all; `name` tells it from the others.
    pub(super) fn add(&mut self, other: Found, offset: u64, name: Option<&str>) {
        let in_file = |reason: &str| name.map_or_else(|| reason.to_owned(), |name| format!("{name}: {reason}"));
        for gap in other.gaps {
            if self.gaps.len() < MAX_LISTED {
                self.gaps.push(Gap { from: gap.from + offset, to: gap.to + offset, why: in_file(&gap.why) });
            }
        }
        self.lost = self.lost.saturating_add(other.lost);
        if let Some((at, reason)) = other.stopped {
            self.stopped = self.stopped.take().or(Some((at + offset, in_file(&reason))));
        }
        let known = other.notes.iter().map(|note| in_file(note)).filter(|note| !self.notes.contains(note));
        let notes: Vec<String> = known.collect();
        self.notes.extend(notes);
        self.dropouts_ms = self.dropouts_ms.saturating_add(other.dropouts_ms);
    }

    /// The place up to which a recording of this length was read, and the gaps before it.
    pub(super) fn end(&self, of: u64) -> End {
        let lost = (self.lost > 0).then(|| self.in_words());
        let (at, stopped) = match &self.stopped {
            Some((at, why)) => (*at, Some(why.clone())),
            None => (of, None),
        };
        let reason = [stopped, lost].into_iter().flatten().collect::<Vec<_>>().join("; ");
        End { at, of, why: (!reason.is_empty()).then_some(reason), gaps: self.gaps.clone() }
    }

    fn in_words(&self) -> String {
        let one = |gap: &Gap| format!("bytes {} to {} ({})", gap.from, gap.to, gap.why);
        let named = self.gaps.iter().take(MAX_NAMED).map(one).collect::<Vec<_>>().join(", ");
        let further = (self.lost as usize).saturating_sub(MAX_NAMED);
        let further = if further > 0 { format!(" and {further} further stretches") } else { String::new() };
        let parts = if self.lost == 1 { "part" } else { "parts" };
        format!("{} {parts} could not be read: {named}{further}", self.lost)
    }
}
