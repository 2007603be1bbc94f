//! Requests of autonomy to the plant: leased set-points, and the abstract act.

use minicbor::{Decode, Encode};

use crate::id::{CommandId, TrackId, WorldId};
use crate::time::{Instant, Span};

/// A set-point with a lease. When the lease ends on the plant's clock, the plant brakes by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Drive {
    /// Time at which it was made, on the vehicle host's clock.
    #[n(0)]
    pub stamp: Instant,
    /// Forward speed, mm/s.
    #[n(1)]
    pub speed_mm_s: i32,
    /// Curvature, 10⁻⁶ per metre, positive to the left.
    #[n(2)]
    pub curvature_um: i32,
    /// Time for which the set-point may be followed, from `stamp`.
    #[n(3)]
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
    /// Designated track.
    #[n(3)]
    pub track: TrackId,
    /// Position at which autonomy holds the track to be: east, millimetres.
    #[n(4)]
    pub x_mm: i32,
    /// North, millimetres.
    #[n(5)]
    pub y_mm: i32,
    /// Command that confirmed it.
    #[n(6)]
    pub command: CommandId,
}
