//! Orbit: where a satellite is and how it moves, from a two-line element set.
//!
//! SGP4 (Hoots and Roehrich, *Spacetrack Report No. 3*, 1980; Vallado et al., *Revisiting Spacetrack Report #3*, AIAA
//! 2006-6753) with the WGS 72 numbers that element sets are fitted with. It is evaluated at nodes, whole multiples of
//! 10 s after the epoch, and interpolated between them by a cubic Hermite polynomial: the state is a smooth function of
//! time alone, independent of earlier requests. Nodes are rounded to 0.1 mm and 0.1 µm/s, so that a last bit which
//! differs between machines seldom remains.
//!
//! Manoeuvres are left out. A set of a day ago is off by about a kilometre, which no propagation makes good.

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use sgp4::MinutesSinceEpoch;
use sgp4::chrono::Timelike;

use crate::date::{DAY_S, Date};
use crate::vector::{Vector, norm};

/// Seconds between nodes.
const NODE_S: f64 = 10.0;

/// Longest time from the epoch, either way, in which an orbit is stated, seconds: a week.
pub const SPAN_S: f64 = 7.0 * DAY_S;

/// Height below which an element set is refused, metres above the Earth's equatorial radius: the air takes the
/// satellite within a day.
const LEAST_HEIGHT_M: f64 = 120_000.0;

/// Equatorial radius, metres (WGS 84).
const RADIUS_M: f64 = 6_378_137.0;

/// Two-line element set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Elements {
    /// The line that starts with 1.
    pub line_1: String,
    /// The line that starts with 2.
    pub line_2: String,
}

impl Elements {
    /// Elements from two lines.
    pub fn new(line_1: &str, line_2: &str) -> Self {
        Elements { line_1: line_1.into(), line_2: line_2.into() }
    }
}

/// Fault of an element set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// The lines cannot be read.
    #[error("two-line elements expected: {0}")]
    Lines(String),
    /// The elements are out of SGP4's range.
    #[error("elements that SGP4 takes expected: {0}")]
    Elements(String),
    /// SGP4 has no state within a week of the epoch.
    #[error("an orbit that lasts a week expected; after {seconds} s: {reason}")]
    Ends {
        /// Seconds since the epoch.
        seconds: f64,
        /// SGP4's error.
        reason: String,
    },
    /// The satellite is too low within a week of the epoch.
    #[error("a height of at least 120 km expected; after {seconds} s it is {height_m:.0} m")]
    Low {
        /// Seconds since the epoch.
        seconds: f64,
        /// Height above the equatorial radius, metres.
        height_m: f64,
    },
}

/// Position and velocity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitState {
    /// Position from the Earth's centre, TEME, metres.
    pub position_m: Vector,
    /// Velocity, TEME, m/s.
    pub velocity_m_s: Vector,
}

/// Orbit of one satellite. It remembers the two nodes it used last; what it states does not depend on them.
#[derive(Debug)]
pub struct Orbit {
    constants: sgp4::Constants,
    epoch: Date,
    start: OrbitState,
    last: Mutex<Option<(i64, [OrbitState; 2])>>,
}

impl Clone for Orbit {
    fn clone(&self) -> Self {
        let Orbit { constants, epoch, start, .. } = self;
        Orbit { constants: constants.clone(), epoch: *epoch, start: *start, last: Mutex::default() }
    }
}

impl Orbit {
    /// Orbit of an element set; asks SGP4 for every hour of the week on either side of the epoch.
    ///
    /// # Errors
    /// Lines that cannot be read, elements out of range, an orbit that ends or is too low within a week.
    pub fn new(elements: &Elements) -> Result<Orbit, OrbitError> {
        let Elements { line_1, line_2 } = elements;
        let read = read(line_1, line_2)?;
        let constants = sgp4::Constants::from_elements_afspc_compatibility_mode(&read);
        let constants = constants.map_err(|error| OrbitError::Elements(error.to_string()))?;
        let start = propagated(&constants, 0.0)?;
        for hour in -168..=168 {
            let seconds = f64::from(hour) * 3600.0;
            let height_m = norm(propagated(&constants, seconds)?.position_m) - RADIUS_M;
            if height_m.is_nan() || height_m < LEAST_HEIGHT_M {
                return Err(OrbitError::Low { seconds, height_m });
            }
        }
        Ok(Orbit { constants, epoch: epoch(&read), start, last: Mutex::default() })
    }

    /// Date of the element set.
    pub fn epoch(&self) -> Date {
        self.epoch
    }

    /// State `seconds` after the epoch. Beyond [`SPAN_S`] it is that of the span's end, and without a number that of
    /// the epoch.
    pub fn state_at(&self, seconds: f64) -> OrbitState {
        if seconds.is_nan() {
            return self.start;
        }
        let seconds = seconds.clamp(-SPAN_S, SPAN_S);
        let node = (seconds / NODE_S).floor();
        let [from, to] = self.nodes(node as i64);
        hermite(&from, &to, (seconds - node * NODE_S) / NODE_S)
    }

    /// States at this node and the next.
    fn nodes(&self, node: i64) -> [OrbitState; 2] {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, nodes)) = last.filter(|(time, _)| *time == node) {
            return nodes;
        }
        let cached = last.filter(|(time, _)| time + 1 == node).map(|(_, [_, to])| to);
        let nodes = [cached.unwrap_or_else(|| self.node(node)), self.node(node + 1)];
        *last = Some((node, nodes));
        nodes
    }

    /// State at a node. [`Orbit::new`] has checked that SGP4 has a state at every hour of the span. For a node in
    /// between without one it is the epoch's.
    fn node(&self, node: i64) -> OrbitState {
        propagated(&self.constants, node as f64 * NODE_S).unwrap_or(self.start)
    }
}

/// The lines, read.
fn read(line_1: &str, line_2: &str) -> Result<sgp4::Elements, OrbitError> {
    // The reader subtracts '0' from the last character before it knows that it is a digit.
    let ends = |line: &str| line.is_ascii() && line.as_bytes().last().is_some_and(u8::is_ascii_digit);
    if !ends(line_1) || !ends(line_2) {
        return Err(OrbitError::Lines("lines of ASCII that end with their checksums".into()));
    }
    let read = sgp4::Elements::from_tle(line_1.as_bytes(), line_2.as_bytes());
    read.map_err(|error| OrbitError::Lines(error.to_string()))
}

/// Date of an element set.
fn epoch(read: &sgp4::Elements) -> Date {
    let days = read.datetime.date().signed_duration_since(sgp4::chrono::NaiveDate::default()).num_days();
    let time = read.datetime.time();
    // The default day is 1970-01-01.
    let midnight = 2_440_587.5 + days as f64;
    Date { midnight, second: f64::from(time.num_seconds_from_midnight()) + f64::from(time.nanosecond()) * 1e-9 }
}

/// SGP4's state, rounded.
fn propagated(constants: &sgp4::Constants, seconds: f64) -> Result<OrbitState, OrbitError> {
    let result = constants.propagate_afspc_compatibility_mode(MinutesSinceEpoch(seconds / 60.0));
    let prediction = result.map_err(|error| OrbitError::Ends { seconds, reason: error.to_string() })?;
    let position_m = prediction.position.map(|km| (km * 1e7).round() / 1e4);
    let velocity_m_s = prediction.velocity.map(|km_s| (km_s * 1e10).round() / 1e7);
    Ok(OrbitState { position_m, velocity_m_s })
}

/// The cubic through two states [`NODE_S`] apart, at share `s` of the way, and its derivative.
fn hermite(from: &OrbitState, to: &OrbitState, s: f64) -> OrbitState {
    let mut state = *from;
    let parts = from.position_m.iter().zip(&from.velocity_m_s).zip(to.position_m.iter().zip(&to.velocity_m_s));
    let states = state.position_m.iter_mut().zip(&mut state.velocity_m_s);
    for ((position, velocity), ((p, v), (q, w))) in states.zip(parts) {
        // Displacement between the states, and both velocities as displacements in [`NODE_S`], metres.
        let (way, v, w) = (q - p, v * NODE_S, w * NODE_S);
        let (second, third) = (3.0 * way - 2.0 * v - w, v + w - 2.0 * way);
        *position = p + s * (v + s * (second + s * third));
        *velocity = (v + s * (2.0 * second + s * 3.0 * third)) / NODE_S;
    }
    state
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::vector::sub;

    /// A sun-synchronous orbit at about 520 km, made up.
    pub(crate) fn elements() -> Elements {
        Elements::new(
            "1 99999U 25001A   25172.50000000  .00002000  00000-0  10000-3 0  9991",
            "2 99999  97.5000 250.0000 0010000  90.0000 270.0000 15.18000000    10",
        )
    }

    #[test]
    fn interpolation_is_off_by_less_than_a_metre() {
        let orbit = Orbit::new(&elements()).unwrap();
        let (mut most_m, mut most_m_s) = (0.0_f64, 0.0_f64);
        for i in 0..20_000 {
            let seconds = f64::from(i) * 4.321;
            let exact = propagated(&orbit.constants, seconds).unwrap();
            let state = orbit.state_at(seconds);
            most_m = most_m.max(norm(sub(state.position_m, exact.position_m)));
            most_m_s = most_m_s.max(norm(sub(state.velocity_m_s, exact.velocity_m_s)));
        }
        // Most of it is SGP4's own: its velocity is the change of its position to some centimetres per second.
        assert!(most_m < 0.05 && most_m_s < 0.05, "{most_m} m, {most_m_s} m/s");
    }

    #[test]
    fn a_state_does_not_depend_on_earlier_calls() {
        let orbit = Orbit::new(&elements()).unwrap();
        let forth: Vec<OrbitState> = (0..5000).map(|i| orbit.state_at(f64::from(i) * 0.73)).collect();
        let back: Vec<OrbitState> = (0..5000).rev().map(|i| orbit.state_at(f64::from(i) * 0.73)).collect();
        assert!(forth.iter().eq(back.iter().rev()));
        let fresh = Orbit::new(&elements()).unwrap();
        assert_eq!(fresh.state_at(1234.5), orbit.clone().state_at(1234.5));
    }

    #[test]
    fn velocity_is_the_change_of_position() {
        let orbit = Orbit::new(&elements()).unwrap();
        for seconds in [0.3, 9.99, 4000.0, -77.7] {
            let way = sub(orbit.state_at(seconds + 0.005).position_m, orbit.state_at(seconds - 0.005).position_m);
            let velocity = orbit.state_at(seconds).velocity_m_s;
            assert!(norm(sub(way.map(|part| part / 0.01), velocity)) < 1e-3);
        }
    }

    #[test]
    fn an_element_set_keeps_its_epoch() {
        let orbit = Orbit::new(&elements()).unwrap();
        assert_eq!(orbit.epoch(), Date::of_day(2025, 6, 21).plus_seconds(43_200.0));
    }

    #[test]
    fn lines_of_no_orbit_are_refused() {
        let Elements { line_1, line_2 } = &elements();
        let cases: [(&str, &str); 5] =
            [("", ""), ("é", "ü"), (line_2, line_1), (&line_1[..68], line_2), (&format!("{} ", &line_1[..68]), line_2)];
        for (a, b) in cases {
            assert!(matches!(Orbit::new(&Elements::new(a, b)), Err(OrbitError::Lines(_))), "{a} {b}");
        }
    }

    fn summed(line: &str) -> String {
        let value = |c: char| c.to_digit(10).unwrap_or(u32::from(c == '-'));
        let line: String = line.chars().take(68).collect();
        format!("{line}{}", line.chars().map(value).sum::<u32>() % 10)
    }

    #[test]
    fn altered_lines_are_refused_or_have_states() {
        let Elements { line_1, line_2 } = &elements();
        let altered =
            |line: &str, at: usize, digit: &str| summed(&format!("{}{digit}{}", &line[..at], &line[at + 1..]));
        for at in 0..68 {
            for with in ["9", "0", "-", "+", " ", ".", "A"] {
                let first = Orbit::new(&Elements::new(&altered(line_1, at, with), line_2));
                let second = Orbit::new(&Elements::new(line_1, &altered(line_2, at, with)));
                for orbit in [first, second].into_iter().flatten() {
                    assert!(norm(orbit.state_at(12_345.6).position_m) > RADIUS_M, "{at} {with}");
                }
            }
        }
    }

    #[test]
    fn an_orbit_that_decays_is_refused() {
        let elements = Elements::new(
            "1 99999U 25001A   25172.50000000  .00002000  00000-0  90000-1 0  9997",
            "2 99999  97.5000 250.0000 0010000  90.0000 270.0000 16.40000000    16",
        );
        let refused = Orbit::new(&elements);
        assert!(matches!(refused, Err(OrbitError::Low { .. } | OrbitError::Ends { .. })), "{refused:?}");
    }

    #[test]
    fn times_of_no_number_have_a_state() {
        let orbit = Orbit::new(&elements()).unwrap();
        for seconds in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert!(norm(orbit.state_at(seconds).position_m).is_finite());
        }
    }
}
