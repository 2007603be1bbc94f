//! Conversion of a scenario's `[operator]` to the console's script, and to the oracle's copy of it.

use console::ConsoleConfig;
use console::eye::Eye;
use console::operator::{Action, ScriptStep, TrackCondition, When};
use evidence::mission::{Due, Script, Verb};
use scenario::{Scenario, Seconds};
use wire::command::TimeTag;
use wire::id::{NodeId, UnitId};
use wire::person::Role;
use wire::sensor::Class;
use wire::sign::Secret;
use wire::time::Span;

use super::draw::Draw;
use super::scene;

/// Confidence from which the operator acts on a displayed track, permille.
const CONFIDENCE: u16 = 600;

/// The console's configuration, with the operator's own key.
pub(super) fn console(
    scenario: &Scenario,
    draw: &Draw,
    operator_secret: Secret,
    revocations: Vec<(NodeId, Vec<u8>)>,
) -> ConsoleConfig {
    ConsoleConfig {
        units: vec![UnitId::A, UnitId::B, UnitId::C],
        awaited: awaited(scenario),
        operator: NodeId::OPERATOR,
        operator_secret,
        role: Role::Supervise,
        script: scenario.operator.step.iter().map(step).collect(),
        eye: eye(scenario, draw),
        revocations,
        text: false,
    }
}

/// The operator's eye, where the scenario gives one.
fn eye(scenario: &Scenario, draw: &Draw) -> Option<Eye> {
    let cycles = scenario.operator.identification_cycles?;
    let world = scene::build_scene(scenario, draw.shift_m, None);
    let vehicles = world.objects.iter().filter(|object| object.class == Class::Vehicle);
    let places = vehicles.flat_map(|object| places(&object.path)).map(scene::millimetres);
    let cycles_milli = (cycles.get() * 1000.0) as u32;
    Some(Eye { cycles_milli, better_ppm: draw.better_ppm, vehicles: places.collect() })
}

/// Places on a way, at most a metre apart on legs of up to 200 m.
fn places(path: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let length_of = |leg: &[[f32; 2]]| {
        let [east, north] = [leg[1][0] - leg[0][0], leg[1][1] - leg[0][1]];
        let parts = (east * east + north * north).sqrt().ceil().clamp(1.0, 200.0);
        let [x, y] = leg[0];
        (0..parts as u16).map(move |n| f32::from(n) / parts).map(move |share| [x + share * east, y + share * north])
    };
    path.windows(2).flat_map(length_of).chain(path.last().copied()).collect()
}

/// The orders that the operator is to give, and the stated end of the mission. A revocation is no order: the unit does
/// not carry it out.
pub(super) fn presumed(scenario: &Scenario) -> Script {
    let us = |seconds: Seconds| (seconds.get() * 1e6) as u64;
    let orders = scenario.operator.step.iter().filter(|step| *step.verb != Verb::Revoke);
    let due = |step: &scenario::Step| Due {
        verb: *step.verb,
        at_us: us(*step.at_s),
        within_us: us(step.within_s),
        after_us: step.after_s.as_deref().map_or(0, |after| us(*after)),
        mode: step.when_state,
        track: step.when_track,
    };
    Script { mission: scenario.mission.as_deref().copied(), steps: orders.map(due).collect() }
}

/// Units that the scenario has: the unit under test and its teammates.
fn awaited(scenario: &Scenario) -> Vec<UnitId> {
    let brought = |unit: &UnitId| scenario.unit.iter().any(|u| u.name.as_str() == unit.node().name());
    [UnitId::A, UnitId::B, UnitId::C].into_iter().filter(|unit| *unit == UnitId::A || brought(unit)).collect()
}

fn step(step: &scenario::Step) -> ScriptStep {
    let class = step.when_track.unwrap_or(Class::Vehicle);
    ScriptStep {
        at_ms: Some((step.at_s.get() * 1000.0) as u64),
        unit: UnitId::A,
        when: When {
            mode: step.when_state,
            track: step.when_track.map(|_| TrackCondition { class, confidence: CONFIDENCE }),
        },
        action: match *step.verb {
            Verb::Enable => Action::Enable,
            Verb::Arm => Action::Arm(class),
            Verb::Confirm => Action::Confirm,
            Verb::Hold => Action::Hold,
            Verb::Resume => Action::Resume,
            Verb::Disarm => Action::Disarm,
            Verb::Configure => {
                let values = step.values.expect("invariant: a loaded step that configures has its values");
                Action::Configure(values.settings())
            }
            Verb::Revoke => {
                let node = step.who.as_ref().and_then(|name| NodeId::from_name(name.as_str()));
                Action::Revoke(node.expect("invariant: a loaded step that revokes names somebody"))
            }
        },
        reason: step.reason.as_ref().map(|r| r.as_str().to_owned()).unwrap_or_default(),
        within_ms: (step.within_s.get() * 1000.0) as u64,
        tag: step.after_s.as_deref().map(|after| TimeTag { after: span(*after), within: span(step.window_s) }),
    }
}

fn span(seconds: Seconds) -> Span {
    Span::ms((seconds.get() * 1000.0) as u64)
}
