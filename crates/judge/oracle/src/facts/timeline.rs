//! The events of a trial, sorted by subject. No event is judged here.

use std::collections::BTreeMap;

use evidence::trial::TransitionRow;
use evidence::{Evidence, Micros, Under};
use ground_truth::{Any, Entry, Note};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{CommandId, NodeId, ObjectId, RecordId, TrackId};
use wire::mode::{Cause, Guards, Mode};

use super::Span;
use super::motion::{self, Reserves, Truth};

/// A change of mode of the unit under test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Change {
    /// Time of the change.
    pub at: Micros,
    /// Mode before it.
    pub from: Mode,
    /// Mode after it.
    pub to: Mode,
    /// Cause, in the unit's own words.
    pub cause: Cause,
}

/// Basis of unit A's judgement, in its own words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Judgement {
    /// Guards that failed.
    pub failing: Guards,
    /// Its place was no older than *Tf*.
    pub placed: bool,
    /// Tracks that were no older than that.
    pub tracks: u8,
}

/// Place at which unit A took itself to be, in its own words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StatedPlace {
    /// Time of the statement.
    pub at: Micros,
    /// Time at which the fix behind it was taken.
    pub fixed: Micros,
    /// East and north, mm.
    pub place: (i32, i32),
}

/// The sorted events.
#[derive(Clone, Debug, Default)]
pub(crate) struct Timeline {
    /// Mode changes of unit A.
    pub changes: Vec<Change>,
    /// Basis of unit A's judgement, with its beginning.
    pub judgements: Vec<(Micros, Judgement)>,
    /// Places at which unit A took itself to be.
    pub stated_places: Vec<StatedPlace>,
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
    pub time_tags: BTreeMap<CommandId, (Micros, Micros)>,
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
    pub(crate) fn new(evidence: &Evidence) -> Timeline {
        let mut timeline = Timeline::default();
        evidence.entries.iter().for_each(|w| timeline.add_entry(w.at, &w.entry, evidence.under));
        motion::complete_samples(&mut timeline.truth);
        timeline
    }

    fn add_entry(&mut self, time: Micros, entry: &Entry, tested: Under) {
        let node = entry.node;
        let of_unit = node == tested.node();
        match entry.event {
            Any::Service(Event::Transition { from, to, cause, .. }) if of_unit => {
                self.changes.push(Change { at: time, from, to, cause })
            }
            // A restarted unit knows of no mode before.
            Any::Instrument(Note::Restarted { node, .. }) if node == tested.node() => {
                let from = self.changes.last().map_or(Mode::Idle, |c| c.to);
                self.changes.push(Change { at: time, from, to: Mode::Idle, cause: Cause::Start });
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
            }) if unit == tested.unit => {
                let (place, speed) = ((x_mm, y_mm), speed_mm_s.saturating_abs());
                let (set_speed, reserves) = (set_speed_mm_s, None);
                let (stamp, safe, asked_safe) = (entry.at.0, true, true);
                let truth =
                    Truth { at: time, stamp, place, speed, set_speed, leased, fence, safe, asked_safe, reserves };
                self.truth.push(truth);
            }
            // A plant logs margins right after the sample that they belong to.
            Any::Instrument(Note::Margins { unit, safe, asked, energy, clearance }) if unit == tested.unit => {
                if let Some(truth) = self.truth.last_mut() {
                    (truth.safe, truth.asked_safe) = (safe >= 0, asked >= 0);
                    truth.reserves = Some(Reserves { energy, clearance });
                }
            }
            Any::Instrument(Note::Collided { unit, object, speed_mm_s }) if unit == tested.unit => {
                self.collisions.push((time, object, speed_mm_s));
            }
            Any::Service(Event::Judged { failing, placed, tracks }) if of_unit => {
                self.judgements.push((time, Judgement { failing, placed, tracks }));
            }
            Any::Service(Event::Located { stamp, pose_x_mm, pose_y_mm, .. }) if of_unit => {
                // Both stamps are of the unit's own clock: only their difference holds in trace time.
                let fixed = time.saturating_sub(entry.at.since(stamp).0);
                self.stated_places.push(StatedPlace { at: time, fixed, place: (pose_x_mm, pose_y_mm) });
            }
            Any::Service(Event::Minted { authority, track, .. }) if of_unit => {
                self.minted.push((time, authority, track))
            }
            Any::Service(Event::Revoked { authority, .. }) if of_unit => self.revoked.push((time, authority)),
            Any::Service(Event::Intended { command, kind, tag }) if node == NodeId::CONSOLE => {
                self.intended.push((time, command, kind));
                self.time_tags.extend(tag.map(|tag| (command, (tag.after.0, tag.within.0))));
            }
            Any::Service(Event::Stored { command, .. }) if of_unit => {
                self.stored.insert(command, time);
            }
            Any::Service(Event::Executed { command, kind, refused: None }) if of_unit => {
                self.executed.push((time, command, kind))
            }
            Any::Service(Event::Accepted { record, .. }) if node == NodeId::GATEWAY => {
                self.accepted.push((time, record))
            }
            // A refusal on shared memory answers no attack by itself: `core_input` counts those of an insider's messages.
            Any::Service(Event::Refused { at: interface, .. })
                if !matches!(interface, wire::event::Interface::Bus(_)) =>
            {
                self.refused.push((time, node));
            }
            _ => {}
        }
    }

    /// True if an operator had given exactly this by `time`: the id alone could be of another command.
    pub(crate) fn operator_gave(&self, id: CommandId, wanted: CommandKind, time: Micros) -> bool {
        self.intended.iter().any(|(given_at, command, kind)| *command == id && *kind == wanted && *given_at <= time)
    }

    /// Time at which an order that was given at `given_at` is due at the latest: a time tag counts from before it.
    pub(crate) fn order_due(&self, id: CommandId, given_at: Micros) -> Micros {
        given_at.saturating_add(self.time_tags.get(&id).map_or(0, |(after, _)| *after))
    }

    /// Time at which an operator first gave a command with this id.
    pub(crate) fn given_at(&self, id: CommandId) -> Option<Micros> {
        self.intended.iter().find(|(_, command, _)| *command == id).map(|(given_at, ..)| *given_at)
    }

    /// Mode of unit A at `time`.
    pub(crate) fn mode_at(&self, time: Micros) -> Mode {
        self.changes.iter().take_while(|c| c.at <= time).last().map_or(Mode::Idle, |c| c.to)
    }

    /// True if unit A was in `mode` at some instant of `[from, to]`.
    pub(crate) fn was_in(&self, mode: Mode, from: Micros, to: Micros) -> bool {
        self.mode_at(from) == mode || self.changes.iter().any(|c| c.at >= from && c.at <= to && c.to == mode)
    }

    /// Time from the begin of `span` for which unit A stayed in modes that satisfy `test`, microseconds.
    pub(crate) fn stayed(&self, (from, to): Span, test: impl Fn(Mode) -> bool) -> Micros {
        if !test(self.mode_at(from)) {
            return 0;
        }
        self.first_change(from, |c| !test(c.to)).map_or(to, |c| c.at.min(to)).saturating_sub(from)
    }

    /// Time at which unit A was last in `mode`, at `time` or before; the start of the run where it never was.
    pub(crate) fn last_in(&self, mode: Mode, time: Micros) -> Micros {
        if self.mode_at(time) == mode {
            return time;
        }
        self.changes.iter().rev().find(|c| c.at <= time && c.from == mode).map_or(0, |c| c.at)
    }

    /// True if unit A judged by values that satisfy `test` at some instant of `[from, to]`.
    pub(crate) fn judged_by(&self, from: Micros, to: Micros, test: impl Fn(&Judgement) -> bool) -> bool {
        let first = self.judgements.partition_point(|(time, _)| *time <= from).saturating_sub(1);
        self.judgements[first..].iter().take_while(|(time, _)| *time <= to).any(|(_, judgement)| test(judgement))
    }

    /// True if unit A held authority over `track` at some instant of `[from, to]`.
    pub(crate) fn held_authority_over(&self, track: TrackId, from: Micros, to: Micros) -> bool {
        // Authority over a track ends with the next that is minted, at the latest.
        let next = self.minted.iter().skip(1).map(|(minted_at, ..)| *minted_at).chain(std::iter::once(Micros::MAX));
        let mut spans = self.minted.iter().zip(next).filter(|((.., held_track), _)| *held_track == track);
        spans.any(|((minted_at, ..), until)| {
            let (first, last) = (from.max(*minted_at), to.min(until));
            first <= last && self.was_in(Mode::PrepareToAct, first, last)
        })
    }

    /// True if unit A held authority at `time`.
    pub(crate) fn held_authority_at(&self, time: Micros) -> bool {
        self.mode_at(time) == Mode::PrepareToAct
    }

    /// The first change at or after `from` that satisfies `test`.
    pub(crate) fn first_change(&self, from: Micros, test: impl Fn(&Change) -> bool) -> Option<Change> {
        self.changes.iter().find(|c| c.at >= from && test(c)).copied()
    }

    /// Time in READY or PREPARE_TO_ACT up to `end`.
    pub(crate) fn nominal_until(&self, end: Micros) -> Micros {
        let starts = self.changes.iter();
        let ends = self.changes.iter().skip(1).map(|c| c.at).chain(std::iter::once(end));
        let spans = starts.zip(ends).filter(|(c, _)| matches!(c.to, Mode::Ready | Mode::PrepareToAct));
        spans.map(|(c, until)| until.saturating_sub(c.at)).sum()
    }

    /// True if the last sample of the plant shows it standing without a lease.
    pub(crate) fn ends_at_rest_unleased(&self) -> bool {
        self.truth.last().is_some_and(|t| !t.leased && t.safe)
    }

    /// The first sample from `from` on after which `test` holds until the end of the run.
    pub(crate) fn truth_for_good(&self, from: Micros, test: impl Fn(&Truth) -> bool) -> Option<Micros> {
        let after = self.truth.iter().rev().take_while(|t| t.at >= from);
        after.take_while(|t| test(t)).last().map(|t| t.at)
    }

    /// Stays of the unit in PREPARE_TO_ACT: begin and end, the last at `end` of the run.
    pub(crate) fn authority_spans(&self, end: Micros) -> impl Iterator<Item = Span> + '_ {
        let ends = self.changes.iter().skip(1).map(|c| c.at).chain([end]);
        let stays = self.changes.iter().zip(ends).filter(|(c, _)| c.to == Mode::PrepareToAct);
        stays.map(|(c, until)| (c.at, until))
    }

    /// Begin of the latest DEGRADED at `time` or before; the start of the run where there was none.
    pub(crate) fn degraded_since(&self, time: Micros) -> Micros {
        self.changes.iter().rev().find(|c| c.to == Mode::Degraded && c.at <= time).map_or(0, |c| c.at)
    }

    /// The transitions as rows of a report.
    pub(crate) fn transition_rows(&self) -> Vec<TransitionRow> {
        let row = |c: &Change| TransitionRow {
            t_ms: c.at as f64 / 1000.0,
            from: c.from.name().into(),
            to: c.to.name().into(),
            cause: c.cause.label(),
        };
        self.changes.iter().map(row).collect()
    }
}

/// True in a mode of nominal control.
pub(crate) fn is_nominal(mode: Mode) -> bool {
    matches!(mode, Mode::Ready | Mode::PrepareToAct)
}

/// True in a mode in which the unit does not drive.
pub(crate) fn is_resting(mode: Mode) -> bool {
    matches!(mode, Mode::HoldSafe | Mode::Idle)
}
