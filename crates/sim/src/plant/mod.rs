//! The plant: a body in the world that follows leased set-points, and the contract that every kind of body fulfils.
//!
//! The lease is the same for all: a set-point is followed only until its lease ends on the plant's own clock; then the
//! body changes to its safe motion by itself, and the plant reports it once. No message is needed for that. A kind of
//! body ([`Moves`]) gives the motions that it is able to, the way it is driven, its state, and its own terms of safety,
//! if these are not to stand still. `wheeled`, `multirotor`, `fixed_wing` and `satellite` are such.

mod air;
mod airframe;
mod fixed_wing;
#[cfg(test)]
mod flown;
mod multirotor;
mod satellite;
mod wheeled;

use config::platform::MAX_LEASE;
use std::collections::BTreeMap;

use config::platform::{Body, Vehicle};
use rapier3d::prelude::*;
use spacecraft::region::Sky;
use wire::drive;
use wire::id::ObjectId;
use wire::time::Instant;

use crate::fidelity::Fidelity;
use crate::limits::SceneError;
use crate::scene::StartPose;
use crate::world::World;

use air::Air;
use fixed_wing::FixedWing;
use multirotor::Multirotor;
use satellite::Satellite;
use wheeled::Wheeled;

/// Below this speed, m/s, a body counts as standing.
pub const STANDSTILL: f32 = 0.05;

/// Motion that a body is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyMotion {
    /// Motion of a body that steers.
    Course {
        /// Forward speed, m/s.
        speed: f32,
        /// Curvature, 1/m, positive to the left.
        curvature: f32,
    },
    /// Motion of a body that moves freely, in the level frame: x along its heading, y left, z up.
    Velocity {
        /// Along x, y and z, m/s.
        along: [f32; 3],
        /// Turn about z, rad/s, counter-clockwise.
        turn: f32,
    },
    /// The body's safe motion.
    Rest,
}

impl BodyMotion {
    /// Horizontal speed, m/s, signed where it has its own direction.
    pub fn speed(&self) -> f32 {
        match self {
            BodyMotion::Course { speed, .. } => *speed,
            BodyMotion::Velocity { along: [x, y, _], .. } => (x * x + y * y).sqrt(),
            BodyMotion::Rest => 0.0,
        }
    }
}

impl From<drive::SetPoint> for BodyMotion {
    fn from(requested: drive::SetPoint) -> Self {
        match requested {
            drive::SetPoint::Course { speed_mm_s, curvature_um } => {
                BodyMotion::Course { speed: speed_mm_s as f32 / 1e3, curvature: curvature_um as f32 / 1e6 }
            }
            drive::SetPoint::Velocity { mm_s, turn_mrad_s } => {
                BodyMotion::Velocity { along: mm_s.map(|mm| mm as f32 / 1e3), turn: turn_mrad_s as f32 / 1e3 }
            }
            drive::SetPoint::Rest => BodyMotion::Rest,
        }
    }
}

/// Set-point of the plant, with its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPoint {
    /// Motion that is asked for.
    pub motion: BodyMotion,
    /// End of the lease, on the plant's clock.
    pub until: Instant,
}

impl SetPoint {
    /// To go at `speed` (m/s) along a `curvature` (1/m).
    pub fn course((speed, curvature): (f32, f32), until: Instant) -> Self {
        SetPoint { motion: BodyMotion::Course { speed, curvature }, until }
    }
}

/// The body in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Body origin, world frame, metres.
    pub position: Vector,
    /// Body to world; the level frame's where the sensors hang level in a body that tilts.
    pub rotation: Rotation,
    /// Velocity of the body, world frame, m/s.
    pub velocity: Vector,
    /// Rate of turn about body z, rad/s.
    pub yaw_rate: f32,
}

impl State {
    /// Heading, radians counter-clockwise from east, in (−π, π].
    pub fn yaw(&self) -> f32 {
        let ahead = self.rotation * Vector::X;
        libm::atan2f(ahead.y, ahead.x)
    }

    /// Speed along the body's x axis, m/s.
    pub fn speed(&self) -> f32 {
        self.velocity.dot(self.rotation * Vector::X)
    }

    /// A point of the body frame in the world frame.
    pub fn to_world(&self, body: Vector) -> Vector {
        self.position + self.rotation * body
    }

    /// A point of the world frame in the body frame.
    pub fn to_body(&self, world: Vector) -> Vector {
        self.rotation.inverse() * (world - self.position)
    }
}

/// Margins of a body to its own terms of safety: in parts of each limit, negative beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyMargins {
    /// Margin of the body's motion to its safe set.
    pub safe: f32,
    /// Margin of the requested motion to that set.
    pub asked: f32,
    /// Stored energy, beyond the reserve that the way to safety takes.
    pub energy: f32,
    /// Distance to the surface below, beyond the least.
    pub clearance: f32,
}

/// Motion of a body that leaves the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Body to world.
    pub attitude: Rotation,
    /// Rates about the body's axes, rad/s.
    pub rates: Vector,
    /// East, north and up, metres.
    pub place: [f64; 3],
    /// Along the same axes, m/s.
    pub velocity: [f64; 3],
    /// True if the unit has a place on the map: a payload that is turned away looks at none.
    pub placed: bool,
    /// Distance to the surface below, metres, where a range finder reaches it.
    pub below: Option<f32>,
    /// Charge of the battery, 0 to 1.
    pub charge: f32,
}

/// Contract of a kind of body.
trait Moves {
    /// The motion within its limits; `None` in the terms of another kind.
    fn able(&self, requested: BodyMotion) -> Option<BodyMotion>;
    /// Drives it for one step of the world; [`BodyMotion::Rest`] is its safe motion.
    fn push(&mut self, motion: BodyMotion, world: &mut World);
    /// Place and motion.
    fn state(&self, world: &World) -> State;
    /// The body that carries the sensors.
    fn body(&self) -> RigidBodyHandle;
    /// Collider of the body.
    fn shell(&self) -> ColliderHandle;
    /// Motion of one that leaves the ground.
    fn flight(&self, _world: &World) -> Option<Flight> {
        None
    }
    /// Margins to the body's own terms of safety under the requested motion; none where safety is to stand still.
    fn safety_margins(&self, _asked: BodyMotion, _world: &World) -> Option<SafetyMargins> {
        None
    }
    /// Distance that is left to the envelope, metres, of which `fence` is left to the fence.
    fn margin(&self, _world: &World, fence: f32) -> f32 {
        fence
    }
    /// Attitude (body to the inertial frame) and the references of attitude sensors, of a body that looks at stars.
    fn sky(&self) -> Option<([f64; 4], Sky)> {
        None
    }
}

/// A body under leased set-points.
#[derive(Clone)]
pub struct Plant {
    kind: Kind,
    set_point: Option<SetPoint>,
}

#[derive(Clone)]
enum Kind {
    Wheeled(Box<Wheeled>),
    Multirotor(Box<Multirotor>),
    FixedWing(Box<FixedWing>),
    Satellite(Box<Satellite>),
}

impl Plant {
    /// Puts a wheeled vehicle into `world`, standing; as heavy and with as much grip as `fidelity` says.
    pub fn new(world: &mut World, start: &StartPose, vehicle: &Vehicle, fidelity: &Fidelity) -> Self {
        let kind = Kind::Wheeled(Box::new(Wheeled::new(world, start, vehicle, fidelity)));
        Plant { kind, set_point: None }
    }

    /// Puts a platform's body into `world`; `seed` seeds the gusts.
    ///
    /// # Errors
    /// Orbital elements that describe no orbit.
    pub fn from_body(
        world: &mut World,
        start: &StartPose,
        body: &Body,
        fidelity: &Fidelity,
        seed: u64,
    ) -> Result<Self, SceneError> {
        let kind = match body {
            Body::Wheeled(vehicle) => return Ok(Plant::new(world, start, vehicle, fidelity)),
            Body::Multirotor(numbers) => {
                let air = Air::new(world.scene().wind, seed);
                Kind::Multirotor(Box::new(Multirotor::new(world, start, numbers, fidelity.load, air)))
            }
            Body::FixedWing(numbers) => {
                let air = Air::new(world.scene().wind, seed);
                Kind::FixedWing(Box::new(FixedWing::new(world, start, numbers, fidelity.load, air)))
            }
            Body::Satellite(numbers) => {
                let made = Satellite::new(world, start, numbers).map_err(|_| SceneError::Orbit)?;
                Kind::Satellite(Box::new(made))
            }
        };
        Ok(Plant { kind, set_point: None })
    }

    /// Takes a new set-point in place of the last, its motion clamped to the body's limits and its lease to
    /// [`MAX_LEASE`] from `now`. False, and the last one kept, where it is in the terms of another kind of body.
    pub fn accept(&mut self, now: Instant, requested: SetPoint) -> bool {
        let able = self.moves().able(requested.motion);
        // A sender that states a longer lease, or a stamp ahead, must not keep a dead autonomy's set-point in force.
        let until = requested.until.min(now + MAX_LEASE);
        self.set_point = able.map(|motion| SetPoint { motion, until }).or(self.set_point);
        able.is_some()
    }

    /// The set-point under a valid lease.
    pub fn set_point(&self) -> Option<SetPoint> {
        self.set_point
    }

    /// Drives for the step that ends at `now`, then steps the world. Gives the set-point of a lease that has just
    /// ended.
    pub fn step(&mut self, now: Instant, world: &mut World) -> Option<SetPoint> {
        // Before the body is driven: no step follows a set-point with an expired lease.
        let lapsed = self.set_point.take_if(|s| s.until <= now);
        let motion = self.requested_motion();
        self.moves_mut().push(motion, world);
        world.step();
        lapsed
    }

    /// The body that carries the sensors, for [`World::view`].
    pub fn body(&self) -> RigidBodyHandle {
        self.moves().body()
    }

    /// The objects that the body touches, with the direction from it to each, unit vectors of the world frame.
    pub fn touches(&self, world: &World) -> BTreeMap<ObjectId, Vector> {
        world.touching(self.moves().shell())
    }

    /// Place and motion of the body.
    pub fn state(&self, world: &World) -> State {
        self.moves().state(world)
    }

    /// Motion of a body that leaves the ground.
    pub fn flight(&self, world: &World) -> Option<Flight> {
        self.moves().flight(world)
    }

    /// Attitude (body to the inertial frame) and the references of attitude sensors, of a body that looks at stars.
    pub fn sky(&self) -> Option<([f64; 4], Sky)> {
        self.moves().sky()
    }

    /// Margins to the body's own terms of safety; none where safety is to stand still.
    pub fn safety_margins(&self, world: &World) -> Option<SafetyMargins> {
        self.moves().safety_margins(self.requested_motion(), world)
    }

    /// Distance that is left to the envelope, metres; negative outside: the fence, and the limits of height.
    pub fn margin(&self, world: &World) -> f32 {
        let State { position, .. } = self.state(world);
        self.moves().margin(world, world.scene().margin([position.x, position.y]))
    }

    fn requested_motion(&self) -> BodyMotion {
        self.set_point.map_or(BodyMotion::Rest, |s| s.motion)
    }

    fn moves(&self) -> &dyn Moves {
        match &self.kind {
            Kind::Wheeled(body) => &**body,
            Kind::Multirotor(body) => &**body,
            Kind::FixedWing(body) => &**body,
            Kind::Satellite(body) => &**body,
        }
    }

    fn moves_mut(&mut self) -> &mut dyn Moves {
        match &mut self.kind {
            Kind::Wheeled(body) => &mut **body,
            Kind::Multirotor(body) => &mut **body,
            Kind::FixedWing(body) => &mut **body,
            Kind::Satellite(body) => &mut **body,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use wire::time::Span;

    use super::*;
    use crate::scene::Scene;

    fn drive(plant: &mut Plant, world: &mut World, from: u64, steps: u64, ask: Option<(f32, f32)>) -> Vec<Instant> {
        let mut lapses = Vec::new();
        for k in from + 1..=from + steps {
            let now = Instant(k * 10_000);
            if let Some((speed, curvature)) = ask {
                plant.accept(now, SetPoint::course((speed, curvature), now + Span::ms(300)));
            }
            lapses.extend(plant.step(now, world).map(|_| now));
        }
        lapses
    }

    #[test]
    fn vehicle_follows_set_points_and_brakes_without_lease() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        let mut world = World::new(Arc::new(scene.clone()));
        let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
        drive(&mut plant, &mut world, 0, 100, None);
        let parked = plant.state(&world);
        assert!(parked.speed().abs() < STANDSTILL, "{parked:?}");
        assert!((parked.position.z - world.terrain().height(-10.0, -5.0)).abs() < 0.1, "{parked:?}");

        drive(&mut plant, &mut world, 100, 400, Some((2.0, 0.1)));
        let moving = plant.state(&world);
        assert!((moving.speed() - 2.0).abs() < 0.15, "{moving:?}");
        assert!((moving.yaw_rate - 0.2).abs() < 0.04, "{moving:?}");

        let lapses = drive(&mut plant, &mut world, 500, 200, None);
        assert_eq!(lapses, [Instant(5_300_000)]);
        assert!(plant.state(&world).speed().abs() < STANDSTILL);
    }

    /// However slowly or backwards it went.
    #[test]
    fn lease_end_stops_the_vehicle() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        for speed in [3.0, 1.0, 0.49, 0.3, 0.1, 0.06, -0.06, -0.4, -1.0] {
            let mut world = World::new(Arc::new(scene.clone()));
            let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
            drive(&mut plant, &mut world, 0, 400, Some((speed, 0.0)));
            let travelled = plant.state(&world).speed();
            assert!((travelled - speed).abs() < 0.15, "{speed}: {travelled}");
            assert_eq!(drive(&mut plant, &mut world, 400, 29, None), [], "{speed}: before its end");
            assert!(plant.set_point().is_some(), "{speed}");
            assert_eq!(drive(&mut plant, &mut world, 429, 1, None), [Instant(4_300_000)], "{speed}");
            assert_eq!(plant.set_point(), None, "{speed}");
            drive(&mut plant, &mut world, 430, 120, None);
            let stood = plant.state(&world).position;
            drive(&mut plant, &mut world, 550, 100, None);
            let moved = (plant.state(&world).position - stood).length();
            assert!(moved < 0.01, "{speed}: {moved} m in a second without a lease");
        }
    }

    /// A body that rocks on its springs after a stop does not move over the ground.
    #[test]
    fn speed_is_that_of_the_place() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        let mut world = World::new(Arc::new(scene.clone()));
        let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
        drive(&mut plant, &mut world, 0, 400, Some((3.0, 0.0)));
        for k in 400..600 {
            let before = plant.state(&world);
            drive(&mut plant, &mut world, k, 1, None);
            let after = plant.state(&world);
            let displaced = (after.position - before.position).dot(after.rotation * Vector::X) / 0.01;
            let told = (before.speed() + after.speed()) / 2.0;
            assert!((displaced - told).abs() < 0.05, "step {k}: {displaced} m/s by the place, {told} m/s told");
        }
    }

    #[test]
    fn lease_is_bounded_by_the_plant() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        for speed in [2.0, 0.2] {
            let mut world = World::new(Arc::new(scene.clone()));
            let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
            plant.accept(Instant(0), SetPoint::course((speed, 0.0), Instant(60_000_000)));
            let lapses = drive(&mut plant, &mut world, 0, 200, None);
            assert_eq!(lapses, [Instant(0) + MAX_LEASE], "{speed}");
        }
    }

    /// A light one with small wheels: it stands on them, keeps to its own limits, and stops by itself.
    #[test]
    fn another_vehicle_keeps_to_its_own_limits() {
        let vehicle = Vehicle {
            mass_kg: 27.0,
            chassis_m: [0.7, 0.55, 0.4],
            wheelbase_m: 0.5,
            track_m: 0.5,
            wheel_radius_m: 0.1,
            suspension_m: 0.2,
            spring_rate: 49.0,
            max_speed_m_s: 1.8,
            braking_m_s2: 3.0,
            max_curvature_per_m: 1.0,
            ..Vehicle::GROUND
        };
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        let mut world = World::new(Arc::new(scene.clone()));
        let mut plant = Plant::new(&mut world, &scene.start, &vehicle, &Fidelity::SHIPPED);
        drive(&mut plant, &mut world, 0, 100, None);
        let parked = plant.state(&world);
        assert!((parked.position.z - world.terrain().height(-10.0, -5.0)).abs() < 0.05, "{parked:?}");

        drive(&mut plant, &mut world, 100, 500, Some((9.0, 9.0)));
        let fast = plant.state(&world);
        assert!((1.5..1.95).contains(&fast.speed()), "{fast:?}");
        assert!((fast.yaw_rate - fast.speed()).abs() < 0.3, "{fast:?}");
        assert!((fast.rotation * Vector::Z).z > 0.9, "{fast:?}");

        // The lease runs 0.3 s on; at 2 m/s² another second stops it, and then it settles.
        drive(&mut plant, &mut world, 600, 330, None);
        assert!(plant.state(&world).speed().abs() < STANDSTILL, "{:?}", plant.state(&world));
    }

    /// The brakes know of neither.
    #[test]
    fn load_or_low_grip_lengthens_the_stop() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        let left = |fidelity: Fidelity| {
            let mut world = World::new(Arc::new(scene.clone()));
            let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &fidelity);
            drive(&mut plant, &mut world, 0, 500, Some((3.0, 0.0)));
            let fast = plant.state(&world).speed();
            assert!(fast > 2.6, "{fast}");
            // The lease runs 0.3 s on.
            drive(&mut plant, &mut world, 500, 70, None);
            plant.state(&world).speed() / fast
        };
        let shipped = left(Fidelity::SHIPPED);
        let laden = left(Fidelity { load: 1.6, ..Fidelity::SHIPPED });
        let slippery = left(Fidelity { grip: 0.1, ..Fidelity::SHIPPED });
        assert!(shipped + 0.05 < laden && shipped + 0.05 < slippery, "{shipped} {laden} {slippery}");
    }

    /// A vehicle in a tight curve brakes with at least 3 m/s².
    #[test]
    fn tight_curve_at_full_speed_stays_upright() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        let mut world = World::new(Arc::new(scene.clone()));
        let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
        drive(&mut plant, &mut world, 0, 500, Some((9.0, 9.0)));
        let state = plant.state(&world);
        assert!((state.rotation * Vector::Z).z > 0.9, "{state:?}");
        assert!((2.6..3.2).contains(&state.speed()), "{state:?}");

        drive(&mut plant, &mut world, 500, 300, Some((3.0, 0.0)));
        let fast = plant.state(&world).speed();
        assert!(fast > 2.8, "{fast}");
        // The lease runs 0.3 s on; what is left of a second at 3 m/s² takes 2.1 m/s.
        drive(&mut plant, &mut world, 800, 100, None);
        assert!(plant.state(&world).speed() < fast - 2.1, "{:?}", plant.state(&world));
    }
}
