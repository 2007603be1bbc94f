//! `[[inject]]`: datagrams of the relay's own making.

use adversary::plan::{self, DatagramAction};
use evidence::Planned;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Injection, attacks, during};
use crate::{Count, Millis};

attacks! {
    /// Sends datagrams of the relay's own making.
    Inject {
        /// Their content.
        content: Content,
        /// Count of the datagrams.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

impl Attack for Inject {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let content = match self.content {
            Content::Alert => plan::InjectedContent::PlaintextAlert,
            Content::CloseNotify => plan::InjectedContent::CloseNotify,
            Content::PlainData => plan::InjectedContent::AppData,
            Content::Garbage => plan::InjectedContent::Garbage,
            Content::Noise => plan::InjectedContent::Noise,
            Content::SilentHello => plan::InjectedContent::ClientHello,
            Content::MalformedHello => plan::InjectedContent::ClientHelloTruncated,
        };
        let (count, every_ms) = (self.count.unsigned() as u32, self.every_ms.unsigned());
        let action = DatagramAction::Inject { content, count, every_ms };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Inject)))
    }
}

/// Content of an injected datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Content {
    /// A plaintext epoch-0 fatal alert.
    Alert,
    /// A plaintext epoch-0 close_notify.
    CloseNotify,
    /// Plaintext epoch-0 application data.
    PlainData,
    /// An epoch-1 record of random bytes.
    Garbage,
    /// Random bytes that are no record at all.
    Noise,
    /// A well-formed ClientHello, followed by silence, from a fresh source.
    SilentHello,
    /// A ClientHello with broken lengths.
    MalformedHello,
}
