//! Requests of autonomy to the plant: leased set-points, and the abstract act.

use minicbor::{Decode, Encode};

use crate::id::{CommandId, TrackId, WorldId};
use crate::time::{Instant, Span};

/// Motion that a plant is asked for, in the terms of its kind of body. A plant refuses the terms of another kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub enum SetPoint {
    /// Motion of a body that steers.
    #[n(0)]
    Course {
        /// Forward speed, mm/s.
        #[n(0)]
        speed_mm_s: i32,
        /// Curvature, 10⁻⁶ per metre, positive to the left.
        #[n(1)]
        curvature_um: i32,
    },
    /// Motion of a body that moves freely, in the level frame: x along its heading, y left, z up.
    #[n(1)]
    Velocity {
        /// Along x, y and z, mm/s.
        #[n(0)]
        mm_s: [i32; 3],
        /// Turn about z, mrad/s, counter-clockwise.
        #[n(1)]
        turn_mrad_s: i32,
    },
    /// The plant's own safe motion, as when a lease has ended.
    #[n(2)]
    Rest,
}

/// A set-point with a lease. When the lease ends on the plant's clock, the plant changes to its safe motion by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Drive {
    /// Time at which it was made, on the vehicle host's clock.
    #[n(0)]
    pub stamp: Instant,
    /// Motion that is asked for.
    #[n(1)]
    pub set_point: SetPoint,
    /// Time for which the set-point may be followed, from `stamp`.
    #[n(2)]
    pub lease: Span,
}

/// The abstract act: autonomy has consumed its authority. The plant only notes the true object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Act {
    /// Time, on the vehicle host's clock.
    #[n(0)]
    pub stamp: Instant,
    /// World in which the authority was minted.
    #[n(1)]
    pub world: WorldId,
    /// Serial of the consumed authority.
    #[n(2)]
    pub authority: u32,
    /// Track that the authority is bound to.
    #[n(3)]
    pub track: TrackId,
    /// Position at which autonomy holds the track to be: east, millimetres.
    #[n(4)]
    pub x_mm: i32,
    /// Place of the track, north, millimetres.
    #[n(5)]
    pub y_mm: i32,
    /// Command that confirmed it.
    #[n(6)]
    pub command: CommandId,
}
