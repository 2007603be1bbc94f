//! A body on four wheels, the front ones steer.
//!
//! Its numbers are the platform's ([`Vehicle`]). Its safe motion is to brake to standstill and stay there.
//!
//! Body frame: x forward, y left, z up, origin on the ground under the chassis centre.

use config::platform::Vehicle;
use rapier3d::control::{DynamicRayCastVehicleController, WheelTuning};
use rapier3d::prelude::*;

use super::{BodyMotion, Moves, STANDSTILL, State};
use crate::fidelity::Fidelity;
use crate::scene::StartPose;
use crate::world::{DT, GRAVITY, World, turn};

/// Share of a suspension's length by which it can give either way.
const SUSPENSION_TRAVEL: f32 = 0.8;
/// The most that one suspension bears, N for each kilogram of the vehicle: eight times its share of the weight.
const SUSPENSION_LIMIT: f32 = 20.0;
const PROPORTIONAL: f32 = 4.0;
const INTEGRAL: f32 = 1.5;

/// The vehicle and its controller.
#[derive(Clone)]
pub(super) struct Wheeled {
    limits: Vehicle,
    vehicle: DynamicRayCastVehicleController,
    shell: ColliderHandle,
    /// Speed that the controller tracks: the set-point, approached at the greatest acceleration.
    reference: f32,
    integral: f32,
    steering: f32,
}

impl Wheeled {
    /// Puts this vehicle into `world`, standing; as heavy and with as much grip as `fidelity` says.
    pub(super) fn new(world: &mut World, start: &StartPose, vehicle: &Vehicle, fidelity: &Fidelity) -> Self {
        let chassis = world.physics.bodies.insert(chassis_body(world, start, vehicle));
        let [length, width, height] = vehicle.chassis_m.map(|edge| edge / 2.0);
        let shell = ColliderBuilder::cuboid(length, width, height).mass(vehicle.mass_kg * fidelity.load).friction(0.4);
        let shell = world.physics.insert_collider(shell, Some(chassis));
        Wheeled {
            limits: *vehicle,
            vehicle: wheels(chassis, vehicle, fidelity.grip),
            shell,
            reference: 0.0,
            integral: 0.0,
            steering: 0.0,
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

    fn throttle(&mut self, wanted: f32, speed: f32, ahead: Vector) {
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
            // Feed-forward for the slope: the integral would still push after a crest.
            let grade = GRAVITY * ahead.z;
            let requested = (PROPORTIONAL * error + self.integral + grade).clamp(-braking_m_s2, braking_m_s2);
            (mass_kg * requested / 4.0, 0.0)
        };
        for wheel in self.vehicle.wheels_mut() {
            wheel.engine_force = force;
            wheel.brake = brake;
        }
    }
}

impl Moves for Wheeled {
    fn able(&self, requested: BodyMotion) -> Option<BodyMotion> {
        let Vehicle { max_speed_m_s, max_reverse_m_s, max_curvature_per_m, .. } = self.limits;
        match requested {
            BodyMotion::Course { speed, curvature } => Some(BodyMotion::Course {
                speed: speed.clamp(-max_reverse_m_s, max_speed_m_s),
                curvature: curvature.clamp(-max_curvature_per_m, max_curvature_per_m),
            }),
            BodyMotion::Rest => Some(BodyMotion::Rest),
            BodyMotion::Velocity { .. } => None,
        }
    }

    fn push(&mut self, motion: BodyMotion, world: &mut World) {
        let (speed, curvature) = match motion {
            BodyMotion::Course { speed, curvature } => (speed, curvature),
            BodyMotion::Rest | BodyMotion::Velocity { .. } => (0.0, 0.0),
        };
        self.steer(curvature);
        let state = self.state(world);
        self.throttle(speed, state.speed(), state.rotation * Vector::X);
        let physics = &mut world.physics;
        let queries = physics.broad_phase.as_query_pipeline_mut(
            physics.narrow_phase.query_dispatcher(),
            &mut physics.bodies,
            &mut physics.colliders,
            QueryFilter::default().exclude_rigid_body(self.vehicle.chassis),
        );
        self.vehicle.update_vehicle(DT, queries);
    }

    fn state(&self, world: &World) -> State {
        let body = &world.physics.bodies[self.vehicle.chassis];
        let pose = body.position();
        let up = pose.rotation * Vector::Z;
        let position = pose.translation - up * self.limits.ride_height_m();
        State {
            position,
            rotation: pose.rotation,
            // Of the same point: above the wheels a body that rocks on its springs still moves.
            velocity: body.velocity_at_point(position),
            yaw_rate: body.angvel().dot(up),
        }
    }

    fn body(&self) -> RigidBodyHandle {
        self.vehicle.chassis
    }

    fn shell(&self) -> ColliderHandle {
        self.shell
    }
}

/// The chassis never sleeps: wheel impulses on a sleeping body would pile up unseen.
fn chassis_body(world: &World, start: &StartPose, vehicle: &Vehicle) -> RigidBody {
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
