//! What the map draws beneath everything: the site as the mission was planned on it. It is no statement about the world
//! now, comes with the console's making and never over the feed.

use serde::{Deserialize, Serialize};

/// Most points or blocks of each kind that are drawn.
pub const MAX_POINTS: usize = 256;

/// A place on the ground, metres east and north.
pub type Place = [f32; 2];

/// The planned site. What exceeds [`MAX_POINTS`] is not drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Corners of the geofence, in order.
    #[serde(default)]
    pub fence: Vec<Place>,
    /// Way points, in order.
    #[serde(default)]
    pub route: Vec<Place>,
    /// Whether the route starts again at its end.
    #[serde(default)]
    pub looped: bool,
    /// Known obstacles.
    #[serde(default)]
    pub blocks: Vec<Block>,
}

/// Something that stands on the site.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Centre.
    pub at: Place,
    /// Half its length and half its width, metres.
    pub half: Place,
    /// Direction of its length, radians counter-clockwise from east.
    #[serde(default)]
    pub yaw: f32,
}
