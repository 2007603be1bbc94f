//! Open-loop assessment of other people's recordings: the platform's guards over a log, and over copies of it with false fixes.
//!
//! Bytes in, an [`Assessment`] out; no I/O, no clock. `log` reads PX4 ULog, MCAP and MAVLink telemetry, `map` says which field is which input, `track` makes
//! the readings, `replay` runs the guards of `autonomy` over them, `inject` over copies with the false fixes of `falsify`, `fit` tells how far the guards'
//! model fits the vehicle, `scene` makes a scenario of the route. Intervals and tables are `results`' business. A recorded vehicle reacts to no guard, so no property of
//! the closed loop is assessed.

mod apart;
mod columns;
mod curve;
mod error;
mod facts;
mod falsify;
mod fit;
mod fix;
mod guess;
mod inject;
mod lever;
pub mod log;
pub mod map;
mod motion;
mod parts;
mod read;
mod replay;
mod scene;
mod track;

pub use error::TrackError;
pub use facts::Facts;
pub use falsify::Injection;
pub use guess::{GuessError, guess};
pub use inject::Injected;
pub use replay::Check;
pub use scene::{SceneError, Wanted, scenario_text};

use autonomy::geofence::Geofence;
use config::platform::Limits;
use serde::{Deserialize, Serialize};
use wire::bounds::Bounds;
use wire::time::{Instant, Span};

use inject::Clean;
use log::Log;
use map::Map;
use replay::{Failing, Guards};
use track::Track;

/// Most trips of one test that are listed.
const MAX_LISTED: usize = 5;

/// Numbers of a platform that its guards are handed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Terms {
    /// Its bounds.
    pub bounds: Bounds,
    /// The limits of its guards.
    pub limits: Limits,
}

impl Terms {
    /// Terms of `platforms/ground.toml`.
    pub const GROUND: Terms = Terms { bounds: Bounds::GROUND, limits: Limits::GROUND };
}

/// Result of an assessment.
#[derive(Clone, Debug)]
pub struct Assessment {
    /// Time for which the guards were judged, seconds.
    pub judged_s: f64,
    /// Restarts of the guards by the map's rule.
    pub restarts: u64,
    /// Facts about the readings.
    pub facts: Facts,
    /// Reservations about this recording, a sentence each.
    pub remarks: Vec<String>,
    /// Every test, and last any of them.
    pub trips: Vec<Tripped>,
    /// Every injection.
    pub injected: Vec<Injected>,
}

/// Failures of one test on the recording as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Tripped {
    /// Test; absent for any of them.
    pub check: Option<Check>,
    /// False where the map gives the test no input, or the recording none that can be judged.
    pub judged: bool,
    /// Number of times that it began to fail.
    pub trips: u64,
    /// Time for which it failed, seconds.
    pub failing_s: f64,
    /// Time for which it did not, seconds: a test that fails cannot trip.
    pub at_risk_s: f64,
    /// The first trips.
    pub first: Vec<Moment>,
}

/// A moment of a recording.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Moment {
    /// Seconds from the first fix.
    pub at_s: f64,
    /// Mode, where the map gives one.
    pub mode: Option<String>,
}

/// Runs the guards of a platform over a recording and its copies.
///
/// # Errors
/// When the recording lacks an input that the map names; damage to it is named first.
pub fn assess(log: &Log<'_>, map: &Map, terms: &Terms, seed: u64) -> Result<Assessment, TrackError> {
    let bounds = &terms.bounds;
    let track = track::track(log, map, bounds).map_err(|error| error.because_of(&log.end))?;
    let fence = map.fence.as_ref().map(|fence| {
        let mm = |m: f64| libm::round(m * 1000.0) as i32;
        Geofence::new(&fence.corners.as_ref().iter().map(|[x, y]| (mm(*x), mm(*y))).collect::<Vec<_>>())
    });
    let restart = map.judge.restart_s.as_ref().map(|s| Span(libm::round(*s.as_ref() * 1e6) as u64));
    let lever_m = track.facts.lever_m.unwrap_or_default();
    let fresh = Guards::new(terms, lever_m, fence.as_ref(), restart, &track.pauses);
    let start = track.steps.first().map_or(Instant(0), |step| step.stamp);
    let period = Span::ms(bounds.control_period_ms.max(1));
    let count = (track.end.since(start).0 / period.0) as usize + 1;
    let tick_time = |tick: usize| start + Span(period.0 * tick as u64);
    let mut guards = fresh.clone();
    let ticks: Vec<Option<Failing>> = (0..count).map(|tick| guards.tick(tick_time(tick), &track.steps, None)).collect();
    let counted: Vec<bool> = (0..count).map(|tick| is_counted(map, &track, tick_time(tick))).collect();
    let seconds = period.0 as f64 / 1e6;
    let judged = ticks.iter().zip(&counted).filter(|(tick, counted)| tick.is_some() && **counted).count();
    let fails = |check: Check| match check {
        Check::TimeBase => track.is_timed,
        Check::Geofence => map.fence.is_some(),
        Check::Silence | Check::Gate | Check::Drift => true,
    };
    let mode = |tick: usize| mode_at(&track, tick_time(tick)).map(str::to_owned);
    let failing = |check: Option<Check>, failing: Failing| check.map_or(failing.any(), |check| failing.contains(check));
    let trips = Check::ALL.map(Some).into_iter().chain([None]);
    let trips = trips.map(|check| {
        let of: Vec<Option<bool>> = ticks
            .iter()
            .zip(&counted)
            .map(|(tick, counted)| tick.filter(|_| *counted).map(|tick| failing(check, tick)))
            .collect();
        Tripped::from_ticks(check, check.is_none_or(fails), &of, seconds, mode)
    });
    let trips = trips.collect();
    let clean = Clean { steps: &track.steps, start, period, ticks: &ticks, counted: &counted, pauses: &track.pauses };
    let injected = inject::inject(&clean, &fresh, &map.inject, seed);
    let remarks = fit::remarks(log, map, terms, &track);
    let judged_s = judged as f64 * seconds;
    Ok(Assessment { judged_s, restarts: guards.restarts, facts: track.facts, remarks, trips, injected })
}

fn mode_at(track: &Track, time: Instant) -> Option<&str> {
    let next = track.modes.partition_point(|(from, _)| *from <= time.0);
    track.modes.get(next.checked_sub(1)?).map(|(_, name)| name.as_str())
}

fn is_counted(map: &Map, track: &Track, time: Instant) -> bool {
    let judged = map.mode.as_ref().map_or(&[][..], |mode| &mode.judged);
    judged.is_empty() || mode_at(track, time).is_some_and(|mode| judged.iter().any(|name| name == mode))
}

impl Tripped {
    /// Summary of a test's failing at each tick; none where it is not judged.
    fn from_ticks(
        check: Option<Check>,
        judged: bool,
        ticks: &[Option<bool>],
        seconds: f64,
        mode: impl Fn(usize) -> Option<String>,
    ) -> Self {
        let begins = |tick: &usize| {
            let before = tick.checked_sub(1).and_then(|before| ticks[before]).unwrap_or(false);
            ticks[*tick] == Some(true) && !before
        };
        let began: Vec<usize> = (0..ticks.len()).filter(begins).collect();
        let lasting = |failing: bool| ticks.iter().filter(|tick| **tick == Some(failing)).count() as f64 * seconds;
        let first = began.iter().take(MAX_LISTED);
        Self {
            check,
            judged,
            trips: began.len() as u64,
            failing_s: lasting(true),
            at_risk_s: lasting(false),
            first: first.map(|tick| Moment { at_s: *tick as f64 * seconds, mode: mode(*tick) }).collect(),
        }
    }
}
