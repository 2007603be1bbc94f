//! Checks of the steps of a scenario against each other: names, waits for other steps, and the level of knowledge.

use evidence::trial::Knowledge;
use ground_truth::{MAX_STEP_NAME, StepName};

use super::finding::{Finding, finding};
use super::step::{Trigger, When};
use super::timed::Windowed;
use super::{Located, Scenario};

/// Every mistake in its steps.
pub(super) fn steps(s: &Scenario) -> Vec<Finding> {
    let windows = s.windows();
    let mut found = Vec::new();
    for window in &windows {
        found.extend(name(*window));
        found.extend(content(s, *window));
        found.extend(declared(s, *window));
        if let Some(when) = window.timing().when {
            found.extend(condition(when));
            found.extend(when.trigger().and_then(|trigger| known(s, *window, when, trigger)));
            found.extend(named(&windows, *window, when));
        }
    }
    found
}

fn name(window: &dyn Windowed) -> Option<Finding> {
    let timing = window.timing();
    match (timing.step, timing.when) {
        (None, Some(when)) => Some(finding(when, "a step that waits has no name", "add `step = \"...\"`")),
        (Some(step), _) if StepName::new(step.as_str()).is_none() => {
            let message = format!("the name of a step has at most {MAX_STEP_NAME} characters");
            Some(finding(step, message, "choose a shorter one"))
        }
        (Some(_), _) | (None, None) => None,
    }
}

fn condition(trigger: &Located<When>) -> Option<Finding> {
    let kinds = "enters, begun, ended, datagrams, silence_ms, hears";
    let found = |message: String| Some(finding(trigger, message, format!("say exactly one of {kinds}")));
    match trigger.triggers().len() {
        0 => found("waits for nothing".to_owned()),
        1 if trigger.enters.is_none() && (trigger.from.is_some() || trigger.nth.is_some()) => {
            Some(finding(trigger, "`from` and `nth` go with `enters`", "take them out, or say `enters`"))
        }
        1 => None,
        n => found(format!("waits for {n} things")),
    }
}

/// The table's own action may need more than its level.
fn content(s: &Scenario, window: &dyn Windowed) -> Option<Finding> {
    let (needs, level) = (window.needs(), level(s, window));
    let located = window.timing().knowledge.or(s.knowledge.as_ref());
    let message = || format!("what this does needs {} knowledge, its level is {}", needs.name(), level.name());
    (needs > level)
        .then(|| located.map(|located| finding(located, message(), format!("say `knowledge = \"{}\"`", needs.name()))))
        .flatten()
}

/// A table may lower the scenario's level, never raise it.
fn declared(s: &Scenario, window: &dyn Windowed) -> Option<Finding> {
    let own_knowledge = window.timing().knowledge.filter(|own_knowledge| ***own_knowledge > s.level())?;
    let message = format!("more than the scenario's level, {}", s.level().name());
    Some(finding(own_knowledge, message, "raise the scenario's `knowledge`, or take this out"))
}

/// The event that is waited for has to be within the level, and within sight of the place that waits.
fn known(s: &Scenario, window: &dyn Windowed, when: &Located<When>, trigger: Trigger<'_>) -> Option<Finding> {
    let (needs, level) = (trigger.needs(), level(s, window));
    if needs > level {
        let message = format!("waiting for this needs {} knowledge, the level is {}", needs.name(), level.name());
        return Some(finding(when, message, format!("say `knowledge = \"{}\"`", needs.name())));
    }
    let blind = match trigger {
        Trigger::Passes(_) | Trigger::Silence(_) => window.sees() != Some(Knowledge::OnPath),
        Trigger::Hears(_) => window.sees() != Some(Knowledge::Insider),
        Trigger::Enters { .. } | Trigger::Begun(_) | Trigger::Ended(_) => false,
    };
    blind.then(|| finding(when, "this cannot be seen from there", "let another step see it, and wait for that step"))
}

fn level(s: &Scenario, window: &dyn Windowed) -> Knowledge {
    window.timing().knowledge.map_or_else(|| s.level(), |own_knowledge| **own_knowledge)
}

/// The step that is waited for has to be there and may not wait for this one; tables of one step begin together.
fn named(windows: &[&dyn Windowed], window: &dyn Windowed, trigger: &Located<When>) -> Option<Finding> {
    let own_name = window.timing().step?;
    if tables_of(windows, own_name.as_str()).any(|other| other.timing().when.is_none_or(|w| **w != **trigger)) {
        let message = format!("the tables of step `{}` wait for different things", own_name.as_str());
        return Some(finding(own_name, message, "give them one `when`, or names of their own"));
    }
    let mut next = waited_for(trigger);
    for _ in 0..windows.len() {
        let name = next?;
        if name == own_name.as_str() {
            return Some(finding(trigger, "waits for itself", "let one step of the circle begin by its time"));
        }
        let Some(table) = tables_of(windows, name).next() else {
            return Some(finding(trigger, format!("there is no step `{name}`"), "name a step of this scenario"));
        };
        next = table.timing().when.and_then(|trigger| waited_for(trigger));
    }
    None
}

/// The tables of the step `name`.
fn tables_of<'w>(windows: &'w [&'w dyn Windowed], name: &'w str) -> impl Iterator<Item = &'w &'w dyn Windowed> {
    windows.iter().filter(move |w| w.timing().step.is_some_and(|s| s.as_str() == name))
}

fn waited_for(trigger: &When) -> Option<&str> {
    match trigger.trigger()? {
        Trigger::Begun(name) | Trigger::Ended(name) => Some(name.as_str()),
        Trigger::Enters { .. } | Trigger::Passes(_) | Trigger::Silence(_) | Trigger::Hears(_) => None,
    }
}
