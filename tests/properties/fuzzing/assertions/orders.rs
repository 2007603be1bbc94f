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
            let mut executed = facts.witness.taken.iter().filter(|order| order.refused.is_none());
            none(executed.find(|order| !signed(facts, order)).map(|order| format!("{order:?} was given by nobody")))
        },
        examples: || (hold_taken(NodeId::OPERATOR, None), hold_taken(NodeId::CONSOLE, None)),
        carried_by: Some(("boundary.role", "roles")),
    },
    Assertion {
        name: "what_a_revoked_operator_orders_is_never_executed",
        holds: |facts| {
            let Some(struck) = facts.witness.struck_ms else { return Ok(()) };
            let late = |order: &&Taken| order.id.operator == NodeId::OPERATOR_2 && order.at_ms > struck;
            let mut executed = facts.witness.taken.iter().filter(|order| order.refused.is_none());
            none(executed.find(late).map(|order| format!("{order:?}, revoked at {struck:.0} ms")))
        },
        examples: || {
            let struck_at = |ms: f64| {
                let mut facts = hold_taken(NodeId::OPERATOR_2, None);
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
            let in_force = |order: &&Taken| order.refused.is_some_and(|reason| reason != Reason::Interlock);
            let mut of_operator = facts.witness.taken.iter().filter(|order| order.id.operator == NodeId::OPERATOR);
            let found = of_operator.find(in_force).filter(|_| out_of_the_way(&facts.deeds));
            none(found.map(|order| format!("{order:?}")))
        },
        examples: || {
            (hold_taken(NodeId::OPERATOR, Some(Reason::Interlock)), hold_taken(NodeId::OPERATOR, Some(Reason::Rate)))
        },
        carried_by: None,
    },
    Assertion {
        name: "an_operators_hold_is_obeyed_at_once_whatever_others_do",
        holds: |facts| none(disobeyed(facts).filter(|_| out_of_the_way(&facts.deeds))),
        examples: || {
            let with_order = |mut facts: Facts| {
                facts.witness.given.push(given_order(3_900.0, NodeId::OPERATOR));
                facts
            };
            (with_order(holding("roles", &["hold"])), with_order(trial("roles", &["hold"])))
        },
        carried_by: None,
    },
    Assertion {
        name: "the_plant_acts_no_more_often_than_operators_confirmed",
        holds: |facts| {
            let confirmed = |order: &&Given| matches!(order.kind, CommandKind::Confirm(_)) && is_operator(order.key);
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
fn signed(facts: &Facts, order: &Taken) -> bool {
    facts.witness.given.iter().any(|given| {
        let same = (given.id, given.kind) == (order.id, order.kind) && given.at_ms <= order.at_ms;
        same && is_operator(given.key) && given.key == given.id.operator
    })
}

/// True if no attack acts between the operator and the unit.
fn out_of_the_way(deeds: &Deeds) -> bool {
    deeds.in_any_space(&ELSEWHERE) && !deeds.any(&IN_THE_PATH)
}

/// A HOLD of the first operator's that did not stop the unit in the time that its way takes.
fn disobeyed(facts: &Facts) -> Option<String> {
    let holds = facts.witness.given.iter().filter(|g| g.kind == CommandKind::Hold && g.key == NodeId::OPERATOR);
    let deadline = holds.map(|order| order.at_ms + facts.limits.obeyed).filter(|amount| *amount <= facts.duration_ms);
    deadline
        .map(|amount| (amount, mode_at(&facts.changes, amount)))
        .find(|(_, mode)| drives(mode))
        .map(|(amount, mode)| format!("{mode} at {amount:.0} ms, {:.0} ms after a hold", facts.limits.obeyed))
}

fn given_order(at_ms: f64, key: NodeId) -> Given {
    let id = CommandId { operator: key, boot: Boot(1), sequence: Sequence(1) };
    Given { at_ms, id, kind: CommandKind::Hold, key }
}

/// A trial in which a hold under this key is given and reaches the unit at 5 s.
fn hold_taken(key: NodeId, refused: Option<Reason>) -> Facts {
    let mut facts = trial("roles", &["hold"]);
    let order = given_order(4_990.0, key);
    facts.witness.given.push(order);
    facts.witness.taken.push(Taken { at_ms: 5_000.0, id: order.id, kind: order.kind, refused });
    facts
}
