//! The plan of the hostile broker.

use adversary::plan::{AckForgery, BrokerAction, InsiderBrokerConfig, Kind, OrderForgery};
use scenario::{Direction, Order, Scenario, Windowed};

use super::timed;

/// The plan, when the scenario has one.
pub(crate) fn plan(s: &Scenario, phase: u64) -> Option<InsiderBrokerConfig> {
    let mut actions = Vec::new();
    let mut add = |of: &dyn Windowed, direction, action| actions.push(timed(of, direction, phase, action));
    for a in s.broker_drop.iter() {
        add(a, a.direction, BrokerAction::Drop { only: a.only.map(kind) });
    }
    for a in s.broker_delay.iter() {
        add(a, a.direction, BrokerAction::Delay { ms: a.by_ms.unsigned(), only: a.only.map(kind) });
    }
    for a in s.broker_reorder.iter() {
        add(a, a.direction, BrokerAction::Reorder { hold_ms: a.hold_ms.unsigned() });
    }
    for a in s.broker_duplicate.iter() {
        add(a, a.direction, BrokerAction::Duplicate { copies: a.copies.unsigned() as u32 });
    }
    for a in s.broker_replay.iter() {
        let (count, every_ms) = (a.count.unsigned() as u32, a.every_ms.unsigned());
        add(a, a.direction, BrokerAction::Replay { count, every_ms });
    }
    s.broker_retain.iter().for_each(|a| add(a, a.direction, BrokerAction::Retain));
    for a in s.broker_invent.iter() {
        let (count, every_ms) = (a.count.unsigned() as u32, a.every_ms.unsigned());
        let action = BrokerAction::Invent { kind: kind(a.verb), forgery: order(a.forgery), count, every_ms };
        add(a, Direction::Down, action);
    }
    for a in s.broker_forge.iter() {
        add(a, Direction::Up, BrokerAction::Forge { forgery: acknowledgement(a.forgery) });
    }
    (!actions.is_empty()).then_some(InsiderBrokerConfig { actions })
}

pub(crate) fn kind(asked: Order) -> Kind {
    match asked {
        Order::Enable => Kind::Enable,
        Order::Arm => Kind::Arm,
        Order::Confirm => Kind::Confirm,
        Order::Hold => Kind::Hold,
        Order::Resume => Kind::Resume,
        Order::Disarm => Kind::Disarm,
        Order::Configure => Kind::Configure,
    }
}

fn order(forgery: scenario::OrderForgery) -> OrderForgery {
    match forgery {
        scenario::OrderForgery::OwnKey => OrderForgery::OwnKey,
        scenario::OrderForgery::Altered => OrderForgery::Altered,
        scenario::OrderForgery::Spliced => OrderForgery::Spliced,
    }
}

fn acknowledgement(forgery: scenario::AckForgery) -> AckForgery {
    match forgery {
        scenario::AckForgery::OwnKey => AckForgery::OwnKey,
        scenario::AckForgery::Altered => AckForgery::Altered,
        scenario::AckForgery::Replayed => AckForgery::Replayed,
    }
}
