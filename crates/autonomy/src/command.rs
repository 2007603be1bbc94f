//! Command intake: the way of an operator's order through the trust boundary, and the unit's signed answer.
//!
//! An order is two signed statements of one operator, the intent and, away from safe, its confirmation. The transport,
//! the broker and the gateway are not asked for its sender or time: the signatures and a nonce that this unit issued
//! are. An [`Ordered`] is the proof that all of it held; the machine takes no other order. Permission to carry it out
//! is left to `transition`.
//!
//! ```compile_fail,E0451
//! let forged = autonomy::command::Ordered {
//!     id: unreachable!(), kind: unreachable!(), intent: [0; 32], moved: None, window: None, consent: unreachable!(),
//!     waived: Default::default(),
//! };
//! ```

mod confirmation;
pub mod consent;
pub mod given;
pub mod schedule;

use std::collections::VecDeque;

use sha2::{Digest, Sha256};
use wire::codec;
use wire::command::{Ack, CommandKind, Intent, MAX_ORDER, Order};
use wire::id::{CommandId, NodeId, Nonce, TrackId, UnitId};
use wire::mode::Mode;
use wire::policy::{Policy, Waived};
use wire::refusal::{Reason, Refusal};
use wire::sign::{Key, Keyring, Purpose};
use wire::time::{Age, Instant, Span};
use wire::trust::rate::RateClass;
use wire::trust::{Accepted, Counters, Decoded, Rates, RevocationList};

use confirmation::Confirmed;
use consent::{Consent, Reports, ShownPlace};
use schedule::OrderWindow;

/// Nonces kept; more than are issued within any command limit in use.
const NONCES: usize = 16;

/// Operators who may order, and the orders seen already.
#[derive(Clone, Debug)]
pub struct CommandGate {
    unit: UnitId,
    operators: Vec<NodeId>,
    limit: Span,
    nonces: VecDeque<Issued>,
    reports: Reports,
    counters: Counters,
    rates: Rates,
}

/// A nonce that this unit issued and an intent may repeat.
#[derive(Clone, Copy, Debug)]
struct Issued {
    nonce: Nonce,
    at: Instant,
    /// True once the session at the broker was lost after the issue: only an order towards safe may still repeat the
    /// nonce.
    void: bool,
}

/// An order that passed the trust boundary: an operator's, in time, confirmed where it leads away from safe, and new.
#[derive(Debug)]
pub struct Ordered {
    id: CommandId,
    kind: CommandKind,
    intent: [u8; 32],
    moved: Option<CommandId>,
    window: Option<OrderWindow>,
    consent: Consent,
    waived: Waived,
}

/// Claimed content of an order: enough to answer it, untrusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claimed {
    /// Id of the command, by which repetitions are recognised.
    pub id: CommandId,
    /// Command asked for.
    pub kind: CommandKind,
    /// SHA-256 of its signed intent.
    pub intent: [u8; 32],
}

/// An order that was refused, and its claims if it could be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rejected {
    /// Reason of the refusal.
    pub refusal: Refusal,
    /// Claims of the order.
    pub claimed: Option<Claimed>,
}

impl Ordered {
    fn new(
        accepted: Accepted<Intent>,
        claimed: &Claimed,
        moved: Option<CommandId>,
        issued: Option<Instant>,
        (consent, confirmed): (Consent, &Confirmed),
    ) -> Ordered {
        let (intent, evidence) = accepted.into_parts();
        let waived = evidence.waived.union(consent.waived()).union(confirmed.waived());
        let window = OrderWindow::from_intent(&intent, issued.unwrap_or(evidence.received));
        Ordered { id: intent.id, kind: intent.kind, intent: claimed.intent, moved, window, consent, waived }
    }

    /// Copy of the order for a forked world; only [`schedule`] asks for it.
    fn copy(&self) -> Ordered {
        let Ordered { id, kind, intent, moved, window, consent, waived } = *self;
        Ordered { id, kind, intent, moved, window, consent, waived }
    }

    /// Id of the command, by which repetitions are recognised.
    pub fn id(&self) -> CommandId {
        self.id
    }

    /// Command asked for.
    pub fn kind(&self) -> CommandKind {
        self.kind
    }

    /// Value to which it moved its operator's counter, if it did.
    pub fn moved(&self) -> Option<CommandId> {
        self.moved
    }

    /// Window in which it is carried out; none: at once.
    pub fn window(&self) -> Option<OrderWindow> {
        self.window
    }

    /// Checks that were waived on its way.
    pub fn waived(&self) -> Waived {
        self.waived
    }

    /// Claims of the intent, proven by the checks.
    pub fn claimed(&self) -> Claimed {
        Claimed { id: self.id, kind: self.kind, intent: self.intent }
    }
}

impl CommandGate {
    /// The gate of `unit` for orders of `operators`; a nonce may be at most `limit` old.
    pub fn new(unit: UnitId, operators: Vec<NodeId>, limit: Span) -> Self {
        let nonces = VecDeque::with_capacity(NONCES);
        CommandGate {
            unit,
            operators,
            limit,
            nonces,
            reports: Reports::default(),
            counters: Counters::default(),
            rates: Rates::default(),
        }
    }

    /// Takes a new nonce into use.
    pub fn issue(&mut self, nonce: Nonce, now: Instant) {
        if self.nonces.len() == NONCES {
            self.nonces.pop_front();
        }
        self.nonces.push_back(Issued { nonce, at: now, void: false });
    }

    /// Remembers a report that was signed, for the orders that will name it.
    pub fn reported(&mut self, signed: &[u8], places: impl Iterator<Item = (TrackId, ShownPlace)>) {
        self.reports.note(signed, places);
    }

    /// The nonce that an intent made now should repeat, and when it was issued.
    pub fn current(&self) -> Option<(Nonce, Instant)> {
        self.nonces.back().map(|issued| (issued.nonce, issued.at))
    }

    /// Orders under way that lead away from safe are void from now on: their operator has to give them again.
    pub fn void(&mut self) {
        self.nonces.iter_mut().for_each(|issued| issued.void = true);
    }

    /// Judges one order, received at `now`. It is remembered only if every check has passed. Cheap checks
    /// come first. An order that verifies is charged to its operator, one that fails to no one, and both have an
    /// end: of a flood only a given number of signatures are verified, unless it is of forged HOLDs.
    pub fn admit(
        &mut self,
        policy: &Policy,
        keys: &Keyring,
        revoked: &RevocationList,
        now: Instant,
        bytes: &[u8],
    ) -> Result<Ordered, Rejected> {
        let unread = |refusal| Rejected { refusal, claimed: None };
        let order = codec::decode::<Order<'_>>(bytes, MAX_ORDER).map_err(|malformed| unread(malformed.into()))?;
        let (intent, signed) = Decoded::<Intent>::parse(now, order.intent, MAX_ORDER).map_err(unread)?;
        let claim = *intent.claim();
        let claimed = Claimed { id: claim.id, kind: claim.kind, intent: Sha256::digest(&order.intent[..]).into() };
        let judged = self.addressed(&claim).and_then(|()| schedule::tagged(&claim)).and_then(|()| {
            let node = claim.id.operator;
            // Cheap checks precede the two signatures: an order without a nonce that this unit issued lately costs no
            // verification.
            let fresh = intent.in_time(policy, self.age(&claim, now), self.limit)?;
            let consent = Consent::judge(policy, &self.reports, &claim)?;
            let admitted = fresh.by_role(policy, &self.operators)?.admitted(policy, revoked, now)?;
            let new = admitted.not_repeated(policy, &self.counters, &claimed.intent)?;
            let needed = new.within_rate(policy, &self.rates, node, now)?.worth_verifying(policy, &self.rates, now)?;
            let second = order.confirmation.map(|bytes| &**bytes);
            let proven = needed.by_operator(policy, keys, &signed).and_then(|attributed| {
                let confirmed = Confirmed::judge(policy, keys, now, (&claim, &claimed), second)?;
                Ok((attributed, confirmed))
            });
            let class = RateClass::from_kind(claim.kind);
            let (attributed, confirmed) = proven.inspect_err(|_| self.rates.unproven(class, now))?;
            let before = self.counters.newest(node);
            let ordered = attributed.accept_once(policy, &mut self.counters, &claimed.intent)?;
            // Only an accepted order is charged: charged before its signature is verified, a forged order would use up
            // the operator's rate and keep HOLDs out.
            self.rates.charge(node, class, now);
            let moved = self.counters.newest(node).filter(|newest| before != Some(*newest));
            Ok(Ordered::new(ordered.accept(policy)?, &claimed, moved, self.issued(&claim), (consent, &confirmed)))
        });
        judged.map_err(|refusal| Rejected { refusal, claimed: Some(claimed) })
    }

    /// True if a refusal at `now` is to be logged and answered, beside being counted.
    pub fn should_report(&mut self, now: Instant) -> bool {
        self.rates.should_report(now)
    }

    fn addressed(&self, claim: &Intent) -> Result<(), Refusal> {
        if claim.unit == self.unit { Ok(()) } else { Err(Refusal::Unit { expected: self.unit, got: claim.unit }) }
    }

    /// The age of an intent is at most that of the nonce it repeats.
    fn age(&self, claim: &Intent, now: Instant) -> Option<Age> {
        Some(Age::on_one_host(self.issued(claim)?, now))
    }

    /// Issue of the nonce that an intent repeats, where it may still repeat it.
    fn issued(&self, claim: &Intent) -> Option<Instant> {
        let issued = self.nonces.iter().find(|issued| issued.nonce == claim.nonce)?;
        (!issued.void || claim.kind.towards_safe()).then_some(issued.at)
    }
}

/// The unit's signed answer to a command, which is `due` after that time if it was stored.
pub fn acknowledge(key: &Key, claimed: &Claimed, refused: Option<Reason>, mode: Mode, due: Option<Span>) -> Vec<u8> {
    let ack = Ack { id: claimed.id, intent: claimed.intent, refused, mode, due };
    key.sign(Purpose::Ack, &codec::encode(&ack))
}
