//! The plant's motion by its own truth, and the distances to the limits that the platform is made for.

use evidence::{Micros, Witnessed};
use explain::Explanation;
use ground_truth::{Any, Note};
use libm::hypot;
use wire::bounds::Bounds;
use wire::id::UnitId;
use wire::mode::Mode;

use super::{ClaimsMade, Clock, Distance, TruthPoint};

/// Most points of the motion that are kept: a pixel each in the widest drawing.
const MAX_POINTS: usize = 480;

/// A statement of the plant: time, place in millimetres, speed in mm/s, distance to the fence in millimetres.
#[derive(Clone, Copy)]
struct Sample {
    at: Micros,
    place: (i32, i32),
    speed: i32,
    fence: i32,
}

fn samples(entries: &[Witnessed]) -> impl Iterator<Item = Sample> {
    entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { unit: UnitId::A, x_mm, y_mm, speed_mm_s, fence_mm, .. }) => {
            Some(Sample { at: w.at, place: (x_mm, y_mm), speed: speed_mm_s, fence: fence_mm })
        }
        _ => None,
    })
}

/// Time of the plant's last statement.
pub(super) fn last(entries: &[Witnessed]) -> Option<Micros> {
    samples(entries).map(|of| of.at).max()
}

/// The speed over time; of a long run every nth statement.
pub(super) fn truth(entries: &[Witnessed], clock: Clock) -> Vec<TruthPoint> {
    let every = samples(entries).count().div_ceil(MAX_POINTS).max(1);
    let point = |of: Sample| TruthPoint { at: clock.seconds_at(of.at), speed: f64::from(of.speed.abs()) / 1e3 };
    samples(entries).step_by(every).map(point).collect()
}

/// Reports that an insider says it sent.
pub(super) fn claims(entries: &[Witnessed]) -> Option<ClaimsMade> {
    let mut all: Option<ClaimsMade> = None;
    for w in entries {
        if let Any::Instrument(Note::Claimed { off_mm, .. }) = w.entry.event {
            let claims = all.get_or_insert(ClaimsMade { n: 0, off_m: 0.0 });
            claims.n += 1;
            claims.off_m = claims.off_m.max(f64::from(off_mm) / 1e3);
        }
    }
    all
}

/// Distances to the limits: of the first change to HOLD_SAFE, else of the first to DEGRADED, and of the whole run to the fence.
pub(super) fn distances(entries: &[Witnessed], explained: &[Explanation], bounds: &Bounds) -> Vec<Distance> {
    let to = |mode| explained.iter().find(|e| e.to == mode);
    let mut all = match (to(Mode::HoldSafe), to(Mode::Degraded)) {
        (Some(stop), _) => stopping(entries, stop, bounds),
        (None, Some(slowing)) => slowed(slowing, bounds),
        (None, None) => Vec::new(),
    };
    let nearest = samples(entries).map(|of| of.fence).min();
    // Where there is no fence the plant says a distance beyond any.
    if let Some(fence) = nearest.filter(|fence| *fence < i32::MAX / 2) {
        let (value, limit) = (f64::from(fence) / 1e3, f64::from(bounds.fence_margin_mm) / 1e3);
        let what = "Nearest to the fence";
        all.push(Distance { what, value, limit, unit: "m", from: "margin of the fence", least: true });
    }
    all
}

fn at_most(what: &'static str, value: f64, (limit, unit): (f64, &'static str), from: &'static str) -> Distance {
    Distance { what, value, limit, unit, from, least: false }
}

fn milliseconds(us: Micros) -> f64 {
    us as f64 / 1e3
}

fn slowed(change: &Explanation, bounds: &Bounds) -> Vec<Distance> {
    let limit = (bounds.to_degraded_ms as f64, "ms");
    let mut all =
        vec![at_most("Loss to DEGRADED", milliseconds(change.split.noticed_us), limit, "Td, by the services' logs")];
    all.extend(displayed("DEGRADED to the display", change, bounds));
    all
}

fn displayed(what: &'static str, change: &Explanation, bounds: &Bounds) -> Option<Distance> {
    let limit = (bounds.freshness_ms as f64, "ms");
    change.split.display_us.map(|us| at_most(what, milliseconds(us), limit, "Tf, age of what is shown"))
}

fn stopping(entries: &[Witnessed], stop: &Explanation, bounds: &Bounds) -> Vec<Distance> {
    let limit = (bounds.to_hold_safe_ms as f64, "ms");
    let noticed = stop.split.noticed_us;
    let mut all = vec![at_most("Loss to HOLD_SAFE", milliseconds(noticed), limit, "Th, by the services' logs")];
    all.extend(displayed("HOLD_SAFE to the display", stop, bounds));
    let Some(standing) = stop.split.standing_us else { return all };
    let (speed, braking) = (f64::from(bounds.max_speed_mm_s) / 1e3, f64::from(bounds.braking_mm_s2) / 1e3);
    let hold = bounds.to_hold_safe_ms as f64 / 1e3;
    let way = way(entries, stop.origin.since_us, stop.at_us + standing);
    let limit = speed * hold + speed * speed / (2.0 * braking);
    all.push(at_most("Way from the loss until it stands", way, (limit, "m"), "v·Th + v²/2a at the largest speed"));
    let time = (noticed + standing) as f64 / 1e6;
    let limit = hold + speed / braking;
    all.push(at_most("Time from the loss until it stands", time, (limit, "s"), "Th + v/a at the largest speed"));
    all
}

/// Way within these times, metres.
fn way(entries: &[Witnessed], from: Micros, to: Micros) -> f64 {
    let within: Vec<Sample> = samples(entries).filter(|of| of.at >= from && of.at <= to).collect();
    let step = |pair: &[Sample]| match pair {
        [a, b] => hypot(f64::from(b.place.0 - a.place.0), f64::from(b.place.1 - a.place.1)),
        _ => 0.0,
    };
    within.windows(2).map(step).sum::<f64>() / 1e3
}
