//! Conversion of a recording and its map to the readings that the guards take: fixes, odometry, modes, set-points.
//!
//! World frame: metres east and north, of the first fix where the recording has latitude and longitude, else of the fixes' own zero. A
//! reading is made at each fix, with the mean of odometry since the reading before; where fixes fail to come for longer than the platform's
//! limit, readings with odometry alone go on at its control period. Numbers between samples are interpolated, within each of `parts`; these are
//! put one behind another, with a pause between two of them that is not judged. Inputs come from `read`.

use wire::bounds::Bounds;
use wire::sensor::Odometry;
use wire::time::{Instant, Span};

use crate::apart;
use crate::columns::{Columns, in_order};
use crate::error::{MAX_PERIODS, TrackError};
use crate::facts::Facts;
use crate::fix::Place;
use crate::lever;
use crate::log::Log;
use crate::map::{Map, ModeMap, SetpointMap};
use crate::motion::two;
use crate::parts::{Stretches, Timed};
use crate::read::{Part, Read};

/// A reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    pub(crate) stamp: Instant,
    pub(crate) fix: Option<Place>,
    pub(crate) odometry: Option<Odometry>,
    /// Speed to the left, mm/s, where the map gives one.
    pub(crate) left_mm_s: Option<i32>,
}

/// The readings of a recording and facts about them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    pub(crate) steps: Vec<Step>,
    /// Time of the last reading or sample.
    pub(crate) end: Instant,
    /// Pauses between parts: the end of one, and the beginning of the next.
    pub(crate) pauses: Vec<(Instant, Instant)>,
    /// Modes by the time from which on they hold.
    pub(crate) modes: Vec<(u64, String)>,
    /// The lever that was estimated, whether it is used or not.
    pub(crate) estimate: Option<lever::Estimate>,
    /// False where no fix has a receiver's time that could be judged.
    pub(crate) is_timed: bool,
    pub(crate) facts: Facts,
    /// Remarks on the readings, in sentences.
    pub(crate) remarks: Vec<String>,
}

/// Makes the readings.
///
/// # Errors
/// When the recording lacks an input that the map names.
pub(crate) fn track(log: &Log<'_>, map: &Map, bounds: &Bounds) -> Result<Track, TrackError> {
    let mut read = Read::from_log(log, map)?;
    let (estimate, mut facts) = (read.lever(map), facts(map, &read));
    let stated = map.fix.lever_m.as_ref().map(|lever| *lever.as_ref());
    facts.lever_m = Some(stated.or(estimate.map(|estimate| estimate.lever_m)).unwrap_or([0.0; 2]));
    if let Some(setpoint) = &map.setpoint {
        let speeds = setpoints(log, setpoint)?;
        let most = f64::from(bounds.max_speed_mm_s) / 1000.0;
        facts.setpoints = Some((speeds.len() as u64, speeds.iter().filter(|speed| **speed > most).count() as u64));
    }
    let period = bounds.control_period_ms.max(1) * 1000;
    let shifts = apart::shifts(read.parts.iter().map(|part| part.ends), 2 * period);
    let mut track = Track { estimate, is_timed: read.is_timed, facts, ..Track::default() };
    for (part, shift) in read.parts.iter().zip(&shifts) {
        let (first, last) = (Instant(part.ends.0 + shift), Instant(part.ends.1 + shift));
        let begin = track.steps.first().map_or(first, |step| step.stamp);
        if last.since(begin).0 / period > MAX_PERIODS {
            return Err(TrackError::Long { from_s: begin.0 / 1_000_000, to_s: last.0 / 1_000_000 });
        }
        if !track.steps.is_empty() {
            track.pauses.push((track.end, first));
        }
        let steps = steps(part, bounds).into_iter();
        track.steps.extend(steps.map(|step| Step { stamp: step.stamp + Span(*shift), ..step }));
        track.end = last;
    }
    let mut remarks = std::mem::take(&mut read.remarks);
    let judged = track.steps.first().and_then(|step| apart::judged(step.stamp, &track.pauses, track.end));
    remarks.extend(apart::backwards(&read).into_iter().chain(judged));
    track.remarks = remarks;
    track.modes = match &map.mode {
        Some(mode) => modes(log, mode, &read, &shifts)?,
        None => Vec::new(),
    };
    Ok(track)
}

fn facts(map: &Map, read: &Read) -> Facts {
    let all_fixes = || read.parts.iter().map(|part| &part.fixes.kept);
    let used: u64 = all_fixes().map(|fixes| fixes.len() as u64).sum();
    let intervals = |times: &[u64]| times.windows(2).map(|two| (two[1] - two[0]) as f64 / 1e6).collect::<Vec<_>>();
    let stamps = all_fixes().flat_map(|fixes| intervals(&fixes.iter().map(|(time, _)| *time).collect::<Vec<_>>()));
    let of = |fact: fn(&Facts) -> f64| read.parts.iter().map(move |part| fact(&part.motion.facts));
    let sideways = read.parts.iter().map(|part| part.motion.facts.sideways_m).sum::<Option<f64>>();
    Facts {
        fixes: used,
        fixes_unused: read.messages.saturating_sub(used),
        fix_period_s: median(stamps).unwrap_or(0.0),
        odometry: read.parts.iter().map(|part| part.motion.facts.odometry).sum(),
        odometry_unused: read.parts.iter().map(|part| part.motion.facts.odometry_unused).sum(),
        odometry_period_s: median(read.parts.iter().flat_map(|part| intervals(part.motion.speed.times())))
            .unwrap_or(0.0),
        sigma_m: map.fix.sigma.as_ref().and_then(|_| median(all_fixes().flatten().map(|(_, fix)| fix.sigma_m))),
        way_m: of(|facts| facts.way_m).sum(),
        sideways_m: sideways,
        speed_m_s: of(|facts| facts.speed_m_s).fold(0.0, f64::max),
        lever_m: None,
        parts: Some(read.parts.len() as u64).filter(|parts| *parts > 1),
        setpoints: None,
    }
}

/// Readings of a part: one at each fix; where fixes fail to come, further ones with odometry alone.
fn steps(part: &Part, bounds: &Bounds) -> Vec<Step> {
    let Part { fixes, motion, turning, ends: (_, end), .. } = part;
    let (limit, period) = (bounds.product_limit().0, bounds.control_period_ms.max(1) * 1000);
    let whole = |metres: f64| libm::round(metres * 1000.0).clamp(-1e9, 1e9) as i32;
    let step = |from: u64, to: u64, fix: Option<Place>| {
        let has_speed = motion.speed.age(to).is_some_and(|age| age <= limit);
        let rate = match &motion.rate {
            Some(rate) => rate.mean(from, to),
            None => (turning.value(to) - turning.value(from)) / ((to - from).max(1) as f64 / 1e6),
        };
        let mrad_s = libm::round(rate * 1000.0).clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16;
        let odometry = Odometry { speed_mm_s: whole(motion.speed.mean(from, to)), yaw_rate_mrad_s: mrad_s };
        let left = motion.left.as_ref().map(|left| whole(left.mean(from, to)));
        Step { stamp: Instant(to), fix, odometry: has_speed.then_some(odometry), left_mm_s: left.filter(|_| has_speed) }
    };
    let mut steps: Vec<Step> = Vec::with_capacity(fixes.kept.len());
    let mut before = part.ends.0;
    for (i, (at, fix)) in fixes.kept.iter().enumerate() {
        steps.push(step(before, *at, Some(*fix)));
        before = *at;
        let next = fixes.kept.get(i + 1).map_or(end + 1, |(next, _)| *next);
        while next - before > period && next - at > limit {
            let to = if before == *at { (before + limit).min(next - 1) } else { before + period };
            steps.push(step(before, to, None));
            before = to;
        }
    }
    steps
}

fn modes(log: &Log<'_>, map: &ModeMap, read: &Read, shifts: &[u64]) -> Result<Vec<(u64, String)>, TrackError> {
    let mut columns = Columns::new(log, &map.topic);
    let (clock, value) = (columns.stamp(&map.stamp)?, columns.plain(&map.field)?);
    let stretches = Stretches::split_at(Timed::new(columns.rows()?, clock), &read.backs);
    let name = |value: f64| map.names.get(&value.to_string()).cloned().unwrap_or_else(|| value.to_string());
    let mut all: Vec<(u64, f64)> = Vec::new();
    for (part, shift) in read.parts.iter().zip(shifts) {
        let rows = stretches.rows(part.key).iter();
        let (samples, _) = in_order(rows.filter_map(|(time, row)| Some((*time, value.read(row)?))));
        // A mode from before the part's first fix holds at its start, and never within the part before it.
        let free = all.last().map_or(0, |(time, _)| *time);
        all.extend(samples.into_iter().map(|(time, value)| ((time + shift).max(free), value)));
    }
    all.dedup_by(|later, earlier| later.1 == earlier.1);
    Ok(all.into_iter().map(|(time, value)| (time, name(value))).collect())
}

fn setpoints(log: &Log<'_>, map: &SetpointMap) -> Result<Vec<f64>, TrackError> {
    let mut columns = Columns::new(log, &map.topic);
    let speed = columns.optional(map.speed.as_ref())?;
    let velocity = map.velocity.as_ref().map(|axes| two(&mut columns, axes)).transpose()?;
    let rows = columns.rows()?.rows;
    let read = |row| match (speed, velocity) {
        (Some(speed), _) => speed.read(row).map(f64::abs),
        (None, Some((x, y))) => Some(libm::hypot(x.read(row)?, y.read(row)?)),
        (None, None) => None,
    };
    Ok(rows.iter().filter_map(read).collect())
}

/// Median; the upper of the two middle ones for an even number.
fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
