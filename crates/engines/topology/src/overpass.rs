//! The map of a platform that passes over a region in an orbit: its scale, and the way of the point below it.
//!
//! Both follow from the planned orbit, not from reports. Drawing is left to the console.

use spacecraft::region::Region;

use crate::{MemberRole, Topology};

/// Time before and after the moment overhead for which the way is computed, whole seconds: 450 km on either side.
const AROUND_S: i32 = 60;

/// A pass over a region, as a map shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Overpass {
    /// Metres on the ground for each metre of the map.
    pub scale_m: f64,
    /// Places of the point below the platform, metres of the map east and north, a second apart.
    pub below: Vec<[f64; 2]>,
}

impl Topology {
    /// The pass of the unit under test; none of a platform that stays near the ground, or without an orbit.
    pub fn overpass(&self) -> Option<Overpass> {
        let pass = self.members.iter().find_map(|member| {
            let MemberRole::Perception(config) = &member.role else { return None };
            config.sky.as_ref().map(|sky| &sky.pass)
        })?;
        let region = Region::new(pass).ok()?;
        let below = |second: i32| {
            let [east, north, _] = region.moment_at(pass.overhead_s + f64::from(second)).local_m;
            [east / pass.scale_m, north / pass.scale_m]
        };
        Some(Overpass { scale_m: pass.scale_m, below: (-AROUND_S..=AROUND_S).map(below).collect() })
    }
}
