//! Commands on the display, from its own record.

use std::collections::BTreeMap;

use evidence::Micros;
use ground_truth::Any;
use wire::event::{Event, ShownAs};
use wire::id::{CommandId, NodeId};

use super::{Finding, Property, finding};
use crate::facts::{Facts, SLACK};

/// Longest time for which a command may be shown as under way after the operator last did something about it.
const ANSWER_WITHIN: Micros = 1_000_000;

/// Commands that are shown as executed and that the unit did not execute, or as under way for longer than [`ANSWER_WITHIN`].
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let mut found = Vec::new();
    let mut due: BTreeMap<CommandId, Micros> = BTreeMap::new();
    let answer_limit = ANSWER_WITHIN + SLACK;
    for w in evidence.entries.iter().filter(|w| w.entry.node == NodeId::CONSOLE) {
        let Any::Service(Event::CommandShown { command, shown }) = w.entry.event else { continue };
        let one_step = timeline.intended.iter().any(|(_, id, kind)| *id == command && kind.towards_safe());
        match shown {
            ShownAs::Requested | ShownAs::Released => {
                due.insert(command, w.at + answer_limit);
            }
            ShownAs::Sent => {}
            // An order towards safe has one step: staged, it waits for no second act of the operator.
            ShownAs::Staged if one_step => {}
            // It waits for the operator, who is in no hurry; or it is answered, or shown as not answered.
            ShownAs::Staged
            | ShownAs::Stored
            | ShownAs::Executed
            | ShownAs::Refused
            | ShownAs::Void
            | ShownAs::NotAcknowledged => {
                if let Some(until) = due.remove(&command).filter(|until| *until < w.at) {
                    found.push(shown_under_way(command, until));
                }
            }
        }
        let executed =
            || timeline.executed.iter().any(|(executed_at, id, _)| *id == command && *executed_at <= w.at + SLACK);
        if shown == ShownAs::Executed && !executed() {
            let message = format!("{command} is shown as executed and the unit did not execute it");
            found.push(finding(Property::P7, w.at, message));
        }
    }
    let end = evidence.duration;
    let alive = !evidence.killed.contains(&NodeId::CONSOLE);
    // A dead console shows nothing, and a run that ends within the limit shows no overdue command.
    let left = due.into_iter().filter(|(_, until)| alive && *until < end);
    found.extend(left.map(|(command, until)| shown_under_way(command, until)));
    found
}

fn shown_under_way(command: CommandId, until: Micros) -> Finding {
    let ms = ANSWER_WITHIN / 1000;
    finding(Property::P7, until, format!("{command} is shown as under way for more than {ms} ms"))
}
