//! False statements of B about itself: its place, its motion, the kind of its report, its time base.
//!
//! A report is changed before it is signed, so it passes every cryptographic check. The time of sending is left to

use ground_truth::Action;
use wire::report::Report;
use wire::time::{PeerStamp, Span};

use crate::plan::{Confusion, Falsehood, InsiderTeammateConfig, MotionClaim};

/// A false statement, and the facts needed to log it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Told {
    /// Action taken, if any.
    pub(super) action: Option<Action>,
    /// Distance of the claimed place from the true one, mm.
    pub(super) off_mm: u32,
}

/// Changes a true `report` as the plan has it, `run` after the start.
pub(super) fn falsify(config: &InsiderTeammateConfig, run: Span, report: &mut Report) -> Told {
    let truth = report.pose;
    let open = |at_ms: u64, duration_ms: u64| run >= Span::ms(at_ms) && run < Span::ms(at_ms + duration_ms);
    let mut action = None;
    for lie in config.falsehoods.iter().filter(|lie| open(lie.at_ms, lie.duration_ms)) {
        misplace(lie, run, report);
        action = Some(Action::Lie);
    }
    for confusion in config.confusions.iter().filter(|c| open(c.at_ms, c.duration_ms)) {
        confuse(confusion, report);
        action = Some(Action::Confuse);
    }
    let axis = |claimed: i32, true_one: i32| f64::from(claimed) - f64::from(true_one);
    let off = libm::hypot(axis(report.pose.x_mm, truth.x_mm), axis(report.pose.y_mm, truth.y_mm));
    Told { action, off_mm: off as u32 }
}

fn misplace(lie: &Falsehood, run: Span, report: &mut Report) {
    let direction = f64::from(lie.towards_mrad) / 1000.0;
    let (east, north) = (libm::cos(direction), libm::sin(direction));
    let speed = f64::from(lie.drift_mm_s);
    if lie.motion != MotionClaim::Feigned {
        let travelled = speed * (run.0 - Span::ms(lie.at_ms).0) as f64 / 1e6;
        report.pose.x_mm = report.pose.x_mm.saturating_add((travelled * east) as i32);
        report.pose.y_mm = report.pose.y_mm.saturating_add((travelled * north) as i32);
    }
    if lie.motion != MotionClaim::Hidden {
        let heading = f64::from(report.pose.yaw_mrad) / 1000.0;
        let own_speed = f64::from(report.speed_mm_s);
        let (vx, vy) = (own_speed * libm::cos(heading) + speed * east, own_speed * libm::sin(heading) + speed * north);
        report.speed_mm_s = libm::hypot(vx, vy) as i32;
        report.pose.yaw_mrad = (libm::atan2(vy, vx) * 1000.0) as i16;
    }
}

fn confuse(confusion: &Confusion, report: &mut Report) {
    report.product = confusion.product.mode();
    let shift = confusion.clock_ms.saturating_mul(1000);
    report.stamp = PeerStamp(report.stamp.0.saturating_add_signed(shift));
}
