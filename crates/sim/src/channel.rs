//! The sim's ends of the shared-memory channels: its publications, and the gates before its commands.
//!
//! The gates are always complete, whatever a run's policy waives elsewhere: the plant is one of the oracle's
//! witnesses. Refusals are counted by reason; the first ones are also written down one by one.

use std::collections::{BTreeMap, VecDeque};

use wire::account::WRITTEN_REFUSALS;
use wire::bus::{ChannelKey, Sender};
use wire::codec::Text;
use wire::core::{Output, Topic};
use wire::drive::{Act, Drive};
use wire::event::{Account, Event, Interface};
use wire::id::{Boot, NodeId};
use wire::policy::Policy;
use wire::refusal::{Reason, Refusal};
use wire::time::{Instant, Span};
use wire::trust::BusGate;

use crate::truth::Witness;

/// The oldest a set-point or act may be on arrival.
pub const FRESHNESS: Span = Span::ms(300);
/// Lag behind its clock beyond which a plant has stalled. During a stall the unit had no sight of the world, so no act
/// sent before the plant went on is carried out.
pub const STALL: Span = Span::ms(100);

/// Keys of the sim's channels.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ChannelKeys {
    /// Sim to perception.
    pub frames: ChannelKey,
    /// Sim to perception, unrendered.
    pub candidates: ChannelKey,
    /// Sim to perception, and to autonomy.
    pub navigation: [ChannelKey; 2],
    /// Autonomy to sim.
    pub drive: ChannelKey,
    /// Autonomy to sim.
    pub act: ChannelKey,
}

/// Channels of the sim.
#[derive(Clone)]
pub(crate) struct Channels {
    pub(crate) frames: Sender,
    pub(crate) candidates: Sender,
    pub(crate) navigation: Sender,
    policy: Policy,
    drive: BusGate,
    act: BusGate,
    refused: BTreeMap<(Topic, Reason), u64>,
    received: BTreeMap<Topic, u64>,
    accepted: BTreeMap<Topic, u64>,
}

impl Channels {
    /// `driver` is the unit's autonomy, the only one the plant obeys.
    pub(crate) fn new(keys: ChannelKeys, (own_node, boot): (NodeId, Boot), driver: NodeId) -> Self {
        let sender = |topic, key| Sender::new(topic, own_node, boot, key);
        Channels {
            frames: sender(Topic::Frames, keys.frames),
            candidates: sender(Topic::Candidates, keys.candidates),
            navigation: Sender::to_readers(Topic::Navigation, own_node, boot, keys.navigation.to_vec()),
            policy: Policy::default(),
            drive: BusGate::new(Topic::Drive, driver, keys.drive, FRESHNESS),
            act: BusGate::new(Topic::Act, driver, keys.act, FRESHNESS),
            refused: BTreeMap::new(),
            received: BTreeMap::new(),
            accepted: BTreeMap::new(),
        }
    }

    /// A set-point through its gate.
    pub(crate) fn drive(&mut self, now: Instant, bytes: &[u8]) -> Result<Drive, Refusal> {
        let judged = self.drive.admit::<Drive>(&self.policy, now, bytes).map(|a| a.into_parts().0);
        self.count(Topic::Drive, &judged);
        judged
    }

    /// An act through its gate, not sent before `resumed`, the end of the plant's last stall.
    pub(crate) fn act(&mut self, now: Instant, resumed: Instant, bytes: &[u8]) -> Result<Act, Refusal> {
        let judged = self.act.admit::<Act>(&self.policy, now, bytes).map(|a| a.into_parts().0);
        // An act passes the age limit although the plant stood still between the unit's picture and the act.
        let judged = judged.and_then(|act| match act.stamp < resumed {
            true => Err(Refusal::Stale { limit: now.since(resumed), age: now.since(act.stamp) }),
            false => Ok(act),
        });
        self.count(Topic::Act, &judged);
        judged
    }

    fn count<T>(&mut self, topic: Topic, judged: &Result<T, Refusal>) {
        *self.received.entry(topic).or_default() += 1;
        match judged {
            Ok(_) => *self.accepted.entry(topic).or_default() += 1,
            Err(refusal) => *self.refused.entry((topic, refusal.reason())).or_default() += 1,
        }
    }

    /// Writes a refusal down, unless there have been too many.
    pub(crate) fn note(
        &self,
        now: Instant,
        topic: Topic,
        refusal: &Refusal,
        witness: &mut Witness,
        out: &mut VecDeque<Output>,
    ) {
        if self.refused.values().sum::<u64>() <= WRITTEN_REFUSALS {
            let detail = Text::new(&refusal.to_string());
            let event = Event::Refused { at: Interface::Bus(topic), peer: None, reason: refusal.reason(), detail };
            witness.write(now, event, out);
        }
    }

    /// Writes the closing account.
    pub(crate) fn account(&self, now: Instant, witness: &mut Witness, out: &mut VecDeque<Output>) {
        let received = self.received.iter().map(|(t, n)| (Account::Received(Interface::Bus(*t)), *n));
        let accepted = self.accepted.iter().map(|(t, n)| (Account::Accepted(Interface::Bus(*t)), *n));
        let refused = self.refused.iter().map(|((t, r), n)| (Account::Refused(Interface::Bus(*t), *r), *n));
        for (account, n) in received.chain(accepted).chain(refused) {
            witness.write(now, Event::Count { account, n }, out);
        }
    }
}
