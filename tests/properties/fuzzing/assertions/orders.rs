//! Authority behind the unit's orders; and no attacker outside the path keeps the operator's from it.

use wire::command::CommandKind;
use wire::id::{Boot, CommandId, NodeId, Sequence};
use wire::refusal::Reason;

use super::super::deeds::Deeds;
use super::super::reference::{drives, mode_at};
use super::super::witness::{Given, Taken};
use super::{Assertion, Facts, holding, none, trial};

/// Attack spaces of those who are nowhere in the path of commands, and the moves of `stations` that are.
const ELSEWHERE: [&str; 6] = ["teammates", "stations", "roles", "memory", "perception", "sensors"];
const IN_THE_PATH: [&str; 3] = ["twice", "splice", "take-session"];

pub(super) const ALL: &[Assertion] = &[
    Assertion {
        name: "nothing_is_executed_that_no_operator_signed",
        holds: |facts| {
            let mut executed = facts.witness.taken.iter().filter(|taken| taken.refused.is_none());
            none(executed.find(|taken| !signed(facts, taken)).map(|taken| format!("{taken:?} was given by nobody")))
        },
        examples: || (taken(NodeId::OPERATOR, None), taken(NodeId::CONSOLE, None)),
        carried_by: Some(("boundary.role", "roles")),
    },
    Assertion {
        name: "what_a_revoked_operator_orders_is_never_executed",
        holds: |facts| {
            let Some(struck) = facts.witness.struck_ms else { return Ok(()) };
            let late = |taken: &&Taken| taken.id.operator == NodeId::OPERATOR_2 && taken.at_ms > struck;
            let mut executed = facts.witness.taken.iter().filter(|taken| taken.refused.is_none());
            none(executed.find(late).map(|taken| format!("{taken:?}, revoked at {struck:.0} ms")))
        },
        examples: || {
            let struck_at = |ms: f64| {
                let mut facts = taken(NodeId::OPERATOR_2, None);
                facts.witness.struck_ms = Some(ms);
                facts
            };
            (struck_at(5_500.0), struck_at(4_500.0))
        },
        carried_by: Some(("boundary.standing", "stations")),
    },
    Assertion {
        name: "what_others_ask_for_keeps_no_order_of_the_operators_out",
        holds: |facts| {
            let kept = |taken: &&Taken| taken.refused.is_some_and(|reason| reason != Reason::Interlock);
            let mut of_operator = facts.witness.taken.iter().filter(|taken| taken.id.operator == NodeId::OPERATOR);
            let found = of_operator.find(kept).filter(|_| out_of_the_way(&facts.deeds));
            none(found.map(|taken| format!("{taken:?}")))
        },
        examples: || (taken(NodeId::OPERATOR, Some(Reason::Interlock)), taken(NodeId::OPERATOR, Some(Reason::Rate))),
        carried_by: None,
    },
    Assertion {
        name: "an_operators_hold_is_obeyed_at_once_whatever_others_do",
        holds: |facts| none(disobeyed(facts).filter(|_| out_of_the_way(&facts.deeds))),
        examples: || {
            let given = |mut facts: Facts| {
                facts.witness.given.push(given(3_900.0, NodeId::OPERATOR));
                facts
            };
            (given(holding("roles", &["hold"])), given(trial("roles", &["hold"])))
        },
        carried_by: None,
    },
    Assertion {
        name: "the_plant_acts_no_more_often_than_operators_confirmed",
        holds: |facts| {
            let confirmed = |given: &&Given| matches!(given.kind, CommandKind::Confirm(_)) && is_operator(given.key);
            let (acts, confirmed) = (facts.witness.acts, facts.witness.given.iter().filter(confirmed).count());
            none((acts > confirmed).then(|| format!("{acts} acts, {confirmed} confirmed")))
        },
        examples: || {
            let mut acted = trial("path", &["copy"]);
            acted.witness.acts = 1;
            (trial("path", &["copy"]), acted)
        },
        carried_by: None,
    },
];

fn is_operator(key: NodeId) -> bool {
    [NodeId::OPERATOR, NodeId::OPERATOR_2].contains(&key)
}

/// True if exactly this was given before, in the name of the operator whose key it is signed with.
fn signed(facts: &Facts, taken: &Taken) -> bool {
    facts.witness.given.iter().any(|given| {
        let same = (given.id, given.kind) == (taken.id, taken.kind) && given.at_ms <= taken.at_ms;
        same && is_operator(given.key) && given.key == given.id.operator
    })
}

/// True if no attack acts between the operator and the unit.
fn out_of_the_way(deeds: &Deeds) -> bool {
    deeds.over(&ELSEWHERE) && !deeds.any(&IN_THE_PATH)
}

/// A HOLD of the first operator's that did not stop the unit in the time that its way takes.
fn disobeyed(facts: &Facts) -> Option<String> {
    let holds = facts.witness.given.iter().filter(|g| g.kind == CommandKind::Hold && g.key == NodeId::OPERATOR);
    let by = holds.map(|given| given.at_ms + facts.limits.obeyed).filter(|by| *by <= facts.duration_ms);
    by.map(|by| (by, mode_at(&facts.changes, by)))
        .find(|(_, mode)| drives(mode))
        .map(|(by, mode)| format!("{mode} at {by:.0} ms, {:.0} ms after a hold", facts.limits.obeyed))
}

fn given(at_ms: f64, key: NodeId) -> Given {
    let id = CommandId { operator: key, boot: Boot(1), sequence: Sequence(1) };
    Given { at_ms, id, kind: CommandKind::Hold, key }
}

/// A trial in which a hold under this key is given and reaches the unit at 5 s.
fn taken(key: NodeId, refused: Option<Reason>) -> Facts {
    let mut facts = trial("roles", &["hold"]);
    let given = given(4_990.0, key);
    facts.witness.given.push(given);
    facts.witness.taken.push(Taken { at_ms: 5_000.0, id: given.id, kind: given.kind, refused });
    facts
}
