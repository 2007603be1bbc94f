//! Each limit of P1 and P5 to P11 from both sides: a log just within it is no finding, one just beyond it is. `limits_trust`
//! has the limits of P2 to P4, `guards` and `plant` those judged from the plant, other files those that belong to an attack.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use evidence::trial::Outcome;
use ground_truth::Any;
use oracle::{Property, judge};
use wire::command::CommandKind;
use wire::core::Side;
use wire::event::{Account, Event, Interface, ShownAs};
use wire::id::{CommandId, NodeId, PeerId, TrackId};
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::refusal::Reason;
use wire::sensor::Class;

use super::log::{BOUNDS, Log, command};
use super::orders::obeyed;

/// Permitted lateness of an order, a confirmation and an entry in the log, milliseconds.
const SLACK_MS: u64 = 50;

#[test]
fn p1_the_age_of_a_confirmation() {
    let confirmed = |age_ms: u64| {
        let mut log = Log::whole();
        let kind = CommandKind::Confirm(TrackId(1));
        log.add(7000 - age_ms, NodeId::CONSOLE, Event::Intended { command: command(3), kind, tag: None });
        log.add(7000 - age_ms + 10, NodeId::UNIT_A, Event::Executed { command: command(3), kind, refused: None });
        log.cut_display(7000).acted(7000, Guards::default()).plant_act(7000, Class::Vehicle, 100);
        log.transition(7000, Mode::PrepareToAct, Mode::Ready, Cause::Acted).breaks()
    };
    let limit = BOUNDS.command_limit_ms + SLACK_MS;
    assert_eq!(confirmed(limit), []);
    assert_eq!(confirmed(limit + 1), [Property::P1]);
}

#[test]
fn p1_the_life_of_authority() {
    // A whole log holds for 8 s, from 2 s to the end.
    let held = |longer_ms: u64| {
        let mut log = Log::whole();
        let arming = |event: &Any| match event {
            Any::Service(Event::Transition { to, .. }) => *to == Mode::PrepareToAct,
            Any::Service(Event::Executed { kind, .. } | Event::Intended { kind, .. }) => {
                matches!(kind, CommandKind::Arm(_))
            }
            Any::Service(Event::Minted { .. }) => true,
            _ => false,
        };
        log.entries.iter_mut().filter(|w| arming(&w.entry.event)).for_each(|w| w.at -= longer_ms * 1000);
        log.breaks()
    };
    let limit = BOUNDS.authority_ms + BOUNDS.control_period_ms + SLACK_MS;
    assert_eq!(held(limit - 8000), []);
    assert_eq!(held(limit - 8000 + 1), [Property::P1]);
}

#[test]
fn p5_stop_under_expired_or_revoked_key() {
    let second =
        |executed_ms: u64| obeyed(executed_ms - 10, NodeId::OPERATOR_2, CommandKind::Disarm, NodeId::OPERATOR_2);
    assert_eq!(second(7000 + SLACK_MS).breaks(), []);
    assert_eq!(second(7000 + SLACK_MS + 1).breaks(), [Property::P5], "admitted until 7 s");
    let struck = |ms: u64| second(5000).add(ms, NodeId::GATEWAY, Event::Struck { who: NodeId::OPERATOR_2 }).breaks();
    assert_eq!(struck(5000 - BOUNDS.to_hold_safe_ms), []);
    assert_eq!(struck(5000 - BOUNDS.to_hold_safe_ms - 1), [Property::P5]);
}

#[test]
fn p5_pose_bound_under_distrusted_fixes() {
    let moved = |aside_mm: i32| {
        let mut log = Log::under_way();
        for w in log.entries.iter_mut().filter(|w| (5_100_000..=5_300_000).contains(&w.at)) {
            if let Any::Service(Event::Located { pose_y_mm, distrusted, .. }) = &mut w.entry.event {
                *distrusted = true;
                *pose_y_mm = if w.at == 5_300_000 { aside_mm } else { 0 };
            }
        }
        log.breaks()
    };
    // 100 mm, a twentieth of the 200 mm that it went, 5 mm/s.
    assert_eq!(moved(111), []);
    assert_eq!(moved(112), [Property::P5]);
}

#[test]
fn p6_every_account_off_by_one_is_missed() {
    let (unit, gateway) = (NodeId::UNIT_A, NodeId::GATEWAY);
    let (relay, guard) = (NodeId::RELAY_TELEMETRY, gateway.guard().expect("a guard"));
    let off = [
        (relay, Account::RelayIn(Side::Client)),
        (relay, Account::RelayIn(Side::Server)),
        (relay, Account::RelayOut(Side::Client)),
        (relay, Account::RelayOut(Side::Server)),
        (relay, Account::RelayAdded(Side::Client)),
        (relay, Account::RelayAdded(Side::Server)),
        (relay, Account::RelayDropped(Side::Client)),
        (relay, Account::RelayDropped(Side::Server)),
        (relay, Account::RelayStranger),
        (NodeId::CAMPAIGN, Account::RelayUnsent(Side::Client)),
        (NodeId::CAMPAIGN, Account::RelayUnsent(Side::Server)),
        (guard, Account::SentDirect),
        (guard, Account::Datagrams),
        (guard, Account::Unguarded),
        (guard, Account::KernelDropped),
        (guard, Account::GuardIn),
        (guard, Account::GuardRefused),
        (guard, Account::Delivered),
        (guard, Account::Discarded),
        (guard, Account::Handshake),
        (gateway, Account::Received(Interface::Uplink)),
        (gateway, Account::Accepted(Interface::Uplink)),
        (gateway, Account::Refused(Interface::Uplink, Reason::Stale)),
        (unit, Account::Received(Interface::Downlink)),
        (unit, Account::Accepted(Interface::Downlink)),
        (unit, Account::Refused(Interface::Downlink, Reason::Stale)),
    ];
    for (node, account) in off {
        let mut log = Log::whole();
        log.add(9999, node, Event::Count { account, n: 1 });
        assert_eq!((log.breaks(), log.judge().outcome), (vec![Property::P6], Outcome::Invalid), "{node} {account:?}");
    }
}

#[test]
fn p7_age_and_duration_of_fresh_displays() {
    let limit = BOUNDS.freshness_ms + BOUNDS.telemetry_period_ms + SLACK_MS;
    let old = |ms: u64| Log::whole().displayed(5100 + ms, Mode::PrepareToAct, 5100).breaks();
    assert_eq!(old(limit), []);
    assert_eq!(old(limit + 1), [Property::P7]);
    // It is IDLE until 1 s.
    let left = |ms: u64| Log::whole().displayed(1000 + ms, Mode::Idle, 1000 + ms / 100 * 100).breaks();
    assert_eq!(left(limit - 1), []);
    assert_eq!(left(limit), [Property::P7]);
}

#[test]
fn p7_displayed_place_tolerance() {
    let shown = |north_mm: i32| {
        let mut log = Log::under_way();
        let pose = log.way(4900);
        for w in log.entries.iter_mut().filter(|w| w.at == 5_005_000) {
            if let Any::Service(Event::Displayed { place: Some(place), .. }) = &mut w.entry.event {
                *place = pose;
                place.y_mm = north_mm;
            }
        }
        log.breaks()
    };
    // Six deviations of a fix, and what it drives in the 105 ms since it last said where it is.
    assert_eq!(shown(240 + 315), []);
    assert_eq!(shown(240 + 316), [Property::P7]);
}

#[test]
fn p7_deadline_for_command_and_session_displays() {
    let answered = |ms: u64| {
        let mut log = Log::whole();
        let shown = |shown| Event::CommandShown { command: command(9), shown };
        log.add(6000, NodeId::CONSOLE, shown(ShownAs::Requested));
        log.add(6000 + ms, NodeId::CONSOLE, shown(ShownAs::NotAcknowledged)).breaks()
    };
    assert_eq!(answered(1000 + SLACK_MS), []);
    assert_eq!(answered(1000 + SLACK_MS + 1), [Property::P7]);
    let lost = |ms: u64| {
        let (peer, times) = (PeerId::UNIT_A, 1);
        let mut log = Log::whole();
        log.add(5000, NodeId::UNIT_A, Event::SessionLost { peer });
        log.add(5000 + ms, NodeId::CONSOLE, Event::LossesShown { peer, times }).breaks()
    };
    assert_eq!(lost(1000), []);
    assert_eq!(lost(1001), [Property::P7]);
    let executed = |ms: u64| {
        let mut log = Log::whole();
        log.add(4990, NodeId::CONSOLE, Event::Intended { command: command(9), kind: CommandKind::Enable, tag: None });
        log.add(5000, NodeId::CONSOLE, Event::CommandShown { command: command(9), shown: ShownAs::Executed });
        let event = Event::Executed { command: command(9), kind: CommandKind::Enable, refused: None };
        log.add(5000 + ms, NodeId::UNIT_A, event).breaks()
    };
    assert_eq!(executed(SLACK_MS), []);
    assert_eq!(executed(SLACK_MS + 1), [Property::P7], "shown as executed, and it was not yet");
}

#[test]
fn p8_command_lateness_and_repetition() {
    let kind = CommandKind::Enable;
    let executed = |late_ms: &[u64]| {
        let mut log = Log::whole();
        log.add(3000, NodeId::CONSOLE, Event::Intended { command: command(9), kind, tag: None });
        for ms in late_ms {
            log.add(3000 + ms, NodeId::UNIT_A, Event::Executed { command: command(9), kind, refused: None });
        }
        log.breaks()
    };
    let limit = BOUNDS.command_limit_ms + SLACK_MS;
    assert_eq!(executed(&[limit]), []);
    assert_eq!(executed(&[limit + 1]), [Property::P8]);
    assert_eq!(executed(&[10, 11]), [Property::P8]);
}

#[test]
fn p8_command_before_a_session_loss() {
    let lost = |ms: u64, kind: CommandKind| {
        let id = CommandId { operator: NodeId::OPERATOR, ..command(9) };
        let mut log = Log::whole();
        log.add(5000, NodeId::CONSOLE, Event::Intended { command: id, kind, tag: None });
        let peer = PeerId::UNIT_A;
        log.add(ms, NodeId::UNIT_A, Event::SessionLost { peer }).add(
            ms,
            NodeId::CONSOLE,
            Event::LossesShown { peer, times: 1 },
        );
        log.add(5100, NodeId::UNIT_A, Event::Executed { command: id, kind, refused: None }).breaks()
    };
    assert_eq!(lost(5000, CommandKind::Enable), []);
    assert_eq!(lost(5001, CommandKind::Enable), [Property::P8]);
}

#[test]
fn p9_degraded_end_and_recovery_limits() {
    let lasts = |ms: u64| {
        let mut log = Log::whole();
        log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
        log.transition(5000 + ms, Mode::Degraded, Mode::Ready, Cause::Recovered).breaks()
    };
    let least = BOUNDS.hysteresis_ms - SLACK_MS;
    assert_eq!(lasts(least), []);
    assert_eq!(lasts(least - 1), [Property::P9]);
    let resumed = |executed_ms: u64| {
        let mut log = Log::whole();
        log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator).plant_stops(5000);
        log.command(executed_ms, 9, CommandKind::Resume)
            .transition(8000, Mode::HoldSafe, Mode::Ready, Cause::Operator)
            .breaks()
    };
    assert_eq!([resumed(8000 - 2 * SLACK_MS), resumed(8000 + SLACK_MS)], [vec![], vec![]]);
    assert_eq!(resumed(8000 - 2 * SLACK_MS - 1), [Property::P9]);
    assert_eq!(resumed(8000 + SLACK_MS + 1), [Property::P9]);
}

#[test]
fn p10_run_ending_before_a_death_obligation() {
    let killed = |ms: u64| {
        let mut log = Log::whole();
        log.killed(ms, NodeId::GATEWAY);
        let findings = judge(&log.evidence(vec![NodeId::GATEWAY])).findings;
        findings.iter().any(|f| f.property == Property::P10)
    };
    assert_eq!([9000, 9001].map(killed), [false, true]);
}

#[test]
fn p11_act_distance_from_its_class() {
    let act = |class: Class, mm: u32| Log::whole().cut_display(5000).confirm_and_act(5000, class, mm).breaks();
    assert_eq!(act(Class::Vehicle, BOUNDS.designation_mm), []);
    assert_eq!(act(Class::Vehicle, BOUNDS.designation_mm + 1), [Property::P11]);
    assert_eq!(act(Class::Decoy, 0), [Property::P11]);
}
