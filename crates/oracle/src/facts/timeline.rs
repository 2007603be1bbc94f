//! The events of a trial, sorted by subject. No event is judged here.

use std::collections::BTreeMap;

use evidence::trial::TransitionRow;
use evidence::{Evidence, Micros, Under};
use instrument::{Any, Entry, Note};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{CommandId, NodeId, ObjectId, RecordId, TrackId};
use wire::mode::{Cause, Guards, Mode};

use crate::motion;

pub(crate) use crate::motion::{Kept, Truth};

/// A change of mode of the unit under test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Time of the change.
    pub at: Micros,
    /// From.
    pub from: Mode,
    /// To.
    pub to: Mode,
    /// Cause, in the unit's own words.
    pub cause: Cause,
}

/// Basis of unit A's judgement, in its own words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judged {
    /// Guards that failed.
    pub failing: Guards,
    /// Its place was no older than *Tf*.
    pub placed: bool,
    /// Tracks that were no older than that.
    pub tracks: u8,
}

/// Place at which unit A took itself to be, in its own words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stood {
    /// Time at which it said so.
    pub at: Micros,
    /// Time at which the fix behind it was taken.
    pub fixed: Micros,
    /// East and north, mm.
    pub place: (i32, i32),
}

/// The sorted events.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    /// Mode changes of unit A.
    pub changes: Vec<Change>,
    /// Basis of unit A's judgement, with its beginning.
    pub judged: Vec<(Micros, Judged)>,
    /// Places at which unit A took itself to be.
    pub poses: Vec<Stood>,
    /// Truth of unit A.
    pub truth: Vec<Truth>,
    /// Objects that unit A came to touch: (when, object, speed towards it before, mm/s).
    pub collisions: Vec<(Micros, ObjectId, i32)>,
    /// Authority minted: (when, serial, over which track).
    pub minted: Vec<(Micros, u32, TrackId)>,
    /// Authority that ended unused: (when, serial).
    pub revoked: Vec<(Micros, u32)>,
    /// Operator's intents.
    pub intended: Vec<(Micros, CommandId, CommandKind)>,
    /// Time tags of intents: microseconds until each is due, and for how long it may be carried out from then on.
    pub tags: BTreeMap<CommandId, (Micros, Micros)>,
    /// Times at which unit A stored a command.
    pub stored: BTreeMap<CommandId, Micros>,
    /// Commands that unit A executed.
    pub executed: Vec<(Micros, CommandId, CommandKind)>,
    /// Reports that the gateway accepted of unit A.
    pub accepted: Vec<(Micros, RecordId)>,
    /// Refusals at network interfaces, each with its time and the service that refused.
    pub refused: Vec<(Micros, NodeId)>,
}

impl Timeline {
    /// Sorts the events of `evidence`.
    pub fn of(evidence: &Evidence) -> Timeline {
        let mut line = Timeline::default();
        evidence.entries.iter().for_each(|w| line.take(w.at, &w.entry, evidence.under));
        motion::settle(&mut line.truth);
        line
    }

    fn take(&mut self, at: Micros, entry: &Entry, under: Under) {
        let node = entry.node;
        let of_unit = node == under.node();
        match entry.event {
            Any::Service(Event::Transition { from, to, cause, .. }) if of_unit => {
                self.changes.push(Change { at, from, to, cause })
            }
            // A unit that is started again knows of no mode before.
            Any::Instrument(Note::Restarted { node, .. }) if node == under.node() => {
                let from = self.changes.last().map_or(Mode::Idle, |c| c.to);
                self.changes.push(Change { at, from, to: Mode::Idle, cause: Cause::Start });
            }
            Any::Instrument(Note::Truth {
                unit,
                x_mm,
                y_mm,
                speed_mm_s,
                set_speed_mm_s,
                leased,
                fence_mm: fence,
                ..
            }) if unit == under.unit => {
                let (place, speed) = ((x_mm, y_mm), speed_mm_s.saturating_abs());
                let (set_speed, kept) = (set_speed_mm_s, None);
                let (stamp, safe, asked_safe) = (entry.at.0, true, true);
                let truth = Truth { at, stamp, place, speed, set_speed, leased, fence, safe, asked_safe, kept };
                self.truth.push(truth);
            }
            // Of the sample before it.
            Any::Instrument(Note::Margins { unit, safe, asked, energy, clearance }) if unit == under.unit => {
                if let Some(truth) = self.truth.last_mut() {
                    (truth.safe, truth.asked_safe) = (safe >= 0, asked >= 0);
                    truth.kept = Some(Kept { energy, clearance });
                }
            }
            Any::Instrument(Note::Collided { unit, object, speed_mm_s }) if unit == under.unit => {
                self.collisions.push((at, object, speed_mm_s));
            }
            Any::Service(Event::Judged { failing, placed, tracks }) if of_unit => {
                self.judged.push((at, Judged { failing, placed, tracks }));
            }
            Any::Service(Event::Located { stamp, pose_x_mm, pose_y_mm, .. }) if of_unit => {
                let fixed = at.saturating_sub(entry.at.since(stamp).0);
                self.poses.push(Stood { at, fixed, place: (pose_x_mm, pose_y_mm) });
            }
            Any::Service(Event::Minted { authority, track, .. }) if of_unit => self.minted.push((at, authority, track)),
            Any::Service(Event::Revoked { authority, .. }) if of_unit => self.revoked.push((at, authority)),
            Any::Service(Event::Intended { command, kind, tag }) if node == NodeId::CONSOLE => {
                self.intended.push((at, command, kind));
                self.tags.extend(tag.map(|tag| (command, (tag.after.0, tag.within.0))));
            }
            Any::Service(Event::Stored { command, .. }) if of_unit => {
                self.stored.insert(command, at);
            }
            Any::Service(Event::Executed { command, kind, refused: None }) if of_unit => {
                self.executed.push((at, command, kind))
            }
            Any::Service(Event::Accepted { record, .. }) if node == NodeId::GATEWAY => self.accepted.push((at, record)),
            Any::Service(Event::Refused { at: interface, .. })
                if !matches!(interface, wire::event::Interface::Bus(_)) =>
            {
                self.refused.push((at, node));
            }
            _ => {}
        }
    }

    /// True if an operator had given exactly this by `at`: the id alone could be of another command.
    pub fn gave(&self, id: CommandId, wanted: CommandKind, at: Micros) -> bool {
        self.intended.iter().any(|(given, command, kind)| *command == id && *kind == wanted && *given <= at)
    }

    /// Time at which an order that was given at `given` is due at the latest: a time tag counts from before it.
    pub fn due(&self, id: CommandId, given: Micros) -> Micros {
        given.saturating_add(self.tags.get(&id).map_or(0, |(after, _)| *after))
    }

    /// Mode of unit A at `at`.
    pub fn mode_at(&self, at: Micros) -> Mode {
        self.changes.iter().take_while(|c| c.at <= at).last().map_or(Mode::Idle, |c| c.to)
    }

    /// True if unit A was in `mode` at some instant of `[from, to]`.
    pub fn was_in(&self, mode: Mode, from: Micros, to: Micros) -> bool {
        self.mode_at(from) == mode || self.changes.iter().any(|c| c.at >= from && c.at <= to && c.to == mode)
    }

    /// True if unit A judged by values that satisfy `test` at some instant of `[from, to]`.
    pub fn went_by(&self, from: Micros, to: Micros, test: impl Fn(&Judged) -> bool) -> bool {
        let first = self.judged.partition_point(|(at, _)| *at <= from).saturating_sub(1);
        self.judged[first..].iter().take_while(|(at, _)| *at <= to).any(|(_, judged)| test(judged))
    }

    /// True if unit A held authority over `track` at some instant of `[from, to]`.
    pub fn held(&self, track: TrackId, from: Micros, to: Micros) -> bool {
        let next = self.minted.iter().skip(1).map(|(at, ..)| *at).chain(std::iter::once(Micros::MAX));
        let mut spans = self.minted.iter().zip(next).filter(|((.., over), _)| *over == track);
        spans.any(|((at, ..), until)| {
            let (first, last) = (from.max(*at), to.min(until));
            first <= last && self.was_in(Mode::PrepareToAct, first, last)
        })
    }

    /// True if unit A held authority at `at`.
    pub fn authority_at(&self, at: Micros) -> bool {
        self.mode_at(at) == Mode::PrepareToAct
    }

    /// The first change at or after `from` that satisfies `test`.
    pub fn first_change(&self, from: Micros, test: impl Fn(&Change) -> bool) -> Option<Change> {
        self.changes.iter().find(|c| c.at >= from && test(c)).copied()
    }

    /// Time in READY or PREPARE_TO_ACT up to `end`.
    pub fn nominal(&self, end: Micros) -> Micros {
        let starts = self.changes.iter();
        let ends = self.changes.iter().skip(1).map(|c| c.at).chain(std::iter::once(end));
        let spans = starts.zip(ends).filter(|(c, _)| matches!(c.to, Mode::Ready | Mode::PrepareToAct));
        spans.map(|(c, until)| until.saturating_sub(c.at)).sum()
    }

    /// The transitions as rows of a report.
    pub fn rows(&self) -> Vec<TransitionRow> {
        let row = |c: &Change| TransitionRow {
            t_ms: c.at as f64 / 1000.0,
            from: c.from.name().into(),
            to: c.to.name().into(),
            cause: c.cause.label(),
        };
        self.changes.iter().map(row).collect()
    }
}
