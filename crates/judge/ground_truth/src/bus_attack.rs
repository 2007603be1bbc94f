//! Attacks on the bus of a guest: the messages by which the guest's own programs talk to each other, such as a ROS 2 graph or a
//! MAVLink link.
//!
//! The guest's adapter carries them out and counts the messages that its witness receives (`docs/researcher/guests.md`). The meaning of each on a
//! given bus is left to the adapter's own page.

use minicbor::{Decode, Encode};
use strum::{EnumCount, IntoStaticStr, VariantArray};

/// Attack on the bus of a guest.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    EnumCount,
    VariantArray,
    IntoStaticStr,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum BusAttack {
    /// A second sender of the vehicle's position, shifted north by the amount, m.
    #[n(0)]
    Odometry,
    /// A second sender of set-points: straight ahead at the amount, m/s.
    #[n(1)]
    Command,
    /// A forged order to stop, land or disarm.
    #[n(2)]
    Stop,
    /// A second clock, ahead by the amount, s.
    #[n(3)]
    Clock,
    /// A forged route, shifted north by the amount, m.
    #[n(4)]
    Route,
    /// Positions from the amount of seconds ago, sent again.
    #[n(5)]
    ReplayOdometry,
    /// Set-points from the amount of seconds ago, sent again.
    #[n(6)]
    ReplayCommand,
    /// The honest sender is silenced.
    #[n(7)]
    Silence,
    /// A stranger sets a parameter of the program to the amount.
    #[n(8)]
    Parameter,
    /// More messages than the program can work off.
    #[n(9)]
    Flood,
    /// A second program of the same name or system number.
    #[n(10)]
    TakeName,
    /// A silent listener.
    #[n(11)]
    Listen,
    /// Set-points are changed on the way to the amount, m/s.
    #[n(12)]
    Rewrite,
}

impl BusAttack {
    /// Every attack, in the order of their numbers.
    pub const ALL: [BusAttack; BusAttack::COUNT] =
        *BusAttack::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// The name in files, requests and reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}
