//! Events of the live broker, in the words of the audit log.
//!
//! A refusal keeps its own name in the detail, before the expected and the received value. Chaining and signing are
//! `wire::audit`; carrying entries to the recorder is `link::instrument`.

use wire::codec::Text;
use wire::event::{Event as Audited, Interface};
use wire::id::PeerId;
use wire::refusal::Reason;

use crate::gate::{Denial, Event};

/// The audit event that tells `event`.
pub fn audited(event: &Event) -> Audited {
    match event {
        Event::Admitted { peer } => Audited::Session { peer: *peer, open: true },
        Event::TakenOver { peer } => Audited::TakenOver { peer: *peer },
        Event::Closed { peer } => Audited::Session { peer: *peer, open: false },
        Event::Denied(denial) => Audited::Refused {
            at: Interface::Broker,
            peer: peer_of(denial),
            reason: reason_of(denial),
            detail: Text::new(&format!("{}: {denial}", denial.name())),
        },
    }
}

/// Refused peer, when a handshake has identified it.
fn peer_of(denial: &Denial) -> Option<PeerId> {
    match denial {
        Denial::Connections { .. } | Denial::Handshake(_) | Denial::HandshakeTimeout | Denial::Principal { .. } => None,
        Denial::ClientId { expected: peer, .. }
        | Denial::ConnectionsOfPeer { peer, .. }
        | Denial::ProtocolLevel { peer, .. }
        | Denial::Will { peer, .. }
        | Denial::Dismissed { peer, .. }
        | Denial::Access { peer, .. } => Some(*peer),
    }
}

fn reason_of(denial: &Denial) -> Reason {
    match denial {
        Denial::Connections { .. } | Denial::ConnectionsOfPeer { .. } => Reason::Full,
        Denial::Handshake(refused) | Denial::Dismissed { refused, .. } => refused.fault.reason(),
        Denial::Principal { .. } => Reason::Signer,
        Denial::HandshakeTimeout => Reason::Late,
        Denial::ProtocolLevel { .. } => Reason::Version,
        Denial::ClientId { .. } => Reason::Origin,
        Denial::Will { .. } | Denial::Access { .. } => Reason::Role,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acl;

    #[test]
    fn refused_command_logs_name_identity_and_expectation() {
        let refusal = acl::permit_topic(PeerId::UNIT_B, "hs/cmd/unit-a").expect_err("a unit commands nobody");
        let event = Event::Denied(Denial::Access { peer: PeerId::UNIT_B, refusal });
        let Audited::Refused { at, peer, reason, detail } = audited(&event) else { panic!("not a refusal") };
        assert_eq!((at, peer, reason), (Interface::Broker, Some(PeerId::UNIT_B), Reason::Role));
        let expected = "not_granted: unit-b may publish hs/ack/unit-b, got hs/cmd/unit-a (session of unit-b)";
        assert_eq!(detail.as_str(), expected);
    }
}
