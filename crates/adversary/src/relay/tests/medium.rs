//! A relay in a medium that carries at times only: its losses are counted, and are no attack.

use super::*;
use crate::plan::{Medium, Stretch};

/// Carries from 100 to 200 ms, with 2 then 3 ms of travel, and from 400 to 500 ms.
fn medium() -> Medium {
    let part = |from_ms, until_ms, travel_us| Stretch { from_ms, until_ms, travel_us };
    Medium(vec![part(100, 150, 2_000), part(150, 200, 3_000), part(400, 500, 2_000)])
}

#[test]
fn datagrams_travel_while_the_medium_carries() {
    let config = DatagramRelayConfig { medium: medium(), ..DatagramRelayConfig::default() };
    let mut relay = DatagramRelay::new(setup(NodeId::RELAY_TELEMETRY, 1), config, start()).unwrap();
    let mut events = Vec::new();
    for lost in [99, 200, 300, 399, 500] {
        assert_eq!(turn(&mut relay, at_ms(lost), &uplink(1), &mut events), []);
        assert_eq!(relay.deadline(), None, "at {lost} ms nothing is on its way");
    }
    for (carried, arrives) in [(100, 102), (199, 202), (400, 402)] {
        turn(&mut relay, at_ms(carried), &uplink(2), &mut events);
        assert_eq!(relay.deadline(), Some(at_ms(arrives)));
        assert_eq!(turn(&mut relay, at_ms(arrives), &Input::Timeout, &mut events), [sent(2)]);
    }
    assert!(!events.iter().any(|event| matches!(event, Any::Instrument(Note::Attack { .. }))), "{events:?}");
    turn(&mut relay, at_ms(600), &Input::Finish, &mut events);
    assert_eq!(counted(&events, Account::RelayIn(Side::Client)), 8);
    assert_eq!(counted(&events, Account::RelayDropped(Side::Client)), 5);
    assert_eq!(counted(&events, Account::RelayOut(Side::Server)), 3);
}

#[test]
fn connections_end_with_the_medium() {
    let config = StreamRelayConfig { medium: medium(), ..StreamRelayConfig::default() };
    let mut relay = StreamRelay::new(setup(NodeId::RELAY_COMMAND, 2), config, start()).unwrap();
    let mut events = Vec::new();
    let piece = |n: u32| Input::Stream { connection: SessionId(n), side: Side::Client, bytes: vec![1] };
    let reset = |n: u32| [Output::Reset { connection: SessionId(n) }];
    assert_eq!(turn(&mut relay, at_ms(110), &piece(1), &mut events), []);
    assert_eq!(turn(&mut relay, at_ms(112), &Input::Timeout, &mut events).len(), 1);
    assert_eq!(relay.deadline(), Some(at_ms(200)));
    assert_eq!(turn(&mut relay, at_ms(200), &Input::Timeout, &mut events), reset(1));
    assert_eq!(turn(&mut relay, at_ms(300), &piece(2), &mut events), reset(2));
    assert_eq!(turn(&mut relay, at_ms(400), &piece(3), &mut events), []);
    assert_eq!(turn(&mut relay, at_ms(402), &Input::Timeout, &mut events).len(), 1);
    assert!(!events.iter().any(|event| matches!(event, Any::Instrument(Note::Tampered { .. }))), "{events:?}");
}

#[test]
fn a_medium_beyond_its_bounds_is_refused() {
    let carries =
        |stretch: Stretch, n: usize| DatagramRelayConfig { medium: Medium(vec![stretch; n]), ..Default::default() };
    let good = Stretch { from_ms: 0, until_ms: 10, travel_us: 0 };
    assert!(carries(good, 256).check().is_ok());
    assert!(carries(good, 257).check().is_err());
    assert!(carries(Stretch { from_ms: 11, ..good }, 1).check().is_err());
    assert!(carries(Stretch { travel_us: 60_000_001, ..good }, 1).check().is_err());
}
