//! Effect of losing a part of the platform, whatever speaks in its place.

use super::super::reference::mode_at;
use super::supervision::goes_on;
use super::{Assertion, Facts, change, holding, none, trial};

/// Speed below which a unit stands, mm/s: the residue of wheels and slope.
const STANDING: i32 = 50;

pub(super) const ALL: &[Assertion] = &[
    Assertion {
        name: "without_perception_nothing_keeps_authority_or_full_speed",
        holds: |facts| ended(facts, "perception-ends", facts.limits.degraded, &["READY", "PREPARE_TO_ACT"]),
        examples: || (holding_at("memory", "perception-ends", 3_400.0), trial("memory", &["perception-ends"])),
        carried_by: Some(("boundary.tag", "memory")),
    },
    Assertion {
        name: "without_a_recorder_nothing_keeps_authority",
        holds: |facts| ended(facts, "recorder-ends", facts.limits.seal, &["PREPARE_TO_ACT"]),
        examples: || {
            let mut armed = trial("memory", &["recorder-ends"]);
            armed.changes.push(change(2_600.0, "READY", "PREPARE_TO_ACT"));
            (trial("memory", &["recorder-ends"]), armed)
        },
        carried_by: Some(("guards.sealed_log", "memory")),
    },
    Assertion {
        name: "without_fixes_a_unit_that_drives_holds",
        holds: |facts| {
            let mut out = facts.deeds.each(&["fix-out"]).filter(|out| out.lasts_ms > facts.limits.hold);
            none(out.find_map(|out| goes_on(facts, out.from_ms, facts.limits.hold)))
        },
        examples: || (holding("sensors", &["fix-out"]), trial("sensors", &["fix-out"])),
        carried_by: Some(("guards.localisation", "sensors")),
    },
    Assertion {
        name: "a_unit_that_holds_comes_to_rest_and_stays_there",
        // A world that was stopped shows nothing of its plant.
        holds: |facts| if facts.deeds.any(&["sim-ends", "sim-hangs"]) { Ok(()) } else { none(moves_on(facts)) },
        examples: || {
            let speed_entry = |ms: f64, speed: i32| {
                let mut facts = holding("path", &["cut"]);
                facts.witness.speed = vec![(3_900.0, 3_000), (ms, speed)];
                facts
            };
            (speed_entry(4_500.0, 1_000), speed_entry(6_000.0, 1_000))
        },
        carried_by: None,
    },
];

/// Checks that the unit is in one of these modes `within_ms` after a process ended permanently.
fn ended(facts: &Facts, end: &str, within_ms: f64, modes: &[&str]) -> Result<(), String> {
    let dead = facts.deeds.any(&["autonomy-ends", "autonomy-hangs"]);
    let Some(end) = facts.deeds.each(&[end]).next().filter(|_| !dead) else { return Ok(()) };
    let amount = end.from_ms + within_ms;
    let mode = mode_at(&facts.changes, amount);
    let expected = amount <= facts.duration_ms;
    none(
        (expected && modes.contains(&mode))
            .then(|| format!("{mode} at {amount:.0} ms, {within_ms:.0} ms after {}", end.of)),
    )
}

fn moves_on(facts: &Facts) -> Option<String> {
    let ends = facts.changes.iter().skip(1).map(|change| change.at_ms).chain([facts.duration_ms]);
    let held = facts.changes.iter().zip(ends).filter(|(change, _)| change.to == "HOLD_SAFE");
    let mut resting = held.map(|(change, until)| (change.at_ms + facts.limits.rest, until));
    resting.find_map(|(from, until)| {
        let mut speeds = facts.witness.speed.iter().filter(|(time, _)| (from..until).contains(time));
        let (time, speed) = speeds.find(|(_, speed)| speed.abs() > STANDING)?;
        Some(format!("{speed} mm/s at {time:.0} ms, holding since {:.0} ms", from - facts.limits.rest))
    })
}

fn holding_at(space: &str, end: &str, at_ms: f64) -> Facts {
    let mut facts = trial(space, &[end]);
    facts.changes.push(change(at_ms, "READY", "HOLD_SAFE"));
    facts
}
