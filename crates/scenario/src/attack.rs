//! Attacks on telemetry datagrams by the relay that sits in the path and holds no key.
//!
//! Every attack has a start and a length on the trial's clock (the phase of the trial is added to the start) and a
//! direction; it may be a named step that waits for something (`step`). What the relay does with them belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{Count, Millis, Name, Real, Share, Whole};

/// Which way the datagrams or bytes go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From the platform to the gateway.
    Up,
    /// From the gateway to the platform.
    Down,
    /// Both ways.
    #[default]
    Both,
}

impl Direction {
    /// Whether it covers the way from the platform to the gateway.
    pub fn covers_up(self) -> bool {
        matches!(self, Direction::Up | Direction::Both)
    }

    /// Whether it covers the way from the gateway to the platform.
    pub fn covers_down(self) -> bool {
        matches!(self, Direction::Down | Direction::Both)
    }
}

/// Declares attacks on a path: tables with a window and a direction, by one who sees the path.
macro_rules! attacks {
    ($(
        $(#[$doc:meta])* $name:ident $(needs $level:ident)? { $( $(#[$field_doc:meta])* $field:ident : $kind:ty ),* $(,)? }
    )+) => {
        crate::timed::timed! {$(
            $(#[$doc])*
            $name lasts duration_s $(needs $level)? sees OnPath {
                /// Length of the window.
                duration_s: crate::Seconds,
                /// Which way.
                #[serde(default)]
                direction: crate::attack::Direction,
                $( $(#[$field_doc])* $field: $kind, )*
            }
        )+}
    };
}
pub(super) use attacks;

attacks! {
    /// Holds datagrams back by a time that may grow.
    Delay {
        /// Delay at the start of the window.
        by_ms: Millis,
        /// Growth of the delay.
        #[serde(default)]
        growth_ms_per_s: Real<0, 1_000_000>,
    }

    /// Holds each datagram back by a uniform random time.
    Jitter {
        /// Longest delay.
        up_to_ms: Millis,
    }

    /// Loses each datagram with the same probability.
    Loss {
        /// Probability.
        share: Share,
    }

    /// Loses datagrams in bursts (Gilbert-Elliott): two states, one of which loses.
    BurstLoss {
        /// Probability to enter the losing state, at each datagram.
        enter: Share,
        /// Probability to leave it.
        leave: Share,
        /// Probability of loss while in it.
        share: Share,
    }

    /// Sends each datagram again.
    Duplicate {
        /// Copies beside the original.
        copies: Whole<1, 64>,
        /// Time between copies.
        #[serde(default)]
        every_ms: Millis,
    }

    /// Holds some datagrams back so that later ones overtake them.
    Reorder {
        /// Probability for each datagram.
        share: Share,
        /// How long those are held.
        hold_ms: Millis,
    }

    /// Captures datagrams and sends them again later.
    Replay needs OnPath {
        /// Age of the captured datagram when it is sent again.
        lag_ms: Millis,
        /// How many are sent again.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }

    /// Changes datagrams on the way.
    Corrupt {
        /// Probability for each datagram.
        share: Share,
        /// The change.
        damage: Damage,
    }

    /// Sends captured telemetry from the relay's own socket, claiming to be a peer, without a credential.
    Reoriginate needs OnPath {
        /// The unit it claims to be.
        claim: Name,
        /// How many datagrams.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }

    /// Sends datagrams of the relay's own making.
    Inject {
        /// What they hold.
        content: Content,
        /// How many.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

/// How a datagram is changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Damage {
    /// One random bit flipped.
    Flip,
    /// Cut short at a random length.
    Truncate,
    /// Random bytes added.
    Extend,
    /// Head of this one, tail of the one before.
    Splice,
}

/// What an injected datagram holds.
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
    /// A well-formed ClientHello that nothing follows, from a fresh source.
    SilentHello,
    /// A ClientHello with broken lengths.
    MalformedHello,
}
