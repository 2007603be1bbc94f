//! Acts of a person at the console, as data: the one way from a hand to the console's core.
//!
//! An act enters the core as an input like any other, so that it is in the input journal and a run with a person in it
//! can be replayed. Towards safe one act is enough. Away from safe it takes two: the order is prepared, which lapses
//! after a time, and then confirmed with a reason. Judging acts is left to `console::act`.

use minicbor::{Decode, Encode};
use strum::{EnumCount, VariantArray};

use crate::codec::Text;
use crate::command::CommandKind;
use crate::id::{Boot, CommandId, NodeId, PeerId, TrackId, UnitId};
use crate::mode::Guard;
use crate::time::{Instant, Span};

/// Longest encoded act, bytes.
pub const MAX_ACT: usize = 160;

/// Orders that a person may give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// A command to a unit.
    #[n(0)]
    Command(#[n(0)] UnitId, #[n(1)] CommandKind),
    /// To revoke an identity.
    #[n(1)]
    Revoke(#[n(0)] NodeId),
}

impl Order {
    /// True if it leads towards the safe side and needs one step only.
    pub fn towards_safe(self) -> bool {
        matches!(self, Order::Command(_, kind) if kind.towards_safe())
    }

    /// Name in scripts and logs.
    pub fn name(self) -> &'static str {
        match self {
            Order::Command(_, kind) => kind.name(),
            Order::Revoke(_) => "revoke",
        }
    }
}

/// An act of a person at the console.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Act {
    /// Carry this out: towards safe only. An order prepared, or not yet released to the unit, is given up for it.
    #[n(0)]
    Now(#[n(0)] Order),
    /// First step of an order away from safe, and of no other. It replaces an earlier prepared order, and lapses.
    #[n(1)]
    Prepare(#[n(0)] Order),
    /// Second step: carry out the prepared order, if it is this one. The reason must not be empty.
    #[n(2)]
    Confirm(#[n(0)] Order, #[n(1)] Text<64>),
    /// Give up the prepared order, and one confirmed but not yet released to the unit.
    #[n(3)]
    Withdraw,
    /// Take note of an alarm that was raised at this time of the console's clock.
    #[n(4)]
    Acknowledge(#[n(0)] Alarm, #[n(1)] Instant),
    /// Put the alarm that was raised at this time aside for a while. The reason must not be empty.
    #[n(5)]
    Shelve(#[n(0)] Alarm, #[n(1)] Instant, #[n(2)] Shelf, #[n(3)] Text<64>),
    /// Silence the sound of the alarms raised so far, for two minutes.
    #[n(6)]
    Silence,
}

/// Time for which an alarm may be put aside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Shelf {
    /// One minute.
    #[n(0)]
    Minute,
    /// Ten minutes.
    #[n(1)]
    TenMinutes,
    /// Half an hour.
    #[n(2)]
    HalfHour,
}

impl Shelf {
    /// Every one, the shortest first.
    pub const ALL: [Shelf; 3] = [Shelf::Minute, Shelf::TenMinutes, Shelf::HalfHour];

    /// Length of the time.
    pub fn span(self) -> Span {
        Span::s(60 * self.minutes())
    }

    /// The time in minutes.
    pub fn minutes(self) -> u64 {
        match self {
            Shelf::Minute => 1,
            Shelf::TenMinutes => 10,
            Shelf::HalfHour => 30,
        }
    }
}

/// An act with its number at the window, from 1 and rising: none is carried out twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Numbered {
    /// Number of the act.
    #[n(0)]
    pub serial: u64,
    /// Content of the act.
    #[n(1)]
    pub act: Act,
}

/// Causes of alarms that an operator has to acknowledge. Some of them raise none by themselves any more; they stay for
/// the recordings that name them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Alarm {
    /// The unit is in HOLD_SAFE.
    #[n(0)]
    HoldSafe(#[n(0)] UnitId),
    /// The unit is DEGRADED.
    #[n(1)]
    Degraded(#[n(0)] UnitId),
    /// The display of the unit is stale.
    #[n(2)]
    Stale(#[n(0)] UnitId),
    /// The unit is no longer heard.
    #[n(3)]
    Silent(#[n(0)] UnitId),
    /// The unit no longer reports a track; its last place stays until this is acknowledged or the track is back.
    #[n(4)]
    TrackLost(#[n(0)] UnitId, #[n(1)] Boot, #[n(2)] TrackId),
    /// The gateway has no session with this peer any more.
    #[n(5)]
    LinkDown(#[n(0)] PeerId),
    /// A peer's session at the broker was cut, or taken over by another connection.
    #[n(6)]
    SessionLost(#[n(0)] PeerId),
    /// No message about a command in time.
    #[n(7)]
    NotAcknowledged(#[n(0)] CommandId),
    /// A command was refused, by the gateway or by the unit.
    #[n(8)]
    CommandRefused(#[n(0)] CommandId),
    /// The unit's clock runs faster or slower against the console's than ages of its reports allow for.
    #[n(9)]
    ClockRuns(#[n(0)] UnitId),
    /// The unit's claims about itself contradict each other, as another unit found.
    #[n(10)]
    Contradicts(#[n(0)] UnitId),
    /// The unit claims the place of another one, as another unit found.
    #[n(11)]
    Claims(#[n(0)] UnitId),
    /// A guard of the unit failed, and with it the unit's mode.
    #[n(12)]
    GuardLost(#[n(0)] UnitId, #[n(1)] Guard),
    /// The unit is in HOLD_SAFE by an order that was not given at this console.
    #[n(13)]
    HeldElsewhere(#[n(0)] UnitId),
    /// The unit is not heard although a contact was due by its plan.
    #[n(14)]
    ContactDue(#[n(0)] UnitId),
    /// Several tracks of the unit ended at once.
    #[n(15)]
    TracksLost(#[n(0)] UnitId),
    /// Neither the gateway nor any unit is heard.
    #[n(16)]
    GatewaySilent,
}

/// Rights of a person at this console. A lock against mistakes, not against attackers: unit, gateway and broker check
/// the operator's key, independent of the console's belief.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Look at the display only.
    #[n(0)]
    View,
    /// Stop, disarm, enable, resume; take note of alarms.
    #[n(1)]
    Operate,
    /// All of it: authority, settings, revocations.
    #[default]
    #[n(2)]
    Supervise,
}

impl Role {
    /// Every role, the least first.
    pub const ALL: [Role; 3] = [Role::View, Role::Operate, Role::Supervise];

    /// Name as displayed.
    pub fn name(self) -> &'static str {
        match self {
            Role::View => "view",
            Role::Operate => "operate",
            Role::Supervise => "supervise",
        }
    }
}

/// Reason that an act was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
#[derive(EnumCount, VariantArray)]
pub enum Unable {
    /// Not an act, or too long.
    #[n(0)]
    Malformed,
    /// The number of the act is not above the last one: the act was carried out already, or is out of order.
    #[n(1)]
    Repeated,
    /// The role does not allow it.
    #[n(2)]
    Role,
    /// The order leads away from safe, which takes two steps.
    #[n(3)]
    TwoSteps,
    /// A condition shown beside the control does not hold.
    #[n(4)]
    Interlock,
    /// An equal order is under way.
    #[n(5)]
    Pending,
    /// No order is prepared, or another one is.
    #[n(6)]
    NotPrepared,
    /// The order was not confirmed in time.
    #[n(7)]
    Lapsed,
    /// A reason is required.
    #[n(8)]
    NoReason,
    /// No such alarm stands, or not since then.
    #[n(9)]
    NoAlarm,
    /// The run is over.
    #[n(10)]
    Over,
    /// The order leads towards safe, which takes one step.
    #[n(11)]
    OneStep,
    /// The alarm is about a HOLD_SAFE that stands, which cannot be put aside.
    #[n(12)]
    HoldStands,
    /// No alarm sounds.
    #[n(13)]
    NoSound,
}

impl Unable {
    /// Every one, in wire order.
    pub const ALL: [Unable; Unable::COUNT] = *Unable::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// Message to the person.
    pub fn message(self) -> &'static str {
        match self {
            Unable::Malformed => "not understood",
            Unable::Repeated => "already done: its number has been used",
            Unable::Role => "this role may not do that",
            Unable::TwoSteps => "away from safe: prepare it, then confirm it",
            Unable::Interlock => "an interlock does not hold",
            Unable::Pending => "the same order is under way",
            Unable::NotPrepared => "not what is prepared",
            Unable::Lapsed => "not confirmed in time: prepare it again",
            Unable::NoReason => "a reason is required",
            Unable::NoAlarm => "no such alarm stands any more",
            Unable::Over => "the run is over",
            Unable::OneStep => "towards safe: do it, without preparing it",
            Unable::HoldStands => "HOLD_SAFE stands: its alarm cannot be shelved",
            Unable::NoSound => "no alarm sounds",
        }
    }
}
