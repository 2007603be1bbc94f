//! Each property of the oracle has been seen to fail: on a log in which it is broken, and only there.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use campaign::oracle::{Evidence, Plan, Planned, Property, Verdict, Witnessed, judge};
use campaign::trial::Outcome;
use wire::audit::Entry;
use wire::bounds::Bounds;
use wire::codec::Text;
use wire::command::CommandKind;
use wire::core::{Side, Topic};
use wire::event::{Account, Action, Event, FaultKind, Freshness, GuardVerdict, Interface, Sensor, ShownAs, Suspension};
use wire::id::{Boot, CommandId, FrameId, NodeId, ObjectId, PeerId, RecordId, Sequence, TrackId, UnitId, WorldId};
use wire::mode::{Because, Cause, Guard, Guards, Mode};
use wire::policy::Waived;
use wire::refusal::Reason;
use wire::sensor::{Class, Modalities, Modality, ReceiverTime};
use wire::settings::Settings;
use wire::stream::{Deed, Sight};
use wire::time::{Instant, Span};

/// A whole log holds authority from 2 s to its end.
const BOUNDS: Bounds = Bounds { authority_ms: 8000, ..Bounds::GROUND };

/// A log under construction; times in milliseconds.
#[derive(Clone)]
pub(crate) struct Log {
    entries: Vec<Witnessed>,
    pub(crate) planned: Vec<Plan>,
}

impl Log {
    /// A quiet, whole run of ten seconds: enabled at 1 s, armed at 2 s, displayed all along, telemetry on time.
    pub(crate) fn whole() -> Log {
        let mut log = Log { entries: Vec::new(), planned: Vec::new() };
        log.command(1000, 1, CommandKind::Enable).to(1000, Mode::Idle, Mode::Ready, Cause::Operator);
        log.command(2000, 2, CommandKind::Arm(TrackId(1))).to(2000, Mode::Ready, Mode::PrepareToAct, Cause::Operator);
        let minted = Event::Minted {
            world: WorldId(0),
            authority: 1,
            track: TrackId(1),
            command: command(2),
            waived: Waived::default(),
        };
        log.add(2000, NodeId::UNIT_A, minted);
        log.associated(50, 1, PeerId::UNIT_A);
        for t in (100..10_000).step_by(100) {
            let mode = log.mode(t);
            log.report(t).displayed(t + 5, mode, t).heard(t).truth(t, 1000, 5000);
        }
        log
    }

    pub(crate) fn add(&mut self, ms: u64, node: NodeId, event: Event) -> &mut Log {
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(ms * 1000), event, previous: [0; 32] };
        self.entries.push(Witnessed { at: ms * 1000, entry });
        self
    }

    fn mode(&self, ms: u64) -> Mode {
        let to = |w: &Witnessed| match w.entry.event {
            Event::Transition { to, .. } if w.at <= ms * 1000 => Some(to),
            _ => None,
        };
        self.entries.iter().rev().find_map(to).unwrap_or(Mode::Idle)
    }

    fn to(&mut self, ms: u64, from: Mode, to: Mode, cause: Cause) -> &mut Log {
        let event = Event::Transition { from, to, cause, because: Because::Itself, failing: Guards::default() };
        self.add(ms, NodeId::UNIT_A, event)
    }

    pub(crate) fn command(&mut self, ms: u64, n: u64, kind: CommandKind) -> &mut Log {
        self.add(ms - 10, NodeId::CONSOLE, Event::Intended { command: command(n), kind });
        self.add(ms, NodeId::UNIT_A, Event::Executed { command: command(n), kind, refused: None })
    }

    fn report(&mut self, ms: u64) -> &mut Log {
        let event = Event::Accepted {
            at: Interface::Uplink,
            record: record(ms),
            peer: PeerId::UNIT_A,
            age: Some(Span::ms(1)),
            waived: Waived::default(),
        };
        self.add(ms, NodeId::GATEWAY, event)
    }

    fn displayed(&mut self, ms: u64, mode: Mode, report: u64) -> &mut Log {
        let event = Event::Displayed {
            unit: UnitId::A,
            mode,
            authority: false,
            freshness: Freshness::Fresh,
            age: Span::ms(5),
            tracks_fresh: 0,
            tracks_stale: 0,
            report: record(report),
        };
        self.add(ms, NodeId::CONSOLE, event)
    }

    /// The unit has its association with the gateway, and `peer` this one at the gateway.
    fn associated(&mut self, ms: u64, association: u32, peer: PeerId) -> &mut Log {
        let guard = |node: NodeId| node.guard().expect("a node with a guard");
        let to_gateway = Event::Associated { association: 1, peer: PeerId::GATEWAY };
        self.add(ms, guard(NodeId::UNIT_A), to_gateway);
        self.add(ms, guard(NodeId::GATEWAY), Event::Associated { association, peer })
    }

    /// A datagram at both guards.
    fn heard(&mut self, ms: u64) -> &mut Log {
        for node in [NodeId::GATEWAY, NodeId::UNIT_A] {
            let hash = ms << 8 | node.index() as u64;
            self.saw(ms, node, hash, GuardVerdict::Passed);
        }
        self
    }

    fn saw(&mut self, ms: u64, node: NodeId, hash: u64, verdict: GuardVerdict) -> &mut Log {
        let event = Event::GuardSaw { association: 1, epoch: 1, sequence: ms, length: 100, hash, verdict };
        self.add(ms, node.guard().expect("a node with a guard"), event)
    }

    fn truth(&mut self, ms: u64, speed: i32, fence: i32) -> &mut Log {
        let event = Event::Truth {
            unit: UnitId::A,
            x_mm: 0,
            y_mm: 0,
            yaw_mrad: 0,
            speed_mm_s: speed,
            set_speed_mm_s: speed,
            leased: true,
            fence_mm: fence,
        };
        self.add(ms, NodeId::SIM, event)
    }

    fn confirm_and_act(&mut self, ms: u64, class: Class, distance_mm: u32) -> &mut Log {
        self.command(ms, 3, CommandKind::Confirm(TrackId(1)));
        self.acted(ms, Guards::default()).plant_act(ms, class, distance_mm);
        self.to(ms, Mode::PrepareToAct, Mode::Ready, Cause::Acted)
    }

    fn acted(&mut self, ms: u64, failing: Guards) -> &mut Log {
        let event = Event::Acted { world: WorldId(0), authority: 1, track: TrackId(1), command: command(3), failing };
        self.add(ms, NodeId::UNIT_A, event)
    }

    fn plant_act(&mut self, ms: u64, class: Class, distance_mm: u32) -> &mut Log {
        let event = Event::PlantAct {
            authority: 1,
            command: command(3),
            object: Some(ObjectId(1)),
            class: Some(class),
            distance_mm,
        };
        self.add(ms, NodeId::SIM, event)
    }

    fn thermal_fault(&mut self, from: u64, to: u64) -> &mut Log {
        self.planned.push(Planned::Fault(Sensor::Thermal, FaultKind::Dropout).into());
        let fault =
            |active| Event::Fault { sensor: Sensor::Thermal, kind: FaultKind::Dropout, active, frame: FrameId(1) };
        let present = Modalities::default().with(Modality::Rgb).with(Modality::Depth).with(Modality::Lidar);
        self.add(from, NodeId::SIM, fault(true)).add(to, NodeId::SIM, fault(false));
        self.add(from + 20, NodeId::PERCEPTION, Event::FrameSeen { frame: FrameId(1), present })
    }

    /// From `ms` on, what is displayed and the modes after it are dropped, to be written anew.
    pub(crate) fn cut_display(&mut self, ms: u64) -> &mut Log {
        self.entries.retain(|w| !(w.at >= ms * 1000 && matches!(w.entry.event, Event::Displayed { .. })));
        self
    }

    pub(crate) fn judge(&self) -> Verdict {
        self.judge_with(Vec::new())
    }

    fn judge_with(&self, killed: Vec<NodeId>) -> Verdict {
        let mut entries = self.entries.clone();
        entries.sort_by_key(|w| w.at);
        judge(&Evidence {
            entries,
            broken_log: None,
            custody: Vec::new(),
            bounds: BOUNDS,
            planned: self.planned.clone(),
            duration: 10_000_000,
            stall_limit: u64::MAX,
            operators: vec![(NodeId::OPERATOR, u64::MAX), (NodeId::OPERATOR_2, 7_000_000)],
            killed,
        })
    }

    pub(crate) fn breaks(&self) -> Vec<Property> {
        let mut broken: Vec<Property> = self.judge().findings.iter().map(|f| f.property).collect();
        broken.sort_unstable();
        broken.dedup();
        broken
    }
}

pub(crate) fn command(n: u64) -> CommandId {
    CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(n) }
}

fn record(ms: u64) -> RecordId {
    RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(ms) }
}

#[test]
fn a_whole_log_breaks_nothing() {
    let log = Log::whole();
    assert_eq!(log.breaks(), []);
    assert_eq!(log.judge().outcome, Outcome::Nominal);
}

#[test]
fn p1_an_act_that_no_operator_confirmed() {
    let mut log = Log::whole();
    log.acted(5000, Guards::default()).plant_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), [Property::P1]);
    assert_eq!(log.judge().outcome, Outcome::Unsafe);
}

#[test]
fn p1_an_act_with_a_failing_guard() {
    let mut log = Log::whole();
    log.command(5000, 3, CommandKind::Confirm(TrackId(1)));
    log.acted(5000, Guards::default().with(Guard::Thermal)).plant_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), [Property::P1]);
}

#[test]
fn p1_an_act_under_revoked_authority() {
    let mut log = Log::whole();
    log.add(4000, NodeId::UNIT_A, Event::Revoked { authority: 1, cause: Cause::Expired });
    log.command(5000, 3, CommandKind::Confirm(TrackId(1)));
    log.acted(5000, Guards::default()).plant_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), [Property::P1]);
}

#[test]
fn p1_authority_that_outlives_its_time_and_p11_one_on_another_track_than_was_ordered() {
    let mut log = Log::whole();
    let early =
        |event: &Event| matches!(event, Event::Transition { to: Mode::PrepareToAct, .. } | Event::Minted { .. });
    let ordered = |event: &Event| {
        matches!(
            event,
            Event::Executed { kind: CommandKind::Arm(_), .. } | Event::Intended { kind: CommandKind::Arm(_), .. }
        )
    };
    for w in log.entries.iter_mut().filter(|w| early(&w.entry.event) || ordered(&w.entry.event)) {
        w.at -= 300_000;
    }
    assert_eq!(log.breaks(), [Property::P1], "8.3 s of it");
    let mut log = Log::whole();
    let minted = log.entries.iter_mut().find_map(|w| match &mut w.entry.event {
        Event::Minted { track, .. } => Some(track),
        _ => None,
    });
    *minted.expect("it was minted") = TrackId(2);
    assert_eq!(log.breaks(), [Property::P11]);
}

#[test]
fn p9_degraded_that_ends_before_its_hysteresis() {
    let lasts = |ms: u64| {
        let mut log = Log::whole();
        log.cut_display(5000).to(5000, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
        log.to(5000 + ms, Mode::Degraded, Mode::Ready, Cause::Recovered);
        log.breaks()
    };
    assert_eq!(lasts(1000), []);
    assert_eq!(lasts(400), [Property::P9]);
}

#[test]
fn p2_a_lost_subsystem_without_restriction() {
    let mut log = Log::whole();
    log.thermal_fault(4000, 9000);
    assert_eq!(log.breaks(), [Property::P2]);
    assert_eq!(log.judge().outcome, Outcome::Late);
}

#[test]
fn p3_nothing_timely_for_longer_than_the_bound() {
    let mut log = Log::whole();
    let guard = NodeId::UNIT_A.guard();
    log.entries.retain(|w| !(w.at > 5_000_000 && w.at < 7_000_000 && Some(w.entry.node) == guard));
    assert_eq!(log.breaks(), [Property::P3]);
}

#[test]
fn p3_records_held_back_too_long_are_not_timely() {
    let mut log = Log::whole();
    for t in (5000..8000).step_by(100) {
        let hash = t << 8 | NodeId::GATEWAY.index() as u64;
        let event =
            Event::Attack { action: Action::Delay, side: Side::Server, length: 100, hash, delay: Span::ms(400) };
        log.add(t - 400, NodeId::RELAY_TELEMETRY, event);
    }
    log.planned.push(Planned::Action(Action::Delay).into());
    // What came so late is accepted in this log, which is P7's to say.
    assert_eq!(log.breaks(), [Property::P3, Property::P7]);
}

#[test]
fn p3_a_unit_that_is_not_where_it_takes_itself_to_be() {
    let located = |pose_x_mm: i32| {
        let mut log = Log::whole();
        for t in (5000..7000).step_by(200) {
            let (stamp, time) = (Instant(t * 1000), ReceiverTime(t * 1000));
            let event = Event::Located { stamp, x_mm: 0, y_mm: 0, time, pose_x_mm, pose_y_mm: 0, distrusted: false };
            log.add(t, NodeId::UNIT_A, event);
        }
        log.breaks()
    };
    assert_eq!(located(900), []);
    assert_eq!(located(1100), [Property::P3]);
}

#[test]
fn p7_a_record_accepted_after_it_was_held_back_too_long() {
    let held = |ms: u64| {
        let mut log = Log::whole();
        let hash = 5000 << 8 | NodeId::GATEWAY.index() as u64;
        let delay = Span::ms(ms);
        let event = Event::Attack { action: Action::Delay, side: Side::Server, length: 100, hash, delay };
        log.add(5000 - ms, NodeId::RELAY_TELEMETRY, event);
        log.planned.push(Planned::Action(Action::Delay).into());
        log.breaks()
    };
    assert_eq!(held(250), []);
    assert_eq!(held(350), [Property::P7]);
}

#[test]
fn p3_a_hold_that_the_plant_does_not_follow() {
    let mut log = Log::whole();
    log.cut_display(5000).to(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Lost(Guard::Lease));
    assert_eq!(log.breaks(), [Property::P3]);
}

#[test]
fn p4_driving_outside_the_fence() {
    let mut log = Log::whole();
    log.truth(5000, 800, -20);
    assert_eq!(log.breaks(), [Property::P4]);
}

#[test]
fn p5_a_displayed_record_that_was_never_accepted() {
    let mut log = Log::whole();
    log.displayed(5050, Mode::PrepareToAct, 5001);
    assert_eq!(log.breaks(), [Property::P5]);
}

#[test]
fn p5_an_executed_command_that_nobody_gave() {
    let mut log = Log::whole();
    let event = Event::Executed { command: command(9), kind: CommandKind::Disarm, refused: None };
    log.add(5000, NodeId::UNIT_A, event);
    assert_eq!(log.breaks(), [Property::P5]);
}

#[test]
fn p6_accounts_that_do_not_add_up() {
    let mut log = Log::whole();
    log.add(9999, NodeId::GATEWAY, Event::Count { account: Account::Received(Interface::Uplink), n: 7 });
    assert_eq!(log.breaks(), [Property::P6]);
    assert_eq!(log.judge().outcome, Outcome::Invalid);
}

#[test]
fn p7_a_value_shown_fresh_beyond_its_limit() {
    let mut log = Log::whole();
    log.displayed(5900, Mode::PrepareToAct, 5000);
    assert_eq!(log.breaks(), [Property::P7]);
}

#[test]
fn p7_a_mode_shown_fresh_that_the_unit_has_left() {
    let mut log = Log::whole();
    log.displayed(5005, Mode::Idle, 5000);
    assert_eq!(log.breaks(), [Property::P7]);
}

#[test]
fn p8_a_command_executed_twice_and_one_executed_late() {
    let mut log = Log::whole();
    let twice = Event::Executed { command: command(1), kind: CommandKind::Enable, refused: None };
    log.add(1500, NodeId::UNIT_A, twice);
    assert_eq!(log.breaks(), [Property::P8]);
    let mut log = Log::whole();
    log.add(3000, NodeId::CONSOLE, Event::Intended { command: command(5), kind: CommandKind::Disarm });
    log.add(6000, NodeId::UNIT_A, Event::Executed { command: command(5), kind: CommandKind::Disarm, refused: None });
    assert_eq!(log.breaks(), [Property::P8]);
}

#[test]
fn p3_an_operator_who_holds_is_not_obeyed_in_time() {
    let mut log = Log::whole();
    log.add(5000, NodeId::CONSOLE, Event::Intended { command: command(3), kind: CommandKind::Hold });
    assert_eq!(log.breaks(), [Property::P3]);
    assert_eq!(log.judge().outcome, Outcome::Late);
}

#[test]
fn p4_values_under_which_a_blind_unit_leaves_the_fence() {
    let values = |margin_mm| Settings { speed_mm_s: 3000, margin_mm, arm_permille: 600, keep_permille: 450 };
    let mut log = Log::whole();
    log.command(500, 3, CommandKind::Configure(values(600)));
    assert_eq!(log.breaks(), []);
    log.command(600, 4, CommandKind::Configure(values(599)));
    assert_eq!(log.breaks(), [Property::P4]);
}

/// A command that a rogue gives under `key`, its word at `ms`.
fn rogue(log: &mut Log, ms: u64, id: CommandId, kind: CommandKind, key: NodeId) {
    log.planned.push(Planned::Rogue.into());
    log.add(ms, NodeId::INSIDER_OPERATOR, Event::Rogue { command: id, kind, key, certificate: None });
}

/// The same, and the unit executes it 10 ms later.
fn obeyed(ms: u64, operator: NodeId, kind: CommandKind, key: NodeId) -> Log {
    let id = CommandId { operator, ..command(9) };
    let mut log = Log::whole();
    rogue(&mut log, ms, id, kind, key);
    log.add(ms + 10, NodeId::UNIT_A, Event::Executed { command: id, kind, refused: None });
    log
}

#[test]
fn a_rogues_order_needs_somebody_who_judged_it_and_only_its_stops_are_no_finding() {
    let mut log = Log::whole();
    rogue(
        &mut log,
        5000,
        CommandId { operator: NodeId::OPERATOR_2, ..command(9) },
        CommandKind::Disarm,
        NodeId::OPERATOR_2,
    );
    assert_eq!(log.judge().outcome, Outcome::Invalid, "its word alone");
    let execute = |kind| obeyed(5000, NodeId::OPERATOR_2, kind, NodeId::OPERATOR_2).judge().outcome;
    assert_eq!(execute(CommandKind::Disarm), Outcome::Undetected);
    assert_eq!(execute(CommandKind::Resume), Outcome::Unsafe);
}

#[test]
fn p5_a_stop_by_a_rogue_without_a_standing_operators_key_is_a_finding() {
    let stop = |ms, operator, key| obeyed(ms, operator, CommandKind::Disarm, key);
    assert_eq!(stop(5000, NodeId::UNIT_B, NodeId::UNIT_B).breaks(), [Property::P5], "nobody's operator");
    assert_eq!(stop(5000, NodeId::OPERATOR, NodeId::UNIT_B).breaks(), [Property::P5], "not that operator's key");
    assert_eq!(stop(5000, NodeId::OPERATOR, NodeId::OPERATOR_2).breaks(), [Property::P5], "another operator's");
    assert_eq!(stop(7500, NodeId::OPERATOR_2, NodeId::OPERATOR_2).breaks(), [Property::P5], "expired");
    for (node, at, broken) in [
        (NodeId::UNIT_A, 4900, &[Property::P5][..]),
        (NodeId::UNIT_A, 5100, &[]),
        (NodeId::GATEWAY, 3900, &[Property::P5]),
        (NodeId::GATEWAY, 4900, &[]),
    ] {
        let mut log = stop(5000, NodeId::OPERATOR_2, NodeId::OPERATOR_2);
        log.add(at, node, Event::Struck { who: NodeId::OPERATOR_2 });
        assert_eq!(log.breaks(), broken, "{node} knows it at {at} ms");
    }
}

#[test]
fn p5_and_p9_an_operators_id_over_another_command_than_the_operator_gave() {
    let mut log = Log::whole();
    log.add(4990, NodeId::CONSOLE, Event::Intended { command: command(3), kind: CommandKind::Disarm });
    log.add(5000, NodeId::UNIT_A, Event::Executed { command: command(3), kind: CommandKind::Hold, refused: None });
    assert_eq!(log.breaks(), [Property::P5]);
    let resumed = |given| {
        let mut log = Log::whole();
        log.cut_display(3000).to(3000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator).plant_stops(3000);
        log.add(3990, NodeId::CONSOLE, Event::Intended { command: command(3), kind: given });
        let executed = Event::Executed { command: command(3), kind: CommandKind::Resume, refused: None };
        log.add(4000, NodeId::UNIT_A, executed).to(4000, Mode::HoldSafe, Mode::Ready, Cause::Operator);
        log.breaks()
    };
    assert_eq!(resumed(CommandKind::Resume), []);
    assert_eq!(resumed(CommandKind::Hold), [Property::P5, Property::P9]);
}

#[test]
fn p9_hold_safe_left_and_authority_entered_without_an_operator() {
    let mut log = Log::whole();
    log.cut_display(3000).to(3000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator);
    log.entries.retain(|w| !(w.at > 3_000_000 && matches!(w.entry.event, Event::Truth { .. })));
    log.to(4000, Mode::HoldSafe, Mode::Ready, Cause::Recovered);
    assert_eq!(log.breaks(), [Property::P9]);
    let mut log = Log::whole();
    log.cut_display(3000).to(3000, Mode::PrepareToAct, Mode::Ready, Cause::Expired);
    log.to(4000, Mode::Ready, Mode::PrepareToAct, Cause::Recovered);
    assert_eq!(log.breaks(), [Property::P9]);
}

#[test]
fn p10_a_broken_log() {
    let log = Log::whole();
    let mut entries = log.entries.clone();
    entries.sort_by_key(|w| w.at);
    let verdict = judge(&Evidence {
        entries,
        broken_log: Some("chain of unit-a broken at entry 9".into()),
        custody: Vec::new(),
        bounds: BOUNDS,
        planned: Vec::new(),
        duration: 10_000_000,
        stall_limit: u64::MAX,
        operators: Vec::new(),
        killed: Vec::new(),
    });
    assert_eq!(verdict.outcome, Outcome::Invalid);
    assert!(verdict.findings.iter().all(|f| f.property == Property::P10));
}

#[test]
fn p11_an_act_on_a_decoy_and_one_far_from_any_vehicle() {
    for (class, distance) in [(Class::Decoy, 100), (Class::Vehicle, 9000)] {
        let mut log = Log::whole();
        log.cut_display(5000).confirm_and_act(5000, class, distance);
        assert_eq!(log.breaks(), [Property::P11], "{class:?} {distance}");
    }
    let mut log = Log::whole();
    log.cut_display(5000).confirm_and_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), []);
}

#[test]
fn an_injection_without_its_receipt_is_invalid_whatever_else_happened() {
    let mut log = Log::whole();
    log.planned.push(Planned::Action(Action::Replay).into());
    let event = Event::Attack { action: Action::Replay, side: Side::Server, length: 9, hash: 77, delay: Span::ZERO };
    log.add(4000, NodeId::RELAY_TELEMETRY, event);
    assert_eq!(log.judge().outcome, Outcome::Invalid, "the adversary's word alone is no receipt");
    log.saw(3000, NodeId::GATEWAY, 77, GuardVerdict::Passed).saw(4001, NodeId::GATEWAY, 77, GuardVerdict::Passed);
    assert_eq!(log.judge().outcome, Outcome::Undetected);
}

#[test]
fn a_drop_without_a_guards_closed_account_is_no_receipt() {
    let mut log = Log::whole();
    log.planned.push(Planned::Action(Action::Drop).into());
    let event = Event::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 77, delay: Span::ZERO };
    log.add(4000, NodeId::RELAY_TELEMETRY, event);
    assert_eq!(log.judge().outcome, Outcome::Invalid);
}

#[test]
fn a_refusal_on_the_bus_that_is_no_longer_written_counts_by_the_closing_account() {
    let refused_in_all = |n: u64, came_ms: u64| {
        let at = Interface::Bus(Topic::Tracks);
        let reason = Reason::Tag;
        let mut log = Log::whole();
        log.planned.push(Planned::Action(Action::Forge).into());
        for _ in 0..256 {
            log.add(3000, NodeId::UNIT_A, Event::Refused { at, peer: None, reason, detail: Text::new("tag") });
        }
        let side = Side::Server;
        let event = Event::Attack { action: Action::Forge, side, length: 9, hash: 77, delay: Span::ZERO };
        log.add(came_ms, NodeId::INSIDER_PERCEPTION, event);
        let sight = Event::MouthSaw { reader: NodeId::UNIT_A, at, length: 9, hash: 77 };
        log.add(came_ms + 1, NodeId::CAMPAIGN, sight);
        log.add(9990, NodeId::UNIT_A, Event::Count { account: Account::Refused(at, reason), n });
        log.judge().outcome
    };
    assert_eq!(
        refused_in_all(256, 4000),
        Outcome::Undetected,
        "all that were refused are written, and none is this one"
    );
    assert_eq!(refused_in_all(257, 4000), Outcome::Rejected);
    assert_eq!(refused_in_all(257, 2000), Outcome::Undetected, "while refusals were written this one was none");
}

/// A log in which the relay says at 4 s that it did `deed` to ten bytes at 100 of the direction to the unit, and the
/// mouth there says `seen`, by milliseconds.
fn tampered(deed: Deed, delay_ms: u64, seen: &[(u64, Sight, u64, u32, u64)]) -> Log {
    let mut log = Log::whole();
    log.planned.push(Planned::Stream(deed).into());
    let (side, stream, hash, delay) = (Side::Client, 5, 77, Span::ms(delay_ms));
    let event = Event::Tampered { deed, side, stream, offset: 100, length: 10, hash, delay };
    log.add(4000, NodeId::RELAY_COMMAND, event);
    for (ms, sight, offset, length, hash) in seen.iter().copied() {
        log.add(ms, NodeId::UNIT_A.guard().expect("a mouth"), Event::StreamSaw { sight, stream, offset, length, hash });
    }
    log
}

#[test]
fn what_is_done_to_a_stream_needs_the_far_ends_mouth() {
    use Sight::{Arrived, Closed, HungUp};
    type Seen<'a> = &'a [(u64, Sight, u64, u32, u64)];
    let cases: &[(Deed, u64, Seen<'_>, bool)] = &[
        (Deed::Held, 500, &[], false),
        (Deed::Held, 500, &[(4100, Arrived, 100, 10, 77)], false),
        (Deed::Held, 500, &[(4501, Arrived, 100, 10, 77)], true),
        (Deed::Held, 500, &[(4100, Arrived, 90, 20, 1), (4501, Arrived, 110, 10, 2)], false),
        (Deed::Damaged, 0, &[(4001, Arrived, 100, 10, 78)], false),
        (Deed::Damaged, 0, &[(3999, Arrived, 100, 10, 77)], false),
        (Deed::Damaged, 0, &[(4001, Arrived, 100, 10, 77)], true),
        (Deed::Reset, 0, &[(3990, Closed, 100, 0, 0)], false),
        (Deed::Reset, 0, &[(4001, HungUp, 100, 0, 0), (4002, Closed, 100, 0, 0)], false),
        (Deed::Reset, 0, &[(10_001, Closed, 100, 0, 0)], false),
        (Deed::Reset, 0, &[(4001, Arrived, 100, 10, 3), (4500, Closed, 110, 0, 0)], false),
        (Deed::Reset, 0, &[(4001, Closed, 90, 0, 0)], true),
        (Deed::HalfClosed, 0, &[(4001, Closed, 90, 0, 0)], false),
        (Deed::HalfClosed, 0, &[(4001, Closed, 100, 0, 0)], true),
    ];
    for (i, (deed, delay, seen, receipt)) in cases.iter().enumerate() {
        assert_eq!(tampered(*deed, *delay, seen).judge().receipt, *receipt, "case {i}: {deed:?} {seen:?}");
    }
}

#[test]
fn a_trip_without_a_fault_is_a_false_trip() {
    let mut log = Log::whole();
    log.cut_display(5000).to(5000, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
    assert_eq!(log.judge().outcome, Outcome::FalseTrip);
}

impl Log {
    /// `node` was killed on purpose at `ms`.
    fn killed(&mut self, ms: u64, node: NodeId) -> &mut Log {
        self.planned.push(Planned::Kill(node).into());
        self.add(ms, NodeId::CAMPAIGN, Event::Ended { node, killed: true })
    }

    /// From `ms` on the plant has no lease; it brakes and stands a second later.
    fn plant_stops(&mut self, ms: u64) -> &mut Log {
        for w in &mut self.entries {
            if let Event::Truth { speed_mm_s, set_speed_mm_s, leased, .. } = &mut w.entry.event
                && w.at >= ms * 1000
            {
                (*set_speed_mm_s, *leased) = (0, false);
                *speed_mm_s = if w.at >= (ms + 1000) * 1000 { 0 } else { 500 };
            }
        }
        self
    }

    /// What is owed and broken, under the judge that knows that `node` is dead.
    fn breaks_with_dead(&self, node: NodeId) -> Vec<Property> {
        let verdict = self.judge_with(vec![node]);
        verdict.findings.iter().map(|f| f.property).collect()
    }
}

#[test]
fn a_plant_that_goes_on_when_its_unit_is_killed_breaks_p3() {
    let mut log = Log::whole();
    log.killed(5000, NodeId::UNIT_A).cut_display(5000);
    assert!(log.breaks_with_dead(NodeId::UNIT_A).contains(&Property::P3), "it never stops");
    let mut late = log.clone();
    late.plant_stops(6200);
    assert_eq!(late.breaks_with_dead(NodeId::UNIT_A), [Property::P3], "its lease ends after Th");
    log.plant_stops(5300);
    let verdict = log.judge_with(vec![NodeId::UNIT_A]);
    assert_eq!((verdict.findings.as_slice(), verdict.outcome), (&[][..], Outcome::HoldSafe));
    let plant = verdict.responses[0].plant.unwrap();
    assert_eq!((plant.lease_ended_ms, plant.standing_ms), (Some(300.0), Some(1300.0)));
}

#[test]
fn a_unit_that_stays_ready_when_a_process_it_needs_is_killed_breaks_p2_and_p3() {
    for (node, broken) in [
        (NodeId::PERCEPTION, vec![Property::P2, Property::P3]),
        (NodeId::GATEWAY, vec![Property::P2, Property::P3]),
        (NodeId::RECORDER, vec![Property::P2]),
        (NodeId::CONSOLE, vec![]),
    ] {
        let mut log = Log::whole();
        log.killed(5000, node);
        let mut found = log.breaks_with_dead(node);
        found.retain(|p| matches!(p, Property::P2 | Property::P3));
        found.dedup();
        assert_eq!(found, broken, "{node}");
    }
}

#[test]
fn a_hold_that_does_not_stop_the_unit_when_the_broker_is_killed_breaks_p3() {
    let mut log = Log::whole();
    log.killed(5000, NodeId::BROKER);
    assert_eq!(log.breaks_with_dead(NodeId::BROKER), [Property::P10], "nobody tried");
    log.add(7000, NodeId::CONSOLE, Event::Intended { command: command(9), kind: CommandKind::Hold });
    // Once for what the broker's death owes, once for the operator's HOLD itself.
    assert_eq!(log.breaks_with_dead(NodeId::BROKER), [Property::P2, Property::P3, Property::P3, Property::P3]);
}

#[test]
fn a_run_that_ends_before_what_a_death_owes_is_due_shows_nothing() {
    for node in [NodeId::PERCEPTION, NodeId::GATEWAY, NodeId::RECORDER] {
        let mut log = Log::whole();
        log.killed(9800, node);
        let verdict = log.judge_with(vec![node]);
        assert_eq!((verdict.outcome, verdict.responses[0].kept), (Outcome::Invalid, false), "{node}");
    }
}

#[test]
fn a_hold_that_the_unit_does_not_obey_in_time_breaks_p3() {
    let given = Event::Intended { command: command(9), kind: CommandKind::Hold };
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, given);
    assert_eq!(log.breaks(), [Property::P3]);
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, given).to(7900, Mode::Ready, Mode::HoldSafe, Cause::Operator);
    let findings = log.judge().findings;
    assert!(!findings.iter().any(|f| f.what.contains("had not held")), "{findings:?}");
}

#[test]
fn a_command_shown_as_executed_that_the_unit_did_not_execute_breaks_p7() {
    let shown = |shown| Event::CommandShown { command: command(9), shown };
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(7400, NodeId::CONSOLE, shown(ShownAs::Executed));
    assert_eq!(log.breaks(), [Property::P7]);
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(7400, NodeId::CONSOLE, shown(ShownAs::Refused));
    assert_eq!(log.breaks(), []);
}

#[test]
fn a_command_shown_as_under_way_for_more_than_a_second_breaks_p7() {
    let shown = |shown| Event::CommandShown { command: command(9), shown };
    for late in [ShownAs::Requested, ShownAs::Sent] {
        let mut log = Log::whole();
        log.add(6000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(6100, NodeId::CONSOLE, shown(late));
        log.add(7500, NodeId::CONSOLE, shown(ShownAs::NotAcknowledged));
        assert_eq!(log.breaks(), [Property::P7], "{late:?}: the alarm comes too late");
    }
    let mut log = Log::whole();
    log.add(6000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(
        7000,
        NodeId::CONSOLE,
        shown(ShownAs::NotAcknowledged),
    );
    assert_eq!(log.breaks(), []);
    let mut log = Log::whole();
    log.add(6000, NodeId::CONSOLE, shown(ShownAs::Released));
    assert_eq!(log.breaks(), [Property::P7], "no alarm at all");
}

/// A unit that ends at 3 s, is started again at 4 s and enabled at 5 s; judged by what is said with `word` in it.
fn started_again(change: impl Fn(&mut Log), word: &str) -> Vec<String> {
    let mut log = Log::whole();
    log.killed(3000, NodeId::UNIT_A).cut_display(3000);
    log.add(4000, NodeId::CAMPAIGN, Event::Restarted { node: NodeId::UNIT_A, boot: Boot(2) });
    log.command(5000, 5, CommandKind::Enable).to(5000, Mode::Idle, Mode::Ready, Cause::Operator);
    change(&mut log);
    let findings = log.judge_with(vec![NodeId::UNIT_A]).findings;
    findings.into_iter().map(|f| f.what).filter(|what| what.contains(word)).collect()
}

#[test]
fn p3_is_asked_again_of_a_unit_that_was_started_again() {
    let silent = |from: u64, to: u64| {
        move |log: &mut Log| {
            let guard = NodeId::UNIT_A.guard();
            log.entries.retain(|w| !(w.at > from * 1000 && w.at < to * 1000 && Some(w.entry.node) == guard));
        }
    };
    assert_eq!(started_again(silent(3000, 4000), "nothing timely"), [""; 0], "dead");
    assert_eq!(started_again(silent(6000, 8000), "nothing timely").len(), 1, "alive again");
    let hold = |ms: u64| {
        let event = Event::Intended { command: command(9), kind: CommandKind::Hold };
        move |log: &mut Log| {
            log.add(ms, NodeId::CONSOLE, event);
        }
    };
    assert_eq!(started_again(hold(2500), "had not held"), [""; 0], "it died under the order");
    assert_eq!(started_again(hold(6000), "had not held").len(), 1, "alive again");
}

#[test]
fn p3_what_a_teammate_sends_to_the_gateway_is_no_sign_of_the_unit() {
    let mut log = Log::whole();
    let guard = NodeId::GATEWAY.guard().expect("a guard");
    log.entries.retain(|w| !(w.at > 5_000_000 && w.at < 7_000_000 && w.entry.node == guard));
    log.add(60, guard, Event::Associated { association: 2, peer: PeerId::UNIT_B });
    for t in (5050..7000).step_by(100) {
        let (hash, verdict) = (t << 8, GuardVerdict::Passed);
        log.add(t, guard, Event::GuardSaw { association: 2, epoch: 1, sequence: t, length: 100, hash, verdict });
    }
    assert_eq!(log.breaks(), [Property::P3]);
}

/// A log in which perception is said to be halted for half of each 100 ms from 4 s to 6 s; its core is fed at `fed`.
fn slowed(fed: impl Fn(u64) -> bool) -> Verdict {
    let node = NodeId::PERCEPTION;
    let how = Suspension::Slow { quota: 500, period: Span::ms(100) };
    let mut log = Log::whole();
    log.planned.push(Planned::Suspend(node).into());
    log.add(4000, NodeId::CAMPAIGN, Event::Suspended { node, how, on: true });
    for from in (4000..6000).step_by(100) {
        log.add(from, NodeId::CAMPAIGN, Event::Halted { node, on: true });
        log.add(from + 50, NodeId::CAMPAIGN, Event::Halted { node, on: false });
    }
    log.add(6000, NodeId::CAMPAIGN, Event::Suspended { node, how, on: false });
    for t in (2000..8000).step_by(25).filter(|t| fed(*t)) {
        log.add(t, NodeId::CAMPAIGN, Event::Ran { node });
    }
    log.judge()
}

#[test]
fn a_slow_process_is_believed_only_when_its_core_is_fed_between_its_stops_and_never_in_them() {
    let stopped = |t: u64| (4000..6000).contains(&t) && t % 100 < 50;
    assert_eq!((slowed(|t| !stopped(t)).receipt, slowed(|t| !stopped(t)).zero), (true, Some(4_000_000)));
    assert!(!slowed(|_| true).receipt, "it runs on");
    assert!(!slowed(|t| !stopped(t) || t == 5025).receipt, "once is enough");
    assert!(!slowed(|_| false).receipt, "silent by itself");
    assert!(!slowed(|t| t < 4000).receipt, "it never runs again");
    assert!(!slowed(|t| t % 2000 == 1000).receipt, "so seldom that nothing is missing");
}

#[test]
fn a_broker_that_is_said_to_hang_has_to_hold_something_up() {
    let hung = |given: u64, delivered: u64| {
        let (node, how) = (NodeId::BROKER, Suspension::Hang);
        let mut log = Log::whole();
        log.planned.push(Planned::Suspend(node).into());
        log.add(4000, NodeId::CAMPAIGN, Event::Suspended { node, how, on: true });
        log.add(6000, NodeId::CAMPAIGN, Event::Suspended { node, how, on: false });
        log.command(given, 7, CommandKind::Hold);
        let event = Event::StreamSaw { sight: Sight::Delivered, stream: 1, offset: 0, length: 9, hash: 1 };
        log.add(delivered, NodeId::GATEWAY.guard().expect("a mouth"), event);
        log.judge().receipt
    };
    assert!(hung(5000, 6010));
    assert!(!hung(5000, 5010), "it is handed on");
    assert!(!hung(3000, 6010), "nothing was given to it");
}

/// A gateway insider says at 4 s that it keeps a report for 800 ms; the console took in what it sent at `came`, and the
/// report was on the display at once where `shown`.
fn late(came: u64, shown: bool) -> Verdict {
    let mut log = Log::whole();
    log.planned.push(Planned::Late(800_000).into());
    log.add(4001, NodeId::INSIDER_GATEWAY, Event::Withheld { record: record(4000) });
    if !shown {
        log.entries
            .retain(|w| !(w.at > 4_000_000 && w.at < 4_850_000 && matches!(w.entry.event, Event::Displayed { .. })));
    }
    log.displayed(4250, Mode::PrepareToAct, 3900);
    let (action, side, delay) = (Action::Delay, Side::Server, Span::ms(800));
    log.add(4200, NodeId::INSIDER_GATEWAY, Event::Attack { action, side, length: 9, hash: 77, delay });
    let (reader, at) = (NodeId::CONSOLE, Interface::Bus(Topic::Feed));
    log.add(came, NodeId::CAMPAIGN, Event::MouthSaw { reader, at, length: 9, hash: 77 });
    log.judge()
}

#[test]
fn a_report_that_is_said_to_come_late_has_to_come_late() {
    assert_eq!((late(4802, false).receipt, late(4802, false).zero), (true, Some(4_001_000)));
    assert!(!late(4802, true).receipt, "it was on the display at once");
    assert!(!late(4300, false).receipt, "half a second early, whatever delay was claimed");
    assert!(!late(5500, false).receipt, "that was another one");
}

#[test]
fn each_table_needs_a_receipt_within_its_own_window() {
    let window = |what, ms: u64| Plan { from: ms * 1000, until: ms * 1000 + 200_000, ..Plan::from(what) };
    let mut log = obeyed(4000, NodeId::OPERATOR, CommandKind::Disarm, NodeId::OPERATOR);
    log.planned = vec![window(Planned::Rogue, 4000), window(Planned::Rogue, 6000)];
    assert!(!log.judge().receipt);
    log.planned[1] = window(Planned::Rogue, 3900);
    assert!(log.judge().receipt);
    let mut log = Log::whole();
    log.thermal_fault(4000, 4200);
    let fault = Planned::Fault(Sensor::Thermal, FaultKind::Dropout);
    for (plan, receipt) in [
        (window(fault, 4000), true),
        (window(fault, 6000), false),
        (window(Planned::Fault(Sensor::Thermal, FaultKind::Freeze), 4000), false),
    ] {
        log.planned = vec![plan];
        assert_eq!(log.judge().receipt, receipt, "{plan:?}");
    }
}

#[test]
fn what_a_rogue_on_shared_memory_forged_is_no_receipt_for_the_gateways_insider() {
    let forged = |node| {
        let mut log = Log::whole();
        log.planned.push(Planned::Feed(Action::Forge).into());
        let (action, side, delay) = (Action::Forge, Side::Server, Span::ZERO);
        log.add(4000, node, Event::Attack { action, side, length: 9, hash: 77, delay });
        let (reader, at) = (NodeId::CONSOLE, Interface::Bus(Topic::Feed));
        log.add(4001, NodeId::CAMPAIGN, Event::MouthSaw { reader, at, length: 9, hash: 77 });
        log.judge().receipt
    };
    assert!(forged(NodeId::INSIDER_GATEWAY));
    assert!(!forged(NodeId::IMPOSTOR));
}
