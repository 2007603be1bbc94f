//! Effect of silence on the links, and of the end of the gateway.

use super::super::reference::{Change, drives, mode_at};
use super::{Assertion, Facts, holding, names, none, same_modes, trial};

const CUTS: [&str; 3] = ["cut", "cut-up", "cut-down"];

pub(super) const ALL: &[Assertion] = &[
    Assertion {
        name: "what_every_boundary_refuses_changes_no_mode",
        holds: |facts| {
            if facts.deeds.only("path", &["repeat", "copy", "alert"]) { same_modes(facts) } else { Ok(()) }
        },
        examples: || (trial("path", &["repeat"]), holding("path", &["repeat"])),
        carried_by: None,
    },
    Assertion {
        name: "a_silence_shorter_than_the_lease_allows_changes_no_mode",
        holds: |facts| {
            let silent: f64 = facts.deeds.done.iter().map(|deed| deed.lasts_ms).sum();
            if facts.deeds.only("path", &CUTS) && silent < facts.limits.grace { same_modes(facts) } else { Ok(()) }
        },
        examples: || {
            let short = |mut facts: Facts| {
                facts.deeds.done[0].lasts_ms = 10.0;
                facts
            };
            (short(trial("path", &["cut"])), short(holding("path", &["cut"])))
        },
        carried_by: None,
    },
    Assertion {
        name: "a_silence_that_lasts_longer_stops_the_unit_no_later",
        holds: |facts| {
            let Some((longer, held)) = facts.longer.as_ref().zip(holds(&facts.changes)) else { return Ok(()) };
            let later = holds(longer).is_none_or(|time| time > held);
            none(later.then(|| format!("it held at {held:.0} ms, and with longer silence {:?}", holds(longer))))
        },
        examples: || {
            let sound = Facts { longer: Some(holding("path", &["cut"]).changes), ..holding("path", &["cut"]) };
            (sound.clone(), Facts { longer: Some(sound.mission.clone()), ..sound })
        },
        carried_by: None,
    },
    Assertion {
        name: "without_grants_the_unit_holds_when_its_lease_has_ended",
        holds: |facts| {
            let deadline = facts.limits.lease + facts.limits.hold;
            let cuts = facts.deeds.each(&["cut", "cut-down"]).filter(|cut| cut.lasts_ms > deadline);
            none(
                cuts.filter(|_| facts.deeds.in_any_space(&["path"]))
                    .find_map(|cut| goes_on(facts, cut.from_ms, deadline)),
            )
        },
        examples: || (holding("path", &["cut"]), trial("path", &["cut"])),
        carried_by: Some(("guards.lease", "path")),
    },
    Assertion {
        name: "without_a_gateway_the_unit_holds_when_its_lease_has_ended",
        holds: |facts| {
            // A unit that is dead itself has no mode to compare.
            let dead = facts.deeds.any(&["autonomy-ends", "autonomy-hangs"]);
            let mut ends = facts.deeds.each(&["gateway-ends"]).filter(|_| !dead);
            none(ends.find_map(|end| goes_on(facts, end.from_ms, facts.limits.lease + facts.limits.hold)))
        },
        examples: || (holding("processes", &["gateway-ends"]), trial("processes", &["gateway-ends"])),
        carried_by: Some(("guards.lease", "processes")),
    },
    Assertion {
        name: "lies_to_the_display_bring_the_unit_nowhere_that_the_mission_does_not_go",
        holds: |facts| {
            if facts.deeds.in_any_space(&["display"]) && !facts.deeds.any(&["swallow"]) {
                subsequence(facts)
            } else {
                Ok(())
            }
        },
        examples: || (trial("display", &["alter"]), holding("display", &["alter"])),
        carried_by: None,
    },
];

/// Time at which the unit first holds.
fn holds(changes: &[Change]) -> Option<f64> {
    changes.iter().find(|change| change.to == "HOLD_SAFE").map(|change| change.at_ms)
}

/// A unit that would have driven when a process ended, and still drives after that. One that had stopped before is not required to move.
pub(super) fn goes_on(facts: &Facts, ended_ms: f64, within_ms: f64) -> Option<String> {
    let amount = ended_ms + within_ms;
    let expected = drives(mode_at(&facts.mission, ended_ms)) && amount <= facts.duration_ms;
    let mode = mode_at(&facts.changes, amount);
    (expected && drives(mode))
        .then(|| format!("{mode} at {amount:.0} ms, {within_ms:.0} ms after what it drives by had ended"))
}

fn subsequence(facts: &Facts) -> Result<(), String> {
    let (trial, mission) = (names(&facts.changes), names(&facts.mission));
    let mut left = mission.iter();
    let all = trial.iter().all(|change| left.any(|other| other == change));
    none((!all).then(|| format!("the unit went {trial:?}, without the word {mission:?}")))
}
