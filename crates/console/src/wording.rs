//! Words for persons, of every view: names of sensors and guards, readings beside their limits, causes, waived checks,
//! times. One list a concept: the window, the terminal and the page take them from here.
//!
//! A cause names the actor that is known and no other. Arranging the words is left to [`banner`](mod@crate::banner) and the
//! views.

use config::suite::Suite;
use wire::bounds::Bounds;
use wire::event::Inconsistency;
use wire::id::UnitId;
use wire::measured::Limit;
use wire::mode::{Cause, Guard, Mode};
use wire::policy::{Check, DisplayRule, Policy, Requirement};
use wire::sensor::Modality;
use wire::time::Span;

/// A microsecond count of one second.
const S: u64 = 1_000_000;

/// Name of the sensor in a place.
pub fn sensor(suite: Suite, place: Modality) -> &'static str {
    match (suite, place) {
        (Suite::Scene, Modality::Rgb) => "Colour camera",
        (Suite::Scene, Modality::Depth) => "Depth camera",
        (Suite::Scene, Modality::Thermal) => "Thermal camera",
        (Suite::Scene, Modality::Lidar) => "LiDAR",
        (Suite::Sky, Modality::Rgb) => "Star tracker",
        (Suite::Sky, Modality::Depth) => "Sun sensor",
        (Suite::Sky, Modality::Thermal) => "Horizon sensor",
        (Suite::Sky, Modality::Lidar) => "Magnetometer",
    }
}

/// Name of a guard.
pub fn guard(suite: Suite, guard: Guard) -> &'static str {
    match guard {
        Guard::Rgb => sensor(suite, Modality::Rgb),
        Guard::Depth => sensor(suite, Modality::Depth),
        Guard::Thermal => sensor(suite, Modality::Thermal),
        Guard::Lidar => sensor(suite, Modality::Lidar),
        Guard::Tracks => "Tracks",
        Guard::Localisation => "Position",
        Guard::Geofence => "Room to the fence",
        Guard::Lease => match suite {
            Suite::Scene => "Permission to drive",
            Suite::Sky => "Permission to work",
        },
        Guard::Teammates => "Teammates",
        Guard::SealedLog => "Sealed log",
        Guard::Designation => "Designation",
        Guard::Drift => "Position drift",
        Guard::TimeBase => "Receiver time",
    }
}

/// A guard's value beside its limit.
pub fn reading(value: i32, limit: Limit) -> String {
    match limit {
        Limit::Age(most) if value == i32::MAX => format!("unknown, limit {most} ms"),
        Limit::Age(most) => format!("{value} of {most} ms"),
        Limit::Spare(_) if value < 0 => format!("{} m short", tenths(-f64::from(value) / 1000.0)),
        Limit::Spare(_) => format!("{} m to spare", tenths(f64::from(value) / 1000.0)),
        Limit::Drift(most) => format!("{:.0} % of its limit", 100.0 * f64::from(value) / f64::from(most.max(1))),
        Limit::Offset(most) => {
            format!("{} of {} ms", tenths(f64::from(value.unsigned_abs()) / 1000.0), f64::from(most) / 1000.0)
        }
    }
}

/// A number with one decimal and a minus that is one; a number that rounds to zero has no sign.
pub fn tenths(number: f64) -> String {
    let rounded = (number * 10.0).round() / 10.0 + 0.0;
    if rounded < 0.0 { format!("−{:.1}", -rounded) } else { format!("{rounded:.1}") }
}

/// Claims of a teammate that cannot all be true: the reason.
pub fn inconsistency(found: Inconsistency) -> &'static str {
    match found {
        Inconsistency::Kinematics => "it moved faster than its body can",
        Inconsistency::Exclusion => "it claims a place where another unit stands",
        Inconsistency::TimeBase => "another sender speaks as it, or its clock jumped",
        Inconsistency::Residual => "it does not go where it says that it heads",
    }
}

/// The reason for a unit's change of mode, with the contradicting teammate where it is known: a sentence, and a detail that
/// may be empty.
pub fn cause(
    change: (Cause, Mode),
    suite: Suite,
    teammate: Option<(UnitId, Inconsistency)>,
    bounds: &Bounds,
) -> [String; 2] {
    let plain = |words: &str| [words.to_owned(), String::new()];
    match change {
        (Cause::Start, _) => plain("Not enabled since its start"),
        (Cause::Operator, Mode::HoldSafe) => plain("An operator held it"),
        (Cause::Operator, Mode::Ready) => plain("Put in READY by an operator"),
        (Cause::Operator, Mode::PrepareToAct) => plain("Armed by an operator"),
        (Cause::Operator, Mode::Idle | Mode::Degraded) => plain("Ordered by an operator"),
        (Cause::Recovered, _) => plain("Every guard holds again"),
        (Cause::Acted, _) => plain("Its authority was used"),
        (Cause::Expired, _) => [
            format!("Authority ended unused after {} s", tenths(Span::ms(bounds.authority_ms).as_ms() / 1000.0)),
            String::new(),
        ],
        (Cause::Lost(guard), _) => lost(guard, suite, teammate, bounds),
        (Cause::Unrecovered(guard), _) => {
            let [what, _] = lost(guard, suite, teammate, bounds);
            [what, format!("not made good within {} s", tenths(Span::ms(bounds.unrecovered_ms).as_ms() / 1000.0))]
        }
    }
}

/// The loss behind a failed guard.
fn lost(of: Guard, suite: Suite, teammate: Option<(UnitId, Inconsistency)>, bounds: &Bounds) -> [String; 2] {
    let seconds = |ms: u64| tenths(ms as f64 / 1000.0);
    let silent = |ms: u64| [format!("{}: nothing for more than {} s", guard(suite, of), seconds(ms)), String::new()];
    match of {
        Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar | Guard::Tracks => silent(bounds.product_limit_ms),
        Guard::Localisation => {
            ["Its position is not to be relied on".to_owned(), format!("too old, or against its {}", suite.reckoning())]
        }
        Guard::Geofence => ["Too near to the fence".to_owned(), "it could not stop before it".to_owned()],
        Guard::Lease => [
            format!("No permission for more than {} s", seconds(bounds.lease_ms)),
            "the gateway is not heard, or an operator holds".to_owned(),
        ],
        Guard::Teammates => match teammate {
            Some((unit, found)) => [format!("{unit} contradicts itself"), inconsistency(found).to_owned()],
            None => ["A teammate contradicts itself".to_owned(), String::new()],
        },
        Guard::SealedLog => silent(bounds.seal_limit_ms),
        Guard::Designation => ["The designated track is no longer borne out".to_owned(), String::new()],
        Guard::Drift => [format!("Its position drifts from its {}", suite.reckoning()), String::new()],
        Guard::TimeBase => ["The receiver's time runs against its clock".to_owned(), String::new()],
    }
}

/// A check of the boundary, as a thing that is not checked.
pub fn check(check: Check) -> &'static str {
    match check {
        Check::Freshness => "ages",
        Check::Origin => "names of senders",
        Check::Signature => "signatures",
        Check::Session => "sessions",
        Check::Sequence => "sequence",
        Check::Product => "origin of sensor content",
        Check::Tag => "tags of the inner bus",
        Check::Role => "roles",
        Check::Late => "ages of orders",
        Check::Duplicate => "repeated orders",
        Check::Confirmation => "second step of orders",
        Check::Rights => "rights at the broker",
        Check::Revocation => "revoked identities",
        Check::Jump => "jumps in the numbers of orders",
        Check::Rate => "number of orders",
        Check::Joint => "values together",
        Check::Extent => "sizes by depth",
        Check::Cluster => "widths by LiDAR",
        Check::Warmth => "warmth",
        Check::Content => "repeated sensor content",
        Check::Fusion => "agreement of all cameras",
        Check::Shown => "what the operator was shown",
        Check::Steady => "sudden warmth",
    }
}

/// Checks that a policy waives, in words; empty under the full policy.
pub fn waived(policy: &Policy) -> String {
    let off = |required: &Requirement| *required == Requirement::Waived;
    let checks: Vec<&str> = policy.boundary.iter().filter(|(_, r)| off(r)).map(|(c, _)| check(*c)).collect();
    let mut parts = Vec::new();
    if !checks.is_empty() {
        parts.push(format!("not checked: {}", shortened(&checks)));
    }
    let guards: Vec<&str> = policy.waived_guards().iter().map(|g| guard(Suite::Scene, g)).collect();
    if !guards.is_empty() {
        parts.push(format!("not guarded: {}", shortened(&guards)));
    }
    let rules = policy.display.iter().filter(|(_, r)| off(r)).map(|(rule, _)| match rule {
        DisplayRule::AgeOut => "values never grow old here",
        DisplayRule::Signature => "shown without its signature",
        DisplayRule::Watch => "ages by the gateway's word",
    });
    parts.extend(rules.map(str::to_owned));
    if off(&policy.record_guard) {
        parts.push("records are not filtered".to_owned());
    }
    parts.join("; ")
}

/// The first two of a list, and how many more.
fn shortened(all: &[&str]) -> String {
    match all {
        [first, second, rest @ ..] if !rest.is_empty() => format!("{first}, {second} and {} more", rest.len()),
        all => all.join(", "),
    }
}

/// An age at most: two decimals below ten seconds, rounded up.
pub fn at_most(span: Span) -> String {
    if span == Span(u64::MAX) { "of unknown age".to_owned() } else { format!("≤ {}", seconds(span)) }
}

/// Seconds of an age, rounded up: two decimals below ten seconds, then one, then minutes and hours.
pub fn seconds(span: Span) -> String {
    if span == Span(u64::MAX) { "unknown".to_owned() } else { written(span, u64::div_ceil) }
}

/// Time left: rounded down.
pub fn left(span: Span) -> String {
    written(span, |us, unit| us / unit)
}

fn written(span: Span, whole: fn(u64, u64) -> u64) -> String {
    match span.0 {
        us if us < 10 * S => format!("{:.2} s", whole(us, S / 100) as f64 / 100.0),
        us if us < 100 * S => format!("{:.1} s", whole(us, S / 10) as f64 / 10.0),
        us if us < 6_000 * S => format!("{} min", whole(us, 60 * S)),
        us => format!("{} h", whole(us, 3_600 * S)),
    }
}

/// How long something has lasted: tenths below ten seconds, then seconds, then minutes with seconds.
pub fn lasting(span: Span) -> String {
    match span.0 {
        us if us < 10 * S => format!("{:.1} s", (us / (S / 10)) as f64 / 10.0),
        us if us < 60 * S => format!("{} s", us / S),
        us if us < 3_600 * S => format!("{} min {} s", us / (60 * S), us / S % 60),
        us => format!("{} h {} min", us / (3_600 * S), us / (60 * S) % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_ages_round_up_and_time_left_down() {
        let ages = [(1, "0.01 s", "0.00 s"), (299_999, "0.30 s", "0.29 s"), (10_000_001, "10.1 s", "10.0 s")];
        let long = [(149_000_000, "3 min", "2 min"), (6_000_000_001, "2 h", "1 h"), (1_420_000, "1.42 s", "1.42 s")];
        for (us, age, rest) in ages.into_iter().chain(long) {
            assert_eq!((seconds(Span(us)).as_str(), left(Span(us)).as_str()), (age, rest), "{us} us");
        }
        assert_eq!((seconds(Span(u64::MAX)).as_str(), at_most(Span::ms(70)).as_str()), ("unknown", "≤ 0.07 s"));
    }

    #[test]
    fn a_duration_is_written_as_people_say_it() {
        let written = [(3_290, "3.2 s"), (42_900, "42 s"), (75_000, "1 min 15 s"), (3_900_000, "1 h 5 min")];
        written.iter().for_each(|(ms, words)| assert_eq!(lasting(Span::ms(*ms)), *words));
    }

    #[test]
    fn a_reading_stands_beside_its_limit() {
        assert_eq!(reading(102, Limit::Age(300)), "102 of 300 ms");
        assert_eq!(reading(-1_240, Limit::Spare(0)), "1.2 m short");
        assert_eq!(reading(18_970, Limit::Spare(0)), "19.0 m to spare");
        assert_eq!(reading(0, Limit::Drift(20)), "0 % of its limit");
        assert_eq!(reading(-266, Limit::Offset(5_000)), "0.3 of 5 ms");
        assert_eq!([-0.04, -1.26].map(tenths), ["0.0", "−1.3"]);
    }

    #[test]
    fn a_change_of_mode_is_worded_without_its_picture() {
        let worded = |of, mode| cause((of, mode), Suite::Scene, None, &Bounds::GROUND)[0].clone();
        let teammate = worded(Cause::Lost(Guard::Teammates), Mode::HoldSafe);
        assert_eq!(
            (teammate.as_str(), worded(Cause::Operator, Mode::Ready).as_str()),
            ("A teammate contradicts itself", "Put in READY by an operator")
        );
    }

    #[test]
    fn a_waived_check_is_named_in_words() {
        let mut policy = Policy::default();
        assert_eq!(waived(&policy), "");
        policy.boundary.insert(Check::Origin, Requirement::Waived);
        policy.display.insert(DisplayRule::AgeOut, Requirement::Waived);
        assert_eq!(waived(&policy), "not checked: names of senders; values never grow old here");
    }
}
