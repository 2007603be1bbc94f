//! Times within which the plant obeys a change of its set-point, and brakes.

use evidence::{Evidence, Micros};
use wire::bounds::Bounds;

use super::{SLACK, process};

/// Excess of the speed of a plant that drives over its set-point, at most, mm/s: on the steepest ground that a scene may have,
/// downhill adds 1 m/s² (`docs/reference/bounds.md`), and the plant corrects 4 m/s² for each m/s.
pub(crate) const OVERSPEED: i32 = 250;

/// Time at which the last set-point from before `last_sent` no longer drives the plant, whatever became of its sender: its lease has ended. A
/// plant with a world that hung obeys once that goes on.
pub(crate) fn set_point_lapsed(evidence: &Evidence, last_sent: Micros) -> Micros {
    let lapsed = last_sent + evidence.bounds.set_point_lease_ms * 1000 + SLACK;
    process::can_judge(evidence, evidence.under.sim, lapsed)
}

/// Time at which a plant that has braked since `since`, from the largest speed to `target`, is that slow.
pub(crate) fn braked_to(evidence: &Evidence, since: Micros, target: i32) -> Micros {
    let Bounds { max_speed_mm_s, braking_mm_s2, .. } = evidence.bounds;
    let above = u64::from(max_speed_mm_s.saturating_sub(target.unsigned_abs()));
    let braking_time = above * 1_000_000 / u64::from(braking_mm_s2).max(1);
    let braked = process::can_judge(evidence, evidence.under.sim, since + braking_time);
    // A plant does not brake in a world that hangs.
    if braked > since + braking_time { braked + braking_time } else { braked }
}
