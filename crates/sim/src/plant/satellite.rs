//! A small satellite on three reaction wheels, pointed at places of a region that it passes over.
//!
//! Its numbers are the platform's ([`Numbers`]), its physics the `spacecraft` crate's. The unit's place is where its
//! payload looks, on the map of the region: set-points move that point. Its attitude controller knows attitude and
//! rates as it does from its own sensors.
//!
//! Its safe motion needs no message: it shuts the payload, keeps looking at its place for a time, so that contact is
//! not lost, and then turns the array to the sun, slowly.

use config::platform::Satellite as Numbers;
use rapier3d::prelude::*;
use spacecraft::attitude::{self, Body, Environment, State as Attitude, Wheel};
use spacecraft::orbit::OrbitError;
use spacecraft::pointing::{Controller, Reference, TurnLimits, desaturation, sun_pointing};
use spacecraft::power::{Power, lit};
use spacecraft::region::{Region, Sky};
use spacecraft::vector::{dot, norm};

use super::{BodyMotion, Flight, Moves, SafetyMargins, State};
use crate::scene::StartPose;
use crate::world::{DT, World, turn};

/// Length of a step, seconds.
const STEP_S: f64 = DT as f64;
/// Steps between two looks at sun and field, which change slowly.
const SKY_STEPS: u64 = 10;
/// Gain of the law that takes momentum out of the wheels, 1/s.
const DESATURATION: f64 = 0.001;
/// Angle from which on a reference goes with its goal, rad.
const CAUGHT: f64 = 0.002;
/// Sine of the elevation of the satellite, seen from the region, below which the payload is turned away: 10°.
const LEAST_ELEVATION: f64 = 0.17;
/// Furthest that a place on the map is reported, m.
const FURTHEST: f64 = 1.0e5;
/// Distance to a limit that does not apply, m.
const NO_LIMIT: f32 = 1.0e4;

/// State of the body's own safe motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// The satellite follows set-points, payload open.
    Led,
    /// The satellite keeps looking at its place, payload shut, for a number of seconds so far.
    Holds(f64),
    /// The satellite points its array at the sun, or slews to it.
    Suns,
}

/// The satellite, its controller and its surroundings.
#[derive(Clone)]
pub(super) struct Satellite {
    numbers: Numbers,
    /// Stand-ins in the world of the scene, which has no satellites in it.
    handle: RigidBodyHandle,
    shell: ColliderHandle,
    region: Region,
    body: Body,
    attitude: Attitude,
    reference: Reference,
    phase: Phase,
    steps: u64,
    /// Heading of the body's x axis on the map, which stays.
    along: f64,
    /// Place on the map that the controller looks at, direction of its way there, and speed that it tracks along and
    /// across that. Only the line of sight follows the way: to turn the body about it would take ten times the wheels'
    /// momentum.
    aim: [f64; 2],
    heading: f64,
    turn: f64,
    tracked: [f64; 2],
    sky: Sky,
    /// True place that the payload looks at, and its motion.
    seen: State,
    charge_j: f64,
}

impl Satellite {
    /// Puts it into its orbit, looking at `start` and moving with it.
    pub(super) fn new(world: &mut World, start: &StartPose, numbers: &Numbers) -> Result<Self, OrbitError> {
        let handle = world.physics.bodies.insert(RigidBodyBuilder::fixed().translation(Vector::new(0.0, 0.0, 1000.0)));
        let shell = world.physics.insert_collider(ColliderBuilder::ball(0.1).sensor(true), Some(handle));
        let region = Region::new(&numbers.pass())?;
        let (aim, heading) = ([f64::from(start.east), f64::from(start.north)], f64::from(start.heading));
        let (before, now) = (region.moment_at(-STEP_S), region.moment_at(0.0));
        let goal = |moment| region.looking_at(moment, aim, heading);
        let reference = Reference::moving(goal(&before), goal(&now), STEP_S);
        let attitude = Attitude { rates_rad_s: reference.rates_rad_s, ..Attitude::at_rest(reference.attitude) };
        let sky = region.sky(&now);
        let mut satellite = Satellite {
            numbers: *numbers,
            handle,
            shell,
            body: body(numbers),
            attitude,
            reference,
            phase: Phase::Holds(0.0),
            steps: 0,
            along: heading,
            aim,
            heading,
            turn: 0.0,
            tracked: [0.0; 2],
            sky,
            seen: State { position: Vector::ZERO, rotation: Rotation::IDENTITY, velocity: Vector::ZERO, yaw_rate: 0.0 },
            charge_j: numbers.battery[0] * numbers.battery[1] * 3600.0,
            region,
        };
        satellite.look(true);
        Ok(satellite)
    }

    fn seconds(&self) -> f64 {
        self.steps as f64 * STEP_S
    }

    /// Updates the true place that the payload looks at, and its motion since the last step.
    fn look(&mut self, first: bool) {
        // Turned to the sun, the payload looks at no place: the last one stays.
        if self.phase == Phase::Suns {
            (self.seen.velocity, self.seen.yaw_rate) = (Vector::ZERO, 0.0);
            return;
        }
        let moment = self.region.moment_at(self.seconds());
        let before = self.seen;
        let place = self.region.aim(&moment, self.attitude.attitude).map_or([FURTHEST; 2], |(place, _)| place);
        let [east, north] = place.map(|m| m.clamp(-FURTHEST, FURTHEST) as f32);
        let (sin, cos) = libm::sincos(self.heading);
        let position = Vector::new(east, north, 0.0);
        self.seen = State {
            position,
            rotation: turn([cos as f32, sin as f32]),
            velocity: if first { Vector::ZERO } else { (position - before.position) / DT },
            yaw_rate: self.turn as f32,
        };
    }

    /// Changes the phase, and gives the speed that is wanted in the level frame with the turn.
    fn wanted(&mut self, motion: BodyMotion) -> ([f64; 2], f64) {
        let [east, north, up] = self.region.moment_at(self.seconds()).local_m;
        // The plant itself turns away from a region near the horizon, whatever set-point a guest or navigation sends.
        let sunk = up < LEAST_ELEVATION * (east * east + north * north + up * up).sqrt();
        self.phase = match (motion, self.phase) {
            (_, _) if sunk => Phase::Suns,
            (BodyMotion::Velocity { .. } | BodyMotion::Course { .. }, _) => Phase::Led,
            (BodyMotion::Rest, Phase::Led) => Phase::Holds(0.0),
            (BodyMotion::Rest, Phase::Holds(s)) if s >= self.numbers.hold_s => Phase::Suns,
            (BodyMotion::Rest, Phase::Holds(s)) => Phase::Holds(s + STEP_S),
            (BodyMotion::Rest, Phase::Suns) => Phase::Suns,
        };
        match (motion, self.phase) {
            (BodyMotion::Velocity { along: [x, y, _], turn }, Phase::Led) => {
                ([f64::from(x), f64::from(y)], f64::from(turn))
            }
            (BodyMotion::Velocity { .. } | BodyMotion::Course { .. } | BodyMotion::Rest, _) => ([0.0; 2], 0.0),
        }
    }

    /// Moves the reference place of the payload by one step, within the limits of acceleration.
    fn track(&mut self, wanted: [f64; 2], turn: f64) {
        let [faster, slower] = self.numbers.acceleration_m_s2;
        let size = |v: [f64; 2]| (v[0] * v[0] + v[1] * v[1]).sqrt();
        let most = if size(wanted) < size(self.tracked) { slower } else { faster } * STEP_S;
        let change = [wanted[0] - self.tracked[0], wanted[1] - self.tracked[1]];
        let share = most / size(change).max(most);
        self.tracked = [self.tracked[0] + share * change[0], self.tracked[1] + share * change[1]];
        self.turn = turn;
        self.heading = libm::remainder(self.heading + turn * STEP_S, core::f64::consts::TAU);
        let (sin, cos) = libm::sincos(self.heading);
        let [x, y] = self.tracked;
        self.aim = [self.aim[0] + (x * cos - y * sin) * STEP_S, self.aim[1] + (x * sin + y * cos) * STEP_S];
    }

    /// The reference of the next step.
    fn goal(&self) -> Reference {
        let later = self.region.moment_at(self.seconds() + STEP_S);
        let goal = match self.phase {
            Phase::Led | Phase::Holds(_) => self.region.looking_at(&later, self.aim, self.along),
            Phase::Suns => sun_pointing(self.sky.sun.unwrap_or([1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]),
        };
        let [rate_rad_s, acceleration_rad_s2] = self.numbers.slew;
        let near = attitude::quaternion::angle(self.reference.attitude, goal) < CAUGHT;
        if near && self.phase != Phase::Suns {
            let moved = Reference::moving(self.reference.attitude, goal, STEP_S);
            let change = spacecraft::vector::sub(moved.rates_rad_s, self.reference.rates_rad_s);
            let acceleration_rad_s2 = spacecraft::vector::scale(change, 1.0 / STEP_S);
            let most = acceleration_rad_s2.map(f64::abs).into_iter().fold(0.0, f64::max);
            // A jump of the goal is no acceleration that wheels could follow.
            let calm = most < 10.0 * self.numbers.slew[1];
            return Reference { acceleration_rad_s2: if calm { acceleration_rad_s2 } else { [0.0; 3] }, ..moved };
        }
        self.reference.step_towards(&Reference::at_rest(goal), &TurnLimits { rate_rad_s, acceleration_rad_s2 }, STEP_S)
    }

    fn field_body(&self) -> [f64; 3] {
        attitude::quaternion::rotate_back(self.attitude.attitude, self.sky.field_t)
    }

    fn power(&self) -> Power {
        let ([battery_w_h, ..], [panel_w, load_w]) = (self.numbers.battery, self.numbers.power_w);
        Power { battery_w_h, panel_w, load_w }
    }

    /// Angle of the line of sight to the sun beyond the least, in parts of the least; by night there is none.
    fn keeps_out(&self) -> f64 {
        let sight = attitude::quaternion::rotate(self.attitude.attitude, [0.0, 0.0, 1.0]);
        let least = self.numbers.keep_out_deg.to_radians();
        self.sky.sun.map_or(1.0, |sun| (libm::acos(dot(sight, sun).clamp(-1.0, 1.0)) - least) / least)
    }
}

impl Moves for Satellite {
    fn able(&self, requested: BodyMotion) -> Option<BodyMotion> {
        let (most, turns) = (self.numbers.max_speed_m_s as f32, self.numbers.max_turn_rad_s as f32);
        match requested {
            BodyMotion::Velocity { along: [x, y, _], turn } => {
                let share = most / (x * x + y * y).sqrt().max(most);
                Some(BodyMotion::Velocity { along: [x * share, y * share, 0.0], turn: turn.clamp(-turns, turns) })
            }
            BodyMotion::Rest => Some(BodyMotion::Rest),
            BodyMotion::Course { .. } => None,
        }
    }

    fn push(&mut self, motion: BodyMotion, _world: &mut World) {
        let (wanted, turn) = self.wanted(motion);
        self.track(wanted, turn);
        let moment = self.region.moment_at(self.seconds());
        if self.steps.is_multiple_of(SKY_STEPS) {
            self.sky = self.region.sky(&moment);
        }
        let (next, field_body) = (self.goal(), self.field_body());
        let [frequency_rad_s, damping] = self.numbers.controller;
        let controller = Controller { frequency_rad_s, damping };
        let torques = controller.torques(&self.body, &self.attitude, &self.reference.leading_to(&next));
        let dipole = desaturation(&self.body, self.attitude.wheels_n_m_s, field_body, DESATURATION);
        let environment = Environment { field_t: self.sky.field_t, position_m: moment.position_m };
        attitude::step(&mut self.attitude, &self.body, torques, dipole, &environment, STEP_S);
        let share = self.sky.sun.map_or(0.0, |sun| lit(self.attitude.attitude, sun, false));
        self.charge_j = self.power().step(self.charge_j, share, STEP_S);
        self.reference = next;
        self.steps += 1;
        self.look(false);
    }

    fn state(&self, _world: &World) -> State {
        self.seen
    }

    fn body(&self) -> RigidBodyHandle {
        self.handle
    }

    fn shell(&self) -> ColliderHandle {
        self.shell
    }

    fn flight(&self, _world: &World) -> Option<Flight> {
        let moment = self.region.moment_at(self.seconds());
        let axis = |axis: [f64; 3]| {
            let local = self.region.to_local(&moment, attitude::quaternion::rotate(self.attitude.attitude, axis));
            Vector::from(local.map(|part| part as f32))
        };
        let turned = Matrix::from_cols(axis([1.0, 0.0, 0.0]), axis([0.0, 1.0, 0.0]), axis([0.0, 0.0, 1.0]));
        let later = self.region.moment_at(self.seconds() + 1.0);
        Some(Flight {
            place: moment.local_m,
            velocity: [0, 1, 2].map(|k: usize| later.local_m[k] - moment.local_m[k]),
            attitude: Rotation::from_mat3(&turned),
            rates: Vector::from(self.attitude.rates_rad_s.map(|rate| rate as f32)),
            placed: self.phase != Phase::Suns && self.seen.position.x < FURTHEST as f32,
            below: None,
            charge: (self.charge_j / self.power().full_j()) as f32,
        })
    }

    fn sky(&self) -> Option<([f64; 4], Sky)> {
        Some((self.attitude.attitude, self.sky))
    }

    fn safety_margins(&self, requested: BodyMotion, _world: &World) -> Option<SafetyMargins> {
        let led = self.phase == Phase::Led;
        let rate = norm(self.attitude.rates_rad_s) / self.numbers.safe_rate_rad_s;
        let speed = f64::from(self.seen.velocity.length());
        // Open, the payload is safe at rest alone.
        let open = if led { 1.0 - speed / (0.2 * self.numbers.max_speed_m_s) } else { 1.0 };
        let wheels = self.attitude.wheels_n_m_s.map(f64::abs).into_iter().fold(0.0, f64::max);
        let room = 1.0 - wheels / self.numbers.wheel_momentum_n_m_s;
        let least = self.numbers.battery[2];
        let charge = self.charge_j / self.power().full_j();
        Some(SafetyMargins {
            safe: (1.0 - rate).min(open) as f32,
            asked: match requested {
                BodyMotion::Velocity { along: [x, y, _], .. } => {
                    1.0 - (x * x + y * y).sqrt() / (0.2 * self.numbers.max_speed_m_s as f32)
                }
                BodyMotion::Course { .. } | BodyMotion::Rest => 1.0,
            },
            energy: ((charge - least) / least) as f32,
            clearance: if led { room.min(self.keeps_out()) } else { room } as f32,
        })
    }

    /// The fence is where the payload may look; shut, it looks nowhere.
    fn margin(&self, _world: &World, fence: f32) -> f32 {
        if self.phase == Phase::Led { fence } else { NO_LIMIT }
    }
}

fn body(numbers: &Numbers) -> Body {
    let wheel = Wheel {
        max_torque_n_m: numbers.wheel_torque_n_m,
        max_momentum_n_m_s: numbers.wheel_momentum_n_m_s,
        ..Wheel::RWP015
    };
    Body { inertia_kg_m2: numbers.inertia_kg_m2, wheels: [wheel; 3], torquers_a_m2: [numbers.torquer_a_m2; 3] }
}

#[cfg(test)]
mod tests {
    use config::platform::{Body as Kind, Line};
    use wire::time::Instant;

    use super::*;
    use crate::plant::SetPoint;
    use crate::plant::flown::Flown;
    use crate::wind::Wind;

    fn numbers() -> Numbers {
        let line = |text: &str| Line::try_from(text.to_owned()).unwrap();
        Numbers {
            inertia_kg_m2: [0.06, 0.10, 0.13],
            wheel_torque_n_m: 0.004,
            wheel_momentum_n_m_s: 0.015,
            torquer_a_m2: 0.3,
            controller: [1.0, 1.0],
            max_speed_m_s: 3.0,
            max_turn_rad_s: 1.2,
            acceleration_m_s2: [1.5, 3.5],
            slew: [0.01, 0.002],
            safe_rate_rad_s: 0.05,
            hold_s: 20.0,
            keep_out_deg: 30.0,
            battery: [75.0, 0.8, 0.3],
            power_w: [40.0, 15.0],
            elements: [
                line("1 99999U 25001A   25172.50000000  .00002000  00000-0  10000-3 0  9991"),
                line("2 99999  97.5000 250.0000 0010000  90.0000 270.0000 15.18000000    10"),
            ],
            start_overhead_s: [1600.0, 5.0],
            scale_m: 1000.0,
            view_m: 30.0,
        }
    }

    #[test]
    fn line_of_sight_keeps_its_place_over_passing_ground() {
        let mut flown = Flown::new(Wind::default(), Kind::Satellite(numbers()));
        let start = flown.plant.state(&flown.world).position;
        let states = flown.fly(15.0, None, 0.0);
        let off = states.iter().map(|s| (s.position - start).length()).fold(0.0, f32::max);
        assert!(off < 0.05, "{off} km on the ground");
        assert!(
            flown.safety_margins().safe > 0.5 && flown.safety_margins().clearance > 0.5,
            "{:?}",
            flown.safety_margins()
        );
    }

    #[test]
    fn line_of_sight_follows_velocity_and_turn() {
        let mut flown = Flown::new(Wind::default(), Kind::Satellite(numbers()));
        let states = flown.fly(4.0, Some([3.0, 0.0, 0.0]), 0.0);
        let (last, most) = (states.last().unwrap(), states.iter().map(|s| s.velocity.length()).fold(0.0, f32::max));
        assert!((last.speed() - 3.0).abs() < 0.05 && most < 3.2, "{last:?}, at most {most}");
        let turned = flown.fly(3.0, Some([2.0, 0.0, 0.0]), 0.5);
        let last = turned.last().unwrap();
        assert!((last.speed() - 2.0).abs() < 0.1 && (last.yaw_rate - 0.5).abs() < 1e-3, "{last:?}");
    }

    /// Brakes, keeps looking with the payload shut, then turns its array to the sun; with no message, and never fast.
    #[test]
    fn lease_end_holds_and_then_faces_the_sun() {
        let mut flown = Flown::new(Wind::default(), Kind::Satellite(numbers()));
        flown.fly(3.0, Some([3.0, 0.0, 0.0]), 0.0);
        assert!(flown.safety_margins().safe < 0.0 && flown.plant.margin(&flown.world) < 100.0);
        flown.fly(1.5, None, 0.0);
        assert!(
            flown.safety_margins().safe > 0.0 && flown.plant.margin(&flown.world) > 1000.0,
            "{:?}",
            flown.safety_margins()
        );
        for _ in 0..400 {
            flown.fly(1.0, None, 0.0);
            assert!(
                flown.safety_margins().safe > 0.0 && flown.safety_margins().clearance > 0.0,
                "{:?}",
                flown.safety_margins()
            );
        }
        let (attitude, sky) = flown.plant.sky().unwrap();
        let array = attitude::quaternion::rotate(attitude, [0.0, 0.0, -1.0]);
        let off = libm::acos(dot(array, sky.sun.unwrap()).clamp(-1.0, 1.0)).to_degrees();
        assert!(off < 1.0, "{off} degrees off the sun");
        assert!(!flown.plant.flight(&flown.world).unwrap().placed);
    }

    #[test]
    fn region_near_its_horizon_is_looked_at_no_longer() {
        let mut flown = Flown::new(Wind::default(), Kind::Satellite(Numbers { hold_s: 3600.0, ..numbers() }));
        flown.fly(400.0, Some([0.0; 3]), 0.0);
        assert!(!flown.plant.flight(&flown.world).unwrap().placed);
        assert!(flown.safety_margins().safe > 0.0, "{:?}", flown.safety_margins());
    }

    /// A lead can ask for ways of the line of sight alone. Reversed again and again at the greatest speed and turn,
    /// they stay far from a tumble: 0.17 rad/s, which a wheel at its greatest torque reaches in 2.6 s (`spacecraft`).
    #[test]
    fn no_lead_makes_it_tumble() {
        let fastest = |half_s: f64| {
            let mut flown = Flown::new(Wind::default(), Kind::Satellite(numbers()));
            let mut most = 0.0_f32;
            for reversal in 0..(30.0 / half_s) as u32 {
                let sign = if reversal.is_multiple_of(2) { 1.0 } else { -1.0 };
                flown.fly(half_s, Some([sign * 3.0, 0.0, 0.0]), sign * 1.2);
                most = most.max(flown.plant.flight(&flown.world).unwrap().rates.length());
            }
            most
        };
        let fastest = [0.1, 0.3, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0].map(fastest);
        assert!(fastest.iter().all(|rate| *rate < 0.04), "{fastest:?} rad/s");
        assert!(fastest.iter().any(|rate| *rate > 0.018), "{fastest:?} rad/s: the lead has an effect");
    }

    #[test]
    fn wheels_terms_are_refused() {
        let mut flown = Flown::new(Wind::default(), Kind::Satellite(numbers()));
        assert!(!flown.plant.accept(Instant(0), SetPoint::course((1.0, 0.0), Instant(300_000))));
    }
}
