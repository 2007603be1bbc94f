//! Plans of the two relays: actions on telemetry datagrams and on pieces of the command stream.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Direction, MAX_COPIES, MAX_HOLD_MS, Medium, PlanError, Timed, at_most, check_range, repeats, share};

/// Plan of the relay in the telemetry path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatagramRelayConfig {
    /// Actions; where several are open, they apply in this order.
    #[serde(default)]
    pub actions: Vec<Timed<DatagramAction>>,
    /// The medium in which it stands.
    #[serde(default)]
    pub medium: Medium,
}

/// Action on datagrams, or datagrams sent beside them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum DatagramAction {
    /// Each is held back by a time that may grow over the window.
    Delay {
        /// At the start of the window.
        ms: u64,
        /// Growth, microseconds per second of the window.
        #[serde(default)]
        growth_us_per_s: u64,
    },
    /// Each is held back by a uniform random time of at most this much.
    Jitter {
        /// Longest hold, milliseconds.
        ms: u64,
    },
    /// Each is lost with the same probability.
    Loss {
        /// Probability for each datagram.
        permille: u16,
    },
    /// Lost in bursts: the model of Gilbert and Elliott, one chain for each direction.
    BurstLoss {
        /// Probability to enter the bad state, at each datagram.
        enter_permille: u16,
        /// Probability to leave it.
        leave_permille: u16,
        /// Probability of loss while in it.
        loss_permille: u16,
    },
    /// Some are emitted again.
    Duplicate {
        /// Copies beside the original.
        copies: u32,
        /// Time between two of them, milliseconds.
        #[serde(default)]
        every_ms: u64,
        /// Probability for each datagram.
        permille: u16,
    },
    /// Some are held back so that later ones overtake them.
    Reorder {
        /// Probability for each datagram.
        permille: u16,
        /// Time of the hold.
        hold_ms: u64,
    },
    /// Captured ones are emitted again. With `every_ms` zero the newest `count` of them at once, oldest first;
    /// otherwise at each step the newest that is old enough.
    Replay {
        /// Age of the captured datagram at least.
        lag_ms: u64,
        /// Number of datagrams.
        count: u32,
        /// Time between two of them, milliseconds.
        every_ms: u64,
    },
    /// The bytes of some are changed.
    Corrupt {
        /// Probability for each datagram.
        permille: u16,
        /// Change made to the bytes.
        damage: Damage,
    },
    /// The newest captured datagram from the client is sent to the server from an address of the relay's own.
    Reoriginate {
        /// Number of datagrams.
        count: u32,
        /// Time between two of them, milliseconds.
        every_ms: u64,
    },
    /// Datagrams of the relay's own making.
    Inject {
        /// Content of each.
        content: InjectedContent,
        /// Number of datagrams.
        count: u32,
        /// Time between two of them, milliseconds.
        every_ms: u64,
    },
}

/// Change to a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Damage {
    /// A random bit is flipped.
    Flip,
    /// Cut short at a random length.
    Truncate,
    /// 1 to 32 random bytes added.
    Extend,
    /// Head of this one, tail of the one before in its direction; a flip where there is none.
    Splice,
}

/// Content of an injected datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InjectedContent {
    /// A plaintext epoch-0 fatal alert.
    PlaintextAlert,
    /// A plaintext epoch-0 close_notify.
    CloseNotify,
    /// Plaintext epoch-0 application data.
    AppData,
    /// An epoch-1 application record of random bytes.
    Garbage,
    /// Random bytes without record framing.
    Noise,
    /// A well-formed ClientHello without a sequel, from an address of the relay's own.
    ClientHello,
    /// A ClientHello with wrong lengths, from an address of the relay's own.
    ClientHelloTruncated,
}

impl InjectedContent {
    /// True if it is sent from an address of the relay's own, and so towards the server only.
    pub fn from_unknown_peer(self) -> bool {
        match self {
            InjectedContent::ClientHello | InjectedContent::ClientHelloTruncated => true,
            InjectedContent::PlaintextAlert
            | InjectedContent::CloseNotify
            | InjectedContent::AppData
            | InjectedContent::Garbage
            | InjectedContent::Noise => false,
        }
    }
}

impl DatagramRelayConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.actions.len())?;
        self.medium.check()?;
        self.actions.iter().try_for_each(|timed| {
            timed.check_window(timed.action.counted().is_none())?;
            timed.action.check(timed.direction)
        })
    }
}

impl DatagramAction {
    /// Number, spacing in ms of the relay's own datagrams; `None` for an action on passing ones.
    pub fn counted(&self) -> Option<(u32, u64)> {
        match *self {
            DatagramAction::Replay { count, every_ms, .. }
            | DatagramAction::Reoriginate { count, every_ms }
            | DatagramAction::Inject { count, every_ms, .. } => Some((count, every_ms)),
            DatagramAction::Delay { .. }
            | DatagramAction::Jitter { .. }
            | DatagramAction::Loss { .. }
            | DatagramAction::BurstLoss { .. }
            | DatagramAction::Duplicate { .. }
            | DatagramAction::Reorder { .. }
            | DatagramAction::Corrupt { .. } => None,
        }
    }

    /// True if it needs datagrams to have been captured.
    pub fn captures(&self) -> bool {
        matches!(self, DatagramAction::Replay { .. } | DatagramAction::Reoriginate { .. })
    }

    fn check(&self, direction: Direction) -> Result<(), PlanError> {
        match *self {
            DatagramAction::Delay { ms, growth_us_per_s } => {
                check_range("ms", ms, 0, MAX_HOLD_MS)?;
                check_range("growth_us_per_s", growth_us_per_s, 0, 1_000_000)
            }
            DatagramAction::Jitter { ms } => check_range("ms", ms, 0, MAX_HOLD_MS),
            DatagramAction::Loss { permille } => share("permille", permille),
            DatagramAction::BurstLoss { enter_permille, leave_permille, loss_permille } => {
                share("enter_permille", enter_permille)?;
                share("leave_permille", leave_permille)?;
                share("loss_permille", loss_permille)
            }
            DatagramAction::Duplicate { copies, every_ms, permille } => {
                check_range("copies", u64::from(copies), 1, u64::from(MAX_COPIES))?;
                check_range("every_ms", every_ms, 0, MAX_HOLD_MS)?;
                share("permille", permille)
            }
            DatagramAction::Reorder { permille, hold_ms } => {
                check_range("hold_ms", hold_ms, 0, MAX_HOLD_MS)?;
                share("permille", permille)
            }
            DatagramAction::Corrupt { permille, damage: _ } => share("permille", permille),
            DatagramAction::Replay { lag_ms, count, every_ms } => {
                check_range("lag_ms", lag_ms, 0, MAX_HOLD_MS)?;
                repeats(count, every_ms)
            }
            DatagramAction::Reoriginate { count, every_ms } => {
                up_only("reoriginate", direction)?;
                repeats(count, every_ms)
            }
            DatagramAction::Inject { content, count, every_ms } => {
                if content.from_unknown_peer() {
                    up_only("inject of a ClientHello", direction)?;
                }
                repeats(count, every_ms)
            }
        }
    }
}

/// A relay's own address can reach the server only; `Both` is read as up.
fn up_only(what: &'static str, direction: Direction) -> Result<(), PlanError> {
    match direction {
        Direction::Up | Direction::Both => Ok(()),
        Direction::Down => Err(PlanError::UpOnly { what }),
    }
}

/// Plan of the relay in the command path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamRelayConfig {
    /// Actions; where several are open, they apply in this order.
    #[serde(default)]
    pub actions: Vec<Timed<StreamAction>>,
    /// The medium in which it stands.
    #[serde(default)]
    pub medium: Medium,
}

/// Action on a byte stream. Order within a direction is always kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum StreamAction {
    /// Pieces are held back by a fixed time.
    Delay {
        /// Time of the hold, milliseconds.
        ms: u64,
    },
    /// No byte passes until the window closes; connections stay open.
    Stall,
    /// Pieces pass at a rate.
    Throttle {
        /// Rate, bytes a second.
        bytes_per_s: u64,
    },
    /// Ends the direction of every open connection when the window opens; later bytes are swallowed.
    HalfClose,
    /// Cuts every open connection when the window opens.
    Reset,
    /// Cuts every open connection when the window opens, and each new one until it closes.
    Cut,
    /// A random bit of some pieces is flipped.
    Corrupt {
        /// Probability for each piece.
        permille: u16,
    },
}

impl StreamRelayConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.actions.len())?;
        self.medium.check()?;
        self.actions.iter().try_for_each(|timed| {
            timed.check_window(timed.action.lasts())?;
            timed.action.check()
        })
    }
}

impl StreamAction {
    /// True if it needs a window, in place of one instant.
    pub fn lasts(&self) -> bool {
        match self {
            StreamAction::HalfClose | StreamAction::Reset => false,
            StreamAction::Delay { .. }
            | StreamAction::Stall
            | StreamAction::Throttle { .. }
            | StreamAction::Cut
            | StreamAction::Corrupt { .. } => true,
        }
    }

    fn check(&self) -> Result<(), PlanError> {
        match *self {
            StreamAction::Delay { ms } => check_range("ms", ms, 0, MAX_HOLD_MS),
            StreamAction::Throttle { bytes_per_s } => check_range("bytes_per_s", bytes_per_s, 1, 10_000_000),
            StreamAction::Corrupt { permille } => share("permille", permille),
            StreamAction::Stall | StreamAction::HalfClose | StreamAction::Reset | StreamAction::Cut => Ok(()),
        }
    }
}
