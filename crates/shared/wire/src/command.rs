//! The command plane: an operator's signed intent, its signed confirmation, and the unit's signed acknowledgement.
//!
//! Every intent repeats a nonce that the unit issued in its telemetry, so the unit can bound the intent's age without
//! trusting console, gateway or broker; none of the three can mint, alter or re-time one.

use minicbor::bytes::ByteSlice;
use minicbor::{Decode, Encode};

use crate::codec::Text;
use crate::id::{CommandId, Nonce, TrackId, UnitId};
use crate::mode::Mode;
use crate::refusal::Reason;
use crate::settings::Settings;
use crate::time::Span;

/// Longest payload on the command plane, bytes.
pub const MAX_ORDER: usize = 1024;
/// Furthest that a time tag may lie ahead.
pub const MAX_AHEAD: Span = Span::s(86_400);

/// Time at which a command is carried out, on the clock of its unit alone: both are counted from the issue of the nonce
/// that the intent repeats, so a delay on the way moves neither.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize, serde::Deserialize)]
pub struct TimeTag {
    /// Time from the nonce's issue until the command is due.
    #[n(0)]
    pub after: Span,
    /// Time from then on during which the command may be carried out.
    #[n(1)]
    pub within: Span,
}

/// Commands that an operator may give a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize, strum::EnumDiscriminants)]
#[serde(rename_all = "snake_case")]
#[strum_discriminants(
    name(OrderKind),
    doc = "Kind of a command, without its track or values.",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema, strum::IntoStaticStr),
    serde(rename_all = "kebab-case"),
    strum(serialize_all = "kebab-case")
)]
pub enum CommandKind {
    /// Stop and stay stopped. Towards safe: one step.
    #[n(0)]
    Hold,
    /// Give up authority. Towards safe: one step.
    #[n(1)]
    Disarm,
    /// IDLE to READY.
    #[n(2)]
    Enable,
    /// HOLD_SAFE to READY.
    #[n(3)]
    Resume,
    /// READY to PREPARE_TO_ACT on this track.
    #[n(4)]
    Arm(#[n(0)] TrackId),
    /// Use the authority held on this track.
    #[n(5)]
    Confirm(#[n(0)] TrackId),
    /// Set these values; in IDLE only.
    #[n(6)]
    Configure(#[n(0)] Settings),
}

impl OrderKind {
    /// Name of the kind in files and logs.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

impl CommandKind {
    /// True if the kind leads towards the safe side and needs one step only.
    pub fn towards_safe(self) -> bool {
        match self {
            CommandKind::Hold | CommandKind::Disarm => true,
            CommandKind::Enable
            | CommandKind::Resume
            | CommandKind::Arm(_)
            | CommandKind::Confirm(_)
            | CommandKind::Configure(_) => false,
        }
    }

    /// True if the kind may wait for a time. An arming and its confirmation rest on the display of the moment, settings
    /// on IDLE.
    pub fn may_wait(self) -> bool {
        match self {
            CommandKind::Hold | CommandKind::Disarm | CommandKind::Enable | CommandKind::Resume => true,
            CommandKind::Arm(_) | CommandKind::Confirm(_) | CommandKind::Configure(_) => false,
        }
    }

    /// The track whose displayed evidence the kind rests on: that of an arming and of its confirmation.
    pub fn rests_on_display(self) -> Option<TrackId> {
        let (CommandKind::Arm(track) | CommandKind::Confirm(track)) = self else { return None };
        Some(track)
    }

    /// Name in scripts and logs.
    pub fn name(self) -> &'static str {
        match self {
            CommandKind::Hold => "hold",
            CommandKind::Disarm => "disarm",
            CommandKind::Enable => "enable",
            CommandKind::Resume => "resume",
            CommandKind::Arm(_) => "arm",
            CommandKind::Confirm(_) => "confirm",
            CommandKind::Configure(_) => "configure",
        }
    }
}

/// First step, signed by the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Intent {
    /// Id of the command: by it repetitions and their order are recognised.
    #[n(0)]
    pub id: CommandId,
    /// Unit that is to carry the command out.
    #[n(1)]
    pub unit: UnitId,
    /// The unit's command nonce as last displayed.
    #[n(2)]
    pub nonce: Nonce,
    /// Command asked for.
    #[n(3)]
    pub kind: CommandKind,
    /// Reason, in the operator's words; empty only towards safe.
    #[n(4)]
    pub reason: Text<64>,
    /// Time of its execution; absent: at once.
    #[n(5)]
    pub tag: Option<TimeTag>,
    /// The unit's report that the operator was shown, where the kind [rests on it](CommandKind::rests_on_display).
    #[cbor(n(6), with = "minicbor::bytes")]
    pub shown: Option<ReportHash>,
}

/// SHA-256 of a signed intent's bytes. Confirmation, acknowledgement and progress name the intent by this hash: an id
/// is chosen by its signer, and two intents can have the same.
pub type IntentHash = [u8; 32];

/// SHA-256 of a signed report's bytes: by it an order names the report that its operator was shown.
pub type ReportHash = [u8; 32];

/// Second step, signed by the operator for everything that leads away from safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Confirmation {
    /// The command confirmed.
    #[n(0)]
    pub id: CommandId,
    /// SHA-256 of the signed intent's bytes.
    #[cbor(n(1), with = "minicbor::bytes")]
    pub intent: IntentHash,
}

/// Order as it travels to the unit: both signed steps, as they left the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Order<'b> {
    /// COSE_Sign1 over [`Intent`].
    #[b(0)]
    pub intent: &'b ByteSlice,
    /// COSE_Sign1 over [`Confirmation`]; absent towards safe.
    #[b(1)]
    pub confirmation: Option<&'b ByteSlice>,
}

/// Answer of the unit, signed by it (COSE_Sign1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Ack {
    /// The command answered.
    #[n(0)]
    pub id: CommandId,
    /// SHA-256 of the signed intent's bytes.
    #[cbor(n(1), with = "minicbor::bytes")]
    pub intent: IntentHash,
    /// Reason for a refusal; absent when it was executed or stored.
    #[n(2)]
    pub refused: Option<Reason>,
    /// Mode after it.
    #[n(3)]
    pub mode: Mode,
    /// Time until it is due, of a command that was stored. Its execution is acknowledged once more.
    #[n(4)]
    pub due: Option<Span>,
}

/// Console to gateway.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Request<'b> {
    /// Stage a signed intent; towards safe it is sent at once.
    #[n(0)]
    Stage(#[b(0)] &'b ByteSlice),
    /// Send the staged intent with its signed confirmation.
    #[n(1)]
    Release(#[b(0)] &'b ByteSlice),
    /// Have the units repeat this in their reports: the display's challenge.
    #[n(2)]
    Watch(#[n(0)] Nonce),
    /// Revoke an identity: the authority's signed revocation.
    #[n(50)]
    Revoke(#[b(0)] &'b ByteSlice),
}
