//! The body of a platform and the limits of its guards: numbers of a platform file beside its bounds.
//!
//! A file of `platforms/` states them, and the launcher hands each core the part that it needs: the vehicle to `sim`,
//! the sensors' mounting to `sim` and `perception`, the limits to `autonomy`. Ranges and the numbers' agreement with
//! each other and with [`wire::bounds::Bounds`] are checked where the file is read (`docs/reference/platforms.md`).

use serde::{Deserialize, Serialize};
use spacecraft::orbit::Elements;
use spacecraft::region::Pass;
use wire::time::Span;

use wire::sensor::{Camera, Lidar};

/// The longest lease of a set-point that a plant honours, counted from arrival.
pub const MAX_LEASE: Span = Span::ms(1000);

/// A platform's body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "a run has one of them, which is copied where it begins")]
pub enum Body {
    /// A vehicle on wheels.
    Wheeled(Vehicle),
    /// An aircraft on four rotors.
    Multirotor(Multirotor),
    /// An aircraft on a fixed wing.
    FixedWing(FixedWing),
    /// A satellite in an orbit.
    Satellite(Satellite),
}

impl Default for Body {
    /// The vehicle of `platforms/ground.toml`.
    fn default() -> Self {
        Body::Wheeled(Vehicle::GROUND)
    }
}

/// A body on four rotors in X, with the loops of a flight controller. Body frame: x forward, y left, z up, origin in
/// the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Multirotor {
    /// Mass, kg.
    pub mass_kg: f32,
    /// Moments of inertia about x, y and z, kg·m².
    pub inertia_kg_m2: [f32; 3],
    /// Length, width and height of the body, metres.
    pub body_m: [f32; 3],
    /// Lever of each rotor about x and about y, metres.
    pub arm_m: f32,
    /// Greatest thrust of a rotor, N.
    pub thrust_n: f32,
    /// Greatest torque of a rotor about z, N·m.
    pub torque_n_m: f32,
    /// Time constant of a rotor, seconds.
    pub rotor_s: f32,
    /// Drag by airspeed, N·s/m.
    pub drag_n_s_m: f32,
    /// Drag by rate of turn, N·m·s.
    pub spin_drag_n_m_s: f32,
    /// Greatest horizontal speed of a set-point, m/s.
    pub max_speed_m_s: f32,
    /// Greatest climb and descent of a set-point, m/s.
    pub max_climb_m_s: f32,
    /// Greatest turn of a set-point, rad/s.
    pub max_turn_rad_s: f32,
    /// Acceleration and braking of the velocity that the controller follows, m/s².
    pub acceleration_m_s2: [f32; 2],
    /// Greatest tilt, degrees.
    pub tilt_deg: f32,
    /// Capacity of the battery, W·h.
    pub battery_w_h: f32,
    /// Power in a hover, and power of everything but the rotors, W.
    pub power_w: [f32; 2],
    /// Height at which a run begins, metres above the ground.
    pub cruise_m: f32,
    /// Time for which it holds its place without a lead, seconds; then it lands.
    pub loiter_s: f32,
    /// Speed of that descent, m/s.
    pub descent_m_s: f32,
    /// Greatest horizontal speed of its safe motion, m/s: the effect of a gust on a body that holds its place.
    pub drift_m_s: f32,
    /// Least height above the surface below while it is led, metres.
    pub clearance_m: f32,
    /// Greatest height above the world's origin, metres.
    pub ceiling_m: f32,
}

impl Multirotor {
    /// The body of `platforms/air.toml`; a test holds the two equal. Mass, inertia, lever, thrust, torque, lag and
    /// drags are those of the quadrotor of PX4's SIH (`sih_params.c`); the rest is assumed, with its reason in the
    /// file.
    pub const SIH: Multirotor = Multirotor {
        mass_kg: 1.0,
        inertia_kg_m2: [0.025, 0.025, 0.030],
        body_m: [0.5, 0.5, 0.2],
        arm_m: 0.2,
        thrust_n: 5.0,
        torque_n_m: 0.1,
        rotor_s: 0.05,
        drag_n_s_m: 1.0,
        spin_drag_n_m_s: 0.025,
        max_speed_m_s: 3.0,
        max_climb_m_s: 1.0,
        max_turn_rad_s: 1.2,
        acceleration_m_s2: [1.5, 2.5],
        tilt_deg: 30.0,
        battery_w_h: 40.0,
        power_w: [150.0, 10.0],
        cruise_m: 3.0,
        loiter_s: 20.0,
        descent_m_s: 0.5,
        drift_m_s: 0.5,
        clearance_m: 1.0,
        ceiling_m: 6.0,
    };
}

/// A body on a fixed wing, with an autopilot for airspeed, bank and climb. Body frame: x forward, y left, z up, origin
/// in the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedWing {
    /// Mass, kg.
    pub mass_kg: f32,
    /// Length, span and height of the body, metres.
    pub body_m: [f32; 3],
    /// Least airspeed, m/s.
    pub min_speed_m_s: f32,
    /// Greatest airspeed of a set-point, m/s.
    pub max_speed_m_s: f32,
    /// Greatest climb and descent of a set-point, m/s.
    pub max_climb_m_s: f32,
    /// Greatest turn of a set-point, rad/s.
    pub max_turn_rad_s: f32,
    /// Increase and decrease of the airspeed, m/s².
    pub acceleration_m_s2: [f32; 2],
    /// Greatest bank, degrees.
    pub bank_deg: f32,
    /// Natural frequency, rad/s, and damping ratio of the bank.
    pub roll: [f32; 2],
    /// Time constant of the climb, seconds.
    pub climb_s: f32,
    /// Capacity of the battery, W·h.
    pub battery_w_h: f32,
    /// Power in flight, and power on the ground, W.
    pub power_w: [f32; 2],
    /// Height at which a run begins, metres above the ground.
    pub cruise_m: f32,
    /// Airspeed on the circle of its safe motion, m/s.
    pub circle_m_s: f32,
    /// Bank on that circle, degrees.
    pub circle_bank_deg: f32,
    /// Time for which it circles without a lead, seconds; then it lands.
    pub circle_s: f32,
    /// Largest horizontal distance from the place where a circle began, metres.
    pub stays_m: f32,
    /// Speed of the descent, m/s.
    pub descent_m_s: f32,
    /// Speed of the wind that its safe motion allows for, m/s.
    pub drift_m_s: f32,
    /// Least height above the surface below while it is led, metres.
    pub clearance_m: f32,
    /// Greatest height above the world's origin, metres.
    pub ceiling_m: f32,
}

impl FixedWing {
    /// The body of `platforms/wing.toml`; a test holds the two equal.
    pub const SLOW_FLYER: FixedWing = FixedWing {
        mass_kg: 0.06,
        body_m: [0.85, 0.85, 0.2],
        min_speed_m_s: 1.5,
        max_speed_m_s: 3.0,
        max_climb_m_s: 1.0,
        max_turn_rad_s: 1.2,
        acceleration_m_s2: [1.5, 2.5],
        bank_deg: 45.0,
        roll: [8.0, 0.9],
        climb_s: 0.3,
        battery_w_h: 2.2,
        power_w: [4.0, 0.5],
        cruise_m: 3.0,
        circle_m_s: 2.0,
        circle_bank_deg: 13.5,
        circle_s: 60.0,
        stays_m: 5.5,
        descent_m_s: 0.5,
        drift_m_s: 0.5,
        clearance_m: 1.0,
        ceiling_m: 6.0,
    };
}

/// A small satellite on three wheels, pointed at places of a region that it passes over. Body frame: principal axes, +z
/// the payload's line of sight, the solar array on the other side. Speeds apply to the point that the payload looks at,
/// in units of the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Satellite {
    /// Moments of inertia about x, y and z, kg·m².
    pub inertia_kg_m2: [f64; 3],
    /// Greatest torque of a wheel, N·m.
    pub wheel_torque_n_m: f64,
    /// Greatest momentum of a wheel, N·m·s.
    pub wheel_momentum_n_m_s: f64,
    /// Greatest dipole of a magnetic torquer, A·m².
    pub torquer_a_m2: f64,
    /// Natural frequency, rad/s, and damping ratio of the attitude controller.
    pub controller: [f64; 2],
    /// Greatest speed of a set-point, m/s of the map.
    pub max_speed_m_s: f64,
    /// Greatest turn of a set-point, rad/s.
    pub max_turn_rad_s: f64,
    /// Acceleration and braking of the speed that the controller follows, m/s² of the map.
    pub acceleration_m_s2: [f64; 2],
    /// Rate and acceleration of a slew to the sun, rad/s and rad/s².
    pub slew: [f64; 2],
    /// Greatest rate of the safe motion, rad/s.
    pub safe_rate_rad_s: f64,
    /// Time for which the payload, shut, keeps looking at its place without a lead, seconds; then the satellite turns
    /// its array to the sun.
    pub hold_s: f64,
    /// Least angle between the open payload's line of sight and the sun, degrees.
    pub keep_out_deg: f64,
    /// Battery: capacity, W·h; charge at the start of a run; least charge that the safe mode needs. Charges are shares
    /// of the capacity.
    pub battery: [f64; 3],
    /// Power of the array at normal incidence, and of the loads, W.
    pub power_w: [f64; 2],
    /// Lines of the orbit's elements.
    pub elements: [Line; 2],
    /// Start of a run after the elements' epoch, and the time after that at which the satellite is overhead, seconds.
    pub start_overhead_s: [f64; 2],
    /// Metres on the ground for each unit of the map.
    pub scale_m: f64,
    /// Distance from the line of sight to a catalogued place that is still in view, m of the map.
    pub view_m: f64,
}

impl Satellite {
    /// The pass that the numbers state, as simulation and flight software know it.
    pub fn pass(&self) -> Pass {
        let [one, two] = self.elements.map(String::from);
        let [start_s, overhead_s] = self.start_overhead_s;
        Pass { elements: Elements::new(&one, &two), start_s, overhead_s, scale_m: self.scale_m }
    }
}

/// Length of a line of orbital elements.
const LINE: usize = 69;

/// A line of orbital elements: 69 characters of ASCII.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Line([u8; LINE]);

impl Line {
    /// The line as text.
    pub fn as_str(&self) -> &str {
        core::str::from_utf8(&self.0).unwrap_or_default()
    }
}

impl TryFrom<String> for Line {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let line = <[u8; LINE]>::try_from(text.as_bytes()).map_err(|_| "69 characters expected")?;
        if line.is_ascii() { Ok(Line(line)) } else { Err("ASCII expected") }
    }
}

impl From<Line> for String {
    fn from(line: Line) -> Self {
        line.as_str().to_owned()
    }
}

/// Limits of the guards of a body that flies, beside [`Limits`]. Heights are above the world's origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aloft {
    /// Height that is flown at, millimetres.
    pub cruise_mm: u32,
    /// Lowest and highest height of the envelope, millimetres.
    pub floor_ceiling_mm: [u32; 2],
    /// Greatest climb and descent that is asked for, mm/s.
    pub climb_mm_s: u32,
    /// Distance between two sources of height, or between one and dead reckoning, that their errors can explain,
    /// millimetres.
    pub height_gate_mm: u32,
    /// Room that set-points leave below the largest speed, for the part that gusts add, mm/s.
    #[serde(default)]
    pub gust_spare_mm_s: u32,
}

/// A four-wheeled vehicle whose front wheels steer. Body frame: x forward, y left, z up, origin on the ground under the
/// chassis centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Mass, kg.
    pub mass_kg: f32,
    /// Length, width and height of the chassis, metres.
    pub chassis_m: [f32; 3],
    /// Distance between the axles, metres.
    pub wheelbase_m: f32,
    /// Distance between the wheels of an axle, metres.
    pub track_m: f32,
    /// Radius of a wheel, metres.
    pub wheel_radius_m: f32,
    /// Height of the chassis centre above the suspensions' mounts, metres.
    pub wheel_drop_m: f32,
    /// Length of a suspension without load, metres.
    pub suspension_m: f32,
    /// Spring rate of a wheel by the vehicle's mass, N/m/kg; with four wheels the chassis sags g / (4 · rate).
    pub spring_rate: f32,
    /// Greatest forward speed, m/s; set-points beyond are clamped.
    pub max_speed_m_s: f32,
    /// Greatest reverse speed, m/s.
    pub max_reverse_m_s: f32,
    /// Greatest acceleration under a set-point, m/s².
    pub max_acceleration_m_s2: f32,
    /// Deceleration of the brakes on the level, m/s².
    pub braking_m_s2: f32,
    /// Greatest curvature, 1/m.
    pub max_curvature_per_m: f32,
    /// Greatest rate of the steering, rad/s.
    pub steering_rad_s: f32,
}

impl Vehicle {
    /// The body of `platforms/ground.toml`; a test holds the two equal.
    pub const GROUND: Vehicle = Vehicle {
        mass_kg: 300.0,
        chassis_m: [1.6, 0.9, 0.44],
        wheelbase_m: 1.2,
        track_m: 0.9,
        wheel_radius_m: 0.3,
        wheel_drop_m: 0.1,
        suspension_m: 0.25,
        spring_rate: 30.0,
        max_speed_m_s: 3.0,
        max_reverse_m_s: 1.0,
        max_acceleration_m_s2: 1.5,
        braking_m_s2: 4.0,
        max_curvature_per_m: 0.4,
        steering_rad_s: 1.5,
    };

    /// Way by which the springs give under the vehicle's weight, metres.
    pub fn sag_m(&self) -> f32 {
        9.81 / (4.0 * self.spring_rate)
    }

    /// Height of the chassis centre above the ground at rest, metres.
    pub fn ride_height_m(&self) -> f32 {
        self.wheel_drop_m + self.suspension_m - self.sag_m() + self.wheel_radius_m
    }
}

impl Default for Vehicle {
    /// The vehicle of `platforms/ground.toml`.
    fn default() -> Self {
        Self::GROUND
    }
}

/// Camera and LiDAR with their places on the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Camera of colour, depth and thermal images.
    pub camera: Camera,
    /// Beams and mounting of the LiDAR.
    pub lidar: Lidar,
}

impl Sensors {
    /// Sensors of `platforms/ground.toml`; a test holds the two equal.
    pub const GROUND: Sensors = Sensors { camera: Camera::GROUND, lidar: Lidar::GROUND };
    /// Sensors of `platforms/air.toml` as seen from the ground below its cruise; a test holds the two equal.
    pub const ALOFT: Sensors = Sensors {
        camera: Camera { forward_m: 0.2, up_m: 3.1, ..Camera::GROUND },
        lidar: Lidar { up_m: 3.15, ..Lidar::GROUND },
    };

    /// Sensors among the two for which networks are trained that look from about as high as `camera`.
    pub fn trained_like(camera: &Camera) -> &'static Sensors {
        let middle = (Self::GROUND.camera.up_m + Self::ALOFT.camera.up_m) / 2.0;
        if camera.up_m < middle { &Self::GROUND } else { &Self::ALOFT }
    }
}

impl Default for Sensors {
    /// Sensors of `platforms/ground.toml`.
    fn default() -> Self {
        Self::GROUND
    }
}

/// Limits of a unit's guards and of its driving that follow from its vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// *t₀*: time from a decision to the brakes, milliseconds: a navigation period, a control period, the plant's own.
    pub reaction_ms: u32,
    /// Distance between a fix and dead reckoning that wheels and terrain can explain, millimetres.
    pub fix_gate_mm: u32,
    /// Largest stated deviation of a fix that is believed, millimetres.
    pub fix_sigma_mm: u32,
    /// Difference of heading that the same can explain, milliradians.
    pub yaw_gate_mrad: u32,
    /// Share of the way by which odometry may be wrong for long, permille: slopes, slip, wear of the tyres.
    pub odometry_permille: u32,
    /// The furthest that the unit can get unobserved before its set-points lapse and it stands, millimetres.
    pub unobserved_mm: u32,
    /// Distance of the rear axle behind the body's origin, millimetres: half of the wheelbase. Wheels that do not steer
    /// do not slide, so in a curve the origin moves sideways by this times the rate of turn.
    pub rear_axle_mm: u32,
    /// Greatest curvature that is asked of the plant, 1/km.
    pub curvature_per_km: u32,
    /// Greatest sideways acceleration in curves, mm/s².
    pub sideways_mm_s2: u32,
    /// Deceleration that driving plans with, mm/s².
    pub comfort_mm_s2: u32,
    /// Speed while the way lies behind, mm/s.
    pub turning_mm_s: u32,
    /// Greatest speed backwards, mm/s; 0 for a body that does not drive backwards.
    #[serde(default)]
    pub reverse_mm_s: u32,
    /// Speed below which the body cannot wait in the air, mm/s; 0 for a body that can stand or hover.
    #[serde(default)]
    pub least_speed_mm_s: u32,
    /// Lookahead along the way: the distance that is covered in this time, milliseconds.
    pub lookahead_ms: u32,
    /// Shortest and longest lookahead, millimetres.
    pub lookahead_mm: [u32; 2],
    /// Length and width of the body, millimetres.
    pub body_mm: [u32; 2],
    /// Half of the width that is kept free ahead, millimetres.
    pub corridor_mm: u32,
    /// Distance kept to an obstacle that is seen in the corridor, millimetres.
    pub standoff_mm: u32,
    /// Clearance that driving keeps beyond the fence guard's margin, so that driving does not trip the guard,
    /// millimetres.
    pub fence_spare_mm: u32,
    /// Clearance of planned ways to the fence beyond its margin, and to obstacles on the map, millimetres.
    pub plan_clearance_mm: u32,
    /// Set-points are velocities, and rest is a motion of the body's own.
    #[serde(default)]
    pub free: bool,
    /// Values of a body that flies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aloft: Option<Aloft>,
}

impl Limits {
    /// Limits of `platforms/ground.toml`; a test holds the two equal.
    pub const GROUND: Limits = Limits {
        reaction_ms: 150,
        fix_gate_mm: 500,
        fix_sigma_mm: 60,
        yaw_gate_mrad: 150,
        odometry_permille: 10,
        unobserved_mm: 2500,
        rear_axle_mm: 600,
        curvature_per_km: 400,
        sideways_mm_s2: 1200,
        comfort_mm_s2: 1000,
        turning_mm_s: 800,
        reverse_mm_s: 1000,
        least_speed_mm_s: 0,
        lookahead_ms: 900,
        lookahead_mm: [1500, 4000],
        body_mm: [1600, 900],
        corridor_mm: 1200,
        standoff_mm: 3000,
        fence_spare_mm: 500,
        plan_clearance_mm: 1500,
        free: false,
        aloft: None,
    };

    /// *t₀* in seconds.
    pub fn reaction_s(&self) -> f64 {
        f64::from(self.reaction_ms) / 1000.0
    }

    /// Greatest curvature, 1/mm.
    pub fn curvature_per_mm(&self) -> f64 {
        f64::from(self.curvature_per_km) / 1e6
    }
}

impl Default for Limits {
    /// Limits of `platforms/ground.toml`.
    fn default() -> Self {
        Self::GROUND
    }
}
