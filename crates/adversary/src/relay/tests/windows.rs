//! Every action acts in its window, in its direction and by its amount, and other traffic passes as it came.

use super::*;

/// Every action on datagrams that pass, each certain to show.
fn passing() -> Vec<DatagramAction> {
    vec![
        DatagramAction::Delay { ms: 40, growth_us_per_s: 0 },
        DatagramAction::Delay { ms: 0, growth_us_per_s: 1_000_000 },
        DatagramAction::Jitter { ms: 1000 },
        DatagramAction::Loss { permille: 1000 },
        DatagramAction::BurstLoss { enter_permille: 1000, leave_permille: 0, loss_permille: 1000 },
        DatagramAction::Duplicate { copies: 1, every_ms: 0, permille: 1000 },
        DatagramAction::Reorder { permille: 1000, hold_ms: 40 },
        DatagramAction::Corrupt { permille: 1000, damage: Damage::Flip },
    ]
}

#[test]
fn datagrams_outside_window_or_direction_pass_unchanged() {
    for action in passing() {
        // A growing delay is none at the instant at which its window opens.
        let opens = if matches!(action, DatagramAction::Delay { ms: 0, .. }) { 101 } else { 100 };
        for (ms, acts) in [(99, false), (opens, true), (299, true), (300, false), (301, false)] {
            let one_way = Timed { direction: Direction::Up, ..timed(100, 200, action.clone()) };
            let mut relay = datagrams(vec![one_way]);
            let mut events = Vec::new();
            let back = Input::Datagram { side: Side::Server, bytes: vec![2; 20] };
            let passed = Output::Datagram { side: Side::Client, bytes: vec![2; 20] };
            assert_eq!(
                turn(&mut relay, at_ms(ms), &back, &mut events),
                [passed],
                "{action:?} at {ms} ms, the other way"
            );
            let out = turn(&mut relay, at_ms(ms), &uplink(1), &mut events);
            assert_eq!(out != [sent(1)], acts, "{action:?} at {ms} ms: {out:?}");
            let reported = events.iter().any(|event| matches!(event, Any::Instrument(Note::Attack { .. })));
            assert_eq!(reported, acts, "{action:?} at {ms} ms: {events:?}");
        }
    }
}

/// The time is the same at any place in the window.
#[test]
fn held_datagrams_wait_the_planned_time() {
    let held = |action: DatagramAction, ms: u64| {
        let mut relay = datagrams(vec![timed(100, 2000, action)]);
        turn(&mut relay, at_ms(ms), &uplink(1), &mut Vec::new());
        relay.deadline()
    };
    for ms in [100, 1100, 2099] {
        assert_eq!(held(DatagramAction::Delay { ms: 250, growth_us_per_s: 0 }, ms), Some(at_ms(ms + 250)));
        assert_eq!(held(DatagramAction::Reorder { permille: 1000, hold_ms: 70 }, ms), Some(at_ms(ms + 70)));
    }
    assert_eq!(held(DatagramAction::Delay { ms: 250, growth_us_per_s: 100_000 }, 1100), Some(at_ms(1100 + 250 + 100)));
}

#[test]
fn jitter_varies_within_its_bound() {
    let mut relay = datagrams(vec![timed(0, 10_000, DatagramAction::Jitter { ms: 30 })]);
    let mut events = Vec::new();
    (0..200).for_each(|n| drop(turn(&mut relay, at_ms(n * 50), &uplink(n as u8), &mut events)));
    let held: Vec<u64> = events
        .iter()
        .filter_map(|event| {
            let Any::Instrument(Note::Attack { action: Action::Delay, delay, .. }) = event else { return None };
            Some(delay.0)
        })
        .collect();
    let (least, most) = (held.iter().min().copied(), held.iter().max().copied());
    assert!(
        held.len() > 190 && least < Some(3_000) && most > Some(27_000) && most <= Some(30_000),
        "{least:?} {most:?}"
    );
}

#[test]
fn copies_have_planned_number_and_spacing() {
    let mut relay =
        datagrams(vec![timed(0, 100, DatagramAction::Duplicate { copies: 2, every_ms: 15, permille: 1000 })]);
    let mut events = Vec::new();
    assert_eq!(turn(&mut relay, at_ms(50), &uplink(1), &mut events), [sent(1)]);
    for ms in [65, 80] {
        assert_eq!(relay.deadline(), Some(at_ms(ms)));
        assert_eq!(turn(&mut relay, at_ms(ms), &Input::Timeout, &mut events), [sent(1)]);
    }
    assert_eq!((relay.deadline(), times(&events, Action::Duplicate)), (None, 2));
}

#[test]
fn counted_sending_ends_with_its_window() {
    let garbage = DatagramAction::Inject { content: InjectedContent::Garbage, count: 9, every_ms: 50 };
    let replay = DatagramAction::Replay { lag_ms: 10, count: 9, every_ms: 50 };
    for action in [garbage, replay, DatagramAction::Reoriginate { count: 9, every_ms: 50 }] {
        let mut relay = datagrams(vec![Timed { direction: Direction::Up, ..timed(100, 120, action.clone()) }]);
        turn(&mut relay, at_ms(10), &uplink(1), &mut Vec::new());
        let mut sent_at = Vec::new();
        while let Some(due) = relay.deadline() {
            assert!(!turn(&mut relay, due, &Input::Timeout, &mut Vec::new()).is_empty(), "{action:?} at {due:?}");
            sent_at.push(due);
        }
        assert_eq!(sent_at, [100, 150, 200].map(at_ms), "{action:?}");
    }
}

#[test]
fn streams_outside_window_or_direction_pass_unchanged() {
    for action in [
        StreamAction::Delay { ms: 40 },
        StreamAction::Stall,
        StreamAction::Throttle { bytes_per_s: 100 },
        StreamAction::Corrupt { permille: 1000 },
    ] {
        for (ms, acts) in [(99, false), (100, true), (299, true), (300, false), (301, false)] {
            let one_way = Timed { direction: Direction::Up, ..timed(100, 200, action.clone()) };
            let mut relay = streams(vec![one_way]);
            let mut events = Vec::new();
            let back = Input::Stream { connection: SessionId(1), side: Side::Server, bytes: vec![2; 10] };
            let passed = Output::Stream { connection: SessionId(1), side: Side::Client, bytes: vec![2; 10] };
            assert_eq!(
                turn(&mut relay, at_ms(ms), &back, &mut events),
                [passed],
                "{action:?} at {ms} ms, the other way"
            );
            let out = turn(&mut relay, at_ms(ms), &piece(1), &mut events);
            assert_eq!(out != [forwarded(1)], acts, "{action:?} at {ms} ms: {out:?}");
            let reported = events.iter().any(|event| matches!(event, Any::Instrument(Note::Tampered { .. })));
            assert_eq!(reported, acts, "{action:?} at {ms} ms: {events:?}");
        }
    }
}

#[test]
fn stream_is_held_for_the_planned_time() {
    for (action, start_ms, due_ms) in [
        (StreamAction::Delay { ms: 40 }, 150, 190),
        (StreamAction::Delay { ms: 40 }, 299, 339),
        (StreamAction::Stall, 150, 300),
        (StreamAction::Throttle { bytes_per_s: 100 }, 150, 250),
    ] {
        let mut relay = streams(vec![timed(100, 200, action.clone())]);
        turn(&mut relay, at_ms(start_ms), &piece(1), &mut Vec::new());
        assert_eq!(relay.deadline(), Some(at_ms(due_ms)), "{action:?} at {start_ms} ms");
        assert_eq!(turn(&mut relay, at_ms(due_ms), &Input::Timeout, &mut Vec::new()), [forwarded(1)]);
    }
}

#[test]
fn relay_draws_from_its_seed_alone() {
    let run_log = |seed: u64| {
        let setup = config::setup::Setup { seed, ..setup(NodeId::RELAY_TELEMETRY, 1) };
        let actions = vec![
            timed(0, 10_000, DatagramAction::Jitter { ms: 50 }),
            timed(0, 10_000, DatagramAction::Loss { permille: 300 }),
        ];
        let mut relay =
            DatagramRelay::new(setup, DatagramRelayConfig { actions, ..DatagramRelayConfig::default() }, start())
                .unwrap();
        let mut events = Vec::new();
        (0..100).for_each(|n| drop(turn(&mut relay, at_ms(n * 10), &uplink(n as u8), &mut events)));
        events.retain(|event| matches!(event, Any::Instrument(Note::Attack { .. })));
        events
    };
    assert_eq!(run_log(7), run_log(7));
    assert_ne!(run_log(7), run_log(8));
}
