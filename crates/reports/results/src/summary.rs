//! Summary of one run for a reviewer, from its log: the report's drawings over time.
//!
//! Times are times of the run. Modes, authority, refusals and reasons are the services' own statements; injections are
//! ground truth and stand apart, as does the plant's own motion. `lanes` reads guards and display, `measured` the motion and its distances
//! to the platform's limits.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod lanes;
mod measured;

use std::collections::BTreeMap;

use evidence::{Micros, Witnessed, truth};
use explain::{Explanation, explain};
use ground_truth::{Any, Note};
use wire::bounds::Bounds;
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;

use crate::report::stage_name;

/// Refusals that come within this of each other are drawn as one.
const TOGETHER: Micros = 100_000;
/// Largest number of stretches of one kind that are listed.
const MAX_STRETCHES: usize = 512;

/// A run.
#[derive(Clone, Debug)]
pub struct RunSummary {
    /// Its name: a scenario or a folder.
    pub name: String,
    /// Length, seconds.
    pub seconds: f64,
    /// Reason for which it is INVALID, or the fault of its log; `None` if it is sound.
    pub flaw: Option<String>,
    /// Modes of the unit under test, one after the other.
    pub modes: Vec<Lasted>,
    /// Periods of authority.
    pub authority: Vec<Lasted>,
    /// Injections, as reported by their actors: ground truth, unknown to the services.
    pub done: Vec<Lasted>,
    /// Refusals at boundaries, by reason.
    pub refused: Vec<Refusals>,
    /// Reason for each change to a more restricted mode.
    pub why: Vec<Why>,
    /// Stretches in which guards of the unit under test fail, the names of all that do in words.
    pub guards: Vec<Lasted>,
    /// The console's display of the unit under test.
    pub shown: Vec<Lasted>,
    /// True motion of the unit under test, thinned out.
    pub truth: Vec<TruthPoint>,
    /// Reports of an insider, as it says itself: ground truth.
    pub claims: Option<ClaimsMade>,
    /// Measured values beside their limits.
    pub distances: Vec<Distance>,
    /// Longest time from a loss of trust to HOLD_SAFE, and from a loss to DEGRADED, milliseconds: the platform's bounds.
    pub limits_ms: [u64; 2],
}

/// True motion at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthPoint {
    /// Time, seconds.
    pub at: f64,
    /// Speed, metres per second.
    pub speed: f64,
}

/// Reports that an insider sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClaimsMade {
    /// Count.
    pub n: u64,
    /// Greatest distance between a place in them and the true one, metres.
    pub off_m: f64,
}

/// A measured value beside its limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Distance {
    /// Value in words.
    pub what: &'static str,
    /// Value.
    pub value: f64,
    /// Limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Origin of the limit.
    pub from: &'static str,
    /// True if the value may not fall below the limit, false if it may not exceed it.
    pub least: bool,
}

/// A state or an injection with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Lasted {
    /// Description.
    pub what: String,
    /// Start, seconds.
    pub from: f64,
    /// End, seconds.
    pub to: f64,
}

/// Refusals of one boundary for one reason.
#[derive(Clone, Debug)]
pub struct Refusals {
    /// The refusing service.
    pub by: String,
    /// Reason, by its name.
    pub reason: String,
    /// Count.
    pub n: u64,
    /// Times, seconds; those within a tenth of a second are one.
    pub at: Vec<Lasted>,
}

/// Reason for a change to a more restricted mode.
#[derive(Clone, Debug)]
pub struct Why {
    /// Time, seconds.
    pub at: f64,
    /// Modes before and after.
    pub change: String,
    /// The cause by its name.
    pub cause: String,
    /// Links from the cause to the display.
    pub chain: Vec<ChainLink>,
}

/// A link of the chain.
#[derive(Clone, Debug)]
pub struct ChainLink {
    /// Kind of the link.
    pub stage: String,
    /// Time, seconds.
    pub at: f64,
    /// Source of the log entry.
    pub by: String,
    /// Description.
    pub what: String,
}

/// The run with this name. `flaw` is the fault of its log.
pub fn from_entries(name: &str, entries: &[Witnessed], bounds: &Bounds, flaw: Option<String>) -> RunSummary {
    // Accounts are closed a while after the plant's last word, and the display is late by then: no part of the run.
    let end = measured::last(entries).or_else(|| entries.iter().map(|w| w.at).max());
    let clock = Clock { end: end.unwrap_or_default() };
    let explained: Vec<Explanation> = explain(entries, bounds).into_iter().filter(Explanation::restricts).collect();
    RunSummary {
        name: name.to_owned(),
        seconds: clock.seconds_at(clock.end),
        flaw,
        modes: modes(entries, clock),
        authority: authority(entries, clock),
        done: truth::lasting(entries).into_iter().map(|l| clock.lasted(l.action, l.from, l.to)).collect(),
        refused: refused(entries, clock),
        why: explained.iter().map(|e| clock.reason(e)).collect(),
        guards: lanes::guards(entries, clock),
        shown: lanes::shown(entries, clock),
        truth: measured::truth(entries, clock),
        claims: measured::claims(entries),
        distances: measured::distances(entries, &explained, bounds),
        limits_ms: [bounds.to_hold_safe_ms, bounds.to_degraded_ms],
    }
}

/// Conversion of microseconds of the run to seconds.
#[derive(Clone, Copy)]
struct Clock {
    end: Micros,
}

impl Clock {
    fn seconds_at(self, time: Micros) -> f64 {
        time as f64 / 1e6
    }

    fn lasted(self, what: String, from: Micros, to: Micros) -> Lasted {
        Lasted { what, from: self.seconds_at(from), to: self.seconds_at(to) }
    }

    fn reason(self, explanation: &Explanation) -> Why {
        let link = |step: &explain::ChainStep| ChainLink {
            stage: stage_name(step.stage).to_owned(),
            at: self.seconds_at(step.at_us),
            by: step.by.name().to_owned(),
            what: step.what.clone(),
        };
        Why {
            at: self.seconds_at(explanation.at_us),
            change: format!("{} to {}", explanation.from.name(), explanation.to.name()),
            cause: lanes::cause_words(explanation.cause),
            chain: explanation.chain.iter().map(link).collect(),
        }
    }
}

fn modes(entries: &[Witnessed], clock: Clock) -> Vec<Lasted> {
    let (mut all, mut now, mut unlisted) = (Vec::new(), (Mode::Idle, 0), 0_u64);
    for w in entries {
        let to = match w.entry.event {
            Any::Service(Event::Transition { to, .. }) if w.entry.node == NodeId::UNIT_A => to,
            // A unit that is started again knows of no mode before.
            Any::Instrument(Note::Restarted { node: NodeId::UNIT_A, .. }) => Mode::Idle,
            _ => continue,
        };
        if all.len() + 1 < MAX_STRETCHES {
            all.push(clock.lasted(now.0.name().to_owned(), now.1, w.at));
            now = (to, w.at);
        } else {
            unlisted += 1;
        }
    }
    // The last stretch stands for all that has no room, and says so.
    let more = if unlisted == 0 { String::new() } else { format!(", then {unlisted} changes not listed") };
    all.push(clock.lasted(format!("{}{more}", now.0.name()), now.1, clock.end));
    all
}

fn authority(entries: &[Witnessed], clock: Clock) -> Vec<Lasted> {
    let mut all: Vec<(u32, Micros, Micros)> = Vec::new();
    for w in entries.iter().filter(|w| w.entry.node == NodeId::UNIT_A) {
        match w.entry.event {
            Any::Service(Event::Minted { authority, .. }) if all.len() < MAX_STRETCHES => {
                all.push((authority, w.at, clock.end))
            }
            Any::Service(Event::Revoked { authority, .. } | Event::Acted { authority, .. }) => {
                let open = all.iter_mut().rev().find(|a| a.0 == authority);
                open.into_iter().for_each(|a| a.2 = w.at);
            }
            _ => {}
        }
    }
    all.into_iter().map(|(serial, from, to)| clock.lasted(format!("authority {serial}"), from, to)).collect()
}

/// Refusals of one boundary for one reason, trace time.
#[derive(Default)]
struct Tally {
    n: u64,
    stretches: Vec<(Micros, Micros)>,
}

impl Tally {
    fn take(&mut self, time: Micros) {
        self.n += 1;
        if let Some(last) = self.stretches.last_mut()
            && time.saturating_sub(last.1) < TOGETHER
        {
            last.1 = time;
        } else if self.stretches.len() < MAX_STRETCHES {
            self.stretches.push((time, time));
        }
    }
}

/// Refusals by refusing service and reason, the most frequent first.
fn refused(entries: &[Witnessed], clock: Clock) -> Vec<Refusals> {
    let mut kinds: BTreeMap<(NodeId, &'static str), Tally> = BTreeMap::new();
    for w in entries {
        if let Any::Service(Event::Refused { reason, .. }) = w.entry.event {
            kinds.entry((w.entry.node, reason.name())).or_default().take(w.at);
        }
    }
    let mut all: Vec<Refusals> = Vec::new();
    for ((by, reason), Tally { n, stretches }) in kinds {
        let at = stretches.into_iter().map(|(from, to)| clock.lasted(reason.to_owned(), from, to)).collect();
        all.push(Refusals { by: by.name().to_owned(), reason: reason.to_owned(), n, at });
    }
    all.sort_by_key(|refusals| std::cmp::Reverse(refusals.n));
    all
}

#[cfg(test)]
mod tests {
    use ground_truth::Entry;
    use wire::codec::Text;
    use wire::event::{Freshness, Interface};
    use wire::id::{Boot, RecordId, Sequence, UnitId};
    use wire::mode::{Guard, Guards};
    use wire::refusal::Reason;
    use wire::time::{Instant, Span};

    use super::*;

    fn seen(at: Micros, node: NodeId, event: Event) -> Witnessed {
        let event = Any::Service(event);
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(0), event, previous: [0; 32] };
        Witnessed { at, entry }
    }

    #[test]
    fn refusals_that_come_together_are_one_stretch() {
        let refused = |reason| Event::Refused { at: Interface::Uplink, peer: None, reason, detail: Text::default() };
        let log = [
            seen(0, NodeId::GATEWAY, Event::Started),
            seen(1_000_000, NodeId::GATEWAY, refused(Reason::Stale)),
            seen(1_050_000, NodeId::GATEWAY, refused(Reason::Stale)),
            seen(2_000_000, NodeId::GATEWAY, refused(Reason::Stale)),
            seen(3_000_000, NodeId::GATEWAY, refused(Reason::Origin)),
            seen(10_000_000, NodeId::GATEWAY, Event::Started),
        ];
        let story = from_entries("x", &log, &Bounds::GROUND, None);
        assert_eq!((story.seconds, story.modes.len(), story.modes[0].what.as_str()), (10.0, 1, "IDLE"));
        let stale = &story.refused[0];
        assert_eq!((stale.reason.as_str(), stale.n, stale.at.len()), ("stale", 3, 2));
        assert_eq!((stale.at[0].from, stale.at[0].to), (1.0, 1.05));
    }

    #[test]
    fn changes_of_mode_without_room_are_counted() {
        let event = Any::Instrument(Note::Restarted { node: NodeId::UNIT_A, boot: Boot(2) });
        let entry = Entry { event, ..seen(1, NodeId::SIM, Event::Started).entry };
        let last = |n| modes(&vec![Witnessed { at: 1, entry }; n], Clock { end: 2 })[511].what.clone();
        assert_eq!([511, 514].map(last), ["IDLE", "IDLE, then 3 changes not listed"]);
    }

    #[test]
    fn lanes_end_with_the_plant_and_name_what_was() {
        let judged = |failing| Event::Judged { failing, placed: true, tracks: 1 };
        let displayed = |freshness| Event::Displayed {
            unit: UnitId::A,
            mode: Mode::Ready,
            authority: None,
            freshness,
            age: Span::ZERO,
            tracks_fresh: 0,
            tracks_stale: 0,
            report: RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(1) },
            failing: Guards::default(),
            place: None,
        };
        let truth = |at, speed_mm_s, fence_mm| {
            let note = Note::Truth {
                unit: UnitId::A,
                x_mm: 0,
                y_mm: 0,
                yaw_mrad: 0,
                speed_mm_s,
                set_speed_mm_s: 0,
                leased: true,
                fence_mm,
            };
            Witnessed {
                entry: Entry { event: Any::Instrument(note), ..seen(at, NodeId::SIM, Event::Started).entry },
                at,
            }
        };
        let none = Guards::default();
        let log = [
            seen(0, NodeId::UNIT_A, judged(none.with_guard(Guard::Lease))),
            seen(1_000_000, NodeId::UNIT_A, judged(none)),
            seen(1_500_000, NodeId::CONSOLE, displayed(Freshness::Fresh)),
            truth(2_000_000, -3_000, 7_000),
            seen(3_000_000, NodeId::UNIT_A, judged(none.with_guard(Guard::Thermal))),
            seen(4_000_000, NodeId::CONSOLE, displayed(Freshness::Stale)),
            truth(9_000_000, 0, 9_000),
            seen(9_500_000, NodeId::CONSOLE, displayed(Freshness::Lost)),
        ];
        let story = from_entries("x", &log, &Bounds::GROUND, None);
        let lane = |what: &str, from, to| Lasted { what: what.to_owned(), from, to };
        assert_eq!(story.seconds, 9.0);
        assert_eq!(story.guards, [lane("Thermal camera", 3.0, 9.0)], "the start of the run is no failure");
        assert_eq!(story.shown, [lane("READY", 1.5, 4.0), lane("STALE, was READY", 4.0, 9.0)]);
        assert_eq!(story.truth.iter().map(|of| of.speed).collect::<Vec<_>>(), [3.0, 0.0]);
        let fence = story.distances.last().expect("a distance");
        assert_eq!((fence.value, fence.limit, fence.least), (7.0, 1.0, true));
    }
}
