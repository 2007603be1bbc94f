//! Reservations: how far the guards' model fits the recorded vehicle, in sentences for the reader of a result.

use crate::Terms;
use crate::facts::Facts;
use crate::log::Log;
use crate::map::{Map, Vehicle};
use crate::track::Track;

/// Remarks on a recording that its reader should know.
pub(crate) fn remarks(log: &Log<'_>, map: &Map, terms: &Terms, track: &Track) -> Vec<String> {
    let facts = &track.facts;
    // What could not be read stands first: the rest may follow from it.
    let mut remarks = reading(log, facts);
    remarks.extend(track.remarks.iter().cloned());
    remarks.extend(motion(map, facts, terms));
    remarks.extend(lever(map, terms, track));
    remarks.extend(sources(map));
    remarks.extend(fixes(map, terms, facts));
    remarks
}

fn motion(map: &Map, facts: &Facts, terms: &Terms) -> Vec<String> {
    let mut remarks = Vec::new();
    let Terms { bounds, limits } = terms;
    if limits.aloft.is_some() {
        remarks.push("The platform flies; a recording has no heights for its guards, and none is judged.".to_owned());
    }
    if map.vehicle != Vehicle::Wheeled && !limits.free {
        let vehicle = match map.vehicle {
            Vehicle::Wheeled => "a wheeled vehicle",
            Vehicle::Multirotor => "a multirotor",
            Vehicle::FixedWing => "a fixed wing",
            Vehicle::Other => "a vehicle without wheels",
        };
        remarks.push(format!(
            "The localisation guard expects wheels: speed along the body axis, no sliding, an origin {} mm ahead of the rear \
             axle, motion in a plane. This is {vehicle}; a trip may be the model's and not the recording's.",
            limits.rear_axle_mm
        ));
    }
    match facts.sideways_m {
        Some(sideways) => {
            let all = libm::hypot(sideways, facts.way_m);
            let share = if all > 0.0 { 100.0 * sideways / all } else { 0.0 };
            remarks.push(format!(
                "{sideways:.1} m of the way are sideways to the body axis and {:.1} m along it ({share:.0} % of the two as a \
                 root of squares): the guard is handed {}.",
                facts.way_m,
                if limits.free { "both" } else { "the part along it" }
            ));
        }
        None => remarks.push("The map gives no sideways speed, so the fit of the model is not measured.".to_owned()),
    }
    let most = f64::from(bounds.max_speed_mm_s) / 1000.0;
    if facts.speed_m_s > most {
        remarks.push(format!(
            "The highest speed is {:.1} m/s; the platform's bounds are made for {most} m/s.",
            facts.speed_m_s
        ));
    }
    if let Some((n, above)) = facts.setpoints {
        remarks.push(format!("{above} of {n} set-points command more than the platform's {most} m/s."));
    }
    remarks
}

/// The receiver's place: its source, and whether the recording bears it out.
fn lever(map: &Map, terms: &Terms, track: &Track) -> Vec<String> {
    let place = |[ahead, left]: [f64; 2]| {
        let side = |metres: f64, [plus, minus]: [&str; 2]| {
            format!("{:.2} m {}", metres.abs(), if metres < 0.0 { minus } else { plus })
        };
        format!("{} and {}", side(ahead, ["ahead", "behind"]), side(left, ["to the left", "to the right"]))
    };
    let used = track.facts.lever_m.unwrap_or_default();
    let origin = f64::from(terms.limits.rear_axle_mm) / 1000.0;
    let moved = format!("the guards' origin is {origin} m ahead of it, and fixes are moved there");
    let found = track.estimate.map(|found| {
        let [ahead, left] = found.deviation_m;
        format!(
            "±{:.2} and ±{left:.2} m, from {} stretches with {:.1} rad of turning",
            ahead, found.stretches, found.turn
        )
    });
    match (&map.fix.lever_m, track.estimate, found) {
        (Some(_), Some(estimate), Some(found)) if differs(used, &estimate) => vec![format!(
            "The map's lever puts the receiver {} of the rear axle's middle, and this recording {} ({found}): trips of gate and drift in curves may be \
             the lever's.",
            place(used),
            place(estimate.lever_m)
        )],
        (Some(_), ..) => Vec::new(),
        (None, Some(_), Some(found)) => vec![format!(
            "The map gives no lever: this recording puts the receiver {} of the rear axle's middle ({found}); {moved}. What is estimated from a \
             recording hides as much of an error in it: measure the lever, and state `lever_m = [{}, {}]` in [fix].",
            place(used),
            used[0],
            used[1]
        )],
        (None, ..) => vec![format!(
            "The map gives no lever, and none is estimated (the recording turns too little, or the vehicle flies): the receiver is taken to be above the rear axle's middle; {moved}."
        )],
    }
}

/// True if a lever is further from an estimate than three of its deviations, and than 10 cm.
fn differs(stated: [f64; 2], estimate: &crate::lever::Estimate) -> bool {
    [0, 1].into_iter().any(|i| {
        let off = (stated[i] - estimate.lever_m[i]).abs();
        off > 0.1 && off > 3.0 * estimate.deviation_m[i]
    })
}

fn sources(map: &Map) -> Vec<String> {
    let mut remarks = Vec::new();
    let (fix, odometry) = (&map.fix.source, &map.odometry.source);
    if fix == odometry {
        remarks.push(format!(
            "Fix and odometry both come from `{fix}`: they are not independent, and their agreement shows little. An attack on that \
             source would move both."
        ));
    } else {
        remarks.push(format!(
            "The map states that `{fix}` and `{odometry}` are different sources; an estimator that is aided by the fix, as PX4's EKF2 \
             is by GNSS, follows a false fix and is not independent of it."
        ));
    }
    if let Some(heading) = &map.heading {
        remarks.push(format!(
            "The heading of fixes is `{}`'s: the guard's test of headings compares it with {}.",
            heading.source,
            if map.odometry.yaw_rate.is_some() { "the rate of turn" } else { "its own change, and cannot fail" }
        ));
    } else if map.odometry.yaw_rate.is_none() {
        remarks.push(
            "The rate of turn is derived from the fixes' own heading, so the test of headings cannot fail.".to_owned(),
        );
    }
    remarks
}

fn fixes(map: &Map, terms: &Terms, facts: &Facts) -> Vec<String> {
    let Terms { bounds, limits } = terms;
    let mut remarks = Vec::new();
    let limit = bounds.product_limit_ms as f64 / 1000.0;
    if facts.fix_period_s > limit {
        remarks.push(format!(
            "Fixes come every {:.2} s and the platform's limit is {limit} s: the guard is silent between any two. Give a platform file with \
             a `product_limit_ms` that this receiver can keep.",
            facts.fix_period_s
        ));
    }
    if facts.odometry_period_s > limit {
        remarks.push(format!(
            "Odometry comes every {:.2} s and the platform's limit is {limit} s.",
            facts.odometry_period_s
        ));
    }
    match facts.sigma_m {
        Some(sigma) if sigma * 1000.0 > f64::from(limits.fix_sigma_mm) => remarks.push(format!(
            "Fixes state a median deviation of {sigma:.2} m; the guard believes {} mm at most. Trips of gate and drift are expected from this \
             receiver. Give a platform file with a `fix_sigma_mm` that it keeps.",
            limits.fix_sigma_mm
        )),
        Some(_) => {}
        None => remarks.push("The map gives no deviation of fixes; the gate is at its narrowest.".to_owned()),
    }
    if map.fix.time.is_none() {
        remarks.push("The map gives no receiver's time: the time base is not judged.".to_owned());
    }
    if map.fence.is_none() {
        remarks.push("The map gives no fence: the geofence is not judged.".to_owned());
    }
    remarks
}

fn reading(log: &Log<'_>, facts: &Facts) -> Vec<String> {
    let mut remarks = Vec::new();
    if facts.fixes_unused > 0 {
        let all = facts.fixes + facts.fixes_unused;
        remarks.push(format!(
            "{} of {all} messages with fixes are not used: invalid, not finite, without a heading, or with a stamp that does not \
             increase.",
            facts.fixes_unused
        ));
    }
    if facts.odometry_unused > 0 {
        let all = facts.odometry + facts.odometry_unused;
        remarks.push(format!(
            "{} of {all} samples of odometry are not used: their stamps do not increase.",
            facts.odometry_unused
        ));
    }
    remarks.extend(log.notes.iter().map(|note| format!("{note}.")));
    if log.dropouts_ms > 0 {
        remarks.push(format!("The logger lost {} ms by its own account.", log.dropouts_ms));
    }
    let damage =
        log.end.why.iter().map(|reason| format!("Read up to byte {} of {}: {reason}.", log.end.at, log.end.of));
    damage.chain(remarks).collect()
}
