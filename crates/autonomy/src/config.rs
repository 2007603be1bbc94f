//! Configuration of an autonomy core: its mission and its surroundings. World frame, millimetres.

use config::contact::Contacts;
use config::platform::Limits;
use config::setup::{NoChannel, Setup};
use serde::{Deserialize, Serialize};
use wire::guest::StartPose;
use wire::id::{NODES, NodeId, PeerId, UnitId};
use wire::roster::RosterError;
use wire::session::MAX_TEAMMATES;
use wire::time::Span;
use wire::trust::Validity;

/// Most points of a route or corners of a geofence.
pub const MAX_POINTS: usize = 64;
/// Most obstacles on a map.
pub const MAX_OBSTACLES: usize = 256;
/// Most operators of one unit.
pub const MAX_OPERATORS: usize = 4;
/// Furthest coordinate from the world's centre, millimetres.
pub const MAX_COORDINATE: i32 = 1_000_000;

/// Mission and surroundings of one unit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AutonomyConfig {
    /// The unit; its node is the core's own.
    pub unit: UnitId,
    /// Way points, in order: millimetres east, millimetres north. Empty: stand.
    pub route: Vec<(i32, i32)>,
    /// True if the last way point leads to the first again.
    #[serde(default)]
    pub looped: bool,
    /// Corners of the geofence, in order, three at least.
    pub geofence: Vec<(i32, i32)>,
    /// Obstacles on the map.
    #[serde(default)]
    pub obstacles: Vec<MapBox>,
    /// Other units whose claims this one hears.
    #[serde(default)]
    pub teammates: Vec<UnitId>,
    /// Operators who may order.
    pub operators: Vec<NodeId>,
    /// Identities that are admitted for a time only.
    #[serde(default)]
    pub mandates: Vec<Validity>,
    /// Peer that may open a session and grant leases.
    #[serde(default = "gateway")]
    pub supervisor: PeerId,
    /// Contact plan of the link to the supervisor.
    #[serde(default)]
    pub contacts: Contacts,
    /// The platform's limits of guards and driving.
    #[serde(default)]
    pub limits: Limits,
    /// The guest that drives in place of mission and navigation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guest: Option<GuestConfig>,
}

/// A guest as an autonomy core is informed of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GuestConfig {
    /// Name in reports.
    pub name: String,
    /// True if its set-points go to the plant as they are.
    pub bare: bool,
    /// Longest time from the start to its first answer.
    pub start_limit: Span,
    /// Longest time from a step to its answer.
    pub step_limit: Span,
    /// Pose at the start, as surveyed.
    #[serde(default)]
    pub start: Option<StartPose>,
}

/// Something on the map that stands: a box on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapBox {
    /// East of its middle, millimetres.
    pub x_mm: i32,
    /// North of its middle, millimetres.
    pub y_mm: i32,
    /// Direction of its length, milliradians counter-clockwise from east.
    pub heading_mrad: i32,
    /// Half of length and width, millimetres.
    pub half_mm: [u32; 2],
    /// Height of its top above the ground, millimetres.
    pub top_mm: u32,
}

/// Reason that a core cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// A channel's key is missing.
    #[error(transparent)]
    Channel(#[from] NoChannel),
    /// The run's identities are no table, or the configuration names one that is not in it.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// A list has too few or too many items.
    #[error("{field}: {least} to {most} items expected, got {got}")]
    Count {
        /// Name of the list.
        field: &'static str,
        /// Fewest items.
        least: usize,
        /// Most items.
        most: usize,
        /// Number of items in the list.
        got: usize,
    },
    /// A coordinate is outside the world.
    #[error("{field}: coordinates within ±{MAX_COORDINATE} mm expected, got {got}")]
    Coordinate {
        /// Name of the coordinate.
        field: &'static str,
        /// Value of the coordinate.
        got: i32,
    },
    /// The setup is another node's.
    #[error("setup of {expected} expected, got that of {got}")]
    Node {
        /// The unit's node.
        expected: NodeId,
        /// The node that the setup is for.
        got: NodeId,
    },
    /// A period is zero: the core would never come to rest.
    #[error("{field}: a period above zero expected")]
    Period {
        /// Name of the period.
        field: &'static str,
    },
}

impl AutonomyConfig {
    /// Refuses a configuration from which no core could be made.
    pub fn check(&self, setup: &Setup) -> Result<(), ConfigError> {
        let expected = self.unit.node();
        if setup.node != expected {
            return Err(ConfigError::Node { expected, got: setup.node });
        }
        count("route", self.route.len(), 0, MAX_POINTS)?;
        count("geofence", self.geofence.len(), 3, MAX_POINTS)?;
        count("obstacles", self.obstacles.len(), 0, MAX_OBSTACLES)?;
        count("teammates", self.teammates.len(), 0, MAX_TEAMMATES)?;
        count("operators", self.operators.len(), 0, MAX_OPERATORS)?;
        count("mandates", self.mandates.len(), 0, NODES)?;
        points("route", self.route.iter().copied())?;
        points("geofence", self.geofence.iter().copied())?;
        points("obstacles", self.obstacles.iter().map(|block| (block.x_mm, block.y_mm)))?;
        let bounds = &setup.bounds;
        let periods =
            [("control_period_ms", bounds.control_period_ms), ("telemetry_period_ms", bounds.telemetry_period_ms)];
        match periods.into_iter().find(|(_, ms)| *ms == 0) {
            Some((field, _)) => Err(ConfigError::Period { field }),
            None => Ok(()),
        }
    }
}

fn gateway() -> PeerId {
    PeerId::GATEWAY
}

fn count(field: &'static str, got: usize, least: usize, most: usize) -> Result<(), ConfigError> {
    if (least..=most).contains(&got) { Ok(()) } else { Err(ConfigError::Count { field, least, most, got }) }
}

fn points(field: &'static str, mut points: impl Iterator<Item = (i32, i32)>) -> Result<(), ConfigError> {
    let outside = |n: i32| !(-MAX_COORDINATE..=MAX_COORDINATE).contains(&n);
    match points.find(|(x, y)| outside(*x) || outside(*y)) {
        Some((x, y)) => Err(ConfigError::Coordinate { field, got: if outside(x) { x } else { y } }),
        None => Ok(()),
    }
}
