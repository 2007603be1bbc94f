//! Checks of a platform's vehicle, sensors and limits of guards, against each other and against its bounds, each with its reason.
//!
//! Lengths of the vehicle are metres, limits millimetres and milliseconds.

use wire::sensor::{Camera, Lidar};

use super::check::{at_least, at_most, unless};
use super::tables::SafeAction;
use super::{Platform, flight, space};
use crate::finding::Finding;
use crate::value::Located;

/// Weakening of the brakes on the steepest ground that a scene may have, m/s².
const SLOPE_M_S2: f64 = 1.0;
/// A navigation period and a step of the plant with its actuators.
pub(super) const READING_AND_PLANT_MS: i64 = 100;
/// Deviations of a fix that the gate adds.
const DEVIATIONS: i64 = 4;
/// Share of a suspension's length by which it can give.
const SUSPENSION_TRAVEL: f64 = 0.8;
pub(super) const GRAVITY: f64 = 9.81;

/// Mistakes in all tables but the bounds.
pub(super) fn check(platform: &Platform) -> Vec<Finding> {
    let wheels: [fn(&Platform) -> Vec<Finding>; 3] = [able, check_parts, stops];
    let groups = [camera, lidar, guards, driving];
    let of_body = match &platform.satellite {
        Some(table) => space::check(platform, table).into_iter().chain(space::safe(platform)).collect(),
        None if platform.multirotor.is_some() || platform.fixed_wing.is_some() || platform.aloft.is_some() => {
            flight::check(platform)
        }
        None => each(&wheels, platform),
    };
    of_body.into_iter().chain(each(&groups, platform)).collect()
}

fn each(groups: &[fn(&Platform) -> Vec<Finding>], platform: &Platform) -> Vec<Finding> {
    groups.iter().flat_map(|group| group(platform)).collect()
}

/// The safe action of wheels.
fn stops(platform: &Platform) -> Vec<Finding> {
    let action = &platform.safe.action;
    let lands = || "a vehicle on wheels does not land".to_owned();
    unless(action, **action == SafeAction::Stop, lands, "state `action = \"stop\"`").into_iter().collect()
}

/// The vehicle against its bounds.
fn able(platform: &Platform) -> Vec<Finding> {
    let (v, b) = (&platform.vehicle, &platform.bounds);
    let [length, ..] = v.chassis_m.map(|edge| edge.get());
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
    ];
    found.into_iter().flatten().collect()
}

/// The parts of the vehicle against each other.
fn check_parts(platform: &Platform) -> Vec<Finding> {
    let v = &platform.vehicle;
    let [.., height] = v.chassis_m.map(|edge| edge.get());
    let sag = GRAVITY / (4.0 * v.spring_rate.get());
    let ride = v.wheel_drop_m.get() + v.suspension_m.get() - sag + v.wheel_radius_m.get();
    let sideways = v.max_speed_m_s.get().powi(2) * v.max_curvature_per_m.get();
    let found = [
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
            (sag, SUSPENSION_TRAVEL * v.suspension_m.get()),
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

/// A finding at a value other than the one that something is `made` for.
fn fixed<T>(located: &Located<T>, (got, expected): (f64, f64), made: &str, remedy: &str) -> Option<Finding> {
    unless(located, got == expected, || format!("{made}: {expected} expected, got {got}"), remedy)
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

/// Limits of guards against bounds.
fn guards(platform: &Platform) -> Vec<Finding> {
    let (g, b) = (&platform.guards, &platform.bounds);
    let speed = b.max_speed_mm_s.get() as f64;
    let stops =
        speed * b.set_point_lease_ms.get() as f64 / 1000.0 + speed * speed / (2.0 * b.braking_mm_s2.get() as f64);
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
            ((g.fix_gate_mm.get() + DEVIATIONS * g.fix_sigma_mm.get()) as f64, b.fence_margin_mm.get() as f64),
            "mm",
            "a jump of fixes that passes the gate (with four `fix_sigma_mm`) may put the unit over its fence (margin)",
            "narrow the gate, believe a smaller deviation, or widen `fence_margin_mm`",
        ),
        at_least(
            &g.unobserved_mm,
            (g.unobserved_mm.get() as f64, stops),
            "mm",
            "without odometry the unit gets further before it stands (set-point lease at the largest speed, then brakes)",
            "raise it, or lower speed or `set_point_lease_ms`",
        ),
    ];
    found.into_iter().flatten().collect()
}

/// Limits of driving against bounds and vehicle.
fn driving(platform: &Platform) -> Vec<Finding> {
    let (g, b) = (&platform.guards, &platform.bounds);
    let speed = b.max_speed_mm_s.get() as f64;
    let [length, width, _] = platform.extent().map(|metres| metres * 1000.0);
    let [near, far] = g.lookahead_mm.map(|mm| mm.get() as f64);
    let found = [
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
        at_most(
            &g.lookahead_mm,
            (near, far),
            "mm",
            "the shortest lookahead is longer than the longest",
            "swap the two",
        ),
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
