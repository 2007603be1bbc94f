//! Dates: a Julian date in two parts, which keeps a nanosecond, and the sidereal time of it.
//!
//! A Julian date as one number of 64 bits has steps of 40 µs, in which a place on the Earth moves by 2 cm: too coarse
//! for a body that is moved a hundred times a second. UT1 is taken as UTC: they differ by less than 0.9 s, by which the
//! Earth turns 400 m at the equator. Leap seconds are left out: a date counts days of 86,400 s.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// Seconds of a day.
pub const DAY_S: f64 = 86_400.0;

/// Julian date of J2000, 2000-01-01 12:00.
const J2000: f64 = 2_451_545.0;

/// Julian date, UTC: the sum of its parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Date {
    /// Julian date of a midnight, days; ends in .5.
    pub midnight: f64,
    /// Seconds since that midnight, from 0 to 86,400.
    pub second: f64,
}

impl Date {
    /// Date from a Julian date and seconds after it.
    pub fn new(julian: f64, seconds: f64) -> Self {
        let midnight = (julian - 0.5).floor() + 0.5;
        Date { midnight, second: (julian - midnight) * DAY_S }.plus_seconds(seconds)
    }

    /// Date of a day of the Gregorian calendar, 1901 to 2099, at midnight (Vallado, *Fundamentals of Astrodynamics*,
    /// algorithm 14).
    pub fn of_day(year: i32, month: i32, day: i32) -> Self {
        let years = 367 * year - 7 * (year + (month + 9) / 12) / 4;
        let days = f64::from(years + 275 * month / 9 + day);
        Date { midnight: days + 1_721_013.5, second: 0.0 }
    }

    /// The date `seconds` later.
    pub fn plus_seconds(self, seconds: f64) -> Self {
        let second = self.second + seconds;
        let days = (second / DAY_S).floor();
        Date { midnight: self.midnight + days, second: second - days * DAY_S }
    }

    /// Seconds from `other` to this date.
    pub fn seconds_since(self, other: Date) -> f64 {
        (self.midnight - other.midnight) * DAY_S + (self.second - other.second)
    }

    /// Julian date as one number, days.
    pub fn julian(self) -> f64 {
        self.midnight + self.second / DAY_S
    }

    /// Days since J2000.
    pub fn days_j2000(self) -> f64 {
        (self.midnight - J2000) + self.second / DAY_S
    }
}

/// Julian date of `seconds` after an epoch.
pub fn julian_date(epoch: Date, seconds: f64) -> Date {
    epoch.plus_seconds(seconds)
}

/// Greenwich mean sidereal time of 1982, radians in [0, 2π): the turn from TEME to the Earth-fixed frame (Aoki et al.,
/// *The new definition of Universal Time*, Astronomy and Astrophysics 105, 1982).
pub fn gmst(date: Date) -> f64 {
    let t = date.days_j2000() / 36_525.0;
    // The formula's first rate is a turn a day, which is taken from the parts of the date and so keeps its digits.
    let slow = 67_310.548_41 + t * (8_640_184.812_866 + t * (0.093_104 - t * 6.2e-6));
    let turns = (date.midnight - J2000).rem_euclid(1.0) + date.second / DAY_S + (slow / DAY_S).rem_euclid(1.0);
    turns.rem_euclid(1.0) * TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vallado, *Fundamentals of Astrodynamics*, example 3-5: 1992-08-20 12:14 UT1 is 152.578787810°.
    #[test]
    fn sidereal_time_is_that_of_the_textbook() {
        let date = Date::of_day(1992, 8, 20).plus_seconds(12.0 * 3600.0 + 14.0 * 60.0);
        assert!((gmst(date).to_degrees() - 152.578_787_810).abs() < 1e-7);
    }

    #[test]
    fn calendar_days_have_their_julian_dates() {
        assert_eq!(Date::of_day(2000, 1, 1).julian(), 2_451_544.5);
        assert_eq!(Date::of_day(2025, 1, 1).julian(), 2_460_676.5);
        assert_eq!(Date::of_day(2024, 2, 29).plus_seconds(DAY_S), Date::of_day(2024, 3, 1));
    }

    #[test]
    fn a_date_keeps_a_nanosecond() {
        let date = Date::of_day(2025, 6, 1).plus_seconds(50_000.0);
        assert!((date.plus_seconds(1e-9).seconds_since(date) - 1e-9).abs() < 1e-11);
    }

    #[test]
    fn time_turns_the_earth_evenly() {
        let date = Date::of_day(2025, 6, 1).plus_seconds(50_000.0);
        let turned = gmst(date.plus_seconds(0.01)) - gmst(date);
        assert!((turned - 7.292_115e-7).abs() < 1e-12, "{turned}");
    }
}
