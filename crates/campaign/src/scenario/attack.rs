//! Attacks on telemetry datagrams by the relay that sits in the path and holds no key.
//!
//! Every attack has a start and a length on the trial's clock (the phase of the trial is added to the start) and a
//! direction; it may be a named step that waits for something (`step`). What the relay does with them belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::step::{Knowledge, Timing, When};
use super::value::{Count, Located, Millis, Name, Real, Seconds, Share, Whole};

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

/// Declares attack tables, each with its window and its direction in front of its own parameters.
macro_rules! attacks {
    ($(
        $(#[$doc:meta])* $name:ident $(needs $level:ident)? { $( $(#[$field_doc:meta])* $field:ident : $kind:ty ),* $(,)? }
    )+) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Start on the trial's clock; the trial's phase is added.
            pub at_s: Located<Seconds>,
            /// Length of the window.
            pub duration_s: Seconds,
            /// Which way.
            #[serde(default)]
            pub direction: Direction,
            /// Name of the step that this is a part of.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub step: Option<Located<Name>>,
            /// What it waits for; `at_s` is then the earliest.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub when: Option<Located<When>>,
            /// What may be known here, where that is less than the scenario's level.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub knowledge: Option<Located<Knowledge>>,
            $( $(#[$field_doc])* pub $field: $kind, )*
        }

        impl crate::scenario::attack::Windowed for $name {
            fn at_s(&self) -> &Located<Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> Seconds {
                self.duration_s
            }
            fn timing(&self) -> Timing<'_> {
                Timing { step: self.step.as_ref(), when: self.when.as_ref(), knowledge: self.knowledge.as_ref() }
            }
            fn needs(&self) -> Knowledge {
                [$(Knowledge::$level,)? Knowledge::Blind][0]
            }
            fn sees(&self) -> Option<Knowledge> {
                Some(Knowledge::OnPath)
            }
        }
    )+};
}
pub(super) use attacks;

/// Anything with a start on the trial's clock and a length.
pub trait Windowed {
    /// Start, before the trial's phase.
    fn at_s(&self) -> &Located<Seconds>;
    /// Length; zero for what happens once.
    fn duration_s(&self) -> Seconds;
    /// Its step and what that waits for.
    fn timing(&self) -> Timing<'_> {
        Timing::default()
    }
    /// The least that has to be known to do it at all.
    fn needs(&self) -> Knowledge {
        Knowledge::Blind
    }
    /// What can be waited for from the place where it is done, beside other steps and what the instrument plane tells:
    /// the traffic on a path, or what a teammate hears.
    fn sees(&self) -> Option<Knowledge> {
        None
    }
}

/// Says how long a table lasts, what it needs and what it sees; its start and step are its fields.
macro_rules! windowed {
    ($($name:ident $length:expr, $needs:ident, $sees:expr;)+) => {$(
        impl crate::scenario::attack::Windowed for $name {
            fn at_s(&self) -> &Located<Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> Seconds {
                let length: fn(&Self) -> Seconds = $length;
                length(self)
            }
            fn timing(&self) -> crate::scenario::Timing<'_> {
                crate::scenario::Timing {
                    step: self.step.as_ref(),
                    when: self.when.as_ref(),
                    knowledge: self.knowledge.as_ref(),
                }
            }
            fn needs(&self) -> crate::scenario::Knowledge {
                crate::scenario::Knowledge::$needs
            }
            fn sees(&self) -> Option<crate::scenario::Knowledge> {
                $sees
            }
        }
    )+};
}
pub(super) use windowed;

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
