//! What must hold of every trial, whatever was done in it.
//!
//! P1 to P11 are the oracle's (P6 and P10 say that the evidence is whole: INVALID, and no word may bring it about but by
//! keeping a fault from arriving); the rest compares with `reference`. Each comes with a trial that it holds of and one that
//! breaks it.

use campaign::search::{Ground, Tried};

use super::reference::{Change, Deeds, Reference, mode_at};

/// A trial with all that is needed to judge it.
pub(super) struct Case<'a> {
    pub(super) ground: &'a Ground,
    pub(super) reference: &'a Reference,
    pub(super) tried: &'a Tried,
}

/// What an assertion looks at.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    /// The oracle's findings.
    pub(super) findings: Vec<String>,
    /// The unit's changes of mode, in the trial and in the mission.
    pub(super) changes: Vec<Change>,
    pub(super) mission: Vec<Change>,
    pub(super) deeds: Deeds,
    pub(super) duration_ms: f64,
    pub(super) hold_ms: f64,
    pub(super) lease_ms: f64,
    pub(super) grace_ms: f64,
    pub(super) mode_in_mission: String,
}

/// One assertion.
pub(super) struct Assertion {
    pub(super) name: &'static str,
    pub(super) holds: fn(&Facts) -> Result<(), String>,
    /// A trial that it holds of, and one that breaks it.
    pub(super) examples: fn() -> (Facts, Facts),
}

macro_rules! unbroken {
    ($($name:ident $id:literal),* $(,)?) => {
        [$(Assertion {
            name: stringify!($name),
            holds: |facts| finding(facts, $id),
            examples: || (Facts::default(), Facts { findings: vec![concat!($id, " at 1 ms: x").into()], ..Facts::default() }),
        }),*]
    };
}

const PROPERTIES: [Assertion; 9] = unbroken![
    p1_no_act_without_authority "P1",
    p2_loss_degrades_in_time "P2",
    p3_lost_trust_holds_in_time "P3",
    p4_inside_the_fence "P4",
    p5_nothing_unaccepted_has_an_effect "P5",
    p6_every_account_balances "P6",
    p8_orders_once_and_never_late "P8",
    p9_recovery_by_the_rules_only "P9",
    p11_never_the_wrong_object "P11",
];

const COMPARED: [Assertion; 6] = [
    Assertion {
        // A hung console goes on showing its last picture: row A36 of the catalogue, listed there as open.
        name: "p7_nothing_old_is_shown_as_fresh_by_a_console_that_runs",
        holds: |facts| if facts.deeds.hangs_console { Ok(()) } else { finding(facts, "P7") },
        examples: || (Facts::default(), Facts { findings: vec!["P7 at 1 ms: x".into()], ..Facts::default() }),
    },
    Assertion {
        name: "what_every_boundary_refuses_changes_no_mode",
        holds: |facts| if facts.deeds.only_refusable { same_modes(facts) } else { Ok(()) },
        examples: || changed(Deeds { only_refusable: true, ..Deeds::default() }),
    },
    Assertion {
        name: "a_silence_shorter_than_the_lease_allows_changes_no_mode",
        holds: |facts| match facts.deeds.only_silence_ms {
            Some(ms) if ms < facts.grace_ms => same_modes(facts),
            Some(_) | None => Ok(()),
        },
        examples: || changed(Deeds { only_silence_ms: Some(10.0), ..Deeds::default() }),
    },
    Assertion {
        name: "lies_to_the_display_bring_the_unit_nowhere_that_the_mission_does_not_go",
        holds: |facts| if facts.deeds.only_display { subsequence(facts) } else { Ok(()) },
        examples: || changed(Deeds { only_display: true, ..Deeds::default() }),
    },
    Assertion {
        name: "without_grants_the_unit_holds_when_its_lease_has_ended",
        holds: |facts| match facts.deeds.no_grant {
            Some((from, to)) if to - from > facts.lease_ms + facts.hold_ms => {
                held_by(facts, from + facts.lease_ms + facts.hold_ms)
            }
            Some(_) | None => Ok(()),
        },
        examples: || held(Deeds { no_grant: Some((3_000.0, 7_000.0)), ..Deeds::default() }),
    },
    Assertion {
        name: "without_a_gateway_the_unit_holds_when_its_lease_has_ended",
        holds: |facts| match facts.deeds.gateway_ends_ms {
            Some(from) => held_by(facts, from + facts.lease_ms + facts.hold_ms),
            None => Ok(()),
        },
        examples: || held(Deeds { gateway_ends_ms: Some(3_000.0), ..Deeds::default() }),
    },
];

/// All of them.
pub(super) const ASSERTIONS: &[Assertion] = &{
    let [a, b, c, d, e, f, g, h, i] = PROPERTIES;
    let [j, k, l, m, n, o] = COMPARED;
    [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o]
};

impl Case<'_> {
    /// What the assertions look at.
    pub(super) fn facts(&self) -> Facts {
        let trial = &self.tried.trial;
        let deeds = deeds(self.ground, self.tried);
        let from = deeds.no_grant.map(|(from, _)| from).or(deeds.gateway_ends_ms).unwrap_or_default();
        Facts {
            findings: trial.findings.clone(),
            changes: trial.transitions.iter().map(Change::of).collect(),
            mission: self.reference.changes.clone(),
            duration_ms: trial.sim_seconds * 1000.0,
            hold_ms: self.reference.hold_ms,
            lease_ms: self.reference.lease_ms,
            grace_ms: self.reference.grace_ms,
            mode_in_mission: self.reference.mode_at(from).to_owned(),
            deeds,
        }
    }
}

/// What the word does, read off its moves by their names.
fn deeds(ground: &Ground, tried: &Tried) -> Deeds {
    let tick = ground.alphabet.tick_ms.unsigned() as f64;
    let letters: Vec<(&str, f64, f64)> = tried
        .word
        .letters()
        .iter()
        .map(|letter| {
            let of = &ground.alphabet.moves[letter.kind];
            let lasts = of.lasts_ms.map_or(0.0, |range| letter.places.first().map_or(0.0, |place| range.at(*place)));
            (of.name.as_str(), f64::from(letter.begins) * tick, lasts)
        })
        .collect();
    let alphabet = ground.alphabet.name.as_str();
    let all = |names: &[&str]| !letters.is_empty() && letters.iter().all(|(name, ..)| names.contains(name));
    let cuts = letters.iter().filter(|(name, ..)| ["cut", "cut-down"].contains(name));
    let longest = cuts.max_by(|a, b| a.2.total_cmp(&b.2));
    let ends = letters.iter().find(|(name, ..)| *name == "gateway-ends");
    // A unit that is dead itself has no mode to compare.
    let alive = !letters.iter().any(|(name, ..)| name.starts_with("autonomy"));
    Deeds {
        only_refusable: alphabet == "path" && all(&["repeat", "copy", "alert"]),
        only_silence_ms: (alphabet == "path" && all(&["cut", "cut-up", "cut-down"]))
            .then(|| letters.iter().map(|(_, _, lasts)| lasts).sum()),
        only_display: alphabet == "display" && !letters.iter().any(|(name, ..)| *name == "swallow"),
        no_grant: longest.filter(|_| alphabet == "path").map(|(_, from, lasts)| (*from, from + lasts)),
        hangs_console: letters.iter().any(|(name, ..)| *name == "console-hangs"),
        gateway_ends_ms: ends.filter(|_| alphabet == "processes" && alive).map(|(_, from, _)| *from),
    }
}

fn finding(facts: &Facts, property: &str) -> Result<(), String> {
    let broken = facts.findings.iter().find(|finding| finding.split(' ').next() == Some(property));
    broken.map_or(Ok(()), |finding| Err(finding.clone()))
}

fn names(changes: &[Change]) -> Vec<(&str, &str)> {
    changes.iter().map(|change| (change.from.as_str(), change.to.as_str())).collect()
}

fn same_modes(facts: &Facts) -> Result<(), String> {
    let (trial, mission) = (names(&facts.changes), names(&facts.mission));
    if trial == mission { Ok(()) } else { Err(format!("the unit went {trial:?}, without the word {mission:?}")) }
}

fn subsequence(facts: &Facts) -> Result<(), String> {
    let (trial, mission) = (names(&facts.changes), names(&facts.mission));
    let mut left = mission.iter();
    let all = trial.iter().all(|change| left.any(|other| other == change));
    if all { Ok(()) } else { Err(format!("the unit went {trial:?}, without the word {mission:?}")) }
}

/// A unit that drove when supervision ended holds by then; one that was not driving owes nothing.
fn held_by(facts: &Facts, by_ms: f64) -> Result<(), String> {
    let driving = ["READY", "PREPARE_TO_ACT", "DEGRADED"].contains(&facts.mode_in_mission.as_str());
    let mode = mode_at(&facts.changes, by_ms);
    if !driving || by_ms > facts.duration_ms || ["HOLD_SAFE", "IDLE"].contains(&mode) {
        Ok(())
    } else {
        Err(format!("{mode} at {by_ms:.0} ms, without supervision since"))
    }
}

fn change(at_ms: f64, from: &str, to: &str) -> Change {
    Change { at_ms, from: from.to_owned(), to: to.to_owned() }
}

fn facts(deeds: Deeds, changes: Vec<Change>) -> Facts {
    Facts {
        changes,
        mission: vec![change(1_000.0, "IDLE", "READY")],
        deeds,
        duration_ms: 9_000.0,
        hold_ms: 1_000.0,
        lease_ms: 600.0,
        grace_ms: 250.0,
        mode_in_mission: "READY".to_owned(),
        ..Facts::default()
    }
}

/// A trial that goes as the mission does, and one that holds on its own.
fn changed(deeds: Deeds) -> (Facts, Facts) {
    let same = vec![change(1_000.0, "IDLE", "READY")];
    let other = vec![change(1_000.0, "IDLE", "READY"), change(4_000.0, "READY", "HOLD_SAFE")];
    (facts(deeds.clone(), same), facts(deeds, other))
}

/// A trial that holds, and one that drives on.
fn held(deeds: Deeds) -> (Facts, Facts) {
    let (on, holds) = changed(deeds);
    (holds, on)
}
