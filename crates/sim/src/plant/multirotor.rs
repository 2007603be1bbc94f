//! A body on four rotors with the loops of a flight controller.
//!
//! Its numbers are the platform's ([`Multirotor`]), the forces follow PX4's SIH model: thrust and torque by rotor with
//! a first-order lag, drag by airspeed and by rate of turn. The controller is the usual cascade: velocity to
//! acceleration, acceleration to tilt and thrust, tilt to rates, rates to torques, torques to rotors. It knows its
//! attitude, rates and velocity as such a controller does from its own sensors; it has no position.
//!
//! Its safe motion needs no message: it holds its place for a time, or for as long as the battery lets it, and then
//! lands where it is.
//!
//! Body frame: x forward, y left, z up, origin in the centre of mass. A gimbal keeps the sensors level.

use config::platform::Multirotor as Numbers;
use rapier3d::prelude::*;

use super::air::Air;
use super::airframe::{self, Airframe};
use super::{BodyMotion, Flight, Moves, SafetyMargins, State};
use crate::scene::StartPose;
use crate::world::{DT, World, turn};

const GRAVITY: f32 = 9.81;
/// Gains of the cascade, 1/s: velocity, tilt, rate. Each loop is more than twice as fast as the one around it, and the
/// last as fast as the lag of the rotors allows (20 /s in SIH).
const VELOCITY: f32 = 2.5;
const TILT: f32 = 6.0;
const RATE: f32 = 16.0;
/// Integral gain of the velocity loop, 1/s², which holds against wind; and its greatest part, m/s².
const INTEGRAL: f32 = 2.5;
const MOST_INTEGRAL: f32 = 4.0;
/// Least and greatest share of the rotors' thrust that is asked for in the air: below the least no torque can be made.
const THRUST: [f32; 2] = [0.1, 0.9];
/// Height of its underside below which a body that lands may have touched the ground, metres; and the descent below
/// which it has, m/s.
const TOUCH: f32 = 0.15;
const STOPPED: f32 = 0.1;

/// State of the body's own safe motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// The aircraft follows set-points.
    Led,
    /// The aircraft holds its place, for a number of seconds so far.
    Loiters(f32),
    /// The aircraft descends.
    Lands,
    /// The aircraft stands, rotors off.
    Landed,
}

/// The body, its rotors and its controller.
#[derive(Clone)]
pub(super) struct Multirotor {
    airframe: Airframe,
    numbers: Numbers,
    air: Air,
    /// Thrust of each rotor as a share of its greatest: front right, rear left, front left, rear right.
    rotors: [f32; 4],
    phase: Phase,
    /// Velocity that the controller tracks, level frame, m/s.
    reference: Vector,
    /// Change of the tracked velocity, m/s².
    ahead: Vector,
    integral: Vector,
    /// Energy that is left, joules.
    energy: f32,
}

impl Multirotor {
    /// Puts the body into `world`, in a hover at its cruise height; as heavy as `load` says.
    pub(super) fn new(world: &mut World, start: &StartPose, numbers: &Numbers, load: f32, air: Air) -> Self {
        let Numbers { body_m, cruise_m, power_w: [power_w, _], descent_m_s, clearance_m, ceiling_m, .. } = *numbers;
        let mass = numbers.mass_kg * load;
        let inertia = Vector::from(numbers.inertia_kg_m2.map(|i| i * load));
        let airframe = airframe::Numbers { body_m, cruise_m, power_w, descent_m_s, clearance_m, ceiling_m };
        let weighed =
            |body: RigidBodyBuilder| body.additional_mass_properties(MassProperties::new(Vector::ZERO, mass, inertia));
        let hover = mass * GRAVITY / (4.0 * numbers.thrust_n);
        Multirotor {
            airframe: Airframe::new(world, start, airframe, weighed),
            numbers: *numbers,
            air,
            rotors: [hover; 4],
            phase: Phase::Loiters(0.0),
            reference: Vector::ZERO,
            ahead: Vector::ZERO,
            integral: Vector::ZERO,
            energy: numbers.battery_w_h * 3600.0,
        }
    }

    /// The velocity of this motion in the level frame, and the turn; the body's own safe motion included.
    fn wanted(&mut self, motion: BodyMotion, (below, sinks): (f32, f32)) -> Option<(Vector, f32)> {
        // As a flight controller does: with what is left for the way down it goes down, with any guest or navigation.
        let low = self.energy < 2.0 * self.airframe.reserve(below);
        self.phase = match (motion, self.phase) {
            (_, Phase::Lands) if below < TOUCH && sinks < STOPPED => Phase::Landed,
            (_, Phase::Landed) if low => Phase::Landed,
            (_, _) if low => Phase::Lands,
            (BodyMotion::Velocity { .. } | BodyMotion::Course { .. }, _) => Phase::Led,
            (BodyMotion::Rest, Phase::Led) => Phase::Loiters(0.0),
            (BodyMotion::Rest, Phase::Loiters(s)) if s >= self.numbers.loiter_s => Phase::Lands,
            (BodyMotion::Rest, Phase::Loiters(s)) => Phase::Loiters(s + DT),
            (BodyMotion::Rest, phase) => phase,
        };
        match (motion, self.phase) {
            (_, Phase::Landed) => None,
            (_, Phase::Lands) => Some((Vector::new(0.0, 0.0, -self.numbers.descent_m_s), 0.0)),
            (BodyMotion::Velocity { along, turn }, _) => Some((Vector::from(along), turn)),
            (BodyMotion::Course { .. } | BodyMotion::Rest, _) => Some((Vector::ZERO, 0.0)),
        }
    }

    /// Lets the tracked velocity follow the wanted one, as fast as the body may.
    fn track(&mut self, wanted: Vector) {
        let [faster, slower] = self.numbers.acceleration_m_s2;
        let change = wanted - self.reference;
        let most = if wanted.length() < self.reference.length() { slower } else { faster } * DT;
        let step = change * (most / change.length().max(most));
        self.reference += step;
        self.ahead = step / DT;
    }

    /// Thrust and torques about the body's axes for this velocity of the level frame.
    fn control(&mut self, body: &RigidBody, level: Rotation, turn: f32) -> (f32, Vector) {
        let Numbers { mass_kg, inertia_kg_m2, tilt_deg, thrust_n, spin_drag_n_m_s, .. } = self.numbers;
        let wanted = level * self.reference;
        let error = wanted - body.linvel();
        self.integral = (self.integral + error * (INTEGRAL * DT)).clamp_length_max(MOST_INTEGRAL);
        // The level frame turns, and the velocity with it.
        let ahead = level * self.ahead + Vector::Z.cross(wanted) * turn;
        let mut requested = ahead + error * VELOCITY + self.integral;
        let most = GRAVITY * libm::tanf(tilt_deg.to_radians());
        let flat = (requested.x * requested.x + requested.y * requested.y).sqrt();
        let share = (most / flat.max(most)).min(1.0);
        requested =
            Vector::new(requested.x * share, requested.y * share, requested.z.clamp(-0.6 * GRAVITY, 0.8 * GRAVITY));
        let force = requested + Vector::Z * GRAVITY;
        let axis = body.rotation() * Vector::Z;
        let [least, greatest] = THRUST.map(|share| share * 4.0 * thrust_n);
        let thrust = (mass_kg * force.dot(axis)).clamp(least, greatest);
        // The turn that brings the body's z axis to the force, in body axes.
        let tilt = Vector::Z.cross(body.rotation().inverse() * force.normalize());
        let rates = Vector::new(tilt.x * TILT, tilt.y * TILT, turn);
        let error = rates - body.rotation().inverse() * body.angvel();
        (thrust, Vector::from(inertia_kg_m2) * error * RATE + rates * spin_drag_n_m_s)
    }

    /// Lets the rotors follow their shares of thrust and torques, and gives thrust and torques as they are.
    fn spin(&mut self, requested: Option<(f32, Vector)>) -> (f32, Vector) {
        let Numbers { arm_m, thrust_n, torque_n_m, rotor_s, .. } = self.numbers;
        let share = match requested {
            Some((thrust, torque)) => {
                let (t, x) = (thrust / (4.0 * thrust_n), torque.x / (4.0 * arm_m * thrust_n));
                let (y, z) = (torque.y / (4.0 * arm_m * thrust_n), torque.z / (4.0 * torque_n_m));
                [t - x - y - z, t + x + y - z, t + x - y + z, t - x + y + z]
            }
            None => [0.0; 4],
        };
        let follows = 1.0 - libm::expf(-DT / rotor_s);
        for (rotor, share) in self.rotors.iter_mut().zip(share) {
            *rotor += (share.clamp(0.0, 1.0) - *rotor) * follows;
        }
        let [a, b, c, d] = self.rotors;
        let torque = Vector::new(
            arm_m * thrust_n * (b + c - a - d),
            arm_m * thrust_n * (b + d - a - c),
            torque_n_m * (c + d - a - b),
        );
        (thrust_n * (a + b + c + d), torque)
    }

    /// Power of the rotors grows with the thrust to the power of 3/2, as momentum theory has it.
    fn drain(&mut self) {
        let Numbers { mass_kg, thrust_n, power_w: [hover, rest], .. } = self.numbers;
        let powers = |share: f32| (share * share * share).max(0.0).sqrt();
        let spent: f32 = self.rotors.iter().map(|share| powers(*share)).sum();
        let hovering = 4.0 * powers(mass_kg * GRAVITY / (4.0 * thrust_n));
        self.energy = (self.energy - (rest + (hover - rest) * spent / hovering) * DT).max(0.0);
    }

    /// Margin of a velocity of the level frame keeps to the safe set, in parts of its limits.
    fn settled(&self, velocity: Vector) -> f32 {
        let Numbers { drift_m_s, descent_m_s, .. } = self.numbers;
        let flat = (velocity.x * velocity.x + velocity.y * velocity.y).sqrt();
        let upright = velocity.z.abs();
        (1.0 - flat / drift_m_s).min(1.0 - upright / (descent_m_s + drift_m_s))
    }
}

impl Moves for Multirotor {
    fn able(&self, requested: BodyMotion) -> Option<BodyMotion> {
        let Numbers { max_speed_m_s, max_climb_m_s, max_turn_rad_s, .. } = self.numbers;
        match requested {
            BodyMotion::Velocity { along: [x, y, z], turn } => {
                let share = max_speed_m_s / (x * x + y * y).sqrt().max(max_speed_m_s);
                let along = [x * share, y * share, z.clamp(-max_climb_m_s, max_climb_m_s)];
                Some(BodyMotion::Velocity { along, turn: turn.clamp(-max_turn_rad_s, max_turn_rad_s) })
            }
            BodyMotion::Rest => Some(BodyMotion::Rest),
            BodyMotion::Course { .. } => None,
        }
    }

    fn push(&mut self, motion: BodyMotion, world: &mut World) {
        let below = self.airframe.ground_clearance(world);
        let wanted = self.wanted(motion, (below, -self.airframe.rigid(world).linvel().z));
        let wanted = wanted.filter(|_| self.energy > 0.0);
        let body = self.airframe.rigid(world);
        let (level, velocity, rotation, rates) =
            (level(body.rotation()), body.linvel(), *body.rotation(), body.angvel());
        let requested = wanted.map(|(velocity, turn)| {
            self.track(velocity);
            self.control(body, level, turn)
        });
        if requested.is_none() {
            (self.reference, self.ahead, self.integral) = (Vector::ZERO, Vector::ZERO, Vector::ZERO);
        }
        let (thrust, torque) = self.spin(requested);
        self.drain();
        let drag = (self.air.step(velocity) - velocity) * self.numbers.drag_n_s_m;
        let body = &mut world.physics.bodies[self.airframe.handle];
        body.reset_forces(true);
        body.reset_torques(true);
        body.add_force(rotation * Vector::Z * thrust + drag, true);
        body.add_torque(rotation * torque - rates * self.numbers.spin_drag_n_m_s, true);
    }

    fn state(&self, world: &World) -> State {
        let body = self.airframe.rigid(world);
        State {
            position: body.translation(),
            rotation: level(body.rotation()),
            velocity: body.linvel(),
            yaw_rate: heading_rate(body),
        }
    }

    fn body(&self) -> RigidBodyHandle {
        self.airframe.handle
    }

    fn shell(&self) -> ColliderHandle {
        self.airframe.shell
    }

    fn flight(&self, world: &World) -> Option<Flight> {
        let body = self.airframe.rigid(world);
        let turned = (*body.rotation(), body.rotation().inverse() * body.angvel());
        Some(self.airframe.flight(world, turned, self.energy / (self.numbers.battery_w_h * 3600.0)))
    }

    fn margin(&self, world: &World, fence: f32) -> f32 {
        self.airframe.margin(world, fence)
    }

    fn safety_margins(&self, requested: BodyMotion, world: &World) -> Option<SafetyMargins> {
        let below = self.airframe.ground_clearance(world);
        let reserve = self.airframe.reserve(below);
        Some(SafetyMargins {
            safe: self.settled(self.airframe.rigid(world).linvel()),
            asked: match requested {
                BodyMotion::Velocity { along, .. } => self.settled(Vector::from(along)),
                BodyMotion::Course { .. } | BodyMotion::Rest => 1.0,
            },
            energy: if self.phase == Phase::Landed { 1.0 } else { (self.energy - reserve) / reserve },
            clearance: self.airframe.clearance(below, self.phase == Phase::Led),
        })
    }
}

/// Rate at which the heading turns, rad/s: that of the body's x axis about the world's z, which a roll of a body that
/// leans ahead leaves as it is.
fn heading_rate(body: &RigidBody) -> f32 {
    let ahead = body.rotation() * Vector::X;
    let moves = body.angvel().cross(ahead);
    let flat = ahead.x * ahead.x + ahead.y * ahead.y;
    if flat > 1e-6 { (ahead.x * moves.y - ahead.y * moves.x) / flat } else { 0.0 }
}

/// The heading of a body as a rotation about z; its x axis never points straight up within the tilt that a controller
/// keeps.
fn level(rotation: &Rotation) -> Rotation {
    let ahead = rotation * Vector::X;
    let flat = (ahead.x * ahead.x + ahead.y * ahead.y).sqrt();
    if flat > 1e-6 { turn([ahead.x / flat, ahead.y / flat]) } else { Rotation::IDENTITY }
}

#[cfg(test)]
mod tests {
    use config::platform::Body;
    use wire::time::Instant;

    use crate::plant::SetPoint;
    use crate::plant::flown::Flown;
    use crate::wind::Wind;

    const NUMBERS: config::platform::Multirotor = config::platform::Multirotor::SIH;

    #[test]
    fn hover_stays_where_it_is() {
        let mut flown = Flown::new(Wind::default(), Body::Multirotor(NUMBERS));
        let start = flown.plant.state(&flown.world).position;
        let states = flown.fly(5.0, None, 0.0);
        let off = states.iter().map(|s| (s.position - start).length()).fold(0.0, f32::max);
        assert!(off < 0.05, "{off}");
        assert!(flown.safety_margins().safe > 0.8, "{:?}", flown.safety_margins());
    }

    #[test]
    fn velocity_is_followed_in_all_axes_and_a_turn() {
        for along in [[3.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [0.0, -3.0, 0.5], [1.0, 0.0, -0.2]] {
            let mut flown = Flown::new(Wind::default(), Body::Multirotor(NUMBERS));
            let states = flown.fly(5.0, Some(along), 0.0);
            let last = states.last().unwrap();
            let got = last.rotation.inverse() * last.velocity;
            let off = (got - rapier3d::prelude::Vector::from(along)).length();
            assert!(off < 0.1, "{along:?}: {got:?}");
            let most = states.iter().map(|s| s.velocity.length()).fold(0.0, f32::max);
            let requested = rapier3d::prelude::Vector::from(along).length();
            assert!(most < 1.1 * requested, "{along:?}: overshoot to {most}");
        }
        let mut flown = Flown::new(Wind::default(), Body::Multirotor(NUMBERS));
        let turned = flown.fly(3.0, Some([0.0; 3]), 0.5);
        assert!((turned.last().unwrap().yaw_rate - 0.5).abs() < 0.02, "{:?}", turned.last());
    }

    #[test]
    fn wheels_terms_are_refused() {
        let mut flown = Flown::new(Wind::default(), Body::Multirotor(NUMBERS));
        assert!(!flown.plant.accept(Instant(0), SetPoint::course((1.0, 0.0), Instant(300_000))));
        assert_eq!(flown.plant.set_point(), None);
    }

    /// Brakes, holds its place, lands, stands; with no message.
    #[test]
    fn lease_end_loiters_and_then_lands() {
        let body = config::platform::Multirotor { loiter_s: 3.0, ..NUMBERS };
        let mut flown = Flown::new(Wind::default(), Body::Multirotor(body));
        flown.fly(4.0, Some([3.0, 0.0, 0.0]), 0.0);
        assert!(flown.safety_margins().safe < 0.0, "{:?}", flown.safety_margins());
        let braked = flown.fly(0.3 + 2.5, None, 0.0);
        assert!(flown.safety_margins().safe > 0.0, "{:?} {:?}", flown.safety_margins(), braked.last());
        let height = braked.last().unwrap().position.z;
        let down = flown.fly(12.0, None, 0.0);
        assert!(down.iter().all(|s| s.velocity.length() < 1.0));
        let ground = flown.world.terrain().height(down.last().unwrap().position.x, down.last().unwrap().position.y);
        let last = down.last().unwrap();
        assert!(height - last.position.z > 1.5 && last.position.z - ground < 0.3, "{last:?} over {ground}");
        assert!(last.velocity.length() < 0.05, "{last:?}");
        assert!(flown.safety_margins().safe > 0.9 && flown.safety_margins().energy > 0.9);
    }

    #[test]
    fn an_empty_battery_shortens_the_loiter() {
        let body = config::platform::Multirotor { battery_w_h: 0.75, loiter_s: 1000.0, ..NUMBERS };
        let mut flown = Flown::new(Wind::default(), Body::Multirotor(body));
        let states = flown.fly(30.0, None, 0.0);
        let last = states.last().unwrap();
        assert!(last.velocity.length() < 0.05 && last.position.z < 0.5, "{last:?}");
        let hardest = states.windows(2).map(|w| (w[1].velocity - w[0].velocity).length()).fold(0.0, f32::max);
        assert!(hardest < 1.0, "it lands and does not fall: {hardest} m/s in a step");
    }

    #[test]
    fn gusts_move_a_hover_within_its_drift() {
        let wind = Wind { east_m_s: 2.0, north_m_s: 0.0, gust_m_s: 1.0, length_m: 50.0 };
        let mut flown = Flown::new(wind, Body::Multirotor(NUMBERS));
        flown.fly(10.0, None, 0.0);
        let states = flown.fly(10.0, None, 0.0);
        let most = states.iter().map(|s| s.velocity.length()).fold(0.0, f32::max);
        assert!((0.01..NUMBERS.drift_m_s).contains(&most), "{most}");
    }
}
