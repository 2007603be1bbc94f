//! Consistency of teammates' claims.
//!
//! A claim that comes here has passed every check of the trust boundary that the policy requires. Cryptography can tie
//! it to a key; it cannot tell whether the holder of the key speaks for itself. The remaining question is whether
//! claims agree with physics, with each other and with their own time base:
//!
//! - *kinematics*: a unit moves no further than its claimed speed allows, and claims no speed beyond the platform's;
//! - *residual*: over many claims it is where its claimed speed and heading lead ([`Reckoning`]);
//! - *exclusion*: two units, this one among them, are not in one place;
//! - *time base*: one unit's boot, sequence and stamp rise together, and no second source repeats an earlier report.
//!
//! A finding stays until an operator consents to go on ([`Teammates::acquit`]). Attribution and ordering are not judged
//! here: those are refusals, and a refused claim never arrives.

use arrayvec::ArrayVec;
use wire::bounds::Bounds;
use wire::event::Inconsistency;
use wire::id::{Boot, PeerId, Sequence, UnitId};
use wire::mode::Because;
use wire::report::Report;
use wire::session::MAX_TEAMMATES;
use wire::time::{Instant, PeerStamp, Span};

use crate::geofence::{Motion, Point, distance};

/// Oldest that a claimed place may be and still exclude another, at any speed.
const REMEMBERED: Span = Span::s(1);

/// Share of the platform's speed that a claim may state, or odometry: sensors are noisy.
pub(crate) const CLAIMABLE_SPEED: f64 = 1.25;

/// For how long dead reckoning remembers, seconds. An honest unit's speed may be off by 3 % of the platform's
/// permanently: 0.09 m/s, times this, has to stay within half the slack, 0.75 m (`docs/reference/bounds.md`).
const REMEMBERS_S: f64 = 8.0;

/// Longest gap between claims over which speed and heading still say where a unit went, seconds.
const BRIDGED_S: f64 = 1.0;

/// Knowledge of the other units.
#[derive(Clone, Debug, Default)]
pub struct Teammates {
    claims: ArrayVec<Claim, MAX_TEAMMATES>,
    found: Option<(UnitId, Inconsistency)>,
}

/// The newest consistent claim of one unit.
#[derive(Clone, Copy, Debug)]
struct Claim {
    unit: UnitId,
    via: PeerId,
    boot: Boot,
    sequence: Sequence,
    stamp: PeerStamp,
    at: Point,
    /// Without its sign, mm/s.
    speed: f64,
    /// East and north, mm/s, from the claimed speed and heading.
    velocity: Point,
    reckoning: Reckoning,
    /// The earliest that it can have been written, on this host's clock.
    written: Instant,
}

/// Place that a unit should have by the motion it claimed, less the one it claims, with a memory that fades: a constant
/// drift *d* between the two settles at *d·τ*, noise and bounded errors stay as they are.
#[derive(Clone, Copy, Debug, Default)]
struct Reckoning {
    off: Point,
}

/// A finding, to be restored if the operator's consent has no effect.
#[derive(Debug)]
pub struct Acquitted(Option<(UnitId, Inconsistency)>);

impl Teammates {
    /// Takes an accepted report of `unit`, brought by `via`, at most `age` old at `now`; `own_motion` is this unit's
    /// motion. Gives the inconsistency that it reveals. An inconsistent claim leaves earlier ones in place.
    pub fn take(
        &mut self,
        (unit, via): (UnitId, PeerId),
        report: &Report,
        age: Span,
        now: Instant,
        own_motion: Option<Motion>,
        bounds: &Bounds,
    ) -> Option<Inconsistency> {
        let speed = f64::from(report.speed_mm_s);
        let heading = f64::from(report.pose.yaw_mrad) / 1000.0;
        let mut claim = Claim {
            unit,
            via,
            boot: report.boot,
            sequence: report.sequence,
            stamp: report.stamp,
            at: (f64::from(report.pose.x_mm), f64::from(report.pose.y_mm)),
            speed: speed.abs(),
            velocity: (speed * libm::cos(heading), speed * libm::sin(heading)),
            reckoning: Reckoning::default(),
            written: now - age,
        };
        let before = self.claims.iter().position(|known| known.unit == unit);
        if let Some(index) = before {
            claim.reckoning = self.claims[index].reckoned_to(&claim);
        }
        let finding = before
            .and_then(|index| self.claims[index].contradicted_by(&claim, bounds))
            .or_else(|| claim.too_fast(bounds))
            .or_else(|| claim.led_elsewhere(bounds))
            .or_else(|| self.excluded(&claim, now, own_motion, bounds));
        match (finding, before) {
            // The contradicting claim is not stored: it would become the reference for the next one, and make itself
            // true by being repeated.
            (Some(found), _) => self.found = Some((unit, found)),
            (None, Some(at)) if claim.order() > self.claims[at].order() => self.claims[at] = claim,
            // Overtaken on its way by a later one of the same source.
            (None, Some(_)) => {}
            (None, None) => {
                let room = self.claims.try_push(claim);
                debug_assert!(room.is_ok(), "only configured teammates arrive, and they fit");
            }
        }
        finding
    }

    /// Reason that teammates are not consistent, if they are not.
    pub fn inconsistent(&self) -> Option<Because> {
        self.found.map(|(unit, _)| Because::Claim(unit))
    }

    /// The finding that stands, if one does.
    pub fn finding(&self) -> Option<(UnitId, Inconsistency)> {
        self.found
    }

    /// Sets the finding aside on an operator's word.
    #[must_use = "restore it if the operator's order is not carried out"]
    pub fn acquit(&mut self) -> Acquitted {
        Acquitted(self.found.take())
    }

    /// Restores the finding that was set aside.
    pub fn restore(&mut self, acquitted: Acquitted) {
        self.found = self.found.or(acquitted.0);
    }

    /// Places that teammates last consistently claimed, as long as that is worth knowing.
    pub fn places(&self, now: Instant) -> impl Iterator<Item = Point> {
        self.claims.iter().filter(move |claim| now.since(claim.written) <= REMEMBERED).map(|claim| claim.at)
    }

    fn excluded(
        &self,
        claim: &Claim,
        now: Instant,
        own_motion: Option<Motion>,
        bounds: &Bounds,
    ) -> Option<Inconsistency> {
        let other_claims = self.claims.iter().filter(|other| other.unit != claim.unit);
        let other_claims = other_claims.filter(|other| now.since(other.written) <= REMEMBERED);
        let places = other_claims.map(|other| (other.at, other.reach(now)));
        let own_place = own_motion.map(|motion| (motion.at, 0.0));
        let limit = f64::from(bounds.exclusion_mm);
        let mut places = places.chain(own_place);
        let clash = places.any(|(place, reach)| distance(place, claim.at) + reach + claim.reach(now) < limit);
        clash.then_some(Inconsistency::Exclusion)
    }
}

impl Claim {
    fn order(&self) -> (Boot, Sequence) {
        (self.boot, self.sequence)
    }

    /// Longest distance that the unit may have gone since, millimetres.
    fn reach(&self, now: Instant) -> f64 {
        self.speed * seconds(now.since(self.written))
    }

    fn too_fast(&self, bounds: &Bounds) -> Option<Inconsistency> {
        let limit = f64::from(bounds.max_speed_mm_s) * CLAIMABLE_SPEED;
        (self.speed > limit).then_some(Inconsistency::Kinematics)
    }

    fn led_elsewhere(&self, bounds: &Bounds) -> Option<Inconsistency> {
        let off = distance(self.reckoning.off, (0.0, 0.0));
        (off > f64::from(bounds.teammate_slack_mm)).then_some(Inconsistency::Residual)
    }

    /// Dead reckoning of `next`, of the same unit: between claims it went with the mean of both velocities.
    /// Behind a gap or a restart its direction is unknown; then only the excess over its speed counts, so that silence
    /// hides no drift.
    fn reckoned_to(&self, next: &Claim) -> Reckoning {
        if next.order() <= self.order() {
            return self.reckoning;
        }
        let elapsed = self.elapsed_to(next);
        let shift = (next.at.0 - self.at.0, next.at.1 - self.at.1);
        let mean = (0.5 * (self.velocity.0 + next.velocity.0), 0.5 * (self.velocity.1 + next.velocity.1));
        let unled = if self.boot == next.boot && elapsed <= BRIDGED_S {
            (shift.0 - mean.0 * elapsed, shift.1 - mean.1 * elapsed)
        } else {
            let far = distance(shift, (0.0, 0.0));
            let share = ((far - self.speed.max(next.speed) * elapsed) / far.max(1.0)).max(0.0);
            (shift.0 * share, shift.1 * share)
        };
        let weight = (1.0 - elapsed / REMEMBERS_S).max(0.0);
        let off = self.reckoning.off;
        Reckoning { off: (weight * off.0 + unled.0, weight * off.1 + unled.1) }
    }

    /// Seconds from this claim to `next`: by the unit's own clock within one boot, else by when they were written.
    fn elapsed_to(&self, next: &Claim) -> f64 {
        if self.boot == next.boot {
            next.stamp.minus(self.stamp).unsigned_abs() as f64 / 1e6
        } else {
            seconds(next.written.since(self.written))
        }
    }

    /// Contradiction of this claim by `next`, of the same unit.
    fn contradicted_by(&self, next: &Claim, bounds: &Bounds) -> Option<Inconsistency> {
        let same_boot = self.boot == next.boot;
        let later = next.order() > self.order();
        let stamps_rise = next.stamp > self.stamp;
        let repeated = next.order() == self.order();
        let second_source_behind = !later && next.via != self.via;
        if repeated || second_source_behind || (same_boot && later != stamps_rise) {
            return Some(Inconsistency::TimeBase);
        }
        let elapsed = self.elapsed_to(next);
        let allowed = self.speed.max(next.speed) * elapsed + f64::from(bounds.teammate_slack_mm);
        (distance(self.at, next.at) > allowed).then_some(Inconsistency::Kinematics)
    }
}

fn seconds(span: Span) -> f64 {
    span.0 as f64 / 1e6
}
