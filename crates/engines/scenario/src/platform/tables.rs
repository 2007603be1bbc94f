//! The optional tables of a platform file: vehicle, sensors, limits of guards, safe action. A key that is left out has the ground
//! platform's value.
//!
//! Ranges are held by the types, agreement between values by `check`. The values' meaning is given by `config::platform` and
//! `wire::sensor`.

use config::platform::{Limits, Sensors, Vehicle};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::sensor::{Camera, Lidar};

use super::Length;
use crate::value::{Located, Real, Whole};

/// Declares a table with defaults.
macro_rules! table {
    ($(#[$about:meta])* $name:ident { $( $(#[$doc:meta])* $field:ident : $kind:ty = $default:expr ),* $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            $( $(#[$doc])* pub $field: Located<$kind>, )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $field: Located::nowhere($default), )* }
            }
        }
    };
}

/// Metres of a vehicle.
type Metres = Real<10, 10_000>;
/// Metres from the body's origin.
type Offset = Real<-5_000, 5_000>;
/// Limits in whole units.
type Limit = Whole<1, 20_000>;

table! {
    /// The vehicle: four wheels, the front ones steer.
    VehicleTable {
        /// Mass, kg.
        mass_kg: Real<1_000, 10_000_000> = Real::constant(300.0),
        /// Length, width and height of the chassis, metres.
        chassis_m: [Metres; 3] = [1.6, 0.9, 0.44].map(Real::constant),
        /// Distance between the axles, metres.
        wheelbase_m: Metres = Real::constant(1.2),
        /// Distance between the wheels of an axle, metres.
        track_m: Metres = Real::constant(0.9),
        /// Radius of a wheel, metres.
        wheel_radius_m: Metres = Real::constant(0.3),
        /// Height of the chassis centre above the suspensions' mounts, metres.
        wheel_drop_m: Real<0, 2_000> = Real::constant(0.1),
        /// Length of a suspension without load, metres.
        suspension_m: Metres = Real::constant(0.25),
        /// Spring rate of a wheel by the vehicle's mass, N/m/kg.
        spring_rate: Real<5_000, 300_000> = Real::constant(30.0),
        /// Greatest forward speed, m/s.
        max_speed_m_s: Real<100, 15_000> = Real::constant(3.0),
        /// Greatest reverse speed, m/s.
        max_reverse_m_s: Real<0, 15_000> = Real::constant(1.0),
        /// Greatest acceleration under a set-point, m/s².
        max_acceleration_m_s2: Real<100, 10_000> = Real::constant(1.5),
        /// Deceleration of the brakes on the level, m/s².
        braking_m_s2: Real<500, 10_000> = Real::constant(4.0),
        /// Greatest curvature, 1/m.
        max_curvature_per_m: Real<10, 2_000> = Real::constant(0.4),
        /// Greatest rate of the steering, rad/s.
        steering_rad_s: Real<50, 10_000> = Real::constant(1.5),
    }
}

table! {
    /// The camera of colour, depth and thermal images.
    CameraTable {
        /// Width of an image, pixels; 160, the shipped networks' input.
        width: Whole<1, 4_096> = Whole::constant(160),
        /// Height of an image, pixels; 120, the shipped networks' input.
        height: Whole<1, 4_096> = Whole::constant(120),
        /// Horizontal field of view, degrees; 90, which the shipped networks were trained with.
        field_of_view_deg: Real<1_000, 170_000> = Real::constant(90.0),
        /// Angle of the optical axis below the body's x axis, degrees; 0, which corroboration assumes.
        pitch_deg: Real<-90_000, 90_000> = Real::constant(0.0),
        /// Mounting point ahead of the body's origin, metres.
        forward_m: Offset = Real::constant(1.0),
        /// Mounting height above the body's origin, metres.
        up_m: Real<100, 5_000> = Real::constant(1.2),
    }
}

table! {
    /// The LiDAR.
    LidarTable {
        /// Rings; 16, from which the LiDAR stage's thresholds are derived.
        rings: Whole<1, 256> = Whole::constant(16),
        /// Beams in a ring; 360, from which the same are derived.
        azimuths: Whole<1, 4_096> = Whole::constant(360),
        /// Elevation of the lowest ring, degrees; -15, likewise.
        lowest_deg: Real<-90_000, 90_000> = Real::constant(-15.0),
        /// Elevation from one ring to the next, degrees; 2, likewise.
        ring_step_deg: Real<10, 30_000> = Real::constant(2.0),
        /// Mounting height above the body's origin, metres.
        up_m: Real<100, 5_000> = Real::constant(1.5),
    }
}

table! {
    /// Limits of the unit's guards and of its driving.
    GuardsTable {
        /// *t₀*: time from a decision to the brakes, milliseconds.
        reaction_ms: Whole<1, 1_000> = Whole::constant(150),
        /// Distance between a fix and dead reckoning that wheels and terrain can explain, millimetres.
        fix_gate_mm: Whole<100, 10_000> = Whole::constant(500),
        /// Largest stated deviation of a fix that is believed, millimetres: gate and drift test allow for it.
        fix_sigma_mm: Whole<40, 20_000> = Whole::constant(60),
        /// Difference of heading that the same can explain, milliradians.
        yaw_gate_mrad: Whole<20, 1_000> = Whole::constant(150),
        /// Share of the way by which odometry may be wrong for long, permille.
        odometry_permille: Whole<0, 100> = Whole::constant(10),
        /// The furthest that the unit can get unobserved before it stands, millimetres.
        unobserved_mm: Length = Whole::constant(2_500),
        /// Greatest sideways acceleration in curves, mm/s².
        sideways_mm_s2: Limit = Whole::constant(1_200),
        /// Deceleration that driving plans with, mm/s².
        comfort_mm_s2: Limit = Whole::constant(1_000),
        /// Speed while the way lies behind, mm/s.
        turning_mm_s: Limit = Whole::constant(800),
        /// Lookahead along the way, milliseconds at the present speed.
        lookahead_ms: Whole<100, 5_000> = Whole::constant(900),
        /// Shortest and longest lookahead, millimetres.
        lookahead_mm: [Whole<100, 50_000>; 2] = [1_500, 4_000].map(Whole::constant),
        /// Half of the width that is kept free ahead, millimetres.
        corridor_mm: Limit = Whole::constant(1_200),
        /// Distance kept to an obstacle that is seen ahead, millimetres.
        standoff_mm: Limit = Whole::constant(3_000),
        /// Clearance to the fence guard's margin that driving keeps, millimetres.
        fence_spare_mm: Length = Whole::constant(500),
        /// Clearance of planned ways to the fence beyond its margin and to obstacles, millimetres.
        plan_clearance_mm: Length = Whole::constant(1_500),
    }
}

table! {
    /// What the unit does when it trusts nothing any more.
    SafeTable {
        /// The action.
        action: SafeAction = SafeAction::Stop,
    }
}

/// Action of a unit in HOLD_SAFE.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SafeAction {
    /// Brake to standstill and stay there: what the plant does by itself when a lease ends, and what P3 asks for.
    Stop,
    /// Hold the place for a time, or for as long as the battery lets it, then land there: what the plant does by itself when a lease ends.
    LoiterThenLand,
    /// Shut the payload, keep looking at the place for a time, then turn the array to the sun: what the plant does by itself when a lease ends.
    HoldThenSun,
}

impl VehicleTable {
    /// The vehicle as the simulation knows it.
    pub(super) fn vehicle(&self) -> Vehicle {
        Vehicle {
            mass_kg: self.mass_kg.get() as f32,
            chassis_m: self.chassis_m.map(|edge| edge.get() as f32),
            wheelbase_m: self.wheelbase_m.get() as f32,
            track_m: self.track_m.get() as f32,
            wheel_radius_m: self.wheel_radius_m.get() as f32,
            wheel_drop_m: self.wheel_drop_m.get() as f32,
            suspension_m: self.suspension_m.get() as f32,
            spring_rate: self.spring_rate.get() as f32,
            max_speed_m_s: self.max_speed_m_s.get() as f32,
            max_reverse_m_s: self.max_reverse_m_s.get() as f32,
            max_acceleration_m_s2: self.max_acceleration_m_s2.get() as f32,
            braking_m_s2: self.braking_m_s2.get() as f32,
            max_curvature_per_m: self.max_curvature_per_m.get() as f32,
            steering_rad_s: self.steering_rad_s.get() as f32,
        }
    }
}

/// The sensors as simulation and perception know them. Their geometry is the shipped one, which `check` holds; their places are the file's.
pub(super) fn sensors(camera: &CameraTable, lidar: &LidarTable) -> Sensors {
    Sensors {
        camera: Camera { forward_m: camera.forward_m.get() as f32, up_m: camera.up_m.get() as f32, ..Camera::GROUND },
        lidar: Lidar { up_m: lidar.up_m.get() as f32, ..Lidar::GROUND },
    }
}

/// The limits as autonomy knows them; three follow from the vehicle.
pub(super) fn limits(guards: &GuardsTable, vehicle: &VehicleTable) -> Limits {
    let thousandths = |value: f64| (value * 1000.0).round() as u32;
    Limits {
        reaction_ms: guards.reaction_ms.unsigned() as u32,
        fix_gate_mm: guards.fix_gate_mm.unsigned() as u32,
        fix_sigma_mm: guards.fix_sigma_mm.unsigned() as u32,
        yaw_gate_mrad: guards.yaw_gate_mrad.unsigned() as u32,
        odometry_permille: guards.odometry_permille.unsigned() as u32,
        unobserved_mm: guards.unobserved_mm.unsigned() as u32,
        rear_axle_mm: thousandths(vehicle.wheelbase_m.get() / 2.0),
        curvature_per_km: thousandths(vehicle.max_curvature_per_m.get()),
        sideways_mm_s2: guards.sideways_mm_s2.unsigned() as u32,
        comfort_mm_s2: guards.comfort_mm_s2.unsigned() as u32,
        turning_mm_s: guards.turning_mm_s.unsigned() as u32,
        reverse_mm_s: thousandths(vehicle.max_reverse_m_s.get()),
        least_speed_mm_s: 0,
        lookahead_ms: guards.lookahead_ms.unsigned() as u32,
        lookahead_mm: guards.lookahead_mm.map(|far| far.unsigned() as u32),
        body_mm: Limits::GROUND.body_mm,
        corridor_mm: guards.corridor_mm.unsigned() as u32,
        standoff_mm: guards.standoff_mm.unsigned() as u32,
        fence_spare_mm: guards.fence_spare_mm.unsigned() as u32,
        plan_clearance_mm: guards.plan_clearance_mm.unsigned() as u32,
        free: false,
        aloft: None,
    }
}
