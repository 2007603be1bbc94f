//! Words for a unit that leaves the ground, or whose link is planned: height, attitude, sunlight, battery, contact.
//! Their drawing is left to `text` and to the window.

use wire::motion::{Attitude, ReportedMotion};
use wire::time::Span;

use crate::shown::State;
use crate::silence::Plan;

/// Height from which on kilometres are reported, metres.
const HIGH_M: f64 = 10_000.0;

/// A speed, mm/s, in metres a second; a speed that rounds to zero has no sign.
pub(crate) fn speed(mm_s: i32) -> String {
    let tenths = (f64::from(mm_s) / 100.0).round() as i32;
    format!("{:.1} m/s", f64::from(tenths) / 10.0)
}

/// Height, attitude, sunlight and battery, each by itself; none of a unit that reports none.
pub(crate) fn motion(state: &State) -> Vec<String> {
    let mut words = Vec::new();
    if let Some(ReportedMotion { up_mm, charge, attitude, sunlit, .. }) = state.motion {
        words.push(height(up_mm));
        words.extend(attitude.map(|attitude| turned(attitude, sunlit.is_some())));
        words.extend(sunlit.map(|lit| if lit { "in the sun" } else { "in eclipse" }.to_owned()));
        words.push(format!("battery {} %", charge / 10));
    }
    words
}

/// Contact by the unit's plan; none of a unit without one. The plan goes on in silence, so this holds at any age.
pub(crate) fn contact(plan: Plan) -> Option<String> {
    let seconds = |span: Span| format!("{:.0} s", span.0 as f64 / 1e6);
    Some(match plan {
        Plan::None => return None,
        Plan::Contact(left) => format!("contact for {}", seconds(left)),
        Plan::Silence(Some(next)) => format!("next contact in {}", seconds(next)),
        Plan::Silence(None) => "no other contact planned".to_owned(),
        Plan::Due(_) => "contact is due".to_owned(),
    })
}

fn height(up_mm: i64) -> String {
    let metres = up_mm as f64 / 1000.0;
    if metres < HIGH_M { format!("height {metres:.1} m") } else { format!("height {:.0} km", metres / 1000.0) }
}

/// Nose and bank, as in an aircraft, radians: down and to the right.
pub(crate) fn nose_and_bank(attitude: Attitude) -> [f64; 2] {
    let [w, x, y, z] = attitude.parts();
    let nose = libm::asin((2.0 * (w * y - z * x)).clamp(-1.0, 1.0));
    [nose, libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))]
}

/// Angle of the payload's line of sight, the body's z axis, to the vertical, radians.
pub(crate) fn off_nadir(attitude: Attitude) -> f64 {
    let [_, x, y, _] = attitude.parts();
    libm::acos((2.0 * (x * x + y * y) - 1.0).clamp(-1.0, 1.0))
}

/// Nose and bank; in an orbit the angle off nadir.
fn turned(attitude: Attitude, orbits: bool) -> String {
    if orbits {
        return format!("{:.0}° off nadir", off_nadir(attitude).to_degrees());
    }
    let [nose, bank] = nose_and_bank(attitude).map(|angle| angle.to_degrees().round());
    let part = |name: &str, degrees: f64, [less, more]: [&str; 2]| match degrees {
        0.0 => format!("{name} level"),
        degrees => format!("{name} {:.0}° {}", degrees.abs(), if degrees < 0.0 { less } else { more }),
    };
    format!("{}, {}", part("nose", nose, ["up", "down"]), part("bank", bank, ["left", "right"]))
}

#[cfg(test)]
mod tests {
    use wire::report::ReportedContact;

    use super::*;

    #[test]
    fn attitude_is_told_as_operators_know_it() {
        let attitude = |x: f64, y: f64, degrees: f64| {
            let (sin, cos) = libm::sincos(degrees.to_radians() / 2.0);
            Attitude::new([cos, sin * x, sin * y, 0.0])
        };
        assert_eq!(turned(attitude(0.0, 1.0, 12.0), false), "nose 12° down, bank level");
        assert_eq!(turned(attitude(1.0, 0.0, -7.0), false), "nose level, bank 7° left");
        assert_eq!(turned(attitude(1.0, 0.0, 180.0), true), "0° off nadir");
        assert_eq!(turned(attitude(1.0, 0.0, 150.0), true), "30° off nadir");
    }

    #[test]
    fn height_of_an_orbit_is_told_in_kilometres() {
        assert_eq!([2_480, 518_300_000].map(height), ["height 2.5 m", "height 518 km"]);
    }

    #[test]
    fn contact_is_told_by_the_plan_in_silence() {
        let told = |left, next: Option<u64>, age| {
            let planned = ReportedContact { left: Span::s(left), next: next.map(Span::s) };
            contact(Plan::new(Some(planned), Span::s(age)))
        };
        assert_eq!(told(12, Some(42), 2).as_deref(), Some("contact for 10 s"));
        assert_eq!(told(12, Some(42), 15).as_deref(), Some("next contact in 27 s"));
        assert_eq!(told(12, Some(42), 43).as_deref(), Some("contact is due"));
        assert_eq!(told(12, None, 13).as_deref(), Some("no other contact planned"));
        assert_eq!(contact(Plan::None), None);
    }
}
