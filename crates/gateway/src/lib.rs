//! The gateway: where telemetry enters the control domain, and where commands leave it.
//!
//! [`Gateway`] is a deterministic core. Telemetry: session → [`admit`] → [`lease`], [`fanout`], [`feed`]. Commands:
//! console's request → [`stage`] → the unit's command subject; acknowledgements come back through the same file. It
//! holds no key that an intent, a report or an acknowledgement could be signed with.
//!
//! A reviewer of trust reads `admit` first. The display's use of the feed is left to the console; a unit's
//! use of grants, teammates and orders, to autonomy.

pub mod admit;
mod commands;
pub mod fanout;
pub mod feed;
pub mod lease;
pub mod process;
pub mod session;
pub mod stage;
mod telemetry;

use std::collections::VecDeque;

use config::contact::Contacts;
use config::setup::{NoChannel, Setup};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;
use serde::{Deserialize, Serialize};
use wire::account::Accounts;
use wire::audit::Journal;
use wire::bounds::Bounds;
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Event, Interface};
use wire::feed::{CommandStage, Feed};
use wire::id::{Boot, NodeId, Nonce, PeerId, UnitId};
use wire::policy::Policy;
use wire::refusal::Refusal;
use wire::roster::RosterError;
use wire::sign::Keyring;
use wire::time::{Instant, Span};
use wire::trust::{BusGate, RevocationList, Validity};

use crate::admit::Boundary;
use crate::fanout::{Hearers, Interest, InterestError};
use crate::feed::Feeder;
use crate::lease::Leases;
use crate::session::Sessions;
use crate::stage::{Rules, Staging};

/// Parties that this gateway knows.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GatewayConfig {
    /// Units that may hold a session and be commanded.
    pub units: Vec<UnitId>,
    /// Interest sets: the teammates whose reports each unit gets. A unit without one gets none.
    pub interests: Vec<Interest>,
    /// Operators with intents that are staged.
    pub operators: Vec<NodeId>,
    /// Identities that are admitted for a time only.
    #[serde(default)]
    pub mandates: Vec<Validity>,
    /// Contact plans of units whose links carry at times only.
    #[serde(default)]
    pub contacts: Vec<(UnitId, Contacts)>,
}

/// Reason for which a gateway cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GatewayError {
    /// The setup lacks the key of the feed or of the requests.
    #[error(transparent)]
    Channel(#[from] NoChannel),
    /// The run's identities are no table, or a unit or operator is not in it.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// An interest set is unsound.
    #[error(transparent)]
    Interest(#[from] InterestError),
}

/// The station with the display that the feed is for.
pub(crate) const DISPLAY: NodeId = NodeId::CONSOLE;

/// The gateway's core.
#[derive(Clone, Debug)]
pub struct Gateway {
    config: GatewayConfig,
    policy: Policy,
    bounds: Bounds,
    boot: Boot,
    boundary: Boundary,
    sessions: Sessions,
    leases: Leases,
    staging: Staging,
    /// Gates of the request channels, one for each station.
    requests: Vec<BusGate>,
    keys: Keyring,
    revoked: RevocationList,
    /// Revocations that hold, as the authority signed them.
    revocations: Vec<Vec<u8>>,
    feed: Feeder,
    hearers: Hearers,
    nonces: ChaCha8Rng,
    accounts: Accounts,
    journal: Journal,
    tick: Option<Instant>,
    /// The display's newest challenge, and when it came.
    watch: Option<(Nonce, Instant)>,
    /// Number of times that the gateway's session at the broker was lost.
    sessions_lost: u32,
    quiet: bool,
    out: VecDeque<Output>,
}

impl Gateway {
    /// A gateway that starts at `now`.
    ///
    /// # Errors
    /// A channel without a key, an unsound table of identities, or a unit or operator that the table does not name.
    pub fn new(setup: Setup, config: GatewayConfig, now: Instant) -> Result<Self, GatewayError> {
        let keys = setup.keyring()?;
        keys.cast("units", config.units.iter().map(|unit| unit.node()))?;
        keys.cast("operators", config.operators.iter().copied())?;
        let hearers = Hearers::from_interests(&config.interests, &config.units)?;
        let freshness = setup.bounds.freshness();
        let rules = Rules {
            policy: setup.policy.clone(),
            keys: keys.clone(),
            operators: config.operators.clone(),
            units: config.units.clone(),
            freshness,
        };
        let mut nonces = ChaCha8Rng::seed_from_u64(setup.seed);
        nonces.set_stream(u64::from(setup.boot.0)); // A restart must not repeat the nonces of the boot before.
        let mut gateway = Self {
            boundary: Boundary::new(setup.policy.clone(), setup.bounds, keys.clone()),
            sessions: Sessions::default(),
            leases: Leases::new(&setup.bounds, config.contacts.clone(), now),
            staging: Staging::new(rules),
            requests: setup.gates(Topic::Intents, freshness)?,
            keys,
            revoked: RevocationList::new(&config.mandates, now),
            revocations: Vec::new(),
            feed: Feeder::new(setup.sender(Topic::Feed)?, now),
            hearers,
            nonces,
            accounts: Accounts::default(),
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
            tick: None,
            watch: None,
            sessions_lost: 0,
            quiet: false,
            out: VecDeque::new(),
            boot: setup.boot,
            bounds: setup.bounds,
            policy: setup.policy,
            config,
        };
        gateway.note(now, Event::Started);
        Ok(gateway)
    }

    /// Counts so far.
    pub fn accounts(&self) -> &Accounts {
        &self.accounts
    }

    fn timeout(&mut self, now: Instant) {
        for command in self.staging.expire(now) {
            self.staged(now, command, CommandStage::Expired);
        }
        if !self.quiet && self.feed.deadline().is_some_and(|due| now >= due) {
            self.out.extend(self.feed.rest(now));
        }
        let Some(due) = self.tick.filter(|tick| now >= *tick) else { return };
        self.keep_up(now, None);
        let period = Span::ms(self.bounds.grant_period_ms);
        // A late timer stays on the grid. A pause of a period or more begins a new grid: grants for the missed periods
        // would go out in a burst.
        let next = if now.since(due) < period { due + period } else { now + period };
        self.tick = (!self.sessions.is_empty()).then_some(next);
    }

    fn finish(&mut self, now: Instant) {
        self.accounts.close(now, &mut self.journal, &mut self.out);
        self.journal.sign(now, &mut self.out);
    }

    fn refuse(&mut self, now: Instant, interface: Interface, peer: Option<PeerId>, refusal: &Refusal) {
        if let Some(event) = self.accounts.refused(interface, peer, refusal) {
            self.note(now, event);
        }
        if !self.quiet {
            self.out.extend(self.feed.refused(now, refusal.reason(), peer));
        }
    }

    fn send_feed(&mut self, now: Instant, message: &Feed<'_>) {
        if !self.quiet {
            self.out.push_back(self.feed.seal(now, message));
        }
    }

    fn note(&mut self, now: Instant, event: Event) {
        self.journal.write(now, event, &mut self.out);
    }
}

impl Core for Gateway {
    fn handle(&mut self, now: Instant, input: &Input) {
        match input {
            Input::Opened { session, peer } => self.opened(now, *session, *peer),
            Input::Record { session, bytes } => self.record(now, *session, bytes),
            Input::Closed { session } => self.closed(now, *session),
            Input::Published { subject, bytes } => self.published(now, *subject, bytes),
            Input::SessionLost => self.session_lost(now),
            Input::Bus { topic, bytes } => self.requested(now, *topic, bytes),
            Input::Timeout => self.timeout(now),
            Input::Quiesce => self.quiet = true,
            Input::Finish => self.finish(now),
            Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. }
            | Input::HostWait { .. }
            | Input::Cue { .. }
            | Input::Guest { .. }
            | Input::Act { .. } => {}
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let feed = self.feed.deadline().filter(|_| !self.quiet);
        [self.tick, self.staging.deadline(), feed].into_iter().flatten().min()
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}
