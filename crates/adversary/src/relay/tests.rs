//! The relays as attacks, and their account under any plan.

mod medium;
mod windows;

use ground_truth::{Action, Any, Note, StreamEffect};
use proptest::prelude::*;
use wire::core::{Core, Input, Output, Side};
use wire::event::{Account, Event, wire_hash};
use wire::id::{NodeId, SessionId};
use wire::time::{Instant, Span};

use super::{DatagramRelay, StreamRelay, Tally};
use crate::plan::{
    Damage, DatagramAction, DatagramRelayConfig, Direction, InjectedContent, StreamAction, StreamRelayConfig, Timed,
};
use crate::testing::{at_ms, counted, setup, times, turn};

#[test]
fn null_attack_passes_every_byte_without_journal() {
    let mut relay = datagrams(vec![]);
    let mut events = Vec::new();
    for n in 0..50u8 {
        let side = if n % 3 == 0 { Side::Server } else { Side::Client };
        let bytes = vec![n; 40];
        let out = turn(&mut relay, at_ms(u64::from(n)), &Input::Datagram { side, bytes: bytes.clone() }, &mut events);
        assert_eq!(out, [Output::Datagram { side: side.opposite(), bytes }]);
        assert_eq!(relay.deadline(), None);
    }
    assert!(
        events.iter().all(|event| matches!(event, Any::Service(Event::Started | Event::Signed { .. }))),
        "{events:?}"
    );
    turn(&mut relay, at_ms(60), &Input::Finish, &mut events);
    assert_eq!(counted(&events, Account::RelayIn(Side::Client)), 33);
    assert_eq!(counted(&events, Account::RelayOut(Side::Server)), 33);
}

#[test]
fn delayed_datagram_leaves_whole_at_its_deadline() {
    let mut relay = datagrams(vec![timed(0, 1000, DatagramAction::Delay { ms: 250, growth_us_per_s: 100_000 })]);
    let mut events = Vec::new();
    assert_eq!(turn(&mut relay, at_ms(500), &uplink(9), &mut events), []);
    assert_eq!(relay.deadline(), Some(at_ms(800)));
    assert_eq!(turn(&mut relay, at_ms(799), &Input::Timeout, &mut events), []);
    assert_eq!(turn(&mut relay, at_ms(800), &Input::Timeout, &mut events), [sent(9)]);
    assert!(events.contains(&Any::Instrument(Note::Attack {
        action: Action::Delay,
        side: Side::Server,
        length: 20,
        hash: wire_hash(&[9; 20]),
        delay: Span::ms(300),
    })));
}

#[test]
fn a_blackout_ends_with_its_window() {
    let mut relay = datagrams(vec![timed(100, 100, DatagramAction::Loss { permille: 1000 })]);
    let mut events = Vec::new();
    let out: Vec<usize> =
        [99, 100, 199, 200].map(|ms| turn(&mut relay, at_ms(ms), &uplink(1), &mut events).len()).into();
    assert_eq!(out, [1, 0, 0, 1]);
    assert_eq!(times(&events, Action::Drop), 2);
}

#[test]
fn burst_loss_loses_in_bursts() {
    let burst = DatagramAction::BurstLoss { enter_permille: 50, leave_permille: 200, loss_permille: 1000 };
    let mut relay = datagrams(vec![timed(0, 100_000, burst)]);
    let mut events = Vec::new();
    let lost: Vec<bool> = (0..2000).map(|ms| turn(&mut relay, at_ms(ms), &uplink(1), &mut events).is_empty()).collect();
    let bursts = lost.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    let losses = lost.iter().filter(|lost| **lost).count();
    assert!(bursts > 20 && losses > 3 * bursts, "{losses} losses in {bursts} bursts");
}

#[test]
fn replay_sends_captured_bytes_and_names_them() {
    let replay = DatagramAction::Replay { lag_ms: 100, count: 2, every_ms: 0 };
    let mut relay = datagrams(vec![Timed { direction: Direction::Up, ..timed(500, 0, replay) }]);
    let mut events = Vec::new();
    for (ms, byte) in [(100, 1), (200, 2), (300, 3), (450, 4)] {
        turn(&mut relay, at_ms(ms), &uplink(byte), &mut events);
    }
    assert_eq!(relay.deadline(), Some(at_ms(500)));
    assert_eq!(turn(&mut relay, at_ms(500), &Input::Timeout, &mut events), [sent(2), sent(3)]);
    assert_eq!(times(&events, Action::Replay), 2);
    assert_eq!(relay.deadline(), None);
}

#[test]
fn naive_replay_comes_from_the_relays_address() {
    let mut relay = datagrams(vec![timed(500, 0, DatagramAction::Reoriginate { count: 3, every_ms: 10 })]);
    let mut events = Vec::new();
    turn(&mut relay, at_ms(100), &uplink(1), &mut events);
    let out = [500, 510, 520].map(|ms| turn(&mut relay, at_ms(ms), &Input::Timeout, &mut events));
    assert!(out.iter().all(|out| *out == [Output::Stranger { bytes: vec![1; 20] }]), "{out:?}");
    assert_eq!(times(&events, Action::Reoriginate), 3);
    turn(&mut relay, at_ms(600), &Input::Finish, &mut events);
    assert_eq!(counted(&events, Account::RelayStranger), 3);
    assert_eq!(counted(&events, Account::RelayOut(Side::Server)), 1);
}

#[test]
fn each_damage_journals_the_changed_bytes_hash() {
    for damage in [Damage::Flip, Damage::Truncate, Damage::Extend, Damage::Splice] {
        let mut relay = datagrams(vec![timed(0, 1000, DatagramAction::Corrupt { permille: 1000, damage })]);
        let mut events = Vec::new();
        for byte in 1..9 {
            let out = turn(&mut relay, at_ms(1), &uplink(byte), &mut events);
            let [Output::Datagram { bytes, .. }] = &out[..] else { panic!("{out:?}") };
            assert_ne!(*bytes, vec![byte; 20], "{damage:?}");
            let is_attack =
                |event: &Any| matches!(event, Any::Instrument(Note::Attack { hash, .. }) if *hash == wire_hash(bytes));
            assert!(events.iter().any(is_attack), "{damage:?}");
        }
    }
}

#[test]
fn a_plaintext_alert_is_one_epoch_zero_record() {
    let alert = DatagramAction::Inject { content: InjectedContent::PlaintextAlert, count: 1, every_ms: 0 };
    let mut relay = datagrams(vec![Timed { direction: Direction::Up, ..timed(0, 0, alert) }]);
    let out = turn(&mut relay, at_ms(0), &Input::Timeout, &mut Vec::new());
    let [Output::Datagram { side: Side::Server, bytes }] = &out[..] else { panic!("{out:?}") };
    assert_eq!((bytes[0], &bytes[1..5], &bytes[11..]), (21, &[0xfe, 0xfd, 0, 0][..], &[0, 2, 2, 80][..]));
}

/// A truncated hello passes no guard.
#[test]
fn hello_storm_comes_from_unknown_peers_only() {
    for (content, sound) in [(InjectedContent::ClientHello, true), (InjectedContent::ClientHelloTruncated, false)] {
        let inject = DatagramAction::Inject { content, count: 1, every_ms: 0 };
        let mut relay = datagrams(vec![timed(0, 0, inject)]);
        let out = turn(&mut relay, at_ms(0), &Input::Timeout, &mut Vec::new());
        let [Output::Stranger { bytes }] = &out[..] else { panic!("{out:?}") };
        assert_eq!(link::guard::hello::opens_association(bytes), sound, "{content:?}");
    }
}

#[test]
fn forked_relay_continues_the_same_draws() {
    let mut relay = datagrams(vec![timed(0, 10_000, DatagramAction::Jitter { ms: 50 })]);
    (0..20).for_each(|ms| drop(turn(&mut relay, at_ms(ms), &uplink(ms as u8), &mut Vec::new())));
    let mut forked = relay.clone();
    for ms in 20..120 {
        let [a, b] = [&mut relay, &mut forked].map(|relay| turn(relay, at_ms(ms), &uplink(ms as u8), &mut Vec::new()));
        assert_eq!(a, b);
    }
}

#[test]
fn stall_holds_the_stream_in_order() {
    let mut relay = streams(vec![timed(100, 400, StreamAction::Stall), timed(0, 1000, StreamAction::Delay { ms: 50 })]);
    let mut events = Vec::new();
    assert_eq!(turn(&mut relay, at_ms(70), &piece(1), &mut events), []);
    assert_eq!(turn(&mut relay, at_ms(80), &piece(2), &mut events), []);
    assert_eq!(relay.deadline(), Some(at_ms(500)));
    assert_eq!(turn(&mut relay, at_ms(500), &Input::Timeout, &mut events), [forwarded(1), forwarded(2)]);
    let held: Vec<_> = stream_effects(&events, StreamEffect::Held).map(|(offset, _, delay)| (offset, delay)).collect();
    assert_eq!(held, [(0, Span::ms(430)), (10, Span::ms(420))], "which bytes, and for how long");
}

#[test]
fn damage_journals_departing_bytes_reset_both_directions() {
    let corrupt = Timed { direction: Direction::Up, ..timed(0, 90, StreamAction::Corrupt { permille: 1000 }) };
    let mut relay = streams(vec![corrupt, timed(100, 0, StreamAction::Reset)]);
    let mut events = Vec::new();
    let out = turn(&mut relay, at_ms(50), &piece(1), &mut events);
    let [Output::Stream { bytes, .. }] = &out[..] else { panic!("{out:?}") };
    assert_ne!(*bytes, vec![1; 10]);
    assert_eq!(stream_effects(&events, StreamEffect::Damaged).collect::<Vec<_>>(), [(0, wire_hash(bytes), Span::ZERO)]);
    turn(&mut relay, at_ms(95), &piece(2), &mut events);
    turn(&mut relay, at_ms(100), &Input::Timeout, &mut events);
    assert_eq!(stream_effects(&events, StreamEffect::Reset).map(|(offset, ..)| offset).collect::<Vec<_>>(), [0, 20]);
}

#[test]
fn a_throttled_stream_is_slow_and_whole() {
    let mut relay = streams(vec![timed(0, 10_000, StreamAction::Throttle { bytes_per_s: 100 })]);
    (0..3).for_each(|n| drop(turn(&mut relay, at_ms(0), &piece(n), &mut Vec::new())));
    for (n, ms) in [(0, 100), (1, 200), (2, 300)] {
        assert_eq!(relay.deadline(), Some(at_ms(ms)));
        assert_eq!(turn(&mut relay, at_ms(ms), &Input::Timeout, &mut Vec::new()), [forwarded(n)]);
    }
}

#[test]
fn cut_ends_open_and_early_returning_connections() {
    let mut relay = streams(vec![timed(100, 100, StreamAction::Cut)]);
    let mut events = Vec::new();
    let reset = |n| [Output::Reset { connection: SessionId(n) }];
    assert_eq!(turn(&mut relay, at_ms(50), &piece_of(1, 1), &mut events), [forwarded(1)]);
    assert_eq!(turn(&mut relay, at_ms(100), &Input::Timeout, &mut events), reset(1));
    assert_eq!(turn(&mut relay, at_ms(110), &piece_of(1, 2), &mut events), [], "late bytes of a cut connection");
    assert_eq!(turn(&mut relay, at_ms(150), &piece_of(2, 3), &mut events), reset(2));
    assert_eq!(turn(&mut relay, at_ms(250), &piece_of(3, 4), &mut events).len(), 1);
}

#[test]
fn a_half_close_ends_one_direction_only() {
    let mut relay = streams(vec![Timed { direction: Direction::Up, ..timed(100, 0, StreamAction::HalfClose) }]);
    let mut events = Vec::new();
    turn(&mut relay, at_ms(50), &piece(1), &mut events);
    let end = Output::Stream { connection: SessionId(1), side: Side::Server, bytes: vec![] };
    assert_eq!(turn(&mut relay, at_ms(100), &Input::Timeout, &mut events), [end]);
    assert_eq!(turn(&mut relay, at_ms(110), &piece(2), &mut events), []);
    let down = Input::Stream { connection: SessionId(1), side: Side::Server, bytes: vec![3] };
    assert_eq!(turn(&mut relay, at_ms(120), &down, &mut events).len(), 1);
}

#[test]
fn a_plan_beyond_its_bounds_is_refused() {
    let config = DatagramRelayConfig {
        actions: vec![timed(0, 0, DatagramAction::Loss { permille: 5 })],
        ..DatagramRelayConfig::default()
    };
    assert!(config.check().is_err(), "a window without length");
    let config = DatagramRelayConfig {
        actions: vec![timed(0, 1, DatagramAction::Loss { permille: 1001 })],
        ..DatagramRelayConfig::default()
    };
    assert!(config.check().is_err());
    let hello = DatagramAction::Inject { content: InjectedContent::ClientHello, count: 1, every_ms: 0 };
    let down = Timed { direction: Direction::Down, ..timed(0, 1, hello) };
    assert!(DatagramRelayConfig { actions: vec![down], ..DatagramRelayConfig::default() }.check().is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Datagrams that came or were added have left, were dropped or are held.
    #[test]
    fn datagrams_are_accounted_for_under_any_plan(
        actions in prop::collection::vec(any_datagram_action(), 0..6),
        traffic in prop::collection::vec((0u64..40, any::<bool>(), 1usize..60), 1..120),
    ) {
        let mut relay = datagrams(actions);
        let mut now = 0;
        for (step, up, length) in traffic {
            now += step;
            let side = if up { Side::Client } else { Side::Server };
            let input = if step % 7 == 6 { Input::Timeout } else { Input::Datagram { side, bytes: vec![3; length] } };
            turn(&mut relay, at_ms(now), &input, &mut Vec::new());
            for side in [Side::Client, Side::Server] {
                prop_assert!(balanced(&relay.tally, side, relay.held_towards(side)), "{:?}", relay.tally);
            }
        }
        turn(&mut relay, at_ms(now), &Input::Finish, &mut Vec::new());
        prop_assert!(balanced(&relay.tally, Side::Client, 0) && balanced(&relay.tally, Side::Server, 0));
    }

    #[test]
    fn stream_pieces_are_accounted_for_under_any_plan(
        actions in prop::collection::vec(any_stream_action(), 0..6),
        traffic in prop::collection::vec((0u64..40, any::<bool>(), 0usize..60, 1u32..4), 1..120),
    ) {
        let mut relay = streams(actions);
        let mut now = 0;
        for (step, up, length, connection) in traffic {
            now += step;
            let side = if up { Side::Client } else { Side::Server };
            let input = Input::Stream { connection: SessionId(connection), side, bytes: vec![3; length] };
            turn(&mut relay, at_ms(now), &input, &mut Vec::new());
            for side in [Side::Client, Side::Server] {
                prop_assert!(balanced(&relay.tally, side, relay.held_towards(side)), "{:?}", relay.tally);
            }
        }
    }
}

/// Offset, hash and delay of the actions on a stream.
fn stream_effects(events: &[Any], wanted: StreamEffect) -> impl Iterator<Item = (u64, u64, Span)> {
    events.iter().filter_map(move |event| {
        let Any::Instrument(Note::Tampered { deed, offset, hash, delay, .. }) = event else { return None };
        (*deed == wanted).then_some((*offset, *hash, *delay))
    })
}

fn balanced(tally: &Tally, side: Side, held: u64) -> bool {
    let (to, from) = (side as usize, side.opposite() as usize);
    tally.came[from] + tally.added[to] == tally.out[to] + tally.dropped[from] + held
}

fn any_datagram_action() -> impl Strategy<Value = Timed<DatagramAction>> {
    let damage = prop_oneof![Just(Damage::Flip), Just(Damage::Truncate), Just(Damage::Extend), Just(Damage::Splice)];
    let action = prop_oneof![
        (0u64..200).prop_map(|ms| DatagramAction::Delay { ms, growth_us_per_s: ms * 1000 }),
        (0u64..200).prop_map(|ms| DatagramAction::Jitter { ms }),
        (0u16..=1000).prop_map(|permille| DatagramAction::Loss { permille }),
        (0u16..=1000).prop_map(|p| DatagramAction::BurstLoss {
            enter_permille: p,
            leave_permille: 1000 - p,
            loss_permille: 900
        }),
        (1u32..64, 0u64..20).prop_map(|(copies, every_ms)| DatagramAction::Duplicate {
            copies,
            every_ms,
            permille: 500
        }),
        (0u64..200).prop_map(|hold_ms| DatagramAction::Reorder { permille: 300, hold_ms }),
        (0u64..200, 1u32..50, 0u64..20).prop_map(|(lag_ms, count, every_ms)| DatagramAction::Replay {
            lag_ms,
            count,
            every_ms
        }),
        damage.prop_map(|damage| DatagramAction::Corrupt { permille: 500, damage }),
        (1u32..20).prop_map(|count| DatagramAction::Reoriginate { count, every_ms: 3 }),
        (1u32..20).prop_map(|count| DatagramAction::Inject { content: InjectedContent::Garbage, count, every_ms: 3 }),
    ];
    (0u64..500, 1u64..2000, action).prop_map(|(start, length, action)| timed(start, length, action))
}

fn any_stream_action() -> impl Strategy<Value = Timed<StreamAction>> {
    let action = prop_oneof![
        (0u64..200).prop_map(|ms| StreamAction::Delay { ms }),
        Just(StreamAction::Stall),
        (1u64..5000).prop_map(|bytes_per_s| StreamAction::Throttle { bytes_per_s }),
        Just(StreamAction::HalfClose),
        Just(StreamAction::Reset),
        Just(StreamAction::Cut),
        Just(StreamAction::Corrupt { permille: 500 }),
    ];
    (0u64..1000, 1u64..300, action).prop_map(|(start, length, action)| timed(start, length, action))
}

fn timed<A>(start_ms: u64, duration_ms: u64, action: A) -> Timed<A> {
    Timed { start_ms, duration_ms, direction: Direction::Both, step: None, action }
}

fn datagrams(actions: Vec<Timed<DatagramAction>>) -> DatagramRelay {
    DatagramRelay::new(
        setup(NodeId::RELAY_TELEMETRY, 1),
        DatagramRelayConfig { actions, ..DatagramRelayConfig::default() },
        start(),
    )
    .unwrap()
}

fn streams(actions: Vec<Timed<StreamAction>>) -> StreamRelay {
    StreamRelay::new(
        setup(NodeId::RELAY_COMMAND, 2),
        StreamRelayConfig { actions, ..StreamRelayConfig::default() },
        start(),
    )
    .unwrap()
}

fn start() -> Instant {
    at_ms(0)
}

fn uplink(byte: u8) -> Input {
    Input::Datagram { side: Side::Client, bytes: vec![byte; 20] }
}

fn sent(byte: u8) -> Output {
    Output::Datagram { side: Side::Server, bytes: vec![byte; 20] }
}

fn piece(byte: u8) -> Input {
    piece_of(1, byte)
}

fn piece_of(connection: u32, byte: u8) -> Input {
    Input::Stream { connection: SessionId(connection), side: Side::Client, bytes: vec![byte; 10] }
}

fn forwarded(byte: u8) -> Output {
    Output::Stream { connection: SessionId(1), side: Side::Server, bytes: vec![byte; 10] }
}
