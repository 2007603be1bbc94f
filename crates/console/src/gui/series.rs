//! Values over time that can be plotted: of each its name, its present value, its limits and its samples.
//!
//! They are read from the trace of a unit ([`crate::trace`]). Drawing them is left to `plots`.

use wire::event::Freshness;
use wire::id::TrackId;
use wire::measured::Limit;
use wire::mode::Guard;
use wire::time::{Instant, Span};

use super::words::seconds;
use crate::shown::{Shown, ShownUnit};
use crate::trace::Sample;
use crate::wording::{self, tenths};

/// Value over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Series {
    /// Measurement of a guard.
    Guard(Guard),
    /// Forward speed.
    Speed,
    /// Greatest possible age of the report that is shown.
    Age,
    /// Confidence of a track.
    Confidence(TrackId),
    /// Height.
    Height,
    /// Charge of the battery.
    Battery,
}

/// A limit of a value: its name, and the value.
pub(super) type Bound = (String, f64);

impl Series {
    /// The series of a unit: its age if it is silent, those that fail, then the chosen guard's, then those of every unit.
    pub(super) fn of(shown: &Shown, unit: &ShownUnit, picked: Option<Guard>, track: Option<TrackId>) -> Vec<Self> {
        let state = unit.state.get().0;
        let measured = |guard: &Guard| Limit::for_guard(*guard, &shown.bounds).is_some();
        let failing = state.failing.iter().filter(measured).take(2);
        let silent = unit.state.freshness() > Freshness::Late && !unit.is_out_of_contact();
        let mut all: Vec<Self> = silent.then_some(Series::Age).into_iter().collect();
        all.extend(failing.chain(picked).map(Series::Guard));
        let flies = state.motion.is_some();
        all.push(Series::Speed);
        if flies {
            all.push(Series::Height);
        }
        all.extend([Series::Guard(Guard::Geofence), Series::Age]);
        if flies {
            all.push(Series::Battery);
        }
        let track = track.or(state.authority.map(|held| held.track));
        let surest =
            || unit.tracks.iter().map(|track| track.get().0).max_by_key(|track| (track.confidence, track.id.0));
        all.extend(track.or_else(|| surest().map(|track| track.id)).map(Series::Confidence));
        let mut once = Vec::new();
        all.into_iter().for_each(|series| {
            if !once.contains(&series) {
                once.push(series);
            }
        });
        once
    }

    /// Name of the value.
    pub(super) fn name(self, unit: &ShownUnit) -> String {
        match self {
            Series::Guard(guard) => wording::guard(unit.state.get().0.suite(), guard).to_owned(),
            Series::Speed => "Speed".to_owned(),
            Series::Age => "Age of report".to_owned(),
            Series::Confidence(track) => format!("Confidence {}", track.0),
            Series::Height => "Height".to_owned(),
            Series::Battery => "Battery".to_owned(),
        }
    }

    /// The present value in words; `None` where it is not known.
    pub(super) fn now(self, shown: &Shown, unit: &ShownUnit) -> Option<String> {
        if self == Series::Age {
            return Some(wording::at_most(unit.state.age()));
        }
        let value = self.value(unit.trace.close().next_back()?)?;
        Some(match self {
            Series::Guard(guard) => {
                let limit = Limit::for_guard(guard, &shown.bounds)?;
                wording::reading(unit.state.get().0.measured.value(guard)?, limit)
            }
            Series::Speed => format!("{} m/s", tenths(value)),
            Series::Age => seconds(unit.state.age()),
            Series::Confidence(_) => format!("{value:.2}"),
            Series::Height if value >= 10_000.0 => format!("{:.0} km", value / 1000.0),
            Series::Height => format!("{} m", tenths(value)),
            Series::Battery => format!("{value:.0} %"),
        })
    }

    /// The value in a report, in the unit of its [`bounds`](Self::bounds).
    pub(super) fn value(self, sample: &Sample) -> Option<f64> {
        match self {
            Series::Guard(guard) => {
                let value = sample.measured.value(guard).filter(|value| *value != i32::MAX)?;
                Some(if guard == Guard::Geofence { f64::from(value) / 1000.0 } else { f64::from(value) })
            }
            Series::Speed => Some(f64::from(sample.speed_mm_s) / 1000.0),
            Series::Age => sample.age.map(in_seconds),
            Series::Confidence(track) => sample.confidence_of(track).map(|permille| f64::from(permille) / 1000.0),
            Series::Height => sample.motion.map(|motion| motion.up_mm as f64 / 1000.0),
            Series::Battery => sample.motion.map(|motion| f64::from(motion.charge) / 10.0),
        }
    }

    /// The limits that the value is held against.
    pub(super) fn bounds(self, shown: &Shown, unit: &ShownUnit) -> Vec<Bound> {
        let settings = unit.settings(&shown.bounds);
        let permille =
            |name: &str, value: u16| (format!("{name} {:.2}", f64::from(value) / 1000.0), f64::from(value) / 1000.0);
        let age = |name: &str, span: Span| (format!("{name} {} s", tenths(in_seconds(span))), in_seconds(span));
        match self {
            Series::Guard(guard) => match Limit::for_guard(guard, &shown.bounds) {
                Some(Limit::Spare(_)) => vec![("stops here".to_owned(), 0.0)],
                Some(Limit::Age(most)) => vec![(format!("most {most}"), f64::from(most))],
                Some(Limit::Drift(most)) => vec![("limit".to_owned(), f64::from(most))],
                Some(Limit::Offset(most)) => {
                    let most = f64::from(most);
                    vec![("limit".to_owned(), most), ("limit".to_owned(), -most)]
                }
                None => Vec::new(),
            },
            Series::Speed => {
                let most = f64::from(settings.speed_mm_s) / 1000.0;
                vec![(format!("most {}", tenths(most)), most)]
            }
            Series::Age => vec![age("late", shown.limits.fresh), age("lost", shown.limits.stale)],
            Series::Confidence(_) => {
                vec![permille("arm", settings.arm_permille), permille("keep", settings.keep_permille)]
            }
            Series::Height | Series::Battery => Vec::new(),
        }
    }

    /// Whether it is beyond a limit now.
    pub(super) fn fails(self, unit: &ShownUnit) -> bool {
        matches!(self, Series::Guard(guard) if unit.state.get().0.failing.contains(guard))
    }

    /// Points of the plot, seconds before now and value, in pieces: a time without reports is left out. The age
    /// of a report grows until the next one.
    pub(super) fn pieces(self, shown: &Shown, unit: &ShownUnit, whole: bool) -> Vec<Vec<[f64; 2]>> {
        let gap = if whole {
            Span(unit.trace.apart().0.saturating_mul(3))
        } else {
            Span::ms(5 * shown.bounds.telemetry_period_ms)
        };
        let samples: Vec<&Sample> =
            if whole { unit.trace.whole().iter().collect() } else { unit.trace.close().collect() };
        let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
        let mut last: Option<(Instant, f64)> = None;
        for sample in samples {
            let Some(value) = self.value(sample) else { continue };
            let x = -in_seconds(shown.at.since(sample.at));
            let near = last.is_some_and(|(at, _)| sample.at.since(at) <= gap);
            match (pieces.last_mut(), last) {
                (Some(piece), Some((at, before))) if self == Series::Age && !whole => {
                    // The greatest age that was shown: right before the next report.
                    piece.push([x, before + in_seconds(sample.at.since(at))]);
                }
                (Some(piece), _) if near => piece.push([x, value]),
                _ => pieces.push(vec![[x, value]]),
            }
            last = Some((sample.at, value));
        }
        if let (Series::Age, Some((at, value)), Some(piece)) = (self, last, pieces.last_mut()) {
            piece.push([0.0, value + in_seconds(shown.at.since(at))]);
        }
        pieces
    }
}

/// A span in seconds.
pub(super) fn in_seconds(span: Span) -> f64 {
    span.as_ms() / 1000.0
}
