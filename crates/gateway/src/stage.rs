//! The command stage: from an operator's signed intent to the order that goes out to the unit.
//!
//! Towards safe an intent goes out at once. Away from safe it waits, at most [`STAGED_FOR`], for the operator's signed
//! confirmation of the very same bytes. The gateway checks schema, rate, role, revocation, signature and reason, and
//! that it is not the same again; it cannot mint, alter or re-time an intent, because the unit checks all of it again.
//! It *cannot* judge the intent's age: the nonce in it is the unit's own. The freshness judged here is that of the
//! request that carried it, on this host. In what order commands follow one another is left to the unit too.
//!
//! A *station* is the owner of a channel of requests. Each has its own rate and its own room here, so that none is
//! kept waiting by another's requests, under any operator's key.

use std::collections::VecDeque;

use sha2::{Digest, Sha256};
use wire::codec;
use wire::command::{Ack, CommandKind, Confirmation, Intent, IntentHash, MAX_ORDER, Order};
use wire::id::{CommandId, NodeId, UnitId};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Refusal;
use wire::sign::Keyring;
use wire::time::{Age, Instant, Span};
use wire::trust::rate::RateClass;
use wire::trust::{Accepted, Counters, Decoded, Rates, RevocationList, SignedStatement};

/// Intents of one station that may wait at once.
pub const MAX_STAGED: usize = 8;
/// Longest time that an intent waits for its confirmation.
pub const STAGED_FOR: Span = Span::s(5);
/// Orders of one station with acknowledgements that are still recognised.
const MAX_SENT: usize = 32;

/// Different answers to one order that are verified: one of its execution, and refusals of its repetitions.
const MAX_ANSWERS: usize = 4;

/// Rules by which commands are judged.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Policy in force.
    pub policy: Policy,
    /// Public keys of every node of the run.
    pub keys: Keyring,
    /// Operators who may give intents.
    pub operators: Vec<NodeId>,
    /// Units that orders may be addressed to.
    pub units: Vec<UnitId>,
    /// The oldest a request may be.
    pub freshness: Span,
}

/// A command: the id that it uses in logs, and the intent that tells it from every other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// Id of the command, as the intent claims.
    pub id: CommandId,
    /// Hash of the signed intent.
    pub intent: IntentHash,
}

/// Result of an accepted request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The intent waits for its confirmation.
    Staged(Command),
    /// The order goes out.
    Send(Dispatch),
}

/// An order on its way out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dispatch {
    /// The command of the order.
    pub command: Command,
    /// Unit that the order is for.
    pub unit: UnitId,
    /// Command asked for.
    pub kind: CommandKind,
    /// Time until it is due, at most; zero without a time tag.
    pub after: Span,
    /// Bytes of the [`Order`] to publish.
    pub order: Vec<u8>,
}

/// A refused request, with the command that goes no further because of it, where that is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rejected {
    /// Command that goes no further.
    pub command: Option<Command>,
    /// Reason of the refusal.
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

impl Waiting {
    fn command(&self) -> Command {
        Command { id: self.intent.id, intent: hash_of(&self.bytes) }
    }
}

/// An order that has gone out.
#[derive(Clone, Debug)]
struct Sent {
    station: NodeId,
    command: Command,
    unit: UnitId,
    /// The unit's answers on its result, each by its hash.
    answers: Vec<[u8; 32]>,
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

    /// Judges a signed intent in a request of `station` that is `age` old.
    pub fn stage(
        &mut self,
        now: Instant,
        (station, age): (NodeId, Option<Age>),
        revoked: &RevocationList,
        bytes: &[u8],
    ) -> Result<Progress, Rejected> {
        let (decoded, signed) = Decoded::<Intent>::parse(now, bytes, MAX_ORDER)?;
        let claim = *decoded.claim();
        let command = Command { id: claim.id, intent: hash_of(bytes) };
        let rejected = |refusal| Rejected { command: Some(command), refusal };
        let Rules { policy, keys, operators, freshness, .. } = &self.rules;
        let record = decoded
            // No echo is involved: the request came over shared memory, and its age is by this host's clock.
            .fresh(policy, age, *freshness, Span::ZERO)
            .and_then(|fresh| fresh.within_rate(policy, &self.rates, station, now))
            .map_err(rejected)?;
        // The channel has said whose it is, so that every request counts, also one that is refused.
        self.rates.charge(station, RateClass::from_kind(claim.kind), now);
        let attributed = record
            .by_role(policy, operators)
            .and_then(|roled| roled.admitted(policy, revoked, now))
            .and_then(|admitted| self.admissible(station, &claim).map(|()| admitted))
            .and_then(|admissible| admissible.by_operator(policy, keys, &signed))
            .map_err(rejected)?;
        let accepted = attributed
            .unrepeated(policy, &mut self.counters, &command.intent)
            .and_then(|ordered| ordered.accept(policy))
            .map_err(rejected)?;
        Ok(self.advance(now, station, accepted, bytes))
    }

    /// True if a refusal at `now` is to be logged, beside being counted.
    pub fn should_report(&mut self, now: Instant) -> bool {
        self.rates.should_report(now)
    }

    /// Charges `station` for one request that is not an intent.
    pub fn needed(&mut self, now: Instant, station: NodeId, class: RateClass) -> Result<(), Refusal> {
        if self.rules.policy.check(Check::Rate) == Requirement::Required {
            self.rates.room(station, class, now)?;
            self.rates.charge(station, class, now);
        }
        Ok(())
    }

    /// `node` has been revoked: its intents no longer wait. Gives the commands that are gone.
    pub fn drop_revoked(&mut self, node: NodeId) -> Vec<Command> {
        let (withdrawn, left): (Vec<Waiting>, _) = self.waiting.drain(..).partition(|w| w.intent.id.operator == node);
        self.waiting = left;
        withdrawn.iter().map(Waiting::command).collect()
    }

    /// No intent waits any longer. Gives the commands that are gone.
    pub fn void(&mut self) -> Vec<Command> {
        self.waiting.drain(..).map(|waiting| waiting.command()).collect()
    }

    /// Judges a signed confirmation of a waiting intent of `station`.
    pub fn release(&mut self, now: Instant, station: NodeId, bytes: &[u8]) -> Result<Progress, Rejected> {
        let decoded = Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(now, bytes)?;
        let (expected, intent) = decoded.claimed();
        // Charged before the signature is verified: the channel has identified the station, so only its own rate is
        // used up.
        self.needed(now, station, RateClass::Away)?;
        let is_ours = |w: &&Waiting| w.station == station && now < w.until;
        // Which of them a confirmation is about is in the intent that it names; by the id alone it is refused below.
        let (exact, named) = (|w: &Waiting| w.command().intent == intent, |w: &Waiting| w.intent.id == expected);
        let place = |fits: &dyn Fn(&Waiting) -> bool| self.waiting.iter().position(|w| is_ours(&w) && fits(w));
        let index = place(&exact).or_else(|| place(&named)).ok_or(Refusal::Confirmation { expected })?;
        let command = self.waiting[index].command();
        let rejected = |refusal| Rejected { command: Some(command), refusal };
        let Rules { policy, keys, .. } = &self.rules;
        match policy.check(Check::Confirmation) {
            Requirement::Waived => {}
            Requirement::Required => {
                let attributed = decoded.by_signer(policy, command.id.operator, keys).map_err(rejected)?;
                attributed.about_intent(command.id, &command.intent).map_err(rejected)?;
            }
        }
        let Waiting { station, intent, bytes: staged, .. } = self.waiting.remove(index);
        Ok(Progress::Send(self.dispatch(station, &intent, &staged, Some(bytes))))
    }

    /// Removes the intents without a confirmation in time.
    pub fn expire(&mut self, now: Instant) -> Vec<Command> {
        let (expired, waiting) = self.waiting.drain(..).partition(|w| now >= w.until);
        self.waiting = waiting;
        let expired: Vec<Waiting> = expired;
        expired.iter().map(Waiting::command).collect()
    }

    /// Time at which the next intent expires.
    pub fn deadline(&self) -> Option<Instant> {
        self.waiting.iter().map(|w| w.until).min()
    }

    /// Judges an acknowledgement: signed by `unit`, about the very intent that went out. `None`: the same bytes came
    /// before.
    ///
    /// An acknowledgement of no sent order and a repeated one are recognised before the signature is checked: neither
    /// costs a verification.
    pub fn acknowledged(&mut self, now: Instant, unit: UnitId, bytes: &[u8]) -> Result<Option<Accepted<Ack>>, Refusal> {
        let decoded = Decoded::<SignedStatement<'_, Ack>>::parse_statement(now, bytes)?;
        if !self.rules.units.contains(&unit) {
            return Err(Refusal::NoUnit { got: unit });
        }
        let (expected, intent) = decoded.claimed();
        let command = Command { id: expected, intent };
        let sent_order = self.sent.iter_mut().find(|sent| sent.unit == unit && sent.command == command);
        let sent = sent_order.ok_or(Refusal::Confirmation { expected })?;
        let answer = hash_of(bytes);
        if sent.answers.contains(&answer) {
            return Ok(None);
        }
        if sent.answers.len() >= MAX_ANSWERS {
            return Err(Refusal::Full { limit: MAX_ANSWERS });
        }
        let attributed = decoded.by_signer(&self.rules.policy, unit.node(), &self.rules.keys)?;
        let accepted = attributed.about_intent(expected, &intent)?;
        sent.answers.push(answer);
        Ok(Some(accepted))
    }

    /// Checks an intent beyond its signature: addressed to one of the gateway's units, with a reason, and with room to
    /// wait.
    fn admissible(&self, station: NodeId, intent: &Intent) -> Result<(), Refusal> {
        let one_step = intent.kind.towards_safe();
        if !self.rules.units.contains(&intent.unit) {
            return Err(Refusal::NoUnit { got: intent.unit });
        }
        if !one_step && intent.reason.as_str().trim().is_empty() {
            return Err(Refusal::NoReason);
        }
        // A HOLD or DISARM never waits, so a full stage keeps none out.
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
        Progress::Staged(Command { id: intent.id, intent: hash_of(bytes) })
    }

    fn dispatch(&mut self, station: NodeId, intent: &Intent, bytes: &[u8], confirmation: Option<&[u8]>) -> Dispatch {
        let Intent { id, unit, kind, tag, .. } = *intent;
        let of_station = |sent: &Sent| sent.station == station;
        if self.sent.iter().filter(|sent| of_station(sent)).count() >= MAX_SENT
            && let Some(oldest) = self.sent.iter().position(of_station)
        {
            self.sent.remove(oldest);
        }
        let command = Command { id, intent: hash_of(bytes) };
        self.sent.push_back(Sent { station, command, unit, answers: Vec::new() });
        let order = Order { intent: bytes.into(), confirmation: confirmation.map(Into::into) };
        let after = tag.map_or(Span::ZERO, |tag| tag.after);
        Dispatch { command, unit, kind, after, order: codec::encode(&order) }
    }
}

/// Binding of confirmation and acknowledgement to an intent: SHA-256 of its signed bytes.
fn hash_of(signed: &[u8]) -> IntentHash {
    Sha256::digest(signed).into()
}
