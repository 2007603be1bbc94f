//! Injections for which the oracle has to find receipts: one plan for each table, with the window in which it is carried out.

use evidence::{Micros, Plan, Planned};
use ground_truth::FaultKind;
use scenario::{Attack, Scenario, Windowed};
use wire::id::ObjectId;

use super::needs;
use crate::process;

/// Every plan of a scenario; the steps last, each once.
pub(crate) fn plans(s: &Scenario, phase: u64) -> Vec<Plan> {
    let mut all: Vec<Plan> = s.attacks().into_iter().filter_map(|attack| injected(attack, phase)).collect();
    all.extend(s.fault.iter().map(|f| during(f, phase, fault(s, f))));
    all.extend(s.kill.iter().map(|k| during(k, phase, process::planned(k))));
    all.extend(disguises(s));
    let mut steps: Vec<_> = s.windows().into_iter().filter_map(|windowed| windowed.step_name()).collect();
    steps.sort_unstable();
    steps.dedup();
    all.extend(steps.into_iter().map(|step| Plan::from(Planned::Step(step))));
    all
}

/// A table's plan: from its start for its length.
fn during(windowed: &dyn Windowed, phase: u64, what: Planned) -> Plan {
    let from = windowed.start_ms(phase) * 1000;
    let length = (windowed.duration_s().get() * 1e6) as Micros;
    Plan { what, from, until: from + length, step: windowed.step_name(), needs: needs::needs_of(what) }
}

/// An attack's plan, with the attack's own details.
fn injected(attack: &dyn Attack, phase: u64) -> Option<Plan> {
    let injection = attack.injection()?;
    let mut plan = during(attack, phase, injection.what);
    // Without a limit its effect may come until the end of the run.
    plan.until = injection.later_ms.map_or(Micros::MAX, |ms| plan.until + ms * 1000);
    plan.needs.takes = injection.takes.or(plan.needs.takes);
    plan.needs.running = injection.running.unwrap_or(plan.needs.running);
    Some(plan)
}

/// Plan of a sensor fault. A perturbation also has an aim, which the scene states.
fn fault(s: &Scenario, fault: &scenario::Fault) -> Planned {
    let aim = s.scene.as_ref().and_then(|scene| scene.perturbation.as_ref()).map(|p| p.aims_at);
    match (fault.kind, aim) {
        (FaultKind::Perturbation, Some(aim)) => Planned::Perturbation(aim),
        (kind, _) => Planned::Fault(fault.sensor, kind),
    }
}

/// Plans of disguises: objects with the paint of another class, or with a print, from the start of the trial.
fn disguises(s: &Scenario) -> impl Iterator<Item = Plan> {
    // An attack on the stacks has no scene.
    let objects = s.scene.iter().flat_map(|scene| scene.object.iter().enumerate());
    objects.flat_map(|(index, object)| {
        let id = ObjectId(index as u16);
        let paint = object.painted_as.filter(|paint| *paint != object.class);
        let paint = paint.map(|class| Planned::Disguise(id, class));
        let print = object.print.as_ref().map(|print| Planned::Print(id, print.aims_at));
        paint.into_iter().chain(print).map(Plan::from)
    })
}
