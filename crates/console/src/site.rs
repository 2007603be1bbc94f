//! The map's background: the site as the mission was planned on it. It makes no statement about the present world,
//! comes with the console's configuration and never over the feed.

use serde::{Deserialize, Serialize};

/// Most points or blocks of each kind that are drawn.
pub const MAX_POINTS: usize = 256;

/// Most heights along a side of the survey; a larger survey is not drawn.
pub const MAX_SIDE: usize = 64;

/// A place on the ground, metres east and north.
pub type GroundPoint = [f32; 2];

/// The planned site. Points beyond [`MAX_POINTS`] are not drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Corners of the geofence, in order.
    #[serde(default)]
    pub fence: Vec<GroundPoint>,
    /// Way points, in order.
    #[serde(default)]
    pub route: Vec<GroundPoint>,
    /// True if the route starts again at its end.
    #[serde(default)]
    pub looped: bool,
    /// Obstacles on the map.
    #[serde(default)]
    pub blocks: Vec<SiteBox>,
    /// Heights of the ground, where it was surveyed.
    #[serde(default)]
    pub relief: Option<Relief>,
    /// Metres on the ground for each metre of the map, where that is not one: a satellite's map is of the places that
    /// its payload looks at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_m: Option<f32>,
    /// Way of the point below a satellite, in order of time, as its planned orbit has it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub below: Vec<GroundPoint>,
}

impl Site {
    /// The drawable part: no more than [`MAX_POINTS`] of each kind, and finite numbers only.
    #[must_use]
    pub fn sound(mut self) -> Self {
        let finite = |place: &GroundPoint| place.iter().all(|x| x.is_finite());
        for places in [&mut self.fence, &mut self.route, &mut self.below] {
            places.truncate(MAX_POINTS);
            places.retain(finite);
        }
        self.blocks.truncate(MAX_POINTS);
        self.blocks.retain(|block| finite(&block.at) && finite(&block.half) && block.yaw.is_finite());
        self.scale_m = self.scale_m.filter(|scale| scale.is_finite() && *scale > 0.0);
        self
    }
}

/// Heights of the ground on a square grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relief {
    /// The grid's south-west corner.
    pub corner: GroundPoint,
    /// Distance between two neighbours, metres.
    pub cell: f32,
    /// Heights in each row.
    pub columns: usize,
    /// Metres; rows from south to north, each from west to east.
    pub heights: Vec<f32>,
}

impl Relief {
    /// The rows, where it is a grid of finite numbers within [`MAX_SIDE`]; else none.
    pub fn rows(&self) -> Vec<&[f32]> {
        let numbers = self.heights.iter().chain(&self.corner).chain([&self.cell]);
        let fits = (2..=MAX_SIDE).contains(&self.columns) && self.heights.len() <= MAX_SIDE * self.columns;
        if !fits || self.cell <= 0.0 || numbers.into_iter().any(|number| !number.is_finite()) {
            return Vec::new();
        }
        self.heights.chunks_exact(self.columns).collect()
    }
}

/// Something that stands on the site.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteBox {
    /// Centre of the box.
    pub at: GroundPoint,
    /// Half of the length and of the width, metres.
    pub half: GroundPoint,
    /// Direction of its length, radians counter-clockwise from east.
    #[serde(default)]
    pub yaw: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that are no numbers are left out.
    #[test]
    fn site_is_drawn_within_bounds_only() {
        let block = |x: f32, half: f32, yaw: f32| SiteBox { at: [x, 0.0], half: [half, 1.0], yaw };
        let site = Site {
            fence: vec![[1.0, f32::NAN], [2.0, 3.0], [f32::INFINITY, 0.0]],
            route: vec![[0.0, 0.0]; MAX_POINTS + 1],
            blocks: vec![
                block(f32::NAN, 1.0, 0.0),
                block(0.0, f32::INFINITY, 0.0),
                block(0.0, 1.0, f32::NAN),
                block(4.0, 1.0, 0.0),
            ],
            ..Site::default()
        };
        let sound = site.sound();
        assert_eq!(
            (sound.fence, sound.route.len(), sound.blocks),
            (vec![[2.0, 3.0]], MAX_POINTS, vec![block(4.0, 1.0, 0.0)])
        );
    }
}
