//! Effects that holders of credentials, or of a place on the host, may not bring about, and attacks that have to be
//! noticed.

use wire::id::{Boot, NodeId, PeerId, RecordId, Sequence};

use super::super::reference::{Change, drives, mode_at};
use super::{Assertion, Facts, holding, none, same_modes, trial};

/// A teammate's messages that the boundary refuses: another's records, broken ones, or no live product.
const NOT_ITS_TO_SAY: [&str; 6] = ["forward", "relabel", "break", "flood", "synthetic", "played-back"];
/// Those messages that leave the insider's own reports unchanged.
const BESIDE_ITS_OWN: [&str; 3] = ["forward", "break", "flood"];
/// Messages outside perception's keys, or marked as no live product.
const NOT_PERCEPTIONS: [&str; 4] = ["echo-navigation", "elsewhere", "synthetic", "played-back"];
/// The time in which the judge of teammates forgets a disagreement, seconds (*tau* in `docs/reference/bounds.md`).
const FORGETS_S: f64 = 8.0;

pub(super) const ALL: &[Assertion] = &[
    Assertion {
        name: "no_report_is_accepted_in_anothers_session",
        holds: |facts| {
            let foreign = |(peer, record): &&(PeerId, RecordId)| peer.to_string() != record.node.name();
            let found = facts.witness.accepted.iter().find(foreign);
            none(found.map(|(peer, record)| format!("{record} was accepted in the session of {peer}")))
        },
        examples: || (accepted(PeerId::UNIT_C), accepted(PeerId::UNIT_B)),
        carried_by: Some(("boundary.origin", "teammates")),
    },
    Assertion {
        name: "what_is_not_a_teammates_to_say_changes_no_mode",
        holds: |facts| if facts.deeds.only("teammates", &NOT_ITS_TO_SAY) { same_modes(facts) } else { Ok(()) },
        examples: || (trial("teammates", &["break"]), holding("teammates", &["break"])),
        carried_by: Some(("boundary.signature", "teammates")),
    },
    Assertion {
        name: "a_place_that_leaves_its_claimed_motion_is_disputed_and_the_unit_holds",
        holds: |facts| none(undisputed(facts)),
        examples: || {
            let mut disputed = holding("teammates", &["hide-drift"]);
            disputed.witness.disputed_ms = Some(4_700.0);
            (disputed, trial("teammates", &["hide-drift"]))
        },
        carried_by: None,
    },
    Assertion {
        name: "who_is_no_operator_changes_no_mode",
        holds: |facts| if facts.deeds.in_any_space(&["roles"]) { same_modes(facts) } else { Ok(()) },
        examples: || (trial("roles", &["arm"]), holding("roles", &["arm"])),
        carried_by: Some(("boundary.role", "roles")),
    },
    Assertion {
        name: "what_has_no_key_on_shared_memory_changes_no_mode",
        holds: |facts| {
            let ends = facts.deeds.any(&["perception-ends", "recorder-ends"]);
            if facts.deeds.in_any_space(&["memory"]) && !ends { same_modes(facts) } else { Ok(()) }
        },
        examples: || (trial("memory", &["vehicle"]), holding("memory", &["vehicle"])),
        carried_by: Some(("boundary.tag", "memory")),
    },
    Assertion {
        // Perception itself can be lied to by who holds its keys, so that there is no vehicle to take authority on.
        name: "who_reads_a_channel_does_not_stop_the_unit_by_writing_it",
        holds: |facts| if facts.deeds.only("perception", &NOT_PERCEPTIONS) { none(stopped(facts)) } else { Ok(()) },
        examples: || (trial("perception", &["elsewhere"]), holding("perception", &["elsewhere"])),
        carried_by: Some(("boundary.tag", "perception")),
    },
];

/// Finding where a teammate's hidden drift of *v* is not answered. The disagreement, which is forgotten with *tau*,
/// grows above the slack; from the next report on the unit must stop driving within *Th*. Judged only where no other
/// claim could hide the drift, and where the unit was driving.
fn undisputed(facts: &Facts) -> Option<String> {
    let other_deeds = facts.deeds.done.iter().filter(|deed| !BESIDE_ITS_OWN.contains(&deed.of.as_str()));
    let [lie] = other_deeds.collect::<Vec<_>>()[..] else { return None };
    let share = facts.limits.slack_m / (lie.number * FORGETS_S);
    if lie.of != "hide-drift" || share >= 1.0 {
        return None;
    }
    // The place is claimed in reports only, and it is the next one that is judged.
    let noticed = lie.from_ms - libm::log(1.0 - share) * FORGETS_S * 1000.0 + facts.limits.report;
    let amount = noticed + facts.limits.hold;
    let drove = drives(mode_at(&facts.mission, noticed)) && amount <= facts.duration_ms && noticed < lie.until_ms();
    let mode = mode_at(&facts.changes, amount);
    let reason = || {
        format!("{mode} at {amount:.0} ms, a drift of {} m/s disputed at {:?}", lie.number, facts.witness.disputed_ms)
    };
    (drove && (drives(mode) || facts.witness.disputed_ms.is_none())).then(reason)
}

/// A restriction of the unit that the mission does not have by then.
fn stopped(facts: &Facts) -> Option<String> {
    let restricts = |change: &&Change| ["DEGRADED", "HOLD_SAFE"].contains(&change.to.as_str());
    let first = |changes: &[Change]| changes.iter().find(restricts).map(|change| change.at_ms);
    let time = first(&facts.changes)?;
    let early = first(&facts.mission).is_none_or(|in_mission| time + facts.limits.obeyed < in_mission);
    early.then(|| format!("restricted at {time:.0} ms, in the mission at {:?}", first(&facts.mission)))
}

fn accepted(peer: PeerId) -> Facts {
    let mut facts = trial("teammates", &["forward"]);
    let record = RecordId { node: NodeId::UNIT_C, boot: Boot(1), sequence: Sequence(1) };
    facts.witness.accepted.push((peer, record));
    facts
}
