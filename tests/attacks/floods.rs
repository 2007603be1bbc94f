//! A flood of refusals at the gateway, from its core to the console's: its effect on the display.
//!
//! The two real cores, joined by the channels that they share; time is virtual, so the rate is exact.

use config::setup::{Channel, Setup};
use console::shown::Shown;
use console::{Console, ConsoleConfig};
use gateway::{Gateway, GatewayConfig};
use wire::bounds::Bounds;
use wire::bus::{ChannelKey, HEADER_LEN, TAG_LEN};
use wire::codec;
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Account, Interface};
use wire::feed::Feed;
use wire::id::{Boot, NodeId, PeerId, SessionId, UnitId, WorldId};
use wire::person::Role;
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::sign::Key;
use wire::sign::Secret;
use wire::time::{Instant, Span};

/// Refusals in a second of the flood.
const RATE: u64 = 50_000;
/// Most refusals that the gateway reports in a second.
const TOLD: usize = 20;

/// A gateway and a console before it.
struct Pair {
    gateway: Gateway,
    console: Console,
    now: Instant,
    /// Refusals reported to the console.
    told: usize,
    /// Other outputs of the console.
    said: usize,
}

fn key_of(node: NodeId) -> Key {
    Key::from_bytes(&[node.index() as u8 + 1; 32])
}

fn setup(node: NodeId) -> Setup {
    Setup {
        node,
        boot: Boot(1),
        world: WorldId(0),
        seed: 1,
        policy: Policy::default(),
        bounds: Bounds::GROUND,
        secret: Secret([node.index() as u8 + 1; 32]),
        public_keys: [NodeId::UNIT_A, NodeId::UNIT_B, NodeId::OPERATOR].map(|of| (of, key_of(of).public())).to_vec(),
        channels: vec![
            Channel { topic: Topic::Feed, producer: NodeId::GATEWAY, key: ChannelKey([1; 32]) },
            Channel { topic: Topic::Intents, producer: NodeId::CONSOLE, key: ChannelKey([2; 32]) },
        ],
        ablation: None,
        verifier: None,
    }
}

impl Pair {
    fn new() -> Self {
        let (units, now) = (vec![UnitId::A, UnitId::B], Instant(1_000_000));
        let operators = vec![NodeId::OPERATOR];
        let of_gateway = GatewayConfig {
            units: units.clone(),
            interests: Vec::new(),
            operators,
            mandates: Vec::new(),
            contacts: Vec::new(),
        };
        let of_console = ConsoleConfig {
            units,
            awaited: Vec::new(),
            operator: NodeId::OPERATOR,
            operator_secret: Secret([9; 32]),
            role: Role::View,
            script: Vec::new(),
            eye: None,
            revocations: Vec::new(),
            text: true,
        };
        let gateway = Gateway::new(setup(NodeId::GATEWAY), of_gateway, now).expect("a gateway");
        let console = Console::new(setup(NodeId::CONSOLE), of_console, now).expect("a console");
        Self { gateway, console, now, told: 0, said: 0 }
    }

    fn at_gateway(&mut self, input: &Input) {
        self.gateway.handle(self.now, input);
        while let Some(output) = self.gateway.output() {
            if let Output::Bus { topic: Topic::Feed, bytes } = output {
                let body = &bytes[HEADER_LEN..bytes.len() - TAG_LEN];
                self.told += usize::from(matches!(codec::decode(body, body.len()), Ok(Feed::Refused(..))));
                self.at_console(&Input::Bus { topic: Topic::Feed, bytes });
            }
        }
    }

    fn at_console(&mut self, input: &Input) {
        self.console.handle(self.now, input);
        while let Some(output) = self.console.output() {
            self.said += 1;
            if let Output::Bus { topic: Topic::Intents, bytes } = output {
                self.at_gateway(&Input::Bus { topic: Topic::Intents, bytes });
            }
        }
    }

    /// Lets `span` pass, with every deadline in it.
    fn pass(&mut self, span: Span) {
        let until = self.now + span;
        loop {
            let due = |time: Option<Instant>| time.filter(|time| *time <= until);
            match (due(self.gateway.deadline()), due(self.console.deadline())) {
                (Some(at), other) if other.is_none_or(|other| at <= other) => {
                    self.now = self.now.max(at);
                    self.at_gateway(&Input::Timeout);
                }
                (_, Some(at)) => {
                    self.now = self.now.max(at);
                    self.at_console(&Input::Timeout);
                }
                (_, None) => break,
            }
        }
        self.now = until;
    }

    fn shown(&self) -> Shown {
        self.console.shown(self.now)
    }
}

/// Number of refusals for this reason, from any peer.
fn times(shown: &Shown, reason: Reason) -> u64 {
    shown.refusals.iter().filter(|refused| refused.reason == reason && !refused.here).map(|refused| refused.n).sum()
}

/// Twenty messages a second show every one of fifty thousand refusals a second.
#[test]
fn refusal_flood_is_displayed_within_two_seconds() {
    let mut pair = Pair::new();
    for (session, peer) in [(1, PeerId::UNIT_A), (2, PeerId::UNIT_B)] {
        pair.at_gateway(&Input::Opened { session: SessionId(session), peer });
    }
    pair.pass(Span::s(1));
    let (broken, long) = (vec![0xff; 40], vec![0; 2000]);
    let seconds: u64 = 4;
    let before = (pair.told, pair.said);
    for second in 0..seconds {
        for n in 0..RATE {
            // One in a hundred is of another kind and from another peer.
            let (session, bytes) = if n % 100 == 99 { (2, long.clone()) } else { (1, broken.clone()) };
            pair.at_gateway(&Input::Record { session: SessionId(session), bytes });
            pair.pass(Span(1_000_000 / RATE));
        }
        let reported = Reason::ALL.iter().map(|reason| times(&pair.shown(), *reason)).sum::<u64>();
        assert!(reported >= second.saturating_sub(1) * RATE, "{reported} in second {second}");
    }
    pair.pass(Span::s(2));
    let shown = pair.shown();
    for (reason, peer, sent) in [
        (Reason::Schema, PeerId::UNIT_A, seconds * RATE / 100 * 99),
        (Reason::Length, PeerId::UNIT_B, seconds * RATE / 100),
    ] {
        assert_eq!(pair.gateway.accounts().total(Account::Refused(Interface::Uplink, reason)), sent);
        let refusals = shown.refusals.iter().find(|refusals| refusals.reason == reason);
        assert_eq!(refusals.map(|refusal| (refusal.peer, refusal.here, refusal.n)), Some((Some(peer), false, sent)));
    }
    assert_eq!(shown.refusals.len(), 2, "one line a kind, however many there are");
    let passed = seconds as usize + 2;
    assert!(pair.told - before.0 <= TOLD * (passed + 1), "{} told", pair.told - before.0);
    // At most twenty pictures a second, a challenge a second, and what little else is reported.
    assert!(pair.said - before.1 <= 25 * passed, "{} said", pair.said - before.1);
}
