//! A guest in the place of mission and navigation: when it is asked, and where its set-points go.
//!
//! *Bare*, a set-point goes to the plant as it is. *Guarded*, the guest drives inside the guards, the state machine,
//! the fence and the leases of the platform, as a complex function under run-time assurance does (L. Sha, "Using
//! simplicity to control complexity", IEEE Software 18(4), 2001; ASTM F3269). Keys, signatures and links stay with the
//! core in both. A guest that fails drives no more: guarded the unit is stopped, bare the lease of the last set-point
//! ends at the plant. The process, its limits and the form of its messages are left to others; here are only requests
//! and answers.

use config::platform::Limits;
use config::setup::Setup;
use wire::codec::{self, List, Text};
use wire::core::Output;
use wire::drive;
use wire::event::Event;
use wire::guest::{
    Answer, Block, Body, BodyVelocity, ControlStep, Declared, Disc, Fault, MAX_ANSWER, MAX_NAME, MAX_WHY, Medium,
    MissionStart, Place, Reply, Request,
};
use wire::mode::Mode;
use wire::sensor::Navigation;
use wire::time::{Instant, Span};

use crate::config::GuestConfig;
use crate::flight;
use crate::geofence::Motion;
use crate::localisation::wrap;
use crate::navigation::{self, SetPoint, Surroundings};
use crate::{Autonomy, AutonomyConfig};

/// Least time between two entries of the place that a guest drives by.
const PLACED_PERIOD: Span = Span::ms(190);

/// State of the exchange with a guest.
#[derive(Clone, Debug)]
pub(crate) struct Pilot {
    bare: bool,
    period: Span,
    start_limit: Span,
    step_limit: Span,
    stage: Stage,
    /// Number of the newest step.
    number: u32,
    reply: Option<Reply>,
    /// Time of the next step, unless the limit changes before.
    next: Instant,
    /// Limit that the newest step gave, mm/s.
    told: f64,
    /// The newest reading that passed the boundary.
    reading: Option<Navigation>,
    stated: Option<(Declared, Text<MAX_NAME>)>,
    placed: Option<Instant>,
    steps: u32,
    limited: u32,
}

/// Kind and reason of a guest's failure.
type Failure = (Fault, Text<MAX_WHY>);

/// Progress of an exchange. A wait is counted in control periods: time in which the core itself did not run is not the
/// guest's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Starting { periods: u32 },
    Asked { periods: u32 },
    Idle,
    Failed,
}

impl Pilot {
    pub(crate) fn new(config: &GuestConfig, period: Span, now: Instant) -> Self {
        Self {
            bare: config.bare,
            period,
            start_limit: config.start_limit,
            step_limit: config.step_limit,
            stage: Stage::Starting { periods: 0 },
            number: 0,
            reply: None,
            next: now,
            told: 0.0,
            reading: None,
            stated: None,
            placed: None,
            steps: 0,
            limited: 0,
        }
    }

    /// True if its set-points go to the plant as they are.
    pub(crate) fn bare(&self) -> bool {
        self.bare
    }

    /// Keeps a reading for the next step.
    pub(crate) fn read(&mut self, reading: &Navigation) {
        self.reading = Some(*reading);
    }

    /// Counts a control period. The failure of a guest that has not answered in time.
    fn overdue(&mut self) -> Option<String> {
        let (periods, limit) = match &mut self.stage {
            Stage::Starting { periods } => (periods, self.start_limit),
            Stage::Asked { periods } => (periods, self.step_limit),
            Stage::Idle | Stage::Failed => return None,
        };
        *periods = periods.saturating_add(1);
        let waited = Span(u64::from(*periods) * self.period.0);
        (waited > limit)
            .then(|| format!("an answer within {} ms expected, none after {}", limit.0 / 1000, waited.0 / 1000))
    }

    /// The step that an answer is for, as far as it answers what was asked.
    fn accept(&mut self, answer: &Answer) -> Result<Option<Reply>, Box<Failure>> {
        match (self.stage, answer) {
            (_, Answer::Failed { fault, why }) => Err(Box::new((*fault, *why))),
            (Stage::Starting { .. }, Answer::Ready) => {
                self.stage = Stage::Idle;
                Ok(None)
            }
            (Stage::Asked { .. }, Answer::Reply(reply)) if reply.number == self.number => {
                self.stage = Stage::Idle;
                self.steps += 1;
                self.reply = Some(*reply);
                Ok(Some(*reply))
            }
            (Stage::Starting { .. } | Stage::Asked { .. } | Stage::Idle | Stage::Failed, _) => {
                Err(Box::new((Fault::OutOfStep, Text::new("an answer to nothing that was asked"))))
            }
        }
    }
}

/// The mission, as a guest is informed of it at `now`.
pub(crate) fn start(setup: &Setup, config: &AutonomyConfig, now: Instant) -> Output {
    let place = |(x, y): &(i32, i32)| Place(*x, *y);
    let disc = |block: &crate::MapBox| {
        let radius_mm = block.half_mm[0].max(block.half_mm[1]);
        Disc { at: Place(block.x_mm, block.y_mm), radius_mm }
    };
    let block = |block: &crate::MapBox| Block {
        at: Place(block.x_mm, block.y_mm),
        half_mm: block.half_mm,
        heading_mrad: block.heading_mrad,
    };
    ask(Request::Start(Box::new(MissionStart {
        now,
        period: Span::ms(setup.bounds.control_period_ms),
        max_speed_mm_s: setup.bounds.max_speed_mm_s,
        braking_mm_s2: setup.bounds.braking_mm_s2,
        route: config.route.iter().map(place).collect(),
        looped: config.looped,
        fence: config.geofence.iter().map(place).collect(),
        obstacles: config.obstacles.iter().map(disc).collect(),
        blocks: Some(config.obstacles.iter().map(block).collect()),
        pose: config.guest.as_ref().and_then(|guest| guest.start),
        body: Some(body(&config.limits)),
    })))
}

fn body(limits: &Limits) -> Body {
    let aloft = limits.aloft.as_ref();
    let medium = match (limits.free, aloft) {
        (false, _) => Medium::Ground,
        (true, Some(_)) => Medium::Air,
        (true, None) => Medium::Space,
    };
    Body {
        medium,
        size_mm: limits.body_mm,
        curvature_per_km: limits.curvature_per_km,
        reverse_mm_s: limits.reverse_mm_s,
        climb_mm_s: aloft.map_or(0, |aloft| aloft.climb_mm_s),
        cruise_mm: aloft.map_or(0, |aloft| aloft.cruise_mm),
    }
}

/// End of the route, where that does not begin again.
pub(crate) fn goal(config: &AutonomyConfig) -> Option<Place> {
    config.route.last().filter(|_| !config.looped).map(|(x, y)| Place(*x, *y))
}

fn ask(request: Request) -> Output {
    Output::Guest { bytes: codec::encode(&request) }
}

impl Autonomy {
    /// A control period with a guest: asks it, or goes on with its last set-point until it wants to be asked or has
    /// another limit.
    pub(crate) fn pilot(&mut self, now: Instant) {
        let limit = self.guest_limit();
        let Some(pilot) = &mut self.driving.pilot else { return };
        if let Some(reason) = pilot.overdue() {
            return self.guest_failed(now, Fault::Silent, Text::new(&reason));
        }
        let (stage, waits) = (pilot.stage, now < pilot.next && pilot.told == limit);
        if let Some(motion) = self.view.localisation.motion() {
            self.driving.mission.pass(motion.at);
        }
        match stage {
            Stage::Failed => self.stop(now),
            // The last set-point goes on as long as its lease.
            Stage::Starting { .. } | Stage::Asked { .. } => {}
            Stage::Idle if waits => {
                self.drive_as_asked(now);
            }
            Stage::Idle => self.ask_guest(now, limit),
        }
    }

    fn ask_guest(&mut self, now: Instant, limit: f64) {
        let teammates = self.links.teammates.places(now).map(|(x, y)| Place(x as i32, y as i32)).collect();
        let tracks: List<_, 16> = self.view.picture.tracks().iter().copied().collect();
        let mode = self.mode();
        let height_mm = self.height().map(|(_, height)| height as i32);
        let nearby = self.view.picture.nearby().map(|nearby| nearby.iter().copied().collect());
        let Some(pilot) = &mut self.driving.pilot else { return };
        pilot.number += 1;
        pilot.stage = Stage::Asked { periods: 0 };
        pilot.told = limit;
        let step = ControlStep {
            number: pilot.number,
            now,
            mode,
            limit_mm_s: limit as u32,
            navigation: pilot.reading,
            tracks,
            teammates,
            height_mm,
            nearby,
        };
        self.out.push_back(ask(Request::Step(Box::new(step))));
    }

    /// The most that a guest may drive now, mm/s. Bare only operators limit it.
    fn guest_limit(&self) -> f64 {
        match (self.driving.pilot.as_ref().is_some_and(|pilot| pilot.bare), self.mode()) {
            (true, Mode::Ready | Mode::PrepareToAct) => f64::from(self.bounds.max_speed_mm_s),
            (true, Mode::Degraded) => f64::from(self.bounds.degraded_speed_mm_s),
            (true, Mode::Idle | Mode::HoldSafe) => 0.0,
            (false, _) => self.mode_speed(),
        }
    }

    /// The guest has answered.
    pub(crate) fn answered(&mut self, now: Instant, bytes: &[u8]) {
        if self.quiet {
            return;
        }
        let Some(pilot) = self.driving.pilot.as_mut().filter(|pilot| pilot.stage != Stage::Failed) else { return };
        let answer = codec::decode::<Answer>(bytes, MAX_ANSWER);
        let answer = answer.map_err(|error| Box::new((Fault::Malformed, Text::new(&error.to_string()))));
        match answer.and_then(|answer| pilot.accept(&answer)) {
            Ok(Some(reply)) => {
                let period = Span::ms(self.identity.bounds.control_period_ms);
                // On the grid of control periods: the one nearest to the time that the guest asks for.
                pilot.next = now + Span(reply.wake.unwrap_or(period).0.saturating_sub(period.0 / 2));
                self.tell_guest(now, &reply);
                let limited = self.drive_as_asked(now);
                if let Some(pilot) = &mut self.driving.pilot {
                    pilot.limited += u32::from(limited);
                }
            }
            Ok(None) => {}
            Err(failure) => self.guest_failed(now, failure.0, failure.1),
        }
    }

    /// Logs the guest's own word on its state and place.
    fn tell_guest(&mut self, now: Instant, reply: &Reply) {
        let Some(pilot) = &mut self.driving.pilot else { return };
        let stated = reply.state.filter(|_| pilot.stated != reply.state);
        let due = pilot.placed.is_none_or(|time| now.since(time) >= PLACED_PERIOD);
        let placed = reply.place.filter(|_| due);
        if stated.is_some() {
            pilot.stated = stated;
        }
        if placed.is_some() {
            pilot.placed = Some(now);
        }
        if let Some((declared, state)) = stated {
            self.write(now, Event::GuestStated { declared, state });
        }
        if let Some(Place(x_mm, y_mm)) = placed {
            self.write(now, Event::GuestPlaced { x_mm, y_mm });
        }
    }

    /// Gives the newest set-point to the plant. True if the guards limited its motion.
    fn drive_as_asked(&mut self, now: Instant) -> bool {
        let Some((reply, bare)) = self.driving.pilot.as_ref().and_then(|pilot| Some((pilot.reply?, pilot.bare))) else {
            return false;
        };
        if let Some(velocity) = reply.velocity.filter(|_| self.identity.limits.free) {
            return self.fly_as_asked(now, f64::from(reply.speed_mm_s), velocity, bare);
        }
        let requested = SetPoint { speed: f64::from(reply.speed_mm_s), curvature: f64::from(reply.curvature_um) / 1e9 };
        let backs = reply.velocity.is_some();
        let point = if bare { requested } else { self.within_guards(requested, backs, now) };
        self.drive(now, point);
        // The curvature of a vehicle that stands is no motion.
        point.speed != requested.speed || (point.speed != 0.0 && point.curvature != requested.curvature)
    }

    /// A velocity of a body that moves freely, in the air with its climb. True if the guards limited it.
    fn fly_as_asked(&mut self, now: Instant, forward: f64, parts: BodyVelocity, bare: bool) -> bool {
        let BodyVelocity { left_mm_s, up_mm_s, turn_mrad_s } = parts;
        let requested = drive::SetPoint::Velocity { mm_s: [forward as i32, left_mm_s, up_mm_s], turn_mrad_s };
        let point = if bare { requested } else { self.flight_within_guards(forward, parts, now) };
        self.move_freely(now, point);
        point != requested
    }

    /// The set-point as far as guards, mode, fence and seen obstacles let it be followed. Backwards only where LiDAR
    /// looks behind, and for a guest that asks by velocity.
    fn within_guards(&self, requested: SetPoint, backs: bool, now: Instant) -> SetPoint {
        let looks_behind = self.view.picture.nearby().is_some();
        self.among_surroundings(now, |motion, env| {
            if requested.speed < 0.0 && backs && looks_behind {
                return navigation::limited_back(requested, motion, env);
            }
            navigation::limited(requested, motion, env)
        })
        .unwrap_or_default()
    }

    /// A velocity within the guards: its horizontal part as a course in its own direction, the climb within the limits
    /// of height. Without leave to drive the plant rests.
    fn flight_within_guards(&self, forward: f64, parts: BodyVelocity, now: Instant) -> drive::SetPoint {
        let left = f64::from(parts.left_mm_s);
        let (direction, speed) = (libm::atan2(left, forward), libm::hypot(forward, left));
        let course = self.among_surroundings(now, |motion, env| {
            let turned = Motion { yaw: wrap(motion.yaw + direction), ..*motion };
            navigation::limited(SetPoint { speed, curvature: 0.0 }, &turned, env).speed
        });
        let Some(allowed) = course.filter(|_| !self.lost()) else { return drive::SetPoint::Rest };
        let limits = &self.identity.limits;
        let margin = f64::from(self.bounds.fence_margin_mm);
        let climb = self
            .height()
            .map_or(0.0, |(aloft, height)| flight::climb_within(f64::from(parts.up_mm_s), height, aloft, margin));
        let fastest_turn = f64::from(limits.turning_mm_s).max(allowed) * limits.curvature_per_mm() * 1000.0;
        let turn = f64::from(parts.turn_mrad_s).clamp(-fastest_turn, fastest_turn);
        let (sin, cos) = libm::sincos(direction);
        // Gusts move a hover sideways whatever the guest asks for.
        let off = self.off_walls();
        let mm_s = [allowed * cos + off.0, allowed * sin + off.1, climb].map(|part| part as i32);
        drive::SetPoint::Velocity { mm_s, turn_mrad_s: turn as i32 }
    }

    /// Decision on the motion and its surroundings; none without leave to drive or without a place.
    fn among_surroundings<T>(&self, now: Instant, decide: impl FnOnce(&Motion, &Surroundings<'_>) -> T) -> Option<T> {
        let mode_speed = self.mode_speed();
        let motion = self.view.localisation.motion().filter(|_| mode_speed > 0.0)?;
        let seen = self.seen(now);
        let things = self.things_at_height(now);
        let (fence, steered) = (&self.view.fence, self.driving.steered);
        let (bounds, limits) = (&self.bounds, &self.identity.limits);
        let env = Surroundings { mode_speed, seen: &seen, things: &things, steered, fence, bounds, limits };
        Some(decide(&motion, &env))
    }

    fn guest_failed(&mut self, now: Instant, fault: Fault, why: Text<MAX_WHY>) {
        if let Some(pilot) = &mut self.driving.pilot {
            pilot.stage = Stage::Failed;
        }
        self.write(now, Event::GuestFailed { fault, why });
        self.stop(now);
    }

    /// A failed guest's vehicle: guarded it is stopped; bare nobody speaks for the guest, and the plant's lease ends.
    fn stop(&mut self, now: Instant) {
        if self.driving.pilot.as_ref().is_some_and(|pilot| !pilot.bare) {
            self.drive(now, SetPoint::default());
        }
    }

    /// The closing account of the exchange.
    pub(crate) fn close_guest(&mut self, now: Instant) {
        if let Some(Pilot { steps, limited, .. }) = self.driving.pilot {
            self.write(now, Event::GuestSteps { steps, limited });
        }
    }
}
