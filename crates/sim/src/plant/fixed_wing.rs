//! A body on a fixed wing with an autopilot, which cannot stand still: its safe motion is a circle.
//!
//! Motion is that of the guidance model of R. Beard and T. McLain, *Small Unmanned Aircraft* (2012), chapter 9:
//! airspeed, bank and climb follow the autopilot's set-points with first-order lags within the airframe's limits, turns
//! are coordinated, and the wind carries the body. Forces of the air on wing and tail are left out. The autopilot knows
//! airspeed, bank and climb as it does from its own sensors; it has no position.
//!
//! Its safe motion needs no message: it circles to the left for a time, or for as long as the battery lets it, comes
//! down circling, and stands on the ground. A velocity below half of the least airspeed is flown as the same circle, at
//! its height.
//!
//! Body frame: x forward, y left, z up, origin in the centre of mass. A gimbal keeps the sensors level.

use config::platform::FixedWing as Numbers;
use rapier3d::prelude::*;

use super::air::Air;
use super::airframe::{self, Airframe};
use super::{BodyMotion, Flight, Moves, SafetyMargins, State};
use crate::scene::StartPose;
use crate::world::{DT, World, turn};

const GRAVITY: f32 = 9.81;
/// Height of its underside below which a body that lands levels its wings, and below which its nose touches the ground,
/// metres.
const LEVELS: f32 = 0.5;
const TOUCH: f32 = 0.15;
/// Deceleration on the ground, m/s².
const SKID: f32 = 4.0;

/// State of the body's own safe motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// The aircraft follows set-points.
    Led,
    /// The aircraft circles, for a number of seconds so far.
    Circles(f32),
    /// The aircraft descends in circles.
    Lands,
    /// The aircraft is on the ground, motor off.
    Landed,
}

/// Airspeed, climb and turn that the autopilot is to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wanted {
    airspeed: f32,
    climb: f32,
    turn: f32,
}

/// The body with its autopilot.
#[derive(Clone)]
pub(super) struct FixedWing {
    airframe: Airframe,
    numbers: Numbers,
    air: Air,
    phase: Phase,
    heading: f32,
    /// Bank, radians, positive to the right, and its rate, rad/s.
    bank: [f32; 2],
    airspeed: f32,
    climb: f32,
    /// Place where its present circle began.
    began: Vector,
    energy: f32,
}

impl FixedWing {
    /// Puts the body into `world`, circling at its cruise height.
    pub(super) fn new(world: &mut World, start: &StartPose, numbers: &Numbers, load: f32, air: Air) -> Self {
        let Numbers { body_m, cruise_m, power_w: [power_w, _], descent_m_s, clearance_m, ceiling_m, .. } = *numbers;
        let airframe = airframe::Numbers { body_m, cruise_m, power_w, descent_m_s, clearance_m, ceiling_m };
        let weighed = |body: RigidBodyBuilder| body.gravity_scale(0.0).additional_mass(numbers.mass_kg * load);
        let airframe = Airframe::new(world, start, airframe, weighed);
        FixedWing {
            airframe,
            numbers: *numbers,
            air,
            phase: Phase::Circles(0.0),
            heading: start.heading,
            bank: [0.0; 2],
            airspeed: numbers.circle_m_s,
            climb: 0.0,
            began: airframe.rigid(world).translation(),
            energy: numbers.battery_w_h * 3600.0,
        }
    }

    /// Rate of turn on the circle, rad/s.
    fn circling(&self) -> f32 {
        GRAVITY * libm::tanf(self.numbers.circle_bank_deg.to_radians()) / self.numbers.circle_m_s
    }

    /// True if this velocity is flown as a circle.
    fn stays(&self, along: [f32; 3]) -> bool {
        along[0] < 0.5 * self.numbers.min_speed_m_s
    }

    /// The phase that follows, and the motion to fly; none on the ground.
    fn wanted(&mut self, motion: BodyMotion, below: f32, place: Vector) -> Option<Wanted> {
        let low = self.energy < 2.0 * self.airframe.reserve(below);
        let before = self.phase;
        self.phase = match (motion, self.phase) {
            (_, Phase::Lands) if below < TOUCH => Phase::Landed,
            // Nothing throws it up again.
            (_, Phase::Landed) => Phase::Landed,
            (_, _) if low => Phase::Lands,
            (BodyMotion::Velocity { .. } | BodyMotion::Course { .. }, _) => Phase::Led,
            (BodyMotion::Rest, Phase::Led) => Phase::Circles(0.0),
            (BodyMotion::Rest, Phase::Circles(s)) if s >= self.numbers.circle_s => Phase::Lands,
            (BodyMotion::Rest, Phase::Circles(s)) => Phase::Circles(s + DT),
            (BodyMotion::Rest, Phase::Lands) => Phase::Lands,
        };
        if before == Phase::Led && self.phase != Phase::Led {
            self.began = place;
        }
        let circle = |climb| Wanted { airspeed: self.numbers.circle_m_s, climb, turn: self.circling() };
        match (motion, self.phase) {
            (_, Phase::Landed) => None,
            (_, Phase::Lands) => {
                let descent = circle(-self.numbers.descent_m_s);
                Some(Wanted { turn: if below < LEVELS { 0.0 } else { descent.turn }, ..descent })
            }
            (BodyMotion::Velocity { along, turn }, Phase::Led) if !self.stays(along) => {
                let airspeed = along[0].max(self.numbers.min_speed_m_s);
                Some(Wanted { airspeed, climb: along[2], turn })
            }
            (BodyMotion::Velocity { along, .. }, Phase::Led) => Some(circle(along[2])),
            (BodyMotion::Velocity { .. } | BodyMotion::Course { .. } | BodyMotion::Rest, _) => Some(circle(0.0)),
        }
    }

    /// Lets airspeed, climb and bank follow for one step.
    fn follow(&mut self, wanted: Wanted) {
        let Numbers { acceleration_m_s2: [faster, slower], bank_deg, roll, climb_s, .. } = self.numbers;
        let change = wanted.airspeed - self.airspeed;
        self.airspeed += change.clamp(-slower * DT, faster * DT);
        self.climb += (wanted.climb - self.climb) * (1.0 - libm::expf(-DT / climb_s));
        let most = bank_deg.to_radians();
        // A turn to the left is a bank to the left.
        let bank = -libm::atanf(self.airspeed * wanted.turn / GRAVITY).clamp(-most, most);
        let [frequency, damping] = roll;
        let [angle, rate] = self.bank;
        let rate = rate + (frequency * frequency * (bank - angle) - 2.0 * damping * frequency * rate) * DT;
        self.bank = [angle + rate * DT, rate];
    }

    /// Rate of turn of a coordinated turn, rad/s, counter-clockwise.
    fn turns(&self) -> f32 {
        if self.phase == Phase::Landed { 0.0 } else { -GRAVITY * libm::tanf(self.bank[0]) / self.airspeed }
    }

    fn level(&self) -> Rotation {
        let (sin, cos) = libm::sincosf(self.heading);
        turn([cos, sin])
    }

    /// Body to world: heading, then the nose along the climb, then the bank.
    fn attitude(&self) -> Rotation {
        let nose = libm::asinf((self.climb / self.airspeed.max(self.numbers.min_speed_m_s)).clamp(-1.0, 1.0));
        self.level() * Rotation::from_axis_angle(Vector::Y, -nose) * Rotation::from_axis_angle(Vector::X, self.bank[0])
    }

    /// Margin of a motion to the circle's limits, as a share of them.
    fn settled(&self, velocity: Vector, place: Vector) -> f32 {
        let Numbers { circle_m_s, descent_m_s, drift_m_s, stays_m, .. } = self.numbers;
        let (vector, flat) = (place - self.began, (velocity.x * velocity.x + velocity.y * velocity.y).sqrt());
        let distance = (vector.x * vector.x + vector.y * vector.y).sqrt();
        let slow = 1.0 - flat / (circle_m_s + drift_m_s);
        slow.min(1.0 - distance / stays_m).min(1.0 - velocity.z.abs() / (descent_m_s + drift_m_s))
    }
}

impl Moves for FixedWing {
    fn able(&self, requested: BodyMotion) -> Option<BodyMotion> {
        let Numbers { max_speed_m_s, max_climb_m_s, max_turn_rad_s, .. } = self.numbers;
        match requested {
            // It flies ahead: a velocity to the side or back is none of its.
            BodyMotion::Velocity { along: [x, _, z], turn } => Some(BodyMotion::Velocity {
                along: [x.clamp(0.0, max_speed_m_s), 0.0, z.clamp(-max_climb_m_s, max_climb_m_s)],
                turn: turn.clamp(-max_turn_rad_s, max_turn_rad_s),
            }),
            BodyMotion::Rest => Some(BodyMotion::Rest),
            BodyMotion::Course { .. } => None,
        }
    }

    fn push(&mut self, motion: BodyMotion, world: &mut World) {
        let (below, place) = (self.airframe.ground_clearance(world), self.airframe.rigid(world).translation());
        match self.wanted(motion, below, place) {
            Some(wanted) => {
                self.follow(wanted);
                self.energy = (self.energy - self.numbers.power_w[0] * DT).max(0.0);
            }
            None => {
                self.airspeed = (self.airspeed - SKID * DT).max(0.0);
                (self.climb, self.bank) = (0.0, [0.0; 2]);
                self.energy = (self.energy - self.numbers.power_w[1] * DT).max(0.0);
            }
        }
        let turns = self.turns();
        self.heading = libm::remainderf(self.heading + turns * DT, core::f32::consts::TAU);
        let (sin, cos) = libm::sincosf(self.heading);
        let vector = Vector::new(self.airspeed * cos, self.airspeed * sin, self.climb);
        let wind = self.air.step(self.airframe.rigid(world).linvel());
        let carried = if self.phase == Phase::Landed { Vector::ZERO } else { wind };
        let attitude = self.attitude();
        let body = &mut world.physics.bodies[self.airframe.handle];
        body.set_rotation(attitude, true);
        body.set_linvel(vector + carried, true);
        body.set_angvel(Vector::Z * turns, true);
    }

    fn state(&self, world: &World) -> State {
        let body = self.airframe.rigid(world);
        let (position, velocity) = (body.translation(), body.linvel());
        State { position, rotation: self.level(), velocity, yaw_rate: self.turns() }
    }

    fn body(&self) -> RigidBodyHandle {
        self.airframe.handle
    }

    fn shell(&self) -> ColliderHandle {
        self.airframe.shell
    }

    fn flight(&self, world: &World) -> Option<Flight> {
        let turned = (self.attitude(), Vector::new(self.bank[1], 0.0, self.turns()));
        Some(self.airframe.flight(world, turned, self.energy / (self.numbers.battery_w_h * 3600.0)))
    }

    fn margin(&self, world: &World, fence: f32) -> f32 {
        self.airframe.margin(world, fence)
    }

    fn safety_margins(&self, requested: BodyMotion, world: &World) -> Option<SafetyMargins> {
        let (below, led) = (self.airframe.ground_clearance(world), self.phase == Phase::Led);
        let (body, reserve) = (self.airframe.rigid(world), self.airframe.reserve(below));
        Some(SafetyMargins {
            safe: if led { -1.0 } else { self.settled(body.linvel(), body.translation()) },
            asked: match requested {
                BodyMotion::Velocity { along, .. } if !self.stays(along) => -1.0,
                BodyMotion::Velocity { .. } | BodyMotion::Course { .. } | BodyMotion::Rest => 1.0,
            },
            energy: if self.phase == Phase::Landed { 1.0 } else { (self.energy - reserve) / reserve },
            clearance: self.airframe.clearance(below, led),
        })
    }
}

#[cfg(test)]
mod tests {
    use config::platform::Body;
    use wire::time::Instant;

    use crate::plant::SetPoint;
    use crate::plant::flown::Flown;
    use crate::wind::Wind;

    const NUMBERS: config::platform::FixedWing = config::platform::FixedWing::SLOW_FLYER;

    /// Time of a coordinated turn's circle: 2π v / (g tan φ).
    fn circle_s() -> f32 {
        let tan = libm::tanf(NUMBERS.circle_bank_deg.to_radians());
        core::f32::consts::TAU * NUMBERS.circle_m_s / (9.81 * tan)
    }

    fn flown(numbers: config::platform::FixedWing) -> Flown {
        Flown::new(Wind::default(), Body::FixedWing(numbers))
    }

    #[test]
    fn airspeed_climb_and_turn_are_followed() {
        let mut flown = flown(NUMBERS);
        flown.fly(6.0, Some([3.0, 0.0, 0.0]), 0.0);
        let states = flown.fly(3.0, Some([3.0, 0.0, 0.3]), 0.8);
        let last = states.last().unwrap();
        assert!((last.speed() - 3.0).abs() < 0.02, "{last:?}");
        assert!((last.velocity.z - 0.3).abs() < 0.02 && (last.yaw_rate - 0.8).abs() < 0.02, "{last:?}");
    }

    /// The radius of a coordinated turn: v²/(g tan φ).
    #[test]
    fn it_never_stands_and_circles_where_it_is_asked_to_stand() {
        let mut flown = flown(NUMBERS);
        flown.fly(5.0, Some([0.0; 3]), 0.0);
        let states = flown.fly(20.0, Some([0.0; 3]), 0.0);
        let slowest = states.iter().map(|s| s.velocity.length()).fold(f32::INFINITY, f32::min);
        assert!(slowest > 0.95 * NUMBERS.circle_m_s, "{slowest} m/s");
        let spread = |k: usize| {
            let along = || states.iter().map(|s| s.position[k]);
            along().fold(f32::NEG_INFINITY, f32::max) - along().fold(f32::INFINITY, f32::min)
        };
        let radius = NUMBERS.circle_m_s * circle_s() / core::f32::consts::TAU;
        for k in 0..2 {
            assert!(
                (spread(k) / (2.0 * radius) - 1.0).abs() < 0.03,
                "{} m across, {} m expected",
                spread(k),
                2.0 * radius
            );
        }
    }

    /// Slows down, circles near the place where its lease ended, comes down, stands; with no message.
    #[test]
    fn lease_end_circles_and_then_lands() {
        let mut flown = flown(config::platform::FixedWing { circle_s: 4.0, ..NUMBERS });
        flown.fly(4.0, Some([3.0, 0.0, 0.0]), 0.0);
        assert!(flown.safety_margins().safe < 0.0, "led at full speed: {:?}", flown.safety_margins());
        let from = flown.plant.state(&flown.world).position;
        flown.fly(0.3 + 1.0, None, 0.0);
        for _ in 0..20 {
            flown.fly(1.0, None, 0.0);
            assert!(
                flown.safety_margins().safe > 0.0 && flown.safety_margins().energy > 0.0,
                "{:?}",
                flown.safety_margins()
            );
        }
        let last = *flown.fly(1.0, None, 0.0).last().unwrap();
        assert!(last.velocity.length() < 0.01 && last.position.z < 0.5, "{last:?}");
        let vector = last.position - from;
        assert!(vector.x.hypot(vector.y) < NUMBERS.stays_m + 1.0, "{vector:?}");
    }

    #[test]
    fn an_empty_battery_ends_the_circles() {
        let mut flown = flown(config::platform::FixedWing { battery_w_h: 0.02, circle_s: 1000.0, ..NUMBERS });
        let last = *flown.fly(30.0, None, 0.0).last().unwrap();
        assert!(last.velocity.length() < 0.01 && last.position.z < 0.5, "{last:?}");
        assert!(flown.safety_margins().energy > 0.0);
    }

    #[test]
    fn wheels_terms_are_refused() {
        assert!(!flown(NUMBERS).plant.accept(Instant(0), SetPoint::course((1.0, 0.0), Instant(300_000))));
    }

    #[test]
    fn wind_carries_it() {
        let wind = Wind { east_m_s: 0.5, ..Wind::default() };
        let mut flown = Flown::new(wind, Body::FixedWing(NUMBERS));
        let period = circle_s();
        flown.fly(4.0, None, 0.0);
        let one = flown.plant.state(&flown.world).position;
        flown.fly(f64::from(period), None, 0.0);
        let moved = flown.plant.state(&flown.world).position - one;
        assert!((moved.x / (0.5 * period) - 1.0).abs() < 0.1 && moved.y.abs() < 0.1, "{moved:?}");
    }
}
