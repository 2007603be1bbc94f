//! Words on the map: labels of units and tracks, distances, coordinates.
//!
//! Beyond LATE no value stands without *was*. Numbers are `wording`'s.

use wire::event::Freshness;
use wire::id::UnitId;
use wire::mode::Guard;
use wire::report::ReportedTrack;

use crate::age::Labelled;
use crate::gui::view_state::ViewState;
use crate::shown::{Shown, ShownUnit};
use crate::silence::Plan;
use crate::site::Site;
use crate::wording::{at_most, lasting, seconds, tenths};

/// Height from which on kilometres are written, metres.
const HIGH_M: f64 = 10_000.0;

/// A label: the first line, and a second that goes first where room is short.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Lines {
    /// Name and state of a unit; number and class of a track.
    pub(super) first: String,
    /// May be empty.
    pub(super) second: String,
}

/// True if a unit that is heard finds the claims of `of` to contradict each other.
pub(super) fn doubts(shown: &Shown, of: UnitId) -> bool {
    shown.units.iter().filter(|unit| unit.state.freshness() <= Freshness::Late).any(|unit| {
        let state = unit.state.get().0;
        let claimed = state.measured.teammate().is_some_and(|(other, _)| other == of);
        claimed && state.failing.contains(Guard::Teammates)
    })
}

/// The label of a unit: its state, then its speed, or its height above the ground.
pub(super) fn unit(site: &Site, shown: &Shown, unit: &ShownUnit) -> Lines {
    let name = unit.unit.name();
    let (state, freshness) = unit.state.get();
    if unit.is_out_of_contact() {
        return Lines { first: format!("{name}  out of contact"), second: contact(unit) };
    }
    let mode = state.mode.name();
    let word = match freshness {
        Freshness::Fresh if doubts(shown, unit.unit) => "contradicts".to_owned(),
        Freshness::Fresh => mode.to_owned(),
        Freshness::Late => format!("{mode} LATE"),
        Freshness::Stale => "STALE".to_owned(),
        Freshness::Lost => "LINK LOST".to_owned(),
    };
    let second = match freshness {
        Freshness::Fresh if doubts(shown, unit.unit) => "where it says it is".to_owned(),
        Freshness::Fresh | Freshness::Late if unit.pose.freshness() > Freshness::Late => {
            format!("place {}", at_most(unit.pose.age()))
        }
        Freshness::Fresh | Freshness::Late => moving(site, unit),
        Freshness::Stale | Freshness::Lost => {
            format!("was {mode}, {}, {}", moving(site, unit), at_most(unit.state.age()))
        }
    };
    Lines { first: format!("{name}  {word}"), second }
}

/// Height of a unit that leaves the ground, else speed.
fn moving(site: &Site, unit: &ShownUnit) -> String {
    let state = unit.state.get().0;
    let metres = state.motion.map(|motion| motion.up_mm as f64 / 1000.0);
    match metres {
        None => format!("{} m/s", tenths(f64::from(state.speed_mm_s) / 1000.0)),
        Some(metres) if metres < HIGH_M => format!("{} m high", tenths(metres)),
        Some(metres) => {
            let aim = if site.scale_m.is_some() { "looks here, " } else { "" };
            let lit = state.motion.and_then(|motion| motion.sunlit);
            let sun = lit.map_or("", |lit| if lit { ", in the sun" } else { ", in eclipse" });
            format!("{aim}{:.0} km high{sun}", metres / 1000.0)
        }
    }
}

/// Contact of a unit that is silent as planned.
fn contact(unit: &ShownUnit) -> String {
    match unit.plan() {
        Plan::Silence(Some(next)) => format!("contact in {}", lasting(next)),
        Plan::Due(ago) => format!("contact due {} ago", lasting(ago)),
        Plan::Silence(None) => "no other contact is planned".to_owned(),
        Plan::None | Plan::Contact(_) => String::new(),
    }
}

/// The label of a track: number and class, with the unit if it is not the chosen one's, and how sure it is where that
/// is too little to arm on.
pub(super) fn track(
    view_state: &ViewState,
    shown: &Shown,
    unit: &ShownUnit,
    labelled: &Labelled<ReportedTrack>,
    passed: bool,
) -> Lines {
    let (track, freshness) = labelled.get();
    let short = unit.unit.name().trim_start_matches("unit-");
    let of = if unit.unit == view_state.unit { String::new() } else { format!("{short} ") };
    let sure = f64::from(track.confidence) / 1000.0;
    let chosen = view_state.track == Some((unit.unit, track.id));
    let sure = if super::unsure(unit, track, shown) || chosen { format!(" {sure:.2}") } else { String::new() };
    let second = match freshness {
        _ if passed => format!("out of view {}", seconds(labelled.age())),
        _ if unit.is_out_of_contact() => format!("was here, {}", at_most(labelled.age())),
        Freshness::Fresh => at_most(labelled.age()),
        Freshness::Late => format!("LATE {}", at_most(labelled.age())),
        Freshness::Stale => format!("STALE {}", at_most(labelled.age())),
        Freshness::Lost => format!("LOST {}", seconds(labelled.age())),
    };
    Lines { first: format!("{of}{} {}{sure}", track.id.0, track.class.name()), second }
}

/// A distance on the map, metres of it, as one on the ground.
pub(super) fn distance(site: &Site, metres: f32) -> String {
    match site.scale_m {
        Some(scale) if scale >= 100.0 => format!("{} km", tenths(f64::from(metres * scale) / 1000.0)),
        Some(scale) => format!("{} m", tenths(f64::from(metres * scale))),
        None => format!("{} m", tenths(f64::from(metres))),
    }
}

/// A whole number of the axis, metres of the map: in the unit of [`axis_unit`].
pub(super) fn coordinate(site: &Site, metres: f32) -> String {
    let number = metres * site.scale_m.map_or(1.0, |scale| if scale >= 100.0 { scale / 1000.0 } else { scale });
    format!("{number:.0}").replace('-', "−")
}

/// Unit of the axes.
pub(super) fn axis_unit(site: &Site) -> &'static str {
    if site.scale_m.is_some_and(|scale| scale >= 100.0) { "km" } else { "m" }
}
