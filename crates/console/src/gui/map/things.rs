//! Things with a place on the map: units and their tracks, each with its age, its certainty and its label.
//!
//! A thing may have moved since it was seen: around it stands the circle in which it may be by now at the platform's
//! greatest speed. A lost thing stays at its last place. Painting is left to `paint`, words to `words`.

use eframe::egui::{Pos2, Vec2, vec2};
use wire::event::Freshness;
use wire::id::{TrackId, UnitId};
use wire::report::ReportedTrack;
use wire::time::Span;

use super::camera::View;
use super::place;
use super::words::{self, Lines};
use crate::age::Labelled;
use crate::banner::Sign;
use crate::gui::marks::{self, Shape, Tone};
use crate::gui::view_state::ViewState;
use crate::shown::{Shown, ShownUnit};
use crate::site::Site;

/// The largest circle that is drawn, metres: beyond it the circle says only "anywhere".
const WIDEST: f32 = 60.0;
/// The largest circle of a lost thing, metres: it is drawn to be found, not to hide the rest.
pub(super) const WIDEST_LOST: f32 = 10.0;
/// Time of the way that the line ahead of a unit shows, seconds.
pub(super) const AHEAD_S: f32 = 2.0;

/// A unit's own marks.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnitMark {
    pub(super) unit: UnitId,
    /// Heading, radians counter-clockwise from east.
    pub(super) yaw: f32,
    /// Its way in the next [`AHEAD_S`], points; zero where it is not known to move.
    pub(super) ahead: Vec2,
    /// State by its report.
    pub(super) sign: Sign,
    /// True if another unit finds its claims to contradict each other.
    pub(super) doubted: bool,
}

/// Kind of a thing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Of {
    Unit(UnitMark),
    Track {
        id: (UnitId, TrackId),
        /// Its unit no longer reports it.
        passed: bool,
        /// Half of the greatest extent of its class, points.
        half: f32,
    },
}

/// Something with a place, an age and a name.
#[derive(Clone, Debug)]
pub(super) struct Thing {
    pub(super) at: Pos2,
    /// Radius of the circle in which it may be, points.
    pub(super) may_be: f32,
    pub(super) tone: Tone,
    pub(super) shape: Shape,
    pub(super) label: Lines,
    pub(super) freshness: Freshness,
    /// Certainty of the unit about a track, 0 to 1.
    pub(super) sure: f32,
    pub(super) of: Of,
    pub(super) chosen: bool,
}

impl Thing {
    /// True if it is a unit.
    pub(super) fn is_unit(&self) -> bool {
        matches!(self.of, Of::Unit(_))
    }

    /// True if it is a track that its unit no longer reports: a mark without a label unless chosen.
    pub(super) fn is_passed(&self) -> bool {
        matches!(self.of, Of::Track { passed: true, .. })
    }

    /// The unit, and the track if it is one.
    pub(super) fn key(&self) -> (UnitId, Option<TrackId>) {
        match self.of {
            Of::Unit(mark) => (mark.unit, None),
            Of::Track { id: (unit, track), .. } => (unit, Some(track)),
        }
    }

    /// Half of the side of its symbol, points.
    pub(super) fn half(&self) -> f32 {
        match (self.of, self.chosen) {
            (_, true) => 17.0,
            (Of::Unit(_), false) => 12.0,
            (Of::Track { .. }, false) => 8.0,
        }
    }

    /// Half of the side of all that is drawn at its place, points, as far as its label keeps off that.
    pub(super) fn outer(&self) -> f32 {
        match self.of {
            Of::Track { half, .. } if self.freshness < Freshness::Lost => self.half().max(half.min(MOST_OUTER)),
            Of::Track { .. } | Of::Unit(_) => self.half(),
        }
    }
}

/// The largest extent that a label keeps off, points.
const MOST_OUTER: f32 = 36.0;

/// The platform's greatest speed, m/s.
pub(super) fn fastest(shown: &Shown) -> f32 {
    shown.bounds.max_speed_mm_s as f32 / 1000.0
}

/// Everything on the map, the most important last: the worst first, so that the fresh are painted above them, units
/// above tracks, the chosen above all.
pub(super) fn all(view_state: &ViewState, site: &Site, shown: &Shown, view: &View) -> Vec<Thing> {
    let mut things = Vec::new();
    for unit in &shown.units {
        let tracks = unit.tracks.iter().map(|track| (track, false));
        let lost = unit.lost.iter().map(|lost| (&lost.track, true));
        let marks = tracks.chain(lost).map(|(track, passed)| track_thing(view_state, shown, unit, view, track, passed));
        things.extend(marks);
        things.push(unit_thing(view_state, site, shown, unit, view));
    }
    things.sort_by_key(|thing| (thing.is_unit(), thing.chosen, std::cmp::Reverse(thing.freshness), thing.key()));
    things
}

fn may_be(shown: &Shown, view: &View, age: Span, freshness: Freshness) -> f32 {
    let widest = if freshness == Freshness::Lost { WIDEST_LOST } else { WIDEST };
    view.long((age.as_ms() as f32 / 1000.0 * fastest(shown)).min(widest))
}

fn track_thing(
    view_state: &ViewState,
    shown: &Shown,
    unit: &ShownUnit,
    view: &View,
    labelled: &Labelled<ReportedTrack>,
    passed: bool,
) -> Thing {
    let (track, of) = labelled.get();
    let freshness = if passed { Freshness::Lost } else { of };
    let (tone, shape) = match (passed, unit.is_out_of_contact()) {
        (true, _) => (Tone::Weak, Shape::Cross),
        (false, true) => (Tone::Weak, Shape::Ring),
        (false, false) => {
            let (tone, shape, _) = marks::track(of, false);
            (tone, shape)
        }
    };
    let may_be = if unit.is_out_of_contact() { 0.0 } else { may_be(shown, view, labelled.age(), freshness) };
    let id = (unit.unit, track.id);
    // The extent is the greatest that perception takes for the class, in any direction: a report states no heading.
    // A place of an orbit's catalogue has none.
    let orbits = unit.state.get().0.motion.is_some_and(|motion| motion.sunlit.is_some());
    let half = if orbits { 0.0 } else { view.long(f32::from(track.class.largest_mm()[0]) / 2000.0) };
    Thing {
        at: view.position(place(track.x_mm, track.y_mm)),
        may_be,
        tone,
        shape,
        label: words::track(view_state, shown, unit, labelled, passed),
        freshness,
        sure: f32::from(track.confidence.min(1000)) / 1000.0,
        of: Of::Track { id, passed, half },
        chosen: view_state.track == Some(id),
    }
}

fn unit_thing(view_state: &ViewState, site: &Site, shown: &Shown, unit: &ShownUnit, view: &View) -> Thing {
    let (pose, freshness) = unit.pose.get();
    let sign = unit.sign();
    let planned = unit.is_out_of_contact();
    let doubted = words::doubts(shown, unit.unit);
    let tone = match (freshness, planned) {
        (_, true) => Tone::Normal,
        (Freshness::Fresh, false) if doubted => Tone::Caution,
        (of, false) => marks::freshness(of).0,
    };
    let yaw = f32::from(pose.yaw_mrad) / 1000.0;
    Thing {
        at: view.position(place(pose.x_mm, pose.y_mm)),
        may_be: if planned { 0.0 } else { may_be(shown, view, unit.pose.age(), freshness) },
        tone,
        shape: Shape::Triangle,
        label: words::unit(site, shown, unit),
        freshness,
        sure: 1.0,
        of: Of::Unit(UnitMark { unit: unit.unit, yaw, ahead: ahead(unit, yaw, view), sign, doubted }),
        chosen: view_state.unit == unit.unit,
    }
}

/// The way of a unit in the next [`AHEAD_S`] at its reported velocity, while that is known.
fn ahead(unit: &ShownUnit, yaw: f32, view: &View) -> Vec2 {
    let (state, freshness) = unit.state.get();
    if freshness > Freshness::Late {
        return Vec2::ZERO;
    }
    let left_mm_s = state.motion.map_or(0, |motion| motion.left_up_mm_s[0]);
    let [forward, left] = [state.speed_mm_s, left_mm_s].map(|mm_s| view.long(mm_s as f32 / 1000.0 * AHEAD_S));
    let (sin, cos) = libm::sincosf(yaw);
    vec2(forward * cos - left * sin, -(forward * sin + left * cos))
}

/// The track nearest to a point of the window, within `reach`.
pub(super) fn nearest_track(things: &[Thing], to: Pos2, reach: f32) -> Option<(UnitId, TrackId)> {
    let tracks = things.iter().filter_map(|thing| match thing.of {
        Of::Track { id, .. } => Some((id, thing.at.distance(to))),
        Of::Unit(_) => None,
    });
    let near = tracks.filter(|(_, far)| *far <= reach);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(id, _)| id)
}
