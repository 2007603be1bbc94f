//! Injections into a copy of the recording: false fixes from a drawn moment on, while odometry goes on as recorded.
//!
//! Open loop: the recorded vehicle does not react, neither to the false fix nor to the guard. Moments are drawn from those
//! before which, and for the length of the injection after which, no guard fails on the recording as it is; so a
//! failure in that time is the injection's. All injections have the same moments as far as their own past allows.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::time::{Instant, Span};

use crate::falsify::{Injection, Placed, span};
use crate::fix::Place;
use crate::map::Inject;
use crate::replay::{Check, Failing, Guards};
use crate::track::Step;

/// Time before a moment in which no guard fails.
const QUIET: Span = Span::ms(1000);
/// Way within an injection from which on the vehicle counts as moving, metres.
const MOVING_M: f64 = 1.0;

/// Result of one injection over all its moments.
#[derive(Clone, Debug, PartialEq)]
pub struct Injected {
    /// Kind and strength.
    pub injection: Injection,
    /// Moments.
    pub n: u64,
    /// Injections after which a guard failed within the length of the injection.
    pub noticed: u64,
    /// Moments after which the vehicle moved by a metre or more, by odometry.
    pub moving: u64,
    /// Injections during motion that were noticed.
    pub noticed_moving: u64,
    /// Time to the first failing guard for each noticed one, seconds, in order of size.
    pub after_s: Vec<f64>,
    /// Tests that failed at the first failing tick, and how often; several may at one.
    pub by: BTreeMap<Check, u64>,
}

/// A recording as it is, tick by tick, to place injections in.
pub(crate) struct Clean<'a> {
    pub(crate) steps: &'a [Step],
    pub(crate) start: Instant,
    pub(crate) period: Span,
    pub(crate) ticks: &'a [Option<Failing>],
    /// True where the mode is one that is judged.
    pub(crate) counted: &'a [bool],
    /// Pauses between parts: the end of one, and the beginning of the next.
    pub(crate) pauses: &'a [(Instant, Instant)],
}

/// Every injection of the map at seeded moments.
pub(crate) fn inject(clean: &Clean<'_>, fresh: &Guards<'_>, map: &Inject, seed: u64) -> Vec<Injected> {
    let window = span(*map.window_s.as_ref());
    let moments = moments(clean, window, *map.placements.as_ref(), seed);
    let fixes: Vec<(Instant, Place)> = clean.steps.iter().filter_map(|step| Some((step.stamp, step.fix?))).collect();
    let mut results: Vec<Injected> = Injection::from_map(map).into_iter().map(Injected::none).collect();
    let (mut guards, mut tick) = (fresh.clone(), 0);
    for (moment, towards) in moments {
        while tick <= moment {
            guards.tick(clean.tick_time(tick), clean.steps, None);
            tick += 1;
        }
        // The readings of the moment's tick are taken; the injection begins behind it.
        let from = clean.tick_time(moment) + Span(1);
        let moving = clean.way_m(from, from + window) >= MOVING_M;
        for result in &mut results {
            let injection = result.injection;
            // The past of a moment lies within its own part.
            let begin = clean.begin(from);
            let fixes = &fixes[fixes.partition_point(|(stamp, _)| *stamp < begin)..];
            if fixes.first().is_none_or(|(first, _)| *first + span(injection.past_s()) > from) {
                continue;
            }
            let placed = Placed { injection, from, towards, fixes };
            let last = moment + (window.0 / clean.period.0) as usize;
            let mut copy = guards.clone();
            let found = (moment + 1..=last).find_map(|tick| {
                let failing =
                    copy.tick(clean.tick_time(tick), clean.steps, Some(&placed)).filter(|failing| failing.any())?;
                Some((clean.tick_time(tick).since(clean.tick_time(moment)).0 as f64 / 1e6, failing))
            });
            result.count(found, moving);
        }
    }
    results.iter_mut().for_each(|result| result.after_s.sort_by(f64::total_cmp));
    results
}

/// Ticks, in order and all different, with a direction for each.
fn moments(clean: &Clean<'_>, window: Span, wanted: usize, seed: u64) -> Vec<(usize, (f64, f64))> {
    let (before, after) = ((QUIET.0 / clean.period.0) as usize, (window.0 / clean.period.0) as usize);
    let fine: Vec<bool> = clean.ticks.iter().map(|tick| tick.is_some_and(|failing| !failing.any())).collect();
    let (mut run, mut eligible) = (0, Vec::new());
    for (tick, fine) in fine.iter().enumerate() {
        run = if *fine && clean.counted[tick] { run + 1 } else { 0 };
        if run > before + after {
            eligible.push(tick - after);
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn = Vec::new();
    for i in 0..wanted.min(eligible.len()) {
        // Partial Fisher-Yates shuffle: each choice of moments is as likely as any other.
        let other = i + (random.next_u64() % (eligible.len() - i) as u64) as usize;
        eligible.swap(i, other);
        let angle = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 * core::f64::consts::TAU;
        let (sin, cos) = libm::sincos(angle);
        drawn.push((eligible[i], (cos, sin)));
    }
    drawn.sort_by_key(|(tick, _)| *tick);
    drawn
}

impl Clean<'_> {
    pub(crate) fn tick_time(&self, tick: usize) -> Instant {
        self.start + Span(self.period.0 * tick as u64)
    }

    /// Beginning of the part that a moment is in.
    fn begin(&self, moment: Instant) -> Instant {
        let next = self.pauses.partition_point(|(_, begin)| *begin <= moment);
        next.checked_sub(1).map_or(self.start, |last| self.pauses[last].1)
    }

    /// Way by odometry between two times, metres.
    fn way_m(&self, from: Instant, to: Instant) -> f64 {
        let first = self.steps.partition_point(|step| step.stamp <= from);
        let steps = self.steps[first..].iter().take_while(|step| step.stamp <= to);
        let (mut way, mut last) = (0.0, from);
        for step in steps {
            let speed = step.odometry.map_or(0.0, |odometry| f64::from(odometry.speed_mm_s).abs() / 1000.0);
            way += speed * step.stamp.since(last).0 as f64 / 1e6;
            last = step.stamp;
        }
        way
    }
}

impl Injected {
    fn none(injection: Injection) -> Self {
        Self { injection, n: 0, noticed: 0, moving: 0, noticed_moving: 0, after_s: Vec::new(), by: BTreeMap::new() }
    }

    fn count(&mut self, found: Option<(f64, Failing)>, moving: bool) {
        self.n += 1;
        self.moving += u64::from(moving);
        if let Some((after, failing)) = found {
            self.noticed += 1;
            self.noticed_moving += u64::from(moving);
            self.after_s.push(after);
            for check in Check::ALL.into_iter().filter(|check| failing.contains(*check)) {
                *self.by.entry(check).or_default() += 1;
            }
        }
    }
}
