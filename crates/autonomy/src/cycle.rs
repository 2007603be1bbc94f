//! Periodic work of the core: judge the guards, step the machine, drive, report; and the ways in which a step's effects
//! leave it.

use config::platform::Aloft;
use wire::codec;
use wire::command::CommandKind;
use wire::core::{Output, Subject, Topic};
use wire::drive::{self, Act, Drive};
use wire::event::{Account, Event};
use wire::id::TrackId;
use wire::measured::Measured;
use wire::mode::{Because, Guard, Mode};
use wire::policy::{Check, Requirement};
use wire::refusal::Refusal;
use wire::session::SessionBody;
use wire::settings::Settings;
use wire::time::{Instant, Span};

use crate::View;
use crate::authority::Spent;
use crate::command::Ordered;
use crate::designation::Designated;
use crate::fitness::{Stage, fit};
use crate::flight;
use crate::geofence::{Motion, Point};
use crate::grid::Keepout;
use crate::health::{Findings, Health};
use crate::intake::report_body;
use crate::look::{Aside, Look};
use crate::mission::PlannedWay;
use crate::navigation::{self, SetPoint, Surroundings};
use crate::settings;
use crate::state::Machine;
use crate::telemetry::Sources;
use crate::things::{self, Obstacle};
use crate::transition::{Context, Effect, Effects, Stimulus, Timing};
use crate::{Autonomy, plan};

/// Period of new command nonces.
const NONCE_PERIOD: Span = Span::ms(500);
/// Distance that the way keeps to a thing that is on no map where there is room for it, from centre to centre,
/// millimetres.
const KEEP_CLEAR_MM: f64 = 3000.0;

impl Autonomy {
    /// The deadline has come.
    pub(crate) fn tick(&mut self, now: Instant) {
        let bounds = self.identity.bounds;
        if now >= self.next_control {
            self.next_control = next_grid_point(self.next_control, Span::ms(bounds.control_period_ms), now);
            self.links.seals.mark(now, self.logged.journal.counter());
            self.carry_out_stored(now);
            self.judge(now);
            self.steer(now);
        }
        if now >= self.next_telemetry {
            self.next_telemetry = next_grid_point(self.next_telemetry, Span::ms(bounds.telemetry_period_ms), now);
            self.renew(now);
            self.introduce(now);
            self.report(now);
        }
    }

    /// The closing account.
    pub(crate) fn finish(&mut self, now: Instant) {
        self.quiet = true;
        self.close_guest(now);
        self.logged.accounts.close(now, &mut self.logged.journal, &mut self.out);
        self.logged.journal.sign(now, &mut self.out);
    }

    /// Judges every guard.
    pub(crate) fn assess(&self, now: Instant) -> Health {
        let limit = self.bounds.product_limit();
        let findings = self.view.picture.judge(Findings::default(), now, limit);
        let findings = findings
            .with_finding(Guard::Localisation, self.view.localisation.lost(now, limit))
            .with_finding(Guard::Drift, self.view.localisation.drifts())
            .with_finding(Guard::TimeBase, self.view.localisation.mistimed())
            .with_finding(Guard::Geofence, self.room(now).filter(|spare| *spare < 0.0).map(|_| Because::Itself))
            .with_finding(Guard::Lease, self.links.lease.lapsed(now))
            .with_finding(Guard::Teammates, self.links.teammates.inconsistent())
            .with_finding(Guard::SealedLog, self.links.seals.missing(now));
        let seen = self.view.picture.waived().union(self.view.localisation.waived());
        let evidence = seen.union(self.status.lease_waived);
        Health::judge(findings, self.identity.waived_guards, evidence)
    }

    /// The values that the guards are judged by.
    fn measured(&self, now: Instant) -> Measured {
        let spare = self.room(now).map(|spare| spare.floor() as i32);
        let measured = self.view.localisation.measure(self.view.picture.measure(Measured::default(), now), now);
        measured
            .claimed(self.links.teammates.finding())
            .with_value(Guard::Geofence, spare)
            // At its full age it has lapsed.
            .aged(Guard::Lease, self.links.lease.age(Span::ms(self.bounds.lease_ms), now).map(|age| age + Span(1)))
            .aged(Guard::SealedLog, self.links.seals.age(now))
    }

    /// Motion of the unit, as long as it is known. Without a place there is no distance to the fence; localisation's
    /// own guards report it.
    pub(crate) fn placed(&self, now: Instant) -> Option<Motion> {
        let lost = self.view.localisation.lost(now, self.bounds.product_limit()).is_some();
        self.view.localisation.motion().filter(|_| !lost && !self.view.localisation.distrusted())
    }

    /// Clearance to the envelope that is left, margins taken off, mm; negative is a breach. None while the place is not
    /// known.
    fn room(&self, now: Instant) -> Option<f64> {
        let limits = &self.identity.limits;
        let clearance = self.view.fence.spare(&self.placed(now)?, &self.bounds, limits);
        let margin = f64::from(self.bounds.fence_margin_mm);
        Some(self.height().map_or(clearance, |(aloft, height)| clearance.min(flight::spare(height, aloft, margin))))
    }

    /// Judges the guards and lets the machine follow from them. After the run is over it no longer follows.
    pub(crate) fn judge(&mut self, now: Instant) {
        if self.quiet {
            return;
        }
        self.health = self.assess(now);
        self.log_basis(now);
        let held = self.machine.authority().map(|authority| authority.track());
        let designation = self.designation(held, now);
        let refused = self.step(now, Stimulus::Judged, &designation);
        debug_assert!(refused.is_none(), "only orders can be refused");
    }

    /// Lets the machine carry out an order; gives the refusal if it may not.
    pub(crate) fn obey(&mut self, now: Instant, order: &Ordered) -> Option<Refusal> {
        if self.quiet {
            return Some(Refusal::Interlock { mode: self.mode() });
        }
        // The guards are judged now: the last judgement may be a control period old.
        self.judge(now);
        match order.kind() {
            CommandKind::Resume => self.resume(now, order),
            CommandKind::Arm(track) => self.arm(now, order, track),
            CommandKind::Confirm(track) => self.give(now, order, Some(track)),
            CommandKind::Configure(values) => self.configure(now, order, &values),
            CommandKind::Hold => self.hold(now, order),
            CommandKind::Disarm | CommandKind::Enable => self.give(now, order, None),
        }
    }

    /// A track that is fit but for its bearings is looked at from another side; the operator asks again.
    fn arm(&mut self, now: Instant, order: &Ordered, track: TrackId) -> Option<Refusal> {
        let refused = self.give(now, order, Some(track))?;
        let wanted = self.mode() == Mode::Ready && !self.view.bearings.suffice(track, &self.bounds);
        if let (true, Some(motion), Some(place)) = (wanted, self.placed(now), self.fit_at(track)) {
            self.driving.look = Some(Look::begin(track, place, &motion, now));
        }
        Some(refused)
    }

    /// Place of a track that is fit by itself.
    fn fit_at(&self, track: TrackId) -> Option<Point> {
        let found = self.view.picture.track(track).filter(|found| fit(found, Stage::Held, &self.bounds))?;
        Some((f64::from(found.x_mm), f64::from(found.y_mm)))
    }

    /// Values that are not safe together are refused in every mode, before the mode is asked whether it lets values
    /// change.
    fn configure(&mut self, now: Instant, order: &Ordered, values: &Settings) -> Option<Refusal> {
        let safe = match self.identity.policy.check(Check::Joint) {
            Requirement::Required => settings::jointly_safe(values, &self.identity.bounds, &self.identity.limits),
            Requirement::Waived => Ok(()),
        };
        safe.err().or_else(|| self.give(now, order, None))
    }

    /// Also a unit that holds already does not go on by an order from before.
    fn hold(&mut self, now: Instant, order: &Ordered) -> Option<Refusal> {
        let refused = self.give(now, order, None);
        self.void_stored(now);
        refused
    }

    /// To go on is to acknowledge the finding about teammates: it is set aside, and restored if the other
    /// guards do not let the unit go on.
    fn resume(&mut self, now: Instant, order: &Ordered) -> Option<Refusal> {
        let acquitted = self.links.teammates.acquit();
        self.health = self.assess(now);
        let refused = self.give(now, order, None);
        if refused.is_some() {
            self.links.teammates.restore(acquitted);
            self.health = self.assess(now);
        }
        self.log_basis(now);
        refused
    }

    /// Logs the basis of the unit's judgement, when that has changed: a display's claim of freshness is held against
    /// it.
    fn log_basis(&mut self, now: Instant) {
        let fresh = self.identity.bounds.freshness();
        let placed = self.view.localisation.reported(now).is_some_and(|(_, age)| age <= fresh);
        let tracks = self.view.picture.tracks().iter().filter(|track| now.since(track.updated) <= fresh).count() as u8;
        let judged = Event::Judged { failing: self.health.failing(), placed, tracks };
        if self.logged.judged.replace(judged) != Some(judged) {
            self.write(now, judged);
        }
    }

    fn give(&mut self, now: Instant, order: &Ordered, track: Option<TrackId>) -> Option<Refusal> {
        let designation = self.designation(track, now);
        self.step(now, Stimulus::Ordered(order), &designation)
    }

    fn designation(&self, track: Option<TrackId>, now: Instant) -> Result<Designated, Because> {
        let track = track.ok_or(Because::Itself)?;
        let held = self.machine.authority().is_some_and(|authority| authority.track() == track);
        let stage = if held { Stage::Held } else { Stage::Arming };
        Designated::judge((&self.view.picture, &self.view.bearings), track, stage, &self.bounds, now)
    }

    fn step(
        &mut self,
        now: Instant,
        stimulus: Stimulus<'_>,
        designation: &Result<Designated, Because>,
    ) -> Option<Refusal> {
        let bounds = &self.identity.bounds;
        let timing =
            Timing { hysteresis: Span::ms(bounds.hysteresis_ms), unrecovered: Span::ms(bounds.unrecovered_ms) };
        let mut ctx = Context { now, health: &self.health, designation, mint: &mut self.mint, timing };
        // A fresh machine takes the place of the old one while that is consumed.
        let machine = std::mem::replace(&mut self.machine, Machine::start());
        let (machine, effects) = machine.step(stimulus, &mut ctx);
        self.machine = machine;
        self.carry_out(now, effects)
    }

    fn carry_out(&mut self, now: Instant, effects: Effects) -> Option<Refusal> {
        let (mut refused, mut moved) = (None, false);
        for effect in effects {
            match effect {
                Effect::Transition { from, to, cause, because, failing } => {
                    self.status.cause = cause;
                    moved = true;
                    self.write(now, Event::Transition { from, to, cause, because, failing });
                }
                Effect::Minted { authority, world, track, command, waived } => {
                    self.write(now, Event::Minted { world, authority, track, command, waived });
                }
                Effect::Revoked(revoked) => {
                    self.write(now, Event::Revoked { authority: revoked.authority, cause: revoked.cause });
                }
                Effect::Acted(spent) => self.act(now, &spent),
                Effect::Refused(refusal) => refused = Some(refusal),
                Effect::Configured(settings) => self.configured(&settings),
            }
        }
        if moved {
            self.void_stored(now);
        }
        refused
    }

    /// Values are set, and the plan is made again where they move the margin: else it would lead to where the fence
    /// guard trips, and no operator could get the unit away from there. In IDLE only, for at most 128 × 128 cells.
    fn configured(&mut self, settings: &Settings) {
        let before = self.bounds.fence_margin_mm;
        self.bounds = settings::tighten_bounds(settings, &self.identity.bounds);
        self.status.settings = Some(*settings);
        if self.bounds.fence_margin_mm != before {
            self.driving.mission.replan(plan(&self.view.fence, &self.view.things, &self.bounds, &self.identity.limits));
        }
    }

    fn act(&mut self, now: Instant, spent: &Spent) {
        let Spent { authority, world, track, x_mm, y_mm, command } = *spent;
        let failing = self.health.failing();
        self.write(now, Event::Acted { world, authority, track, command, failing });
        let act = Act { stamp: now, world, authority, track, x_mm, y_mm, command };
        let bytes = self.links.act.seal(now, &codec::encode(&act));
        self.out.push_back(Output::Bus { topic: Topic::Act, bytes });
    }

    /// Sends the set-point for the present mode.
    fn steer(&mut self, now: Instant) {
        if self.quiet {
            return;
        }
        if let Some(motion) = self.view.localisation.motion() {
            self.view.things.update(&self.view.picture, &motion, now);
        }
        if self.driving.pilot.is_some() {
            return self.pilot(now);
        }
        let set_point = self.set_point(now);
        self.drive(now, set_point);
    }

    /// Sends a set-point with its lease.
    pub(crate) fn drive(&mut self, now: Instant, set_point: SetPoint) {
        self.driving.steered = set_point.curvature;
        self.move_freely(now, self.to_plant(set_point));
    }

    /// Gives a set-point in the plant's terms.
    pub(crate) fn move_freely(&mut self, now: Instant, set_point: drive::SetPoint) {
        let drive = Drive { stamp: now, set_point, lease: Span::ms(self.identity.bounds.set_point_lease_ms) };
        let bytes = self.links.drive.seal(now, &codec::encode(&drive));
        self.out.push_back(Output::Bus { topic: Topic::Drive, bytes });
    }

    /// The set-point in the terms of the plant.
    fn to_plant(&self, SetPoint { speed, curvature }: SetPoint) -> drive::SetPoint {
        if !self.identity.limits.free {
            return drive::SetPoint::Course { speed_mm_s: speed as i32, curvature_um: (curvature * 1e9) as i32 };
        }
        let guarded = self.driving.pilot.as_ref().is_none_or(|pilot| !pilot.bare());
        if guarded && (matches!(self.mode(), Mode::Idle | Mode::HoldSafe) || self.lost()) {
            return drive::SetPoint::Rest;
        }
        let turning = f64::from(self.identity.limits.turning_mm_s);
        let off = if guarded { self.off_walls() } else { (0.0, 0.0) };
        flight::velocity(SetPoint { speed, curvature }, self.height(), (turning, off))
    }

    /// Velocity off the map's walls at the unit's height, ahead and to the left, mm/s; none towards the fence. What
    /// perception shows does not push the unit.
    pub(crate) fn off_walls(&self) -> Point {
        let (Some((aloft, height)), Some(motion)) = (self.height(), self.view.localisation.motion()) else {
            return (0.0, 0.0);
        };
        let bounds = &self.bounds;
        if !self.view.fence.keeps(motion.at, f64::from(bounds.fence_margin_mm + self.identity.limits.fence_spare_mm)) {
            return (0.0, 0.0);
        }
        let [length, width] = self.identity.limits.body_mm.map(f64::from);
        let [lowest, _] = flight::reached(aloft, height);
        let high = self.view.things.on_the_map().filter(|thing| thing.top >= lowest);
        flight::off_walls(&motion, libm::hypot(length, width) / 2.0, high.map(|thing| &thing.extent))
    }

    /// Limits of height and the height, of a unit that flies.
    pub(crate) fn height(&self) -> Option<(&Aloft, f64)> {
        self.identity.limits.aloft.as_ref().zip(self.view.localisation.height())
    }

    /// True if the unit does not know where it is.
    pub(crate) fn lost(&self) -> bool {
        self.health.failing().contains(Guard::Localisation) || self.health.unplaced().is_some()
    }

    fn set_point(&mut self, now: Instant) -> SetPoint {
        let mode_speed = self.mode_speed();
        let motion = self.view.localisation.motion().filter(|_| mode_speed > 0.0);
        let Some(motion) = motion else {
            self.driving.turn.end();
            return SetPoint::default();
        };
        let (seen, things) = (self.seen(now), self.things_at_height(now));
        let aside = self.aside(&motion, &seen, now);
        let way = match &aside {
            Some(Aside::Stand) => None,
            Some(Aside::Way(points)) => Some(PlannedWay { points, beyond: points.last().copied() }),
            None => self.driving.mission.way(motion.at, &seen, now),
        };
        let Some(way) = way else {
            self.driving.turn.end();
            return SetPoint::default();
        };
        let (bounds, limits) = (&self.bounds, &self.identity.limits);
        let (fence, steered) = (&self.view.fence, self.driving.steered);
        let env = Surroundings { mode_speed, seen: &seen, things: &things, steered, fence, bounds, limits };
        let requested = navigation::follow(&motion, &way, &env);
        // LiDAR alone looks behind.
        if self.view.picture.nearby().is_none() {
            self.driving.turn.end();
            return requested;
        }
        self.driving.turn.back_up(requested, &motion, &env, now)
    }

    /// Things that the body would touch at its height. None for a satellite's point of sight.
    pub(crate) fn things_at_height(&self, now: Instant) -> Vec<Obstacle> {
        let limits = &self.identity.limits;
        if limits.body_mm == [0, 0] {
            return Vec::new();
        }
        let heights = self.height().map_or([0.0; 2], |(aloft, height)| flight::reached(aloft, height));
        self.view.things.obstacles(now, heights, self.links.teammates.places(now))
    }

    /// Demand of a look under way: a way from where the unit is, to the other side where there is none on its own;
    /// then, with the track borne out, to stand for a while. A look that is done ends.
    fn aside(&mut self, motion: &Motion, seen: &[Keepout], now: Instant) -> Option<Aside> {
        let look = self.driving.look.take().filter(|look| !look.expired(now) && self.mode() == Mode::Ready)?;
        let place = self.fit_at(look.track)?;
        self.driving.looked_at = Some(place);
        if self.view.bearings.suffice(look.track, &self.bounds) {
            self.driving.look = Some(look.done(now));
            return Some(Aside::Stand);
        }
        let lead = |look: &Look| self.driving.mission.lead(motion.at, look.next(motion.at, place)?, seen);
        let (look, points) = [look, look.turned()].into_iter().find_map(|look| Some((look, lead(&look)?)))?;
        self.driving.look = Some(look);
        Some(Aside::Way(std::iter::once(motion.at).chain(points).collect()))
    }

    /// The most that the mode allows, mm/s. Without localisation no speed is safe.
    pub(crate) fn mode_speed(&self) -> f64 {
        let bounds = &self.bounds;
        let lost = self.lost();
        match self.mode() {
            // It keeps its place.
            Mode::Degraded if self.identity.limits.free => 0.0,
            Mode::Ready | Mode::PrepareToAct if !lost => {
                let gusts = self.identity.limits.aloft.map_or(0, |aloft| aloft.gust_spare_mm_s);
                f64::from(bounds.max_speed_mm_s.saturating_sub(gusts))
            }
            Mode::Degraded if !lost => f64::from(bounds.degraded_speed_mm_s),
            Mode::Ready | Mode::PrepareToAct | Mode::Degraded | Mode::Idle | Mode::HoldSafe => 0.0,
        }
    }

    /// Places to keep clear of that are on no map: between things on the map there may be no room for a distance to
    /// their tracks, too.
    pub(crate) fn seen(&self, now: Instant) -> Vec<Keepout> {
        let width = f64::from(self.identity.limits.body_mm[1]);
        let View { picture, things, .. } = &self.view;
        let tracks = picture.tracks().iter().filter(|track| !things.is_on_the_map(track)).map(|track| {
            let at = (f64::from(track.x_mm), f64::from(track.y_mm));
            let least = things::keep_clear(track.class, width);
            Keepout { at, radius: least.max(KEEP_CLEAR_MM), least }
        });
        let places = self.links.teammates.places(now).chain(self.driving.looked_at);
        tracks.chain(places.map(|at| Keepout { at, radius: KEEP_CLEAR_MM, least: KEEP_CLEAR_MM })).collect()
    }

    /// Renews the command nonce and the session's challenge when they are due.
    fn renew(&mut self, now: Instant) {
        let due = |issued: Option<Instant>, period: Span| issued.is_none_or(|time| now.since(time) >= period);
        let (nonce, challenge) = (self.nonce(), self.nonce());
        if due(self.commands.current().map(|(_, time)| time), NONCE_PERIOD) {
            self.commands.issue(nonce, now);
        }
        let period = Span::ms(self.identity.bounds.challenge_period_ms);
        if let Some(session) = self.links.session.as_mut().filter(|session| due(session.challenged_at(), period)) {
            session.challenge(challenge, now);
        }
    }

    /// Repeats the Hello with this unit's session nonce until the peer uses the nonce.
    pub(crate) fn introduce(&mut self, now: Instant) {
        if let Some(nonce) = self.links.session.as_ref().and_then(|session| session.introduction()) {
            self.send(now, SessionBody::Hello(nonce));
        }
    }

    fn report(&mut self, now: Instant) {
        let introduced = self.links.session.as_ref().is_some_and(|session| session.introduced());
        if !introduced || self.quiet {
            return;
        }
        self.logged.reports = self.logged.reports.next();
        let sources = Sources {
            identity: &self.identity,
            machine: &self.machine,
            failing: self.health.failing(),
            measured: self.measured(now),
            status: &self.status,
            localisation: &self.view.localisation,
            picture: &self.view.picture,
            bearings: &self.view.bearings,
            mission: &self.driving.mission,
            commands: &self.commands,
            watched: self.links.session.as_ref().and_then(|session| session.watched()),
            contact: self.links.lease.contact(now),
            crops: &self.view.crops,
        };
        let signed = sources.signed(now, self.logged.reports);
        let places = self.view.picture.tracks().iter().map(|track| (track.id, (track.x_mm, track.y_mm)));
        self.commands.reported(&signed, places);
        self.send(now, report_body(&signed));
        for crop in self.view.crops.unsent() {
            self.send(now, SessionBody::Crop(crop.as_slice().into()));
        }
    }

    fn send(&mut self, now: Instant, body: SessionBody<'_>) {
        let boot = self.identity.boot;
        if self.quiet {
            return;
        }
        if let Some(session) = &mut self.links.session {
            let bytes = session.session_message(now, boot, body);
            self.out.push_back(Output::Record { session: session.id(), bytes });
            self.logged.accounts.count(Account::Sent);
        }
    }

    pub(crate) fn publish(&mut self, subject: Subject, bytes: Vec<u8>) {
        if !self.quiet {
            self.out.push_back(Output::Publish { subject, bytes });
        }
    }
}

/// The first point of the period's grid after `now`.
fn next_grid_point(due: Instant, period: Span, now: Instant) -> Instant {
    let missed = now.since(due).0 / period.0;
    due + Span((missed + 1) * period.0)
}
