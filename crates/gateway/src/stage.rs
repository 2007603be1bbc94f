//! The command stage: from an operator's signed intent to the order that goes out to the unit.
//!
//! Towards safe an intent goes out at once. Away from safe it waits, at most [`STAGED_FOR`], for the operator's signed
//! confirmation of the very same bytes. The gateway checks schema, rate, role, standing, signature and reason, and that
//! it is not the same again; it cannot mint, alter or re-time an intent, because the unit checks all of it again. What it
//! *cannot* judge is the intent's age: the nonce in it is the unit's own. The freshness judged here is that of the request
//! that carried it, on this host. In what order commands follow one another is left to the unit too.
//!
//! A *station* is whoever a channel of requests belongs to. Each has its own rate and its own room here, so that none is
//! kept waiting by what another asks for, under whatever operator's key.

use std::collections::VecDeque;

use sha2::{Digest, Sha256};
use wire::codec;
use wire::command::{Ack, CommandKind, Confirmation, Intent, MAX_ORDER, Order};
use wire::id::{CommandId, NodeId, UnitId};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Refusal;
use wire::sign::Keyring;
use wire::time::{Age, Instant, Span};
use wire::trust::rate::Lane;
use wire::trust::{Accepted, Counters, Decoded, Rates, Roll, SignedStatement};

/// Intents of one station that may wait at once.
pub const MAX_STAGED: usize = 8;
/// How long an intent waits for its confirmation.
pub const STAGED_FOR: Span = Span::s(5);
/// Orders of one station whose acknowledgements are still recognised.
const MAX_SENT: usize = 32;

/// What commands are judged by.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Policy in force.
    pub policy: Policy,
    /// Everybody's public keys.
    pub keys: Keyring,
    /// Who may give intents.
    pub operators: Vec<NodeId>,
    /// Units that orders may be addressed to.
    pub units: Vec<UnitId>,
    /// The oldest a request may be.
    pub freshness: Span,
}

/// What became of an accepted request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The intent waits for its confirmation.
    Staged(CommandId),
    /// The order goes out.
    Send(Dispatch),
}

/// An order on its way out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dispatch {
    /// Command.
    pub id: CommandId,
    /// Addressee.
    pub unit: UnitId,
    /// What is asked.
    pub kind: CommandKind,
    /// Encoded [`Order`].
    pub order: Vec<u8>,
}

/// A refused request, with the command it claimed to be about where that could be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rejected {
    /// Claimed command.
    pub command: Option<CommandId>,
    /// Why.
    pub refusal: Refusal,
}

impl From<Refusal> for Rejected {
    fn from(refusal: Refusal) -> Self {
        Rejected { command: None, refusal }
    }
}

/// An accepted intent that waits.
#[derive(Clone, Debug)]
struct Waiting {
    station: NodeId,
    intent: Intent,
    bytes: Vec<u8>,
    until: Instant,
}

/// An order that has gone out.
#[derive(Clone, Debug)]
struct Sent {
    station: NodeId,
    id: CommandId,
    unit: UnitId,
    hash: [u8; 32],
}

/// The command stage.
#[derive(Clone, Debug)]
pub struct Staging {
    rules: Rules,
    counters: Counters,
    rates: Rates,
    waiting: Vec<Waiting>,
    sent: VecDeque<Sent>,
}

impl Staging {
    /// An empty stage.
    pub fn new(rules: Rules) -> Self {
        let (counters, rates) = (Counters::default(), Rates::default());
        Self { rules, counters, rates, waiting: Vec::new(), sent: VecDeque::new() }
    }

    /// A signed intent came in a request of `station` that is `age` old.
    pub fn stage(
        &mut self,
        now: Instant,
        (station, age): (NodeId, Option<Age>),
        roll: &Roll,
        bytes: &[u8],
    ) -> Result<Progress, Rejected> {
        let (decoded, signed) = Decoded::<Intent>::parse(now, bytes, MAX_ORDER)?;
        let claim = *decoded.claim();
        let rejected = |refusal| Rejected { command: Some(claim.id), refusal };
        let Rules { policy, keys, operators, freshness, .. } = &self.rules;
        let within = decoded
            .fresh(policy, age, *freshness, Span::ZERO)
            .and_then(|fresh| fresh.within_rate(policy, &self.rates, station, now))
            .map_err(rejected)?;
        // The channel has said whose it is, so that every request counts, also one that is refused.
        self.rates.charge(station, Lane::of(claim.kind), now);
        let attributed = within
            .by_role(policy, operators)
            .and_then(|roled| roled.standing(policy, roll, now))
            .and_then(|standing| self.admissible(station, &claim).map(|()| standing))
            .and_then(|admissible| admissible.by_operator(policy, keys, &signed))
            .map_err(rejected)?;
        let accepted =
            attributed.unrepeated(policy, &mut self.counters, &hash_of(bytes)).map_err(rejected)?.accept_message();
        Ok(self.advance(now, station, accepted, bytes))
    }

    /// Whether a refusal for rate at `now` is to be told, beside being counted.
    pub fn tell(&mut self, now: Instant) -> bool {
        self.rates.tell(now)
    }

    /// There is need for one more request of `station`, which is not an intent.
    pub fn needed(&mut self, now: Instant, station: NodeId, lane: Lane) -> Result<(), Refusal> {
        if self.rules.policy.check(Check::Rate) == Requirement::Required {
            self.rates.room(station, lane, now)?;
            self.rates.charge(station, lane, now);
        }
        Ok(())
    }

    /// `who` has been revoked: nothing of it waits any longer. Gives the commands that are gone.
    pub fn strike(&mut self, who: NodeId) -> Vec<CommandId> {
        let (gone, left): (Vec<Waiting>, _) = self.waiting.drain(..).partition(|w| w.intent.id.operator == who);
        self.waiting = left;
        gone.iter().map(|w| w.intent.id).collect()
    }

    /// A signed confirmation came for an intent of `station` that should be waiting.
    pub fn release(&mut self, now: Instant, station: NodeId, bytes: &[u8]) -> Result<Progress, Rejected> {
        let decoded = Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(now, bytes)?;
        let expected = decoded.claimed_command();
        let rejected = |refusal| Rejected { command: Some(expected), refusal };
        self.needed(now, station, Lane::Away).map_err(rejected)?;
        let waits = |w: &Waiting| w.intent.id == expected && w.station == station && now < w.until;
        let at = self.waiting.iter().position(waits).ok_or(rejected(Refusal::Confirmation { expected }))?;
        let Rules { policy, keys, .. } = &self.rules;
        match policy.check(Check::Confirmation) {
            Requirement::Waived => {}
            Requirement::Required => {
                let attributed = decoded.by_signer(policy, expected.operator, keys).map_err(rejected)?;
                attributed.about(expected, &hash_of(&self.waiting[at].bytes)).map_err(rejected)?;
            }
        }
        let Waiting { station, intent, bytes: staged, .. } = self.waiting.remove(at);
        Ok(Progress::Send(self.dispatch(station, &intent, &staged, Some(bytes))))
    }

    /// Removes the intents whose confirmation did not come in time.
    pub fn expire(&mut self, now: Instant) -> Vec<CommandId> {
        let (expired, waiting) = self.waiting.drain(..).partition(|w| now >= w.until);
        self.waiting = waiting;
        let expired: Vec<Waiting> = expired;
        expired.iter().map(|w| w.intent.id).collect()
    }

    /// When the next intent expires.
    pub fn deadline(&self) -> Option<Instant> {
        self.waiting.iter().map(|w| w.until).min()
    }

    /// `unit`'s acknowledgement of an order of ours: under its signature and about the very intent that went out.
    pub fn acknowledged(&self, now: Instant, unit: UnitId, bytes: &[u8]) -> Result<Accepted<Ack>, Refusal> {
        let decoded = Decoded::<SignedStatement<'_, Ack>>::parse_statement(now, bytes)?;
        let expected = decoded.claimed_command();
        let attributed = decoded.by_signer(&self.rules.policy, unit.node(), &self.rules.keys)?;
        let ours = |sent: &&Sent| sent.id == expected && sent.unit == unit;
        // Two stations may have used one id; the acknowledgement is about one of the two intents.
        let named = |sent: &&Sent| attributed.claims(&sent.hash);
        let ours = self.sent.iter().filter(ours).find(named).or_else(|| self.sent.iter().find(ours));
        let hash = ours.ok_or(Refusal::Confirmation { expected })?.hash;
        attributed.about(expected, &hash)
    }

    /// What an intent must be beyond its signature: addressed to a unit of ours, with a reason, and with room to wait.
    fn admissible(&self, station: NodeId, intent: &Intent) -> Result<(), Refusal> {
        let one_step = intent.kind.towards_safe();
        if !self.rules.units.contains(&intent.unit) {
            let expected = self.rules.units.first().copied().unwrap_or(intent.unit);
            return Err(Refusal::Unit { expected, got: intent.unit });
        }
        if !one_step && intent.reason.as_str().trim().is_empty() {
            return Err(Refusal::NoReason);
        }
        if !one_step && self.waiting.iter().filter(|w| w.station == station).count() >= MAX_STAGED {
            return Err(Refusal::Full { limit: MAX_STAGED });
        }
        Ok(())
    }

    fn advance(&mut self, now: Instant, station: NodeId, accepted: Accepted<Intent>, bytes: &[u8]) -> Progress {
        let intent = *accepted.message();
        if intent.kind.towards_safe() {
            return Progress::Send(self.dispatch(station, &intent, bytes, None));
        }
        self.waiting.push(Waiting { station, intent, bytes: bytes.to_vec(), until: now + STAGED_FOR });
        Progress::Staged(intent.id)
    }

    fn dispatch(&mut self, station: NodeId, intent: &Intent, bytes: &[u8], confirmation: Option<&[u8]>) -> Dispatch {
        let Intent { id, unit, kind, .. } = *intent;
        let of_station = |sent: &Sent| sent.station == station;
        if self.sent.iter().filter(|sent| of_station(sent)).count() >= MAX_SENT
            && let Some(oldest) = self.sent.iter().position(of_station)
        {
            self.sent.remove(oldest);
        }
        self.sent.push_back(Sent { station, id, unit, hash: hash_of(bytes) });
        let order = Order { intent: bytes.into(), confirmation: confirmation.map(Into::into) };
        Dispatch { id, unit, kind, order: codec::encode(&order) }
    }
}

/// What binds confirmation and acknowledgement to an intent: SHA-256 of its signed bytes.
fn hash_of(signed: &[u8]) -> [u8; 32] {
    Sha256::digest(signed).into()
}
