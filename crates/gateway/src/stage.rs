//! The command stage: from an operator's signed intent to the order that goes out to the unit.
//!
//! Towards safe an intent goes out at once. Away from safe it waits, at most [`STAGED_FOR`], for the operator's signed
//! confirmation of the very same bytes. The gateway checks schema, role, signature, order and reason; it cannot mint,
//! alter or re-time an intent, because the unit checks all of it again. What it *cannot* judge is the intent's age: the
//! nonce in it is the unit's own. The freshness judged here is that of the request that carried it, on this host.

use std::collections::VecDeque;

use sha2::{Digest, Sha256};
use wire::codec;
use wire::command::{Ack, CommandKind, Confirmation, Intent, MAX_ORDER, Order};
use wire::id::{CommandId, NodeId, UnitId};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Refusal;
use wire::sign::Keyring;
use wire::time::{Age, Instant, Span};
use wire::trust::{Accepted, Decoded, SignedStatement};

/// Intents that may wait at once.
pub const MAX_STAGED: usize = 8;
/// How long an intent waits for its confirmation.
pub const STAGED_FOR: Span = Span::s(5);
/// Orders whose acknowledgements are still recognised.
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
    intent: Intent,
    bytes: Vec<u8>,
    until: Instant,
}

/// An order that has gone out.
#[derive(Clone, Debug)]
struct Sent {
    id: CommandId,
    unit: UnitId,
    hash: [u8; 32],
}

/// The command stage.
#[derive(Clone, Debug)]
pub struct Staging {
    rules: Rules,
    last: Vec<(NodeId, Option<CommandId>)>,
    waiting: Vec<Waiting>,
    sent: VecDeque<Sent>,
}

impl Staging {
    /// An empty stage.
    pub fn new(rules: Rules) -> Self {
        let last = rules.operators.iter().map(|operator| (*operator, None)).collect();
        Self { rules, last, waiting: Vec::new(), sent: VecDeque::new() }
    }

    /// A signed intent came in a request that is `age` old.
    pub fn stage(&mut self, now: Instant, age: Option<Age>, bytes: &[u8]) -> Result<Progress, Rejected> {
        let (decoded, signed) = Decoded::<Intent>::parse(now, bytes, MAX_ORDER)?;
        let claim = *decoded.claim();
        let rejected = |refusal| Rejected { command: Some(claim.id), refusal };
        let Rules { policy, keys, operators, freshness, .. } = &self.rules;
        let attributed = decoded
            .fresh(policy, age, *freshness, Span::ZERO)
            .and_then(|fresh| fresh.by_operator(policy, operators, keys, &signed))
            .map_err(rejected)?;
        self.admissible(&claim).map_err(rejected)?;
        let mut unlisted = None; // An operator by waiver of its role: nothing is remembered of it.
        let last = self.last.iter_mut().find(|(operator, _)| *operator == claim.id.operator);
        let last = last.map_or(&mut unlisted, |(_, last)| last);
        let accepted = attributed.once(policy, last).map_err(rejected)?.accept_message();
        Ok(self.advance(now, accepted, bytes))
    }

    /// A signed confirmation came for an intent that should be waiting.
    pub fn release(&mut self, now: Instant, bytes: &[u8]) -> Result<Progress, Rejected> {
        let decoded = Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(now, bytes)?;
        let expected = decoded.claimed_command();
        let rejected = |refusal| Rejected { command: Some(expected), refusal };
        let waits = |w: &Waiting| w.intent.id == expected && now < w.until;
        let at = self.waiting.iter().position(waits).ok_or(rejected(Refusal::Confirmation { expected }))?;
        let Rules { policy, keys, .. } = &self.rules;
        match policy.check(Check::Confirmation) {
            Requirement::Waived => {}
            Requirement::Required => {
                let attributed = decoded.by_signer(policy, expected.operator, keys).map_err(rejected)?;
                attributed.about(expected, &hash_of(&self.waiting[at].bytes)).map_err(rejected)?;
            }
        }
        let waiting = self.waiting.remove(at);
        Ok(Progress::Send(self.dispatch(&waiting.intent, &waiting.bytes, Some(bytes))))
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
        let ours = self.sent.iter().find(|sent| sent.id == expected && sent.unit == unit);
        let ours = ours.ok_or(Refusal::Confirmation { expected })?;
        attributed.about(expected, &ours.hash)
    }

    /// What an intent must be beyond its signature: addressed to a unit of ours, with a reason, and with room to wait.
    fn admissible(&self, intent: &Intent) -> Result<(), Refusal> {
        let one_step = intent.kind.towards_safe();
        if !self.rules.units.contains(&intent.unit) {
            let expected = self.rules.units.first().copied().unwrap_or(intent.unit);
            return Err(Refusal::Unit { expected, got: intent.unit });
        }
        if !one_step && intent.reason.as_str().trim().is_empty() {
            return Err(Refusal::NoReason);
        }
        if !one_step && self.waiting.len() >= MAX_STAGED {
            return Err(Refusal::Full { limit: MAX_STAGED });
        }
        Ok(())
    }

    fn advance(&mut self, now: Instant, accepted: Accepted<Intent>, bytes: &[u8]) -> Progress {
        let intent = *accepted.message();
        if intent.kind.towards_safe() {
            return Progress::Send(self.dispatch(&intent, bytes, None));
        }
        self.waiting.push(Waiting { intent, bytes: bytes.to_vec(), until: now + STAGED_FOR });
        Progress::Staged(intent.id)
    }

    fn dispatch(&mut self, intent: &Intent, bytes: &[u8], confirmation: Option<&[u8]>) -> Dispatch {
        let Intent { id, unit, kind, .. } = *intent;
        if self.sent.len() >= MAX_SENT {
            self.sent.pop_front();
        }
        self.sent.push_back(Sent { id, unit, hash: hash_of(bytes) });
        let order = Order { intent: bytes.into(), confirmation: confirmation.map(Into::into) };
        Dispatch { id, unit, kind, order: codec::encode(&order) }
    }
}

/// What binds confirmation and acknowledgement to an intent: SHA-256 of its signed bytes.
fn hash_of(signed: &[u8]) -> [u8; 32] {
    Sha256::digest(signed).into()
}
