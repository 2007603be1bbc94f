//! The embedded MQTT broker of the command plane: its own process, its own certificate, one row of rights per identity.
//!
//! The broker carries commands from the gateway to the units and their acknowledgements back. It can neither mint nor
//! alter nor re-time one: commands and acknowledgements are signed end to end. The meaning of a command is left to
//! `gateway` and `autonomy`.
//!
//! - [`acl`] is the table of rights and the one place that reads it.
//! - [`Broker`], in this file, is the model of the live broker: who receives a publication, without payloads, queues or
//!   time. The twin routes with it.
//! - [`server`] is the live broker, with its parts in [`tls`] (handshake, identity) and [`gate`] (rights of one
//!   connection). TLS, identity, rights and bounds are of this crate; packets, sessions and routing come from the
//!   `mqtt5` crate.
//! - [`watched`] runs it between two real clients, for an observer's view of the traffic.
//! - [`audit`] gives its events in the words of the audit log; [`process`] starts it from a service spec.
//!
//! The model and the live broker share [`acl`]; that they also agree on who receives is held by `tests/command_path`.

pub mod acl;
pub mod audit;
pub mod gate;
pub mod process;
pub mod server;
pub mod tls;
pub mod watched;

use arrayvec::ArrayVec;
use wire::core::Subject;
use wire::id::{NODES, PeerId};
use wire::policy::Requirement;

use crate::acl::{Pattern, Refusal, Verb};

/// Receivers of a publication, each once, in the order of [`PeerId`].
pub type Receivers = ArrayVec<PeerId, NODES>;

/// The deterministic model of the live broker.
///
/// Subscriptions live as long as the identity's session; messages are neither retained nor queued for an absent
/// client, as in the live broker. A publisher that is subscribed to its own topic receives its messages.
#[derive(Clone, Debug, Default)]
pub struct Broker {
    /// Sorted and without duplicates, hence bounded: the closed set has few identities and few patterns for each.
    subscriptions: Vec<(PeerId, Pattern)>,
    rights: Requirement,
}

impl Broker {
    /// A broker without sessions, where the table of rights stands.
    pub fn new() -> Self {
        Self::default()
    }

    /// A broker without sessions; whether the table of rights stands is the policy's to say (`Check::Rights`).
    pub fn with_rights(rights: Requirement) -> Self {
        Self { rights, ..Self::default() }
    }

    /// Subscribes `peer` to the topics of `filter`. A repeated subscription has no effect.
    ///
    /// # Errors
    /// The table does not grant it.
    pub fn subscribe(&mut self, peer: PeerId, filter: &str) -> Result<(), Refusal> {
        let pattern = Pattern::parse(filter)?;
        acl::apply_policy(self.rights, acl::permit(peer, Verb::Subscribe, pattern))?;
        let entry = (peer, pattern);
        if let Err(place) = self.subscriptions.binary_search(&entry) {
            self.subscriptions.insert(place, entry);
        }
        Ok(())
    }

    /// Ends the session of `peer`, and with it all that it subscribed to.
    pub fn disconnect(&mut self, peer: PeerId) {
        self.subscriptions.retain(|(holder, _)| *holder != peer);
    }

    /// Receivers of `publisher`'s message to `subject`. Does not allocate.
    ///
    /// # Errors
    /// The table does not grant it; then no client receives.
    pub fn publish(&self, publisher: PeerId, subject: Subject) -> Result<Receivers, Refusal> {
        let sent = Pattern::One(subject);
        acl::apply_policy(self.rights, acl::permit(publisher, Verb::Publish, sent))?;
        let mut receivers = Receivers::new();
        for (holder, pattern) in &self.subscriptions {
            // The list is sorted by holder, so a holder whose filters overlap is met in one run.
            if pattern.covers(sent) && receivers.last() != Some(holder) {
                receivers.push(*holder);
            }
        }
        Ok(receivers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::id::UnitId;

    /// The ack reaches the gateway once.
    #[test]
    fn command_and_ack_reach_their_receivers_alone() {
        let broker = subscribed();
        let command = broker.publish(PeerId::GATEWAY, Subject::Command(UnitId::A)).expect("granted");
        assert_eq!(command.as_slice(), [PeerId::UNIT_A]);
        let ack = broker.publish(PeerId::UNIT_A, Subject::Ack(UnitId::A)).expect("granted");
        assert_eq!(ack.as_slice(), [PeerId::GATEWAY], "two filters of one identity deliver once");
    }

    #[test]
    fn an_identity_that_is_away_receives_nothing() {
        let mut broker = subscribed();
        broker.disconnect(PeerId::UNIT_A);
        let receivers = broker.publish(PeerId::GATEWAY, Subject::Command(UnitId::A)).expect("granted");
        assert!(receivers.is_empty());
    }

    #[test]
    fn teammate_cannot_command_or_acknowledge_for_another() {
        let mut broker = subscribed();
        for subject in [Subject::Command(UnitId::A), Subject::Ack(UnitId::A), Subject::Command(UnitId::B)] {
            let refusal = broker.publish(PeerId::UNIT_B, subject).expect_err("not granted");
            assert_eq!(refusal.name(), "not_granted");
        }
        broker.subscribe(PeerId::UNIT_B, "hs/cmd/unit-a").expect_err("another unit's commands are not its own");
    }

    fn subscribed() -> Broker {
        let mut broker = Broker::new();
        broker.subscribe(PeerId::GATEWAY, "hs/ack/+").expect("granted");
        broker.subscribe(PeerId::GATEWAY, "hs/ack/unit-a").expect("granted");
        broker.subscribe(PeerId::UNIT_A, "hs/cmd/unit-a").expect("granted");
        broker.subscribe(PeerId::UNIT_B, "hs/cmd/unit-b").expect("granted");
        broker
    }
}
