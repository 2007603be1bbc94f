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
    let mut said = Vec::new();
    for lost in [99, 200, 300, 399, 500] {
        assert_eq!(turn(&mut relay, at(lost), &up(1), &mut said), []);
        assert_eq!(relay.deadline(), None, "at {lost} ms nothing is on its way");
    }
    for (carried, arrives) in [(100, 102), (199, 202), (400, 402)] {
        turn(&mut relay, at(carried), &up(2), &mut said);
        assert_eq!(relay.deadline(), Some(at(arrives)));
        assert_eq!(turn(&mut relay, at(arrives), &Input::Timeout, &mut said), [sent(2)]);
    }
    assert!(!said.iter().any(|event| matches!(event, Any::Instrument(Note::Attack { .. }))), "{said:?}");
    turn(&mut relay, at(600), &Input::Finish, &mut said);
    assert_eq!(counted(&said, Account::RelayIn(Side::Client)), 8);
    assert_eq!(counted(&said, Account::RelayDropped(Side::Client)), 5);
    assert_eq!(counted(&said, Account::RelayOut(Side::Server)), 3);
}

#[test]
fn connections_end_with_the_medium() {
    let config = StreamRelayConfig { medium: medium(), ..StreamRelayConfig::default() };
    let mut relay = StreamRelay::new(setup(NodeId::RELAY_COMMAND, 2), config, start()).unwrap();
    let mut said = Vec::new();
    let piece = |n: u32| Input::Stream { connection: SessionId(n), side: Side::Client, bytes: vec![1] };
    let reset = |n: u32| [Output::Reset { connection: SessionId(n) }];
    assert_eq!(turn(&mut relay, at(110), &piece(1), &mut said), []);
    assert_eq!(turn(&mut relay, at(112), &Input::Timeout, &mut said).len(), 1);
    assert_eq!(relay.deadline(), Some(at(200)));
    assert_eq!(turn(&mut relay, at(200), &Input::Timeout, &mut said), reset(1));
    assert_eq!(turn(&mut relay, at(300), &piece(2), &mut said), reset(2));
    assert_eq!(turn(&mut relay, at(400), &piece(3), &mut said), []);
    assert_eq!(turn(&mut relay, at(402), &Input::Timeout, &mut said).len(), 1);
    assert!(!said.iter().any(|event| matches!(event, Any::Instrument(Note::Tampered { .. }))), "{said:?}");
}

#[test]
fn a_medium_beyond_its_bounds_is_refused() {
    let of =
        |stretch: Stretch, n: usize| DatagramRelayConfig { medium: Medium(vec![stretch; n]), ..Default::default() };
    let good = Stretch { from_ms: 0, until_ms: 10, travel_us: 0 };
    assert!(of(good, 256).check().is_ok());
    assert!(of(good, 257).check().is_err());
    assert!(of(Stretch { from_ms: 11, ..good }, 1).check().is_err());
    assert!(of(Stretch { travel_us: 60_000_001, ..good }, 1).check().is_err());
}
