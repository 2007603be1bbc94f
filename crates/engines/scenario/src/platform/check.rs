//! Checks of a platform's bounds against each other, each with its reason; the derivations are in `docs/reference/bounds.md`.
//! Derivations of vehicle, sensors and limits of guards are in `body`.
//!
//! Times are milliseconds, ways millimetres, unless a name says otherwise.

use spacecraft::attitude::are_moments;
use wire::report::REPORTS_KEPT;

use super::{Bound, BoundsTable, Platform, body};
use crate::finding::{Finding, finding};
use crate::value::Located;

/// Error of the last fix that a fence margin allows for.
const FIX_ERROR_MM: i64 = 400;
/// Distance of the confidence to arm above the one to keep, permille.
const APART_PERMILLE: i64 = 100;
/// Twice the share of the speed by which an honest teammate's wheels may slip, times the seconds for which consistency remembers.
const SLIP_S: f64 = 2.0 * 0.03 * 8.0;

/// Every mistake in a platform file named `stem`.
pub(crate) fn platform(platform: &Platform, stem: &str) -> Vec<Finding> {
    let named = unless(
        &platform.name,
        platform.name.as_str() == stem,
        || format!("the file is named `{stem}`"),
        "make name and file name the same",
    );
    let bounds = [periods(&platform.bounds), chains(&platform.bounds), margins(platform)];
    named.into_iter().chain(bounds.into_iter().flatten()).chain(body::check(platform)).collect()
}

/// Time from a lost uplink to the lapse of the lease: the report is too old, the last grant runs out, a control period
/// finds it.
pub(crate) fn uplink_ms(bounds: &BoundsTable) -> i64 {
    bounds.freshness_ms.get() + bounds.lease_ms.get() + bounds.control_period_ms.get()
}

/// A finding at `located` unless `holds`.
pub(super) fn unless<T>(
    located: &Located<T>,
    holds: bool,
    message: impl FnOnce() -> String,
    remedy: &str,
) -> Option<Finding> {
    (!holds).then(|| finding(located, message(), remedy))
}

/// A finding at `located`, which has the value `got`, where that is above `most`: `unit` of the values, `reason` they are held together.
pub(super) fn at_most<T>(
    located: &Located<T>,
    (got, most): (f64, f64),
    unit: &str,
    reason: &str,
    remedy: &str,
) -> Option<Finding> {
    // A thousandth is far below every number's last digit, and far above its rounding.
    unless(
        located,
        got <= most + 1e-3,
        || format!("{reason}: at most {} {unit} expected, got {}", decimal_text(most), decimal_text(got)),
        remedy,
    )
}

/// A finding at `located` unless these are the moments of inertia of a body.
pub(super) fn inertia<T>(located: &Located<T>, moments: [f64; 3]) -> Option<Finding> {
    let reason =
        || "no body has these moments of inertia: each is positive and below the sum of the other two".to_owned();
    unless(located, are_moments(moments), reason, "give the moments about the three principal axes")
}

/// Finding where it is below `least`.
pub(super) fn at_least<T>(
    located: &Located<T>,
    (got, least): (f64, f64),
    unit: &str,
    reason: &str,
    remedy: &str,
) -> Option<Finding> {
    let message = || format!("{reason}: at least {} {unit} expected, got {}", decimal_text(least), decimal_text(got));
    unless(located, got >= least - 1e-3, message, remedy)
}

/// A number without an end of zeros.
fn decimal_text(value: f64) -> String {
    format!("{}", (value * 1000.0).round() / 1000.0)
}

fn periods(b: &BoundsTable) -> Vec<Finding> {
    let renewed = [
        (&b.grant_period_ms, &b.lease_ms, "the lease it renews", "grant several times in a lease"),
        (&b.telemetry_period_ms, &b.freshness_ms, "the freshness window", "send several times in it"),
        (
            &b.control_period_ms,
            &b.set_point_lease_ms,
            "the lease of the set-points it renews",
            "renew it several times",
        ),
        (
            &b.challenge_period_ms,
            &b.echo_limit_ms,
            "the time for which an echo serves",
            "challenge several times in it",
        ),
    ];
    let shorter = |(period, bound, name, remedy): (&Bound, &Bound, &str, &str)| {
        unless(period, period.get() < bound.get(), || format!("not shorter than {name}"), remedy)
    };
    let reports = unless(
        &b.telemetry_period_ms,
        b.telemetry_period_ms.get() * REPORTS_KEPT as i64 >= b.command_limit_ms.get(),
        || format!("{REPORTS_KEPT} reports are over before an order that names one"),
        "report less often, or shorten the command limit",
    );
    let honoured = at_most(
        &b.set_point_lease_ms,
        (b.set_point_lease_ms.get() as f64, config::platform::MAX_LEASE.0 as f64 / 1000.0),
        "ms",
        "the plant honours no longer lease",
        "shorten the lease",
    );
    renewed.into_iter().map(shorter).chain([reports, honoured]).flatten().collect()
}

fn chains(b: &BoundsTable) -> Vec<Finding> {
    let (td, th, tc) = (b.to_degraded_ms.get(), b.to_hold_safe_ms.get(), b.control_period_ms.get());
    let blind = b.product_limit_ms.get() + tc + b.unrecovered_ms.get() + tc;
    let found = [
        unless(
            &b.to_degraded_ms,
            td <= th,
            || "later than the bound to hold-safe".to_owned(),
            "degrade no later than holding",
        ),
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
    // A slower body reacts later, which is no time in which its place may be older.
    let reaction = g.reaction_ms.get().min(b.control_period_ms.get() + body::READING_AND_PLANT_MS);
    let blind = speed * (lasts - reaction).max(0) as f64 / 1000.0 + FIX_ERROR_MM as f64;
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
