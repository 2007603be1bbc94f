//! Words for a unit that leaves the ground, or whose link is planned: height, attitude, sunlight, battery, contact.
//! Their drawing is left to `text` and to the window.

use wire::motion::{Attitude, ReportedMotion};
use wire::report::ReportedContact;
use wire::time::Span;

use crate::shown::State;

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

/// Contact by the plan of a report that is `age` old. The plan goes on in silence, so this holds at any age.
pub(crate) fn contact(state: &State, age: Span) -> Option<String> {
    state.contact.map(|of| planned(of, age))
}

fn height(up_mm: i64) -> String {
    let metres = up_mm as f64 / 1000.0;
    if metres < HIGH_M { format!("height {metres:.1} m") } else { format!("height {:.0} km", metres / 1000.0) }
}

/// Nose and bank, as in an aircraft; in an orbit the angle of the payload's line of sight, the body's z axis, to the
/// vertical.
fn turned(attitude: Attitude, orbits: bool) -> String {
    let [w, x, y, z] = attitude.parts();
    if orbits {
        let down = -(1.0 - 2.0 * (x * x + y * y));
        return format!("{:.0}° off nadir", libm::acos(down.clamp(-1.0, 1.0)).to_degrees());
    }
    let nose = libm::asin((2.0 * (w * y - z * x)).clamp(-1.0, 1.0)).to_degrees().round();
    let bank = libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)).to_degrees().round();
    let part = |name: &str, degrees: f64, [less, more]: [&str; 2]| match degrees {
        0.0 => format!("{name} level"),
        degrees => format!("{name} {:.0}° {}", degrees.abs(), if degrees < 0.0 { less } else { more }),
    };
    format!("{}, {}", part("nose", nose, ["up", "down"]), part("bank", bank, ["left", "right"]))
}

fn planned(contact: ReportedContact, age: Span) -> String {
    let seconds = |span: Span| format!("{:.0} s", (span.0 - age.0) as f64 / 1e6);
    match contact.next {
        _ if contact.left > age => format!("contact for {}", seconds(contact.left)),
        Some(next) if next > age => format!("next contact in {}", seconds(next)),
        Some(_) => "contact is due".to_owned(),
        None => "no other contact planned".to_owned(),
    }
}

#[cfg(test)]
mod tests {
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
        let contact = |left, next: Option<u64>| ReportedContact { left: Span::s(left), next: next.map(Span::s) };
        assert_eq!(planned(contact(12, Some(42)), Span::s(2)), "contact for 10 s");
        assert_eq!(planned(contact(12, Some(42)), Span::s(15)), "next contact in 27 s");
        assert_eq!(planned(contact(12, Some(42)), Span::s(43)), "contact is due");
        assert_eq!(planned(contact(12, None), Span::s(13)), "no other contact planned");
    }
}
