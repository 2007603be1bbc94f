//! Input over sockets before any core sees it: DTLS records, certificates, topics, byte streams through a relay.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use adversary::plan::{Direction, StreamAction, StreamRelayConfig, Timed};
use adversary::relay::StreamRelay;
use broker::acl::{self, MAX_TOPIC_LEN, Pattern, Verb};
use config::setup::Setup;
use link::certificates::list::Revocations;
use link::certificates::{CertificateVerifier, Presenter};
use link::guard::cookie::{Answer, CALM, CookieExchange};
use link::guard::hello;
use link::guard::observe::Verdict;
use link::guard::record::{HEADER, Split, split};
use link::loopback::LoopbackAddr;
use link::pki::{self, Authority, Credential, Role};
use wire::bounds::Bounds;
use wire::core::{Core, Input, Output, Side, Subject};
use wire::id::{Boot, NodeId, PeerId, SessionId, WorldId};
use wire::policy::Policy;
use wire::sign::Secret;
use wire::time::{Instant, Span};

/// Length of a cookie.
const COOKIE: usize = 32;
/// A hello with a cookie may be longer than any that is looked at.
const ROOM_FOR_A_COOKIE: usize = 1024;
/// Longest word about a refused certificate.
const MAX_WORD: usize = 4096;

/// The pieces of a datagram are the datagram, and their headers are true.
pub fn datagram(bytes: &[u8]) -> bool {
    let (mut whole, mut ended) = (Vec::new(), false);
    for piece in split(bytes) {
        assert!(!ended, "something behind what has no framing");
        match piece {
            Split::Record(raw) => {
                let header = &raw.bytes[..HEADER];
                assert_eq!(header[0], raw.content);
                assert_eq!(header[3..5], raw.epoch.to_be_bytes());
                assert_eq!(header[5..11], raw.sequence.to_be_bytes()[2..]);
                assert_eq!(header[11..13], (raw.body().len() as u16).to_be_bytes());
                let _sound = hello::lengths_hold(raw.body());
                whole.extend_from_slice(raw.bytes);
            }
            Split::Remainder(rest) => {
                ended = true;
                whole.extend_from_slice(rest);
            }
        }
    }
    assert_eq!(whole, bytes, "pieces that are not the datagram");
    !whole.is_empty() && !ended
}

/// An unknown peer's datagram that opens an association has its parts, and takes a cookie; no other passes the cookie
/// exchange, and its answer is no longer than the datagram.
pub fn cookie(bytes: &[u8]) -> bool {
    let (verdict, opens) = (hello::before_association(bytes), hello::opens_association(bytes));
    assert_eq!(verdict == Verdict::Passed, opens);
    if opens {
        let parts = hello::parts(bytes).expect("a sound hello has its parts");
        assert_eq!(parts.random.len(), COOKIE);
        let repeated = hello::with_cookie(bytes, &[3; COOKIE]);
        assert_eq!(repeated.is_some(), parts.cookie.is_empty());
        if let Some(repeated) = repeated.filter(|_| bytes.len() < ROOM_FOR_A_COOKIE) {
            assert!(hello::opens_association(&repeated), "with a cookie it opens nothing");
            let proof = hello::parts(&repeated).expect("a sound hello has its parts");
            assert!(proof.cookie == [3; COOKIE] && proof.random == parts.random);
        }
    }
    if let Some(cookie) = hello::requested_cookie(bytes) {
        let requested = hello::verify_request(7, cookie);
        assert_eq!(hello::requested_cookie(&requested), Some(cookie));
    }
    let mut door = CookieExchange::new().expect("the host has randomness");
    let from = LoopbackAddr::on_port(1).socket();
    match door.judge(from, bytes, CALM, tokio::time::Instant::now()) {
        Answer::Challenge(asked) => {
            assert!(opens && asked.len() <= bytes.len(), "more goes back than came");
            assert!(hello::requested_cookie(&asked).is_some());
        }
        Answer::Refuse(verdict) => assert!(verdict != Verdict::Passed),
        Answer::Admit | Answer::Prove => panic!("a busy exchange admitted an unknown peer without proof"),
    }
    opens
}

/// This process's own authority, which signed no input from outside.
fn authority() -> &'static (Credential, Revocations, CertificateVerifier) {
    static AUTHORITY: OnceLock<(Credential, Revocations, CertificateVerifier)> = OnceLock::new();
    AUTHORITY.get_or_init(|| {
        link::crypto::init();
        let authority = Authority::new().expect("an authority");
        let own_credential = authority.issue(PeerId::UNIT_A, Role::Both).expect("a certificate");
        let list = Revocations::from_credential(&own_credential).expect("the list beside it");
        let verifier = CertificateVerifier::new(&own_credential, &list).expect("a check");
        (own_credential, list, verifier)
    })
}

/// A certificate that an authority did not sign proves no peer; a list that it did not sign is not taken.
pub fn certificate(bytes: &[u8]) -> bool {
    let (own_credential, list, verifier) = authority();
    let named = pki::peer_of(bytes);
    if let Ok(peer) = &named {
        let uri = peer.uri();
        assert!(bytes.windows(uri.len()).any(|window| window == uri.as_bytes()), "{uri} stands nowhere in it");
    }
    assert!(named.is_err() || pki::remaining_life(bytes).is_ok(), "it has a name and no end");
    let presented = Credential { cert_der: bytes.to_vec(), ..own_credential.clone() };
    for presenter in [Presenter::Dialler, Presenter::Listener(PeerId::UNIT_A)] {
        let refused = verifier.check(&presented.chain(), presenter).expect_err("nobody signed it");
        assert!(refused.to_string().len() <= MAX_WORD, "{} bytes about it", refused.to_string().len());
    }
    assert!(list.replace(bytes.to_vec()).is_err(), "a list that nobody signed");
    named.is_ok()
}

/// An accepted topic or filter has one spelling, and grants no more than the table.
pub fn topic(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let subject = Subject::from_topic(text);
    assert!(subject.is_none_or(|subject| subject.topic() == text), "another name of the same subject");
    let pattern = Pattern::parse(text);
    if let Ok(pattern) = &pattern {
        assert!(pattern.to_string() == text && text.len() <= MAX_TOPIC_LEN);
    }
    for peer in [PeerId::UNIT_A, PeerId::UNIT_B, PeerId::GATEWAY, PeerId::BROKER] {
        let covers = |verb, requested| acl::grant(peer, verb).is_some_and(|granted| granted.covers(requested));
        match acl::permit_topic(peer, text) {
            Ok(got) => assert!(Some(got) == subject && covers(Verb::Publish, Pattern::One(got))),
            Err(refusal) => assert!(!refusal.name().is_empty() && refusal.to_string().len() <= 8 * MAX_TOPIC_LEN),
        }
        match acl::permit_filter(peer, text) {
            Ok(got) => assert!(pattern == Ok(got) && covers(Verb::Subscribe, got)),
            Err(refusal) => assert!(!refusal.name().is_empty() && refusal.to_string().len() <= 8 * MAX_TOPIC_LEN),
        }
    }
    pattern.is_ok()
}

/// Output of a relay of streams is in order: whole under delay and throttle, and as long as the input where bits are
/// flipped.
pub fn relay(bytes: &[u8]) -> bool {
    let Some((plan, mut rest)) = bytes.split_first() else { return false };
    let flips = plan % 4 == 3;
    let mut relay = StreamRelay::new(
        setup(),
        StreamRelayConfig { actions: actions(plan % 4), ..StreamRelayConfig::default() },
        START,
    )
    .expect("a plan");
    let (mut map, mut sent) = (BTreeMap::new(), BTreeMap::new());
    let mut now = START;
    while let Some((op, more)) = rest.split_first() {
        let length = usize::from(op >> 3).min(more.len()).max(1);
        let (piece, behind) = more.split_at(length.min(more.len()));
        rest = behind;
        let (connection, side) = (SessionId(u32::from(op & 3)), if op & 4 == 0 { Side::Client } else { Side::Server });
        let whole: &mut Vec<u8> = map.entry((connection, side.opposite())).or_default();
        whole.extend_from_slice(piece);
        // An empty piece would be the end of its direction.
        if !piece.is_empty() {
            relay.handle(now, &Input::Stream { connection, side, bytes: piece.to_vec() });
        }
        collect(&mut relay, &mut sent);
        now += Span::ms(u64::from(*op));
    }
    while let Some(due) = relay.deadline() {
        relay.handle(due, &Input::Timeout);
        collect(&mut relay, &mut sent);
    }
    map.retain(|_, bytes| !bytes.is_empty());
    let lengths = |all: &BTreeMap<(SessionId, Side), Vec<u8>>| all.values().map(Vec::len).collect::<Vec<_>>();
    assert_eq!(lengths(&map), lengths(&sent));
    assert!(flips || map == sent, "other bytes came out");
    !sent.is_empty()
}

const START: Instant = Instant(5_000_000);

fn collect(relay: &mut StreamRelay, map: &mut BTreeMap<(SessionId, Side), Vec<u8>>) {
    while let Some(output) = relay.output() {
        if let Output::Stream { connection, side, bytes } = output {
            map.entry((connection, side)).or_default().extend_from_slice(&bytes);
        }
    }
}

fn actions(plan: u8) -> Vec<Timed<StreamAction>> {
    let timed = |action| Timed { start_ms: 0, duration_ms: 60_000, direction: Direction::Both, step: None, action };
    match plan {
        0 => Vec::new(),
        1 => vec![timed(StreamAction::Delay { ms: 40 }), timed(StreamAction::Throttle { bytes_per_s: 1000 })],
        2 => vec![Timed { duration_ms: 300, ..timed(StreamAction::Stall) }],
        _ => vec![timed(StreamAction::Corrupt { permille: 500 })],
    }
}

fn setup() -> Setup {
    Setup {
        node: NodeId::RELAY_COMMAND,
        boot: Boot(1),
        world: WorldId(0),
        seed: 7,
        policy: Policy::default(),
        bounds: Bounds::GROUND,
        secret: Secret(super::messages::SECRET),
        public_keys: Vec::new(),
        channels: Vec::new(),
        ablation: None,
        verifier: None,
    }
}
