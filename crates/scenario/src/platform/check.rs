//! Checks of a platform's numbers against each other, each with its reason; the derivations are in `docs/reference/bounds.md`.
//!
//! Times are milliseconds, ways millimetres, unless a name says otherwise.

use wire::sensor::{Camera, Lidar};

use super::{BoundsTable, Platform};
use crate::finding::{Finding, finding};
use crate::value::Located;

/// By how much the brakes are weaker on the steepest ground that a scene may have, m/s².
const SLOPE_M_S2: f64 = 1.0;
/// A navigation period and a step of the plant with its actuators.
const READING_AND_PLANT_MS: i64 = 100;
/// Error of the last fix that a fence margin allows for, and four deviations of a fix.
const FIX_ERROR_MM: i64 = 400;
const FOUR_DEVIATIONS_MM: i64 = 160;
/// Distance of the confidence to arm above the one to keep, permille.
const APART_PERMILLE: i64 = 100;
/// Twice the share of the speed by which an honest teammate's wheels may slip, times the seconds for which consistency remembers.
const SLIP_S: f64 = 2.0 * 0.03 * 8.0;
const GRAVITY: f64 = 9.81;

/// Every mistake in a platform file named `stem`.
pub(crate) fn platform(platform: &Platform, stem: &str) -> Vec<Finding> {
    let named = unless(
        &platform.name,
        platform.name.as_str() == stem,
        || format!("the file is named `{stem}`"),
        "make name and file name the same",
    );
    let groups = [periods(&platform.bounds), chains(&platform.bounds), margins(platform), body(platform)];
    let sensors = [camera(platform), lidar(platform)];
    named.into_iter().chain(groups.into_iter().flatten()).chain(sensors.into_iter().flatten()).chain(guards(platform)).collect()
}

/// From a lost uplink to the lapse of the lease: the report is too old, the last grant runs out, a control period finds it.
pub(crate) fn uplink_ms(bounds: &BoundsTable) -> i64 {
    bounds.freshness_ms.get() + bounds.lease_ms.get() + bounds.control_period_ms.get()
}

/// A finding at `at` unless `holds`.
fn unless<T>(at: &Located<T>, holds: bool, message: impl FnOnce() -> String, remedy: &str) -> Option<Finding> {
    (!holds).then(|| finding(at, message(), remedy))
}

/// A finding at `at`, which has the value `got`, where that is above `most`: `unit` of the values, `why` they are held together.
fn at_most<T>(at: &Located<T>, (got, most): (f64, f64), unit: &str, why: &str, remedy: &str) -> Option<Finding> {
    // A thousandth is far below every number's last digit, and far above its rounding.
    unless(at, got <= most + 1e-3, || format!("{why}: at most {} {unit} expected, got {}", told(most), told(got)), remedy)
}

/// The same where it is below `least`.
fn at_least<T>(at: &Located<T>, (got, least): (f64, f64), unit: &str, why: &str, remedy: &str) -> Option<Finding> {
    let message = || format!("{why}: at least {} {unit} expected, got {}", told(least), told(got));
    unless(at, got >= least - 1e-3, message, remedy)
}

/// A number without an end of zeros.
fn told(value: f64) -> String {
    format!("{}", (value * 1000.0).round() / 1000.0)
}

fn periods(b: &BoundsTable) -> Vec<Finding> {
    let found = [
        unless(
            &b.grant_period_ms,
            b.grant_period_ms.get() < b.lease_ms.get(),
            || "not shorter than the lease it renews".to_owned(),
            "grant several times in a lease",
        ),
        unless(
            &b.telemetry_period_ms,
            b.telemetry_period_ms.get() < b.freshness_ms.get(),
            || "not shorter than the freshness window".to_owned(),
            "send several times in it",
        ),
        unless(
            &b.control_period_ms,
            b.control_period_ms.get() < b.set_point_lease_ms.get(),
            || "not shorter than the lease of the set-points it renews".to_owned(),
            "renew a set-point several times in its lease",
        ),
        unless(
            &b.challenge_period_ms,
            b.challenge_period_ms.get() < b.echo_limit_ms.get(),
            || "not shorter than the time for which an echo serves".to_owned(),
            "challenge several times in it",
        ),
        at_most(
            &b.set_point_lease_ms,
            (b.set_point_lease_ms.get() as f64, sim::plant::MAX_LEASE.0 as f64 / 1000.0),
            "ms",
            "the plant honours no longer lease",
            "shorten the lease",
        ),
    ];
    found.into_iter().flatten().collect()
}

fn chains(b: &BoundsTable) -> Vec<Finding> {
    let (td, th, tc) = (b.to_degraded_ms.get(), b.to_hold_safe_ms.get(), b.control_period_ms.get());
    let blind = b.product_limit_ms.get() + tc + b.unrecovered_ms.get() + tc;
    let found = [
        unless(&b.to_degraded_ms, td <= th, || "later than the bound to hold-safe".to_owned(), "degrade no later than holding"),
        at_most(
            &b.lease_ms,
            (uplink_ms(b) as f64, th as f64),
            "ms",
            "after a lost uplink the lease lapses (freshness, lease and control period) beyond Th",
            "shorten the lease, or give Th more time (docs/reference/bounds.md, The three bounds)",
        ),
        at_most(
            &b.unrecovered_ms,
            (blind as f64, th as f64),
            "ms",
            "after lost localisation the unit holds (product limit, unrecovered, two control periods) beyond Th",
            "shorten `unrecovered_ms`, or give Th more time",
        ),
        at_most(
            &b.product_limit_ms,
            ((b.product_limit_ms.get() + tc) as f64, td as f64),
            "ms",
            "after a lost product the unit degrades (product limit and control period) beyond Td",
            "shorten `product_limit_ms`, or give Td more time",
        ),
        at_most(
            &b.track_limit_ms,
            (b.track_limit_ms.get() as f64, td as f64),
            "ms",
            "a designated track outlives Td without an update",
            "shorten `track_limit_ms`, or give Td more time",
        ),
    ];
    found.into_iter().flatten().collect()
}

/// Ways that a unit goes before it stands, and the room that is kept for them.
fn margins(platform: &Platform) -> Vec<Finding> {
    let (b, g) = (&platform.bounds, &platform.guards);
    let speed = b.max_speed_mm_s.get() as f64;
    let margin = b.fence_margin_mm.get() as f64;
    let stale = speed * b.freshness_ms.get() as f64 / 1000.0;
    let lasts = (b.product_limit_ms.get() + b.control_period_ms.get()).max(b.set_point_lease_ms.get());
    let blind = speed * (lasts - g.reaction_ms.get()).max(0) as f64 / 1000.0 + FIX_ERROR_MM as f64;
    let found = [
        at_most(
            &b.degraded_speed_mm_s,
            (b.degraded_speed_mm_s.get() as f64, speed),
            "mm/s",
            "DEGRADED is faster than the largest speed",
            "lower it",
        ),
        at_least(
            &b.fence_margin_mm,
            (margin, stale),
            "mm",
            "a fresh position may be off by more than the margin (largest speed times freshness)",
            "widen the margin, or lower speed or freshness",
        ),
        at_least(
            &b.fence_margin_mm,
            (margin, blind),
            "mm",
            "a unit that loses its position at the margin leaves the fence (way before the brakes, beyond `reaction_ms`, and 400 mm)",
            "widen the margin, lower the speed, or shorten `set_point_lease_ms` and `product_limit_ms`",
        ),
        at_least(
            &b.designation_mm,
            (b.designation_mm.get() as f64, 2.0 * stale),
            "mm",
            "an object may have left the designated place within half of the radius (twice the largest speed times freshness)",
            "widen the radius, or lower speed or freshness",
        ),
        at_least(
            &b.designation_confidence,
            (b.designation_confidence.get() as f64, (b.designation_keep.get() + APART_PERMILLE) as f64),
            "permille",
            "a newly designated track may be given up at once (`designation_keep` and 100)",
            "raise it, or lower `designation_keep`",
        ),
        at_least(
            &b.teammate_slack_mm,
            (b.teammate_slack_mm.get() as f64, SLIP_S * speed),
            "mm",
            "an honest teammate's slipping wheels take more than half of the slack (3 % of the largest speed for 8 s)",
            "widen the slack, or lower the speed",
        ),
    ];
    found.into_iter().flatten().collect()
}

/// The vehicle against its bounds, and its parts against each other.
fn body(platform: &Platform) -> Vec<Finding> {
    let (v, b) = (&platform.vehicle, &platform.bounds);
    let [length, _, height] = v.chassis_m.map(|edge| edge.get());
    let sag = GRAVITY / (4.0 * v.spring_rate.get());
    let ride = v.wheel_drop_m.get() + v.suspension_m.get() - sag + v.wheel_radius_m.get();
    let sideways = v.max_speed_m_s.get().powi(2) * v.max_curvature_per_m.get();
    let found = [
        at_least(
            &v.braking_m_s2,
            (v.braking_m_s2.get() - SLOPE_M_S2, b.braking_mm_s2.get() as f64 / 1000.0),
            "m/s²",
            "on the steepest ground the brakes miss `braking_mm_s2` (1 m/s² less than on the level)",
            "state stronger brakes, or lower `braking_mm_s2`",
        ),
        at_least(
            &v.max_speed_m_s,
            (v.max_speed_m_s.get(), b.max_speed_mm_s.get() as f64 / 1000.0),
            "m/s",
            "the vehicle never reaches `max_speed_mm_s`, from which the margins are derived",
            "lower `max_speed_mm_s`, or state a faster vehicle",
        ),
        at_most(
            &b.exclusion_mm,
            (b.exclusion_mm.get() as f64, length * 1000.0),
            "mm",
            "two units may truly stand nearer than that (length of the chassis)",
            "lower `exclusion_mm`",
        ),
        at_most(
            &v.max_curvature_per_m,
            (v.wheelbase_m.get() * v.max_curvature_per_m.get(), 1.0),
            "",
            "the front wheels steer by more than 45° (wheelbase times curvature)",
            "lower the curvature",
        ),
        at_most(
            &v.max_curvature_per_m,
            (sideways, GRAVITY * v.track_m.get() / (2.0 * ride)),
            "m/s²",
            "the vehicle tips over at its largest speed and curvature (track and height of the centre)",
            "lower curvature or speed, or widen the track",
        ),
        at_most(
            &v.wheel_radius_m,
            (2.0 * v.wheel_radius_m.get(), v.wheelbase_m.get()),
            "m",
            "front and rear wheels overlap (two radii and the wheelbase)",
            "lower the radius, or lengthen the wheelbase",
        ),
        at_most(
            &v.spring_rate,
            (sag, 0.8 * v.suspension_m.get()),
            "m",
            "at rest the springs give by more than their travel (four fifths of the suspension's length)",
            "state stiffer springs, or a longer suspension",
        ),
        at_least(
            &v.chassis_m,
            (ride, height / 2.0),
            "m",
            "the chassis stands on the ground (height of its centre at rest, half of its height)",
            "lower its height, or raise it by wheels, `wheel_drop_m` or suspension",
        ),
    ];
    found.into_iter().flatten().collect()
}

/// What has to be as it is, for what is made for it is fixed: `made`, and the remedy.
fn fixed<T>(at: &Located<T>, (got, expected): (f64, f64), made: &str, remedy: &str) -> Option<Finding> {
    unless(at, got == expected, || format!("{made}: {expected} expected, got {got}"), remedy)
}

fn camera(platform: &Platform) -> Vec<Finding> {
    let trained = "the shipped networks were trained on images of 160 × 120 pixels and 90° across";
    let networks = "take the key out; other images need networks trained for them";
    let (c, ground) = (&platform.camera, Camera::GROUND);
    let found = [
        fixed(&c.width, (c.width.get() as f64, f64::from(ground.width)), trained, networks),
        fixed(&c.height, (c.height.get() as f64, f64::from(ground.height)), trained, networks),
        fixed(&c.field_of_view_deg, (c.field_of_view_deg.get(), 90.0), trained, networks),
        fixed(
            &c.pitch_deg,
            (c.pitch_deg.get(), 0.0),
            "corroboration takes the optical axis for level",
            "take the key out; the angle has no place in `perception::corroborate`",
        ),
    ];
    found.into_iter().flatten().collect()
}

fn lidar(platform: &Platform) -> Vec<Finding> {
    let derived = "the LiDAR stage's thresholds are derived for 16 rings of 2° and one beam a degree";
    let thresholds = "take the key out; another LiDAR needs thresholds derived for it";
    let (l, ground) = (&platform.lidar, Lidar::GROUND);
    let found = [
        fixed(&l.rings, (l.rings.get() as f64, f64::from(ground.rings)), derived, thresholds),
        fixed(&l.azimuths, (l.azimuths.get() as f64, f64::from(ground.azimuths)), derived, thresholds),
        fixed(&l.lowest_deg, (l.lowest_deg.get(), f64::from(ground.lowest_deg)), derived, thresholds),
        fixed(&l.ring_step_deg, (l.ring_step_deg.get(), f64::from(ground.ring_step_deg)), derived, thresholds),
    ];
    found.into_iter().flatten().collect()
}

/// Limits of guards against bounds and vehicle.
fn guards(platform: &Platform) -> Vec<Finding> {
    let (g, b, v) = (&platform.guards, &platform.bounds, &platform.vehicle);
    let speed = b.max_speed_mm_s.get() as f64;
    let stops = speed * b.set_point_lease_ms.get() as f64 / 1000.0 + speed * speed / (2.0 * b.braking_mm_s2.get() as f64);
    let [length, width, _] = v.chassis_m.map(|edge| edge.get() * 1000.0);
    let [near, far] = g.lookahead_mm.map(|mm| mm.get() as f64);
    let found = [
        at_least(
            &g.reaction_ms,
            (g.reaction_ms.get() as f64, (b.control_period_ms.get() + READING_AND_PLANT_MS) as f64),
            "ms",
            "the unit reacts no sooner (control period, 50 ms of navigation, 50 ms of plant and actuators)",
            "raise it, or shorten `control_period_ms`",
        ),
        at_most(
            &g.fix_gate_mm,
            ((g.fix_gate_mm.get() + FOUR_DEVIATIONS_MM) as f64, b.fence_margin_mm.get() as f64),
            "mm",
            "a jump of fixes that passes the gate (with four deviations, 160 mm) may put the unit over its fence (margin)",
            "narrow the gate, or widen `fence_margin_mm`",
        ),
        at_least(
            &g.unobserved_mm,
            (g.unobserved_mm.get() as f64, stops),
            "mm",
            "without odometry the unit gets further before it stands (set-point lease at the largest speed, then brakes)",
            "raise it, or lower speed or `set_point_lease_ms`",
        ),
        at_most(
            &g.comfort_mm_s2,
            (g.comfort_mm_s2.get() as f64, b.braking_mm_s2.get() as f64),
            "mm/s²",
            "driving plans with stronger brakes than `braking_mm_s2`",
            "lower it",
        ),
        at_most(
            &g.turning_mm_s,
            (g.turning_mm_s.get() as f64, speed),
            "mm/s",
            "turning is faster than the largest speed",
            "lower it",
        ),
        at_most(&g.lookahead_mm, (near, far), "mm", "the shortest lookahead is longer than the longest", "swap the two"),
        at_least(
            &g.corridor_mm,
            (g.corridor_mm.get() as f64, width / 2.0),
            "mm",
            "the vehicle is wider than the way that is kept free ahead (half of the chassis' width)",
            "widen the corridor",
        ),
        at_least(
            &g.standoff_mm,
            (g.standoff_mm.get() as f64, length / 2.0),
            "mm",
            "the vehicle's front reaches the obstacle (half of the chassis' length)",
            "lengthen the distance",
        ),
        at_least(
            &g.plan_clearance_mm,
            (g.plan_clearance_mm.get() as f64, (g.fence_spare_mm.get() as f64).max(width / 2.0)),
            "mm",
            "a planned way leaves too little room (`fence_spare_mm`, half of the chassis' width)",
            "raise it, or lower `fence_spare_mm`",
        ),
    ];
    found.into_iter().flatten().collect()
}
