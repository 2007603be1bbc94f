//! From a scenario's `[operator]` to the console's script.

use console::ConsoleConfig;
use console::operator::{Action, Step, TrackCondition, When};
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;
use wire::person::Role;
use wire::sensor::Class;
use wire::setup::Secret;

use crate::scenario::{self, DisplayedState, Scenario, Verb};

/// Confidence from which the operator acts on a displayed track, permille.
const CONFIDENCE: u16 = 600;

/// The console's configuration, with the operator's own key.
pub(super) fn console(
    scenario: &Scenario,
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
        revocations,
        text: false,
    }
}

/// The unit under test and the teammates that the scenario brings.
fn awaited(scenario: &Scenario) -> Vec<UnitId> {
    let brought = |unit: &UnitId| scenario.unit.iter().any(|u| u.name.as_str() == unit.node().name());
    [UnitId::A, UnitId::B, UnitId::C].into_iter().filter(|unit| *unit == UnitId::A || brought(unit)).collect()
}

fn step(step: &scenario::Step) -> Step {
    let class = step.when_track.map_or(Class::Vehicle, class);
    Step {
        at_ms: Some((step.at_s.get() * 1000.0) as u64),
        unit: UnitId::A,
        when: When {
            mode: step.when_state.map(mode),
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
                let who = step.who.as_ref().and_then(|name| NodeId::from_name(name.as_str()));
                Action::Revoke(who.expect("invariant: a loaded step that revokes names somebody"))
            }
        },
        reason: step.reason.as_ref().map(|r| r.as_str().to_owned()).unwrap_or_default(),
        within_ms: (step.within_s.get() * 1000.0) as u64,
    }
}

fn class(class: scenario::Class) -> Class {
    match class {
        scenario::Class::Vehicle => Class::Vehicle,
        scenario::Class::Person => Class::Person,
        scenario::Class::Decoy => Class::Decoy,
        scenario::Class::Obstacle => Class::Obstacle,
    }
}

/// The mode that a displayed state is.
pub(super) fn mode(state: DisplayedState) -> Mode {
    match state {
        DisplayedState::Idle => Mode::Idle,
        DisplayedState::Ready => Mode::Ready,
        DisplayedState::PrepareToAct => Mode::PrepareToAct,
        DisplayedState::Degraded => Mode::Degraded,
        DisplayedState::HoldSafe => Mode::HoldSafe,
    }
}
