//! The plant: a four-wheeled ground vehicle that follows leased set-points.
//!
//! Its numbers are the platform's ([`Vehicle`]). The whole of its interface is: [`Plant::accept`] a [`SetPoint`], [`Plant::step`], read its [`State`]. Another
//! domain (air, space) is another module with these verbs. A set-point is followed only until its lease ends on the
//! plant's own clock; then the plant brakes to standstill by itself and says so once. No message is needed to stop it.
//!
//! Body frame: x forward, y left, z up, origin on the ground under the chassis centre.

use std::collections::BTreeMap;

use rapier3d::control::{DynamicRayCastVehicleController, WheelTuning};
use rapier3d::prelude::*;
use wire::id::ObjectId;
use wire::platform::Vehicle;
use wire::time::{Instant, Span};

use crate::fidelity::Fidelity;
use crate::scene::Start;
use crate::world::{DT, World, turn};

/// The longest lease that is honoured, counted from arrival.
pub const MAX_LEASE: Span = Span::ms(1000);
/// Below this speed, m/s, the vehicle counts as standing.
pub const STANDSTILL: f32 = 0.05;

/// Share of a suspension's length by which it can give either way.
const SUSPENSION_TRAVEL: f32 = 0.8;
/// The most that one suspension bears, N for each kilogram of the vehicle: eight times its share of the weight.
const SUSPENSION_LIMIT: f32 = 20.0;
const PROPORTIONAL: f32 = 4.0;
const INTEGRAL: f32 = 1.5;

/// Set-point of the plant, with its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPoint {
    /// Forward speed, m/s.
    pub speed: f32,
    /// Curvature, 1/m, positive to the left.
    pub curvature: f32,
    /// End of the lease, on the plant's clock.
    pub until: Instant,
}

/// The plant as a body in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Body origin, world frame, metres.
    pub position: Vector,
    /// Body to world.
    pub rotation: Rotation,
    /// Velocity of the chassis, world frame, m/s.
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

/// The vehicle and its controller.
#[derive(Clone)]
pub struct Plant {
    limits: Vehicle,
    vehicle: DynamicRayCastVehicleController,
    shell: ColliderHandle,
    set_point: Option<SetPoint>,
    /// Speed that the controller tracks: the set-point, approached at the greatest acceleration.
    reference: f32,
    integral: f32,
    steering: f32,
}

impl Plant {
    /// Puts this vehicle into `world`, standing; as heavy and with as much grip as `fidelity` says.
    pub fn new(world: &mut World, start: &Start, vehicle: &Vehicle, fidelity: &Fidelity) -> Self {
        let chassis = world.physics.bodies.insert(chassis_body(world, start, vehicle));
        let [length, width, height] = vehicle.chassis_m.map(|edge| edge / 2.0);
        let shell = ColliderBuilder::cuboid(length, width, height).mass(vehicle.mass_kg * fidelity.load).friction(0.4);
        let shell = world.physics.insert_collider(shell, Some(chassis));
        Plant {
            limits: *vehicle,
            vehicle: wheels(chassis, vehicle, fidelity.grip),
            shell,
            set_point: None,
            reference: 0.0,
            integral: 0.0,
            steering: 0.0,
        }
    }

    /// Takes a new set-point in place of the last. Speed and curvature are clamped to the vehicle's limits, the lease
    /// to [`MAX_LEASE`] from `now`.
    pub fn accept(&mut self, now: Instant, asked: SetPoint) {
        let Vehicle { max_speed_m_s, max_reverse_m_s, max_curvature_per_m, .. } = self.limits;
        self.set_point = Some(SetPoint {
            speed: asked.speed.clamp(-max_reverse_m_s, max_speed_m_s),
            curvature: asked.curvature.clamp(-max_curvature_per_m, max_curvature_per_m),
            until: asked.until.min(now + MAX_LEASE),
        });
    }

    /// The set-point under a valid lease.
    pub fn set_point(&self) -> Option<SetPoint> {
        self.set_point
    }

    /// The body that carries the sensors, for [`World::view`].
    pub fn body(&self) -> RigidBodyHandle {
        self.vehicle.chassis
    }

    /// Drives for the step that ends at `now`, then steps the world. Gives the set-point of a lease that has just
    /// ended.
    pub fn step(&mut self, now: Instant, world: &mut World) -> Option<SetPoint> {
        let lapsed = self.set_point.take_if(|s| s.until <= now);
        let (speed, curvature) = self.set_point.map_or((0.0, 0.0), |s| (s.speed, s.curvature));
        self.steer(curvature);
        self.throttle(speed, self.state(world).speed());
        let physics = &mut world.physics;
        let queries = physics.broad_phase.as_query_pipeline_mut(
            physics.narrow_phase.query_dispatcher(),
            &mut physics.bodies,
            &mut physics.colliders,
            QueryFilter::default().exclude_rigid_body(self.vehicle.chassis),
        );
        self.vehicle.update_vehicle(DT, queries);
        world.step();
        lapsed
    }

    /// The objects that the chassis touches, with the direction from it to each, unit vectors of the world frame.
    pub fn touches(&self, world: &World) -> BTreeMap<ObjectId, Vector> {
        world.touching(self.shell)
    }

    /// Place and motion of the vehicle.
    pub fn state(&self, world: &World) -> State {
        let body = &world.physics.bodies[self.vehicle.chassis];
        let pose = body.position();
        let up = pose.rotation * Vector::Z;
        State {
            position: pose.translation - up * self.limits.ride_height_m(),
            rotation: pose.rotation,
            velocity: body.linvel(),
            yaw_rate: body.angvel().dot(up),
        }
    }

    fn steer(&mut self, curvature: f32) {
        let wanted = libm::atanf(self.limits.wheelbase_m * curvature);
        let most = self.limits.steering_rad_s * DT;
        self.steering += (wanted - self.steering).clamp(-most, most);
        for wheel in &mut self.vehicle.wheels_mut()[..2] {
            wheel.steering = self.steering;
        }
    }

    fn throttle(&mut self, wanted: f32, speed: f32) {
        let Vehicle { mass_kg, braking_m_s2, max_acceleration_m_s2, .. } = self.limits;
        let stop = wanted.abs() < STANDSTILL;
        let (force, brake) = if stop {
            self.integral = 0.0;
            self.reference = speed;
            (0.0, mass_kg * braking_m_s2 * DT / 4.0)
        } else {
            let step = if wanted.abs() < self.reference.abs() { braking_m_s2 } else { max_acceleration_m_s2 } * DT;
            self.reference += (wanted - self.reference).clamp(-step, step);
            let error = self.reference - speed;
            self.integral = (self.integral + error * INTEGRAL * DT).clamp(-1.0, 1.0);
            let asked = (PROPORTIONAL * error + self.integral).clamp(-braking_m_s2, braking_m_s2);
            (mass_kg * asked / 4.0, 0.0)
        };
        for wheel in self.vehicle.wheels_mut() {
            wheel.engine_force = force;
            wheel.brake = brake;
        }
    }
}

/// The chassis never sleeps: wheel impulses on a sleeping body would pile up unseen.
fn chassis_body(world: &World, start: &Start, vehicle: &Vehicle) -> RigidBody {
    let (sin, cos) = libm::sincosf(start.heading);
    let up = world.terrain().height(start.east, start.north) + vehicle.ride_height_m();
    let pose = Pose::from_parts(Vector::new(start.east, start.north, up), turn([cos, sin]));
    RigidBodyBuilder::dynamic().pose(pose).can_sleep(false).angular_damping(0.5).build()
}

/// Four wheels, the two that steer first.
fn wheels(chassis: RigidBodyHandle, body: &Vehicle, grip: f32) -> DynamicRayCastVehicleController {
    let mut vehicle = DynamicRayCastVehicleController::new(chassis);
    vehicle.index_up_axis = 2;
    vehicle.index_forward_axis = 0;
    let tuning = WheelTuning {
        suspension_stiffness: body.spring_rate,
        suspension_compression: 4.0,
        suspension_damping: 5.0,
        max_suspension_travel: SUSPENSION_TRAVEL * body.suspension_m,
        side_friction_stiffness: 1.0,
        friction_slip: 2.0 * grip,
        max_suspension_force: SUSPENSION_LIMIT * body.mass_kg,
    };
    for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let mount = Vector::new(x * body.wheelbase_m / 2.0, y * body.track_m / 2.0, -body.wheel_drop_m);
        vehicle.add_wheel(mount, -Vector::Z, -Vector::Y, body.suspension_m, body.wheel_radius_m, &tuning);
    }
    vehicle
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::Scene;

    fn drive(plant: &mut Plant, world: &mut World, from: u64, steps: u64, ask: Option<(f32, f32)>) -> Vec<Instant> {
        let mut lapses = Vec::new();
        for k in from + 1..=from + steps {
            let now = Instant(k * 10_000);
            if let Some((speed, curvature)) = ask {
                plant.accept(now, SetPoint { speed, curvature, until: now + Span::ms(300) });
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
            let gone = plant.state(&world).speed();
            assert!((gone - speed).abs() < 0.15, "{speed}: {gone}");
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

    #[test]
    fn lease_is_bounded_by_the_plant() {
        let scene = Scene { objects: Vec::new(), ..Scene::default() };
        for speed in [2.0, 0.2] {
            let mut world = World::new(Arc::new(scene.clone()));
            let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
            plant.accept(Instant(0), SetPoint { speed, curvature: 0.0, until: Instant(60_000_000) });
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

    /// It brakes with at least 3 m/s².
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
