//! Tracks that end: an event, since a unit drives past the things that it sees. One asks for an act if it was designated, or was
//! last seen in the unit's way; several at once, and none left, are a sensor's.
//!
//! The way ahead is the unit's stopping distance from its present speed and the platform's sure braking, and
//! [`AHEAD_MM`] beyond, in the direction in which it moves, or looks while it stands. It is as wide on either side as
//! two units are kept apart, and at least [`BESIDE_MM`]. The console knows no route.

use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::id::{Boot, TrackId, UnitId};
use wire::person::Alarm;
use wire::report::ReportedTrack;
use wire::sensor::Pose;
use wire::time::{Instant, Span};

use crate::alarm::LedTo;
use crate::finding::Findings;
use crate::history::{History, Incident};
use crate::life::Life;
use crate::shown::{LostTrack, Shown, ShownUnit};

/// A track that ended less than this from one that is still reported is taken for the same object, millimetres.
pub const SAME_MM: f64 = 1_500.0;
/// Way beyond the stopping distance that counts as ahead, millimetres.
pub const AHEAD_MM: f64 = 3_000.0;
/// Least distance to either side of the way that counts as in it, millimetres.
pub const BESIDE_MM: f64 = 1_000.0;
/// Tracks of a unit that end within [`TOGETHER`] and, if none is left or its sensors fail, are a sensor's failure.
pub const SEVERAL: usize = 3;
/// Time within which they do.
pub const TOGETHER: Span = Span::s(1);
/// Time after the tracks within which a failing guard over the unit's sensors is their cause.
const GUARD_WITHIN: Span = Span::s(2);

/// A track that ended, and the cause it belongs to if it asks for an act.
#[derive(Clone, Copy, Debug)]
struct End {
    boot: Boot,
    track: TrackId,
    since: Instant,
    cause: Option<Alarm>,
}

/// Ended tracks of a unit, as many as are shown as lost.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ended {
    ends: Vec<End>,
    /// The last designated track, and when it was.
    designated: Option<(TrackId, Instant)>,
}

impl Ended {
    /// Judges the tracks that ended. `authority` is the track that was designated until now; `sensors` the cause of the
    /// unit's mode if its sensors are, and whether that is new.
    pub(crate) fn look(
        &mut self,
        shown: &Shown,
        unit: &ShownUnit,
        authority: Option<TrackId>,
        (sensors, changed): (Option<Alarm>, bool),
        found: &mut Findings,
        history: &mut History,
    ) {
        let held = unit.state.get().0.authority.map(|held| held.track).or(authority);
        self.designated = held.map(|track| (track, shown.at)).or(self.designated);
        let before = core::mem::take(&mut self.ends);
        let mut newest = None;
        for lost in &unit.lost {
            let (track, _) = lost.track.get();
            let key = (lost.boot, track.id, lost.since);
            let end = before.iter().find(|end| (end.boot, end.track, end.since) == key).copied();
            self.ends.push(end.unwrap_or_else(|| {
                newest = Some(lost.since);
                history.note(lost.since, Incident::TrackEnded(unit.unit, track.id, track.class));
                let asks = self.designated(shown, unit.unit, track.id) || in_way(unit, track, &shown.bounds);
                let cause = asks.then_some(Alarm::TrackLost(unit.unit, lost.boot, track.id));
                End { boot: lost.boot, track: track.id, since: lost.since, cause }
            }));
        }
        if let Some(newest) = newest {
            let near = |end: &End| newest.since(end.since) <= TOGETHER;
            // Of a world full of objects several go out of view in one turn: then others are still reported.
            let blind = sensors.is_some() || unit.tracks.is_empty();
            if blind && self.ends.iter().filter(|end| near(end)).count() >= SEVERAL {
                self.belong(sensors.unwrap_or(Alarm::TracksLost(unit.unit)), unit, near, found);
            } else if let Some(sensors) = sensors {
                self.belong(sensors, unit, |end| near(end) && end.cause.is_some(), found);
            }
        }
        if let (Some(sensors), true) = (sensors, changed) {
            let near = |end: &End| end.cause.is_some() && unit.since.since(end.since) <= GUARD_WITHIN;
            self.belong(sensors, unit, near, found);
        }
        for (end, lost) in self.ends.iter().zip(&unit.lost) {
            self.tell(end, lost, unit, found);
        }
    }

    /// Adds the finding of an ended track, or the track to that of its cause while it stands.
    fn tell(&self, end: &End, lost: &LostTrack, unit: &ShownUnit, found: &mut Findings) {
        let suite = unit.state.get().0.suite();
        let Some(cause) = end.cause else { return };
        if let Alarm::TrackLost(..) = cause {
            found.of(cause, suite);
            return;
        }
        let stands = matches!(cause, Alarm::TracksLost(_)) || found.0.iter().any(|finding| finding.cause == cause);
        if stands {
            let class = lost.track.get().0.class;
            found.of(cause, suite).led_to.push((end.since, LedTo::TrackEnded(unit.unit, end.track, class)));
        }
    }

    /// Makes `cause` the cause of these.
    fn belong(&mut self, cause: Alarm, unit: &ShownUnit, which: impl Fn(&End) -> bool, found: &mut Findings) {
        let suite = unit.state.get().0.suite();
        for end in self.ends.iter_mut().filter(|end| which(end)) {
            if let Some(before) = end.cause.filter(|before| *before != cause) {
                found.of(cause, suite).absorbs.push(before);
            }
            end.cause = Some(cause);
        }
    }

    /// Tracks that the cause is about.
    pub(crate) fn of(&self, cause: &Alarm) -> impl Iterator<Item = (Boot, TrackId)> {
        let cause = *cause;
        self.ends.iter().filter(move |end| end.cause == Some(cause)).map(|end| (end.boot, end.track))
    }

    /// True if the track holds or just held authority, or is chosen by an order under way. Authority ends before its
    /// track does, at most by its own longest time here.
    fn designated(&self, shown: &Shown, unit: UnitId, track: TrackId) -> bool {
        let within = Span::ms(shown.bounds.authority_ms);
        let held = self.designated.is_some_and(|(held, at)| held == track && shown.at.since(at) <= within);
        let chosen = |kind| matches!(kind, CommandKind::Arm(of) | CommandKind::Confirm(of) if of == track);
        let under_way = |command: &crate::life::ShownCommand| {
            command.under_way() || matches!(command.life, Life::Staged | Life::Stored(_))
        };
        held || shown.commands.iter().any(|given| given.unit == unit && chosen(given.kind) && under_way(given))
    }
}

fn in_way(unit: &ShownUnit, track: &ReportedTrack, bounds: &Bounds) -> bool {
    let (state, _) = unit.state.get();
    let left = state.motion.map_or(0, |motion| motion.left_up_mm_s[0]);
    let apart = |other: &ReportedTrack| {
        libm::hypot(f64::from(other.x_mm) - f64::from(track.x_mm), f64::from(other.y_mm) - f64::from(track.y_mm))
    };
    // An object that goes on under another number is still seen.
    let is_seen = unit.tracks.iter().any(|other| apart(other.get().0) < SAME_MM);
    !is_seen && is_ahead(unit.pose.get().0, [state.speed_mm_s, left], [track.x_mm, track.y_mm], bounds)
}

/// True if the place, millimetres east and north, is in the way of a body that moves so, mm/s forward and to its left.
fn is_ahead(pose: &Pose, velocity: [i32; 2], place: [i32; 2], bounds: &Bounds) -> bool {
    let [forward, left] = velocity.map(f64::from);
    let turned = if velocity == [0, 0] { 0.0 } else { libm::atan2(left, forward) };
    let (sin, cos) = libm::sincos(f64::from(pose.yaw_mrad) / 1000.0 + turned);
    let (east, north) = (f64::from(place[0]) - f64::from(pose.x_mm), f64::from(place[1]) - f64::from(pose.y_mm));
    let (along, across) = (east * cos + north * sin, north * cos - east * sin);
    let stopping = (forward * forward + left * left) / (2.0 * f64::from(bounds.braking_mm_s2.max(1)));
    let beside = f64::from(bounds.exclusion_mm).max(BESIDE_MM);
    along >= 0.0 && along <= stopping + AHEAD_MM && across.abs() <= beside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn way_ahead_is_the_stopping_distance_and_three_metres() {
        let bounds = Bounds::GROUND;
        let north = Pose { x_mm: 1_000, y_mm: -2_000, yaw_mrad: 1571 };
        let ahead = |velocity, along: i32, left: i32| {
            is_ahead(&north, velocity, [north.x_mm - left, north.y_mm + along], &bounds)
        };
        // 3 m/s stop within 1.5 m at 3 m/s².
        assert!(ahead([3_000, 0], 4_490, 0) && !ahead([3_000, 0], 4_510, 0));
        assert!(ahead([0, 0], 2_990, 0) && !ahead([0, 0], 3_010, 0), "it stands");
        assert!(!ahead([3_000, 0], -100, 0), "it has passed it");
        assert!(ahead([3_000, 0], 2_000, 1_490) && !ahead([3_000, 0], 2_000, 1_510), "beside it");
        assert!(ahead([-3_000, 0], -4_000, 0) && !ahead([-3_000, 0], 1_000, 0), "it backs");
        assert!(ahead([0, 2_000], 0, 3_000) && !ahead([0, 2_000], 3_000, 0), "it moves sideways");
    }
}
