//! The gates of the trust boundary: their acceptances, and the state after a refusal.

use wire::bus::{self, ChannelKey, HEADER_LEN, Sender, TAG_LEN};
use wire::codec;
use wire::core::Topic;
use wire::id::{Boot, FrameId, NodeId, Nonce, PeerId, Sequence};
use wire::policy::Policy;
use wire::refusal::{Reason, Refusal};
use wire::sensor::{Navigation, ProductMode};
use wire::session::{MAX_SESSION_MESSAGE, SESSION_VERSION, SessionBody, SessionMessage};
use wire::time::{AgeBound, Echo, Instant, PeerStamp, Span};
use wire::track::Tracks;
use wire::trust::{BusGate, SessionGate, Window};

use super::messages::SECRET;

/// Time at which everything is received.
pub(super) const NOW: Instant = Instant(1_000_000);
/// The challenge that was given to the peer, and when.
const CHALLENGE: (Nonce, Instant) = (Nonce(11), Instant(900_000));
/// The nonce that the peer has to repeat in this session.
const SESSION: Nonce = Nonce(5);

/// A session's record is admitted once, in its one form; one that is refused has a name and keeps no other one out.
pub fn session(bytes: &[u8]) -> bool {
    let mut window = Window::new(32, 600);
    let genuine = codec::encode(&genuine());
    match admit(&mut window, bytes) {
        Ok(record) => {
            assert!(
                record.version == SESSION_VERSION && record.session == SESSION && bytes.len() <= MAX_SESSION_MESSAGE
            );
            assert_eq!(codec::encode(&record), bytes, "another encoding");
            assert!(admit(&mut window, bytes).is_err(), "twice");
            true
        }
        Err(refusal) => {
            named(&refusal);
            assert!(admit(&mut window, &genuine).is_ok(), "what was refused keeps the genuine record out");
            false
        }
    }
}

fn admit<'b>(window: &mut Window, bytes: &'b [u8]) -> Result<SessionMessage<'b>, Refusal> {
    let mut ages = AgeBound::new(Span::s(3));
    ages.issue(CHALLENGE.0, CHALLENGE.1);
    let (policy, freshness, echo_limit) = (Policy::default(), Span::ms(300), Span::s(3));
    let peer = PeerId::UNIT_A;
    let mut gate =
        SessionGate { policy: &policy, peer, ages: &mut ages, session: SESSION, window, freshness, echo_limit };
    gate.admit(NOW, bytes).1.map(|record| record.into_parts().0.outer)
}

/// The peer's genuine next message.
fn genuine() -> SessionMessage<'static> {
    SessionMessage {
        version: SESSION_VERSION,
        session: SESSION,
        boot: Boot(1),
        sequence: Sequence(1),
        stamp: PeerStamp(60_000),
        challenge: Nonce(9),
        echo: Some(Echo { nonce: CHALLENGE.0, seen: PeerStamp(10_000) }),
        body: SessionBody::Grant(Span::ms(500)),
    }
}

/// A message on shared memory is admitted once, and with no other byte in it; one that is refused keeps no other one out.
pub fn bus(bytes: &[u8]) -> bool {
    if let Some(body) = bus::body(bytes) {
        let readers = Topic::ALL[usize::from(bytes[0])].readers();
        assert_eq!(bytes[HEADER_LEN..bytes.len() - readers * TAG_LEN], *body, "the body is not what stands there");
    }
    let key = || ChannelKey(SECRET);
    let gate = |topic, producer| BusGate::new(topic, producer, key(), Span::ms(300));
    let policy = Policy::default();
    let (frame, mode) = (FrameId(1), ProductMode::Live);
    let (tracks, crops) = Default::default();
    let tracks = codec::encode(&Tracks { frame, stamp: NOW, mode, products: [None; 4], tracks, crops, nearby: None });
    let genuine = Sender::new(Topic::Tracks, NodeId::PERCEPTION, Boot(1), key()).seal(NOW, &tracks);
    let of_tracks = |gate: &mut BusGate, bytes: &[u8]| gate.admit::<Tracks>(&policy, NOW, bytes).map(|_| ());
    let tracks = judged(gate(Topic::Tracks, NodeId::PERCEPTION), bytes, &genuine, of_tracks);
    let motionless = codec::encode(&Navigation { stamp: NOW, fix: None, odometry: None, spatial: None });
    let genuine = Sender::new(Topic::Navigation, NodeId::SIM, Boot(1), key()).seal(NOW, &motionless);
    let of_navigation = |gate: &mut BusGate, bytes: &[u8]| gate.admit::<Navigation>(&policy, NOW, bytes).map(|_| ());
    tracks | judged(gate(Topic::Navigation, NodeId::SIM), bytes, &genuine, of_navigation)
}

fn judged(
    mut gate: BusGate,
    bytes: &[u8],
    genuine: &[u8],
    admit: impl Fn(&mut BusGate, &[u8]) -> Result<(), Refusal>,
) -> bool {
    let fresh = gate.clone();
    if let Err(refusal) = admit(&mut gate, bytes) {
        named(&refusal);
        assert_eq!(admit(&mut gate, genuine), Ok(()), "what was refused keeps the genuine message out");
        return false;
    }
    assert!(admit(&mut gate, bytes).is_err(), "twice");
    for at in 0..bytes.len() - gate.topic.readers() * TAG_LEN {
        let mut altered = bytes.to_vec();
        altered[at] ^= 1;
        assert!(admit(&mut fresh.clone(), &altered).is_err(), "altered at byte {at}");
    }
    true
}

/// A refusal has a named reason, and its details.
fn named(refusal: &Refusal) {
    assert!(Reason::ALL.contains(&refusal.reason()) && !refusal.to_string().is_empty());
}
