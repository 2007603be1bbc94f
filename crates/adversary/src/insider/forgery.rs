//! Forgeries without an operator's or a unit's key, made with one's own key from observed messages: orders in the
//! operator's name and acknowledgements in a unit's.
//!
//! All of them are well formed, so that the schema is not the check that refuses them. The time of sending is left to
//! the insiders.

use crate::plan::order::command;
use sha2::{Digest, Sha256};
use wire::codec::{self, Text};
use wire::command::OrderKind;
use wire::command::{Ack, CommandKind, Confirmation, Intent, MAX_ORDER, Order};
use wire::core::Subject;
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, TrackId, UnitId};
use wire::mode::Mode;
use wire::sign::{Key, Purpose, Signed};

use super::voice::under_signature;
use crate::plan::{AckForgery, OrderForgery};

/// Most orders remembered with their kind, for telling the subject of an acknowledgement.
const MAX_KINDS: usize = 64;

/// Own key and observed messages from which forgeries are made.
#[derive(Clone, Debug)]
pub(super) struct Forger {
    key: Key,
    /// The two newest orders with a confirmation, newest first.
    orders: [Option<Vec<u8>>; 2],
    kinds: Vec<(CommandId, OrderKind)>,
    newest: Option<Intent>,
    track: TrackId,
    ack: Option<Vec<u8>>,
}

impl Forger {
    /// A forger with only `key`.
    pub(super) fn new(key: Key) -> Self {
        Self { key, orders: [None, None], kinds: Vec::new(), newest: None, track: TrackId(1), ack: None }
    }

    /// Reads a passing message; gives the kind of the order that it is or is about, if known.
    pub(super) fn note(&mut self, subject: Subject, bytes: &[u8]) -> Option<OrderKind> {
        match subject {
            Subject::Command(_) => self.note_order(bytes),
            Subject::Ack(_) => {
                let ack: Ack = codec::decode(Signed::parse(bytes, MAX_ORDER).ok()?.payload, MAX_ORDER).ok()?;
                self.ack = Some(bytes.to_vec());
                self.kinds.iter().find(|(id, _)| *id == ack.id).map(|(_, kind)| *kind)
            }
        }
    }

    fn note_order(&mut self, bytes: &[u8]) -> Option<OrderKind> {
        let (intent, order) = read(bytes)?;
        let kind = OrderKind::from(intent.kind);
        if let CommandKind::Arm(track) | CommandKind::Confirm(track) = intent.kind {
            self.track = track;
        }
        if self.newest.is_none_or(|newest| intent.id > newest.id) {
            self.newest = Some(intent);
        }
        if self.kinds.len() == MAX_KINDS {
            self.kinds.remove(0);
        }
        self.kinds.push((intent.id, kind));
        if order.confirmation.is_some() {
            self.orders = [Some(bytes.to_vec()), self.orders[0].take()];
        }
        Some(kind)
    }

    /// An order that asks for `kind`; `None` while no message was seen to make it from.
    pub(super) fn order(&self, forgery: OrderForgery, kind: OrderKind) -> Option<Vec<u8>> {
        match forgery {
            OrderForgery::OwnKey => Some(self.own_order(kind)),
            OrderForgery::Altered => self.altered(kind),
            OrderForgery::Spliced => self.spliced(),
        }
    }

    fn own_order(&self, kind: OrderKind) -> Vec<u8> {
        let payload = codec::encode(&self.intent(kind));
        let intent = self.key.sign(Purpose::Intent, &payload);
        let statement = Confirmation { id: self.intent(kind).id, intent: Sha256::digest(&intent).into() };
        let confirmation = self.key.sign(Purpose::Confirmation, &codec::encode(&statement));
        let confirmation = confirmation.as_slice();
        codec::encode(&Order { intent: intent.as_slice().into(), confirmation: Some(confirmation.into()) })
    }

    /// An intent in the name of the operator heard last, with the id after the newest one heard.
    fn intent(&self, kind: OrderKind) -> Intent {
        let first = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(0) };
        let id = self.newest.map_or(first, |newest| newest.id);
        Intent {
            id: CommandId { sequence: id.sequence.next(), ..id },
            unit: UnitId::A,
            nonce: self.newest.map_or(Nonce(1), |newest| newest.nonce),
            kind: command(kind, self.track, self.track, None),
            reason: Text::new("invented"),
            tag: None,
            shown: self.newest.and_then(|newest| newest.shown),
        }
    }

    fn altered(&self, kind: OrderKind) -> Option<Vec<u8>> {
        let (_, order) = read(self.orders[0].as_deref()?)?;
        // COSE_Sign1 ends with the signature.
        let signature = order.intent.last_chunk::<64>()?;
        let intent = under_signature(&codec::encode(&self.intent(kind)), signature);
        Some(codec::encode(&Order { intent: intent.as_slice().into(), confirmation: order.confirmation }))
    }

    fn spliced(&self) -> Option<Vec<u8>> {
        let (_, newest) = read(self.orders[0].as_deref()?)?;
        let (_, other) = read(self.orders[1].as_deref()?)?;
        Some(codec::encode(&Order { intent: newest.intent, confirmation: other.confirmation }))
    }

    /// An acknowledgement that says that `order` was executed; `None` if it cannot be made from the messages seen.
    pub(super) fn acknowledgement(&self, forgery: AckForgery, order: &[u8]) -> Option<Vec<u8>> {
        let (intent, order) = read(order)?;
        let mode = match OrderKind::from(intent.kind) {
            OrderKind::Hold => Mode::HoldSafe,
            OrderKind::Arm => Mode::PrepareToAct,
            OrderKind::Disarm | OrderKind::Enable | OrderKind::Resume | OrderKind::Confirm => Mode::Ready,
            OrderKind::Configure => Mode::Idle,
        };
        let ack =
            Ack { id: intent.id, intent: Sha256::digest(&order.intent[..]).into(), refused: None, mode, due: None };
        match forgery {
            AckForgery::OwnKey => Some(self.key.sign(Purpose::Ack, &codec::encode(&ack))),
            AckForgery::Altered => {
                let signature = self.ack.as_deref()?.last_chunk::<64>()?;
                Some(under_signature(&codec::encode(&ack), signature))
            }
            AckForgery::Replayed => self.ack.clone(),
        }
    }
}

/// Splits an order into its intent, with the signature unchecked, and the order.
fn read(bytes: &[u8]) -> Option<(Intent, Order<'_>)> {
    let order: Order<'_> = codec::decode(bytes, MAX_ORDER).ok()?;
    let signed = Signed::parse(order.intent, MAX_ORDER).ok()?;
    Some((codec::decode(signed.payload, MAX_ORDER).ok()?, order))
}
