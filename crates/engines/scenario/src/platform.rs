//! A platform file: bounds, vehicle, sensors, limits of guards and safe action of one platform, with ranges and places, and the bounds
//! that a scenario may tighten.
//!
//! The bounds are fixed before anything is measured (`docs/reference/bounds.md` names the two that were not). The values' meaning is
//! given by `wire::bounds` and `config::platform`; here they are only read, checked and handed on. `tables` has the optional
//! tables, `check` and `body` hold all values against each other, `template` is a file to start from.

mod body;
pub(super) mod check;
mod flight;
mod space;
mod tables;
mod template;
mod wing;

use config::platform::{Body, Limits, Sensors, Vehicle};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::bounds::Bounds;
use wire::sensor::{Camera, Lidar};

use super::value::{Located, Name, Text, Whole};

pub use flight::{AloftTable, MultirotorTable, Small};
pub use space::SatelliteTable;
pub use tables::{CameraTable, GuardsTable, LidarTable, SafeAction, SafeTable, VehicleTable};
pub use template::{platform_schema, platform_template};
pub use wing::FixedWingTable;

/// Milliseconds of a bound: never zero.
pub type Bound = Located<Whole<1, 60_000>>;
/// Milliradians, at most half a turn.
pub type Angle = Located<Whole<0, 3_142>>;
/// Millimetres, millimetres per second, or per second squared.
pub type Length = Whole<0, 100_000>;

/// One platform.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Platform {
    /// Name, equal to the file's name without `.toml`.
    pub name: Located<Name>,
    /// One line for tables.
    pub title: Text<120>,
    /// The platform with links and times that are also this one's: the classes that a scenario states for it are expected here too, unless the scenario
    /// states others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub owes: Option<Located<Name>>,
    /// Its bounds.
    pub bounds: BoundsTable,
    /// The vehicle, where it drives on wheels.
    #[serde(default)]
    pub vehicle: VehicleTable,
    /// The body, where it flies on rotors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub multirotor: Option<MultirotorTable>,
    /// The body, where it flies on a fixed wing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed_wing: Option<FixedWingTable>,
    /// The body, where it is in an orbit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub satellite: Option<SatelliteTable>,
    /// Limits of the guards of one that flies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aloft: Option<AloftTable>,
    /// The camera.
    #[serde(default)]
    pub camera: CameraTable,
    /// The LiDAR.
    #[serde(default)]
    pub lidar: LidarTable,
    /// Limits of guards and driving.
    #[serde(default)]
    pub guards: GuardsTable,
    /// The safe action.
    #[serde(default)]
    pub safe: SafeTable,
}

impl Platform {
    /// The vehicle as the simulation knows it, where it drives on wheels.
    pub fn vehicle(&self) -> Vehicle {
        self.vehicle.vehicle()
    }

    /// The body, as the simulation knows it.
    pub fn body(&self) -> Body {
        if let Some(body) = self.satellite.as_ref().and_then(SatelliteTable::body) {
            return Body::Satellite(body);
        }
        let rotors = self.multirotor.as_ref().map(|body| Body::Multirotor(body.body(self.aloft.as_ref())));
        let wing = self.fixed_wing.as_ref().map(|body| Body::FixedWing(body.body(self.aloft.as_ref())));
        rotors.or(wing).unwrap_or_else(|| Body::Wheeled(self.vehicle()))
    }

    /// Length, width and height of the body, metres.
    fn extent(&self) -> [f64; 3] {
        let rotors = self.multirotor.as_ref().map(|body| body.body_m.map(|edge| edge.get()));
        // The point that a satellite looks at has no width.
        let point = self.satellite.as_ref().map(|_| [0.0; 3]);
        let wing = self.fixed_wing.as_ref().map(|body| body.body_m.map(|edge| edge.get()));
        point.or(rotors).or(wing).unwrap_or_else(|| self.vehicle.chassis_m.map(|edge| edge.get()))
    }

    /// Camera and LiDAR as simulation and perception know them.
    pub fn sensors(&self) -> Sensors {
        tables::sensors(&self.camera, &self.lidar)
    }

    /// Sensors as perception knows them: heights are above the ground, at the height that is flown at.
    pub fn seen_from(&self) -> Sensors {
        let Sensors { camera, lidar } = self.sensors();
        let rotors = self.multirotor.as_ref().map(|body| body.cruise_m.get());
        let wing = self.fixed_wing.as_ref().map(|body| body.cruise_m.get());
        let cruise = rotors.or(wing).unwrap_or(0.0) as f32;
        Sensors {
            camera: Camera { up_m: camera.up_m + cruise, ..camera },
            lidar: Lidar { up_m: lidar.up_m + cruise, ..lidar },
        }
    }

    /// True if networks ship that were trained for views from about the place of this platform's camera.
    pub fn is_trained_for(&self) -> bool {
        !self.is_free() || self.has_camera() && self.seen_from().camera == Sensors::ALOFT.camera
    }

    /// True if its body moves without wheels.
    fn is_free(&self) -> bool {
        self.multirotor.is_some() || self.fixed_wing.is_some() || self.satellite.is_some()
    }

    /// True if this platform has a camera that can be rendered.
    pub fn has_camera(&self) -> bool {
        self.satellite.is_none()
    }

    /// The limits of guards and driving as autonomy knows them.
    pub fn limits(&self) -> Limits {
        let aloft = self.aloft.as_ref().map(AloftTable::limits);
        let limits = tables::limits(&self.guards, &self.vehicle);
        let [length, width, _] = self.extent();
        let body_mm = [length, width].map(|edge| (edge * 1000.0).round() as u32);
        // A body without wheels has no axle that it could swing about, and no reverse gear; rotors go back as fast as they turn.
        let free = self.is_free();
        let back = if self.multirotor.is_some() { limits.turning_mm_s } else { 0 };
        let [rear_axle_mm, reverse_mm_s] = if free { [0, back] } else { [limits.rear_axle_mm, limits.reverse_mm_s] };
        let circle_m_s = self.fixed_wing.as_ref().map_or(0.0, |wing| wing.circle_m_s.get());
        let least_speed_mm_s = (circle_m_s * 1000.0).round() as u32;
        Limits { aloft, free, body_mm, rear_axle_mm, reverse_mm_s, least_speed_mm_s, ..limits }
    }
}

/// Declares the table of bounds and its way to `wire::bounds`, which has the same fields.
macro_rules! bounds_table {
    ($( $(#[$doc:meta])* $field:ident : $kind:ty ),* $(,)?) => {
        /// The bounds of a platform; the fields are as in [`Bounds`].
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct BoundsTable {
            $( $(#[$doc])* pub $field: $kind, )*
        }

        impl BoundsTable {
            /// The bounds as the services know them.
            pub fn to_bounds(&self) -> Bounds {
                Bounds { $( $field: self.$field.unsigned() as _, )* }
            }
        }
    };
}

bounds_table! {
    /// *Tf*: a record or reading older than this is stale.
    freshness_ms: Bound,
    /// *Td*: from the loss of a subsystem to DEGRADED.
    to_degraded_ms: Bound,
    /// *Th*: from the loss of trust to HOLD_SAFE.
    to_hold_safe_ms: Bound,
    /// Length of a supervision lease.
    lease_ms: Bound,
    /// Time between grants.
    grant_period_ms: Bound,
    /// Time between telemetry records.
    telemetry_period_ms: Bound,
    /// Time between control steps.
    control_period_ms: Bound,
    /// Age at which a perception product or localisation reading counts as lost.
    product_limit_ms: Bound,
    /// Length of a set-point's lease, enforced by the plant.
    set_point_lease_ms: Bound,
    /// Time between challenges.
    challenge_period_ms: Bound,
    /// Time for which an echo may serve, from the issue of its nonce.
    echo_limit_ms: Bound,
    /// Greatest age of a command's nonce.
    command_limit_ms: Bound,
    /// Lifetime of unused authority.
    authority_ms: Bound,
    /// Time for which guards hold before DEGRADED may end.
    hysteresis_ms: Bound,
    /// Time for which a loss that driving depends on may last before DEGRADED becomes HOLD_SAFE.
    unrecovered_ms: Bound,
    /// Longest time without a seal over the log before authority goes.
    seal_limit_ms: Bound,
    /// P11: farthest that a true object of the class may be from the designated position, millimetres.
    designation_mm: Located<Length>,
    /// Confidence from which a track can be designated, permille.
    designation_confidence: Located<Whole<0, 1_000>>,
    /// Confidence below which a designated track is given up, permille.
    designation_keep: Whole<0, 1_000>,
    /// Least angle between the outermost lines of sight along which a track was borne out before it can be designated, milliradians; 0 asks for none.
    designation_bearings_mrad: Angle,
    /// Time for which a designated track may go without an update.
    track_limit_ms: Bound,
    /// Highest speed, millimetres per second.
    max_speed_mm_s: Length,
    /// Speed while degraded, millimetres per second.
    degraded_speed_mm_s: Located<Length>,
    /// Guaranteed deceleration of the plant, millimetres per second squared.
    braking_mm_s2: Whole<1, 100_000>,
    /// Distance from the fence kept beyond the stopping distance, millimetres.
    fence_margin_mm: Located<Length>,
    /// Two units claimed nearer than this cannot both be there, millimetres.
    exclusion_mm: Located<Length>,
    /// A teammate's claimed displacement may exceed its claimed speed's by this, millimetres.
    teammate_slack_mm: Located<Length>,
    /// Width of the anti-replay window, records.
    replay_window: Whole<1, 64>,
    /// Largest step of a sequence.
    sequence_jump: Whole<1, 1_000_000>,
}

/// Bounds that a scenario tightens; absent ones stay the platform's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tightened {
    /// *Tf*.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub freshness_ms: Option<Bound>,
    /// *Td*.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_degraded_ms: Option<Bound>,
    /// *Th*.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_hold_safe_ms: Option<Bound>,
    /// Length of a supervision lease.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lease_ms: Option<Bound>,
    /// Length of a set-point's lease.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set_point_lease_ms: Option<Bound>,
    /// Angle between two lines of sight to a track that can be designated, milliradians; tighter is wider.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub designation_bearings_mrad: Option<Angle>,
}

impl Tightened {
    /// The bounds that it would loosen, each with its place and the platform's value.
    pub fn loosened<'a>(&'a self, base: &BoundsTable) -> Vec<(&'a Bound, i64)> {
        let pairs = [
            (&self.freshness_ms, &base.freshness_ms),
            (&self.to_degraded_ms, &base.to_degraded_ms),
            (&self.to_hold_safe_ms, &base.to_hold_safe_ms),
            (&self.lease_ms, &base.lease_ms),
            (&self.set_point_lease_ms, &base.set_point_lease_ms),
        ];
        let own_pairs = pairs
            .into_iter()
            .filter_map(|(own_field, base)| own_field.as_ref().map(|own_bound| (own_bound, base.get())));
        own_pairs.filter(|(own_bound, base)| own_bound.get() > *base).collect()
    }

    /// True if no bound is tightened.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The bounds in force: the platform's, where not tightened.
    pub fn applied_to(&self, base: &BoundsTable) -> BoundsTable {
        fn pick<T: Clone>(own_value: &Option<T>, base: &T) -> T {
            own_value.clone().unwrap_or_else(|| base.clone())
        }
        BoundsTable {
            freshness_ms: pick(&self.freshness_ms, &base.freshness_ms),
            to_degraded_ms: pick(&self.to_degraded_ms, &base.to_degraded_ms),
            to_hold_safe_ms: pick(&self.to_hold_safe_ms, &base.to_hold_safe_ms),
            lease_ms: pick(&self.lease_ms, &base.lease_ms),
            set_point_lease_ms: pick(&self.set_point_lease_ms, &base.set_point_lease_ms),
            designation_bearings_mrad: pick(&self.designation_bearings_mrad, &base.designation_bearings_mrad),
            ..base.clone()
        }
    }
}
