//! Expected behaviour, without the cores: the mission as it goes without an attack, and a few rules from the bounds alone.
//!
//! It knows neither messages nor state machines. Unpredictable outcomes are left open; the oracle judges them.

use evidence::trial::TransitionRow;
use search::Tried;
use wire::bounds::Bounds;

/// The mission without any sequence, and the bounds.
pub(super) struct Reference {
    /// The unit's changes of mode.
    pub(super) changes: Vec<Change>,
    pub(super) limits: Limits,
}

/// Time limits, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Limits {
    /// *Th*.
    pub(super) hold: f64,
    /// *Td*, and a control period in which it is judged.
    pub(super) degraded: f64,
    /// Lease, a control period, and the extension by a datagram under way.
    pub(super) lease: f64,
    /// Longest silence without any consequence: the lease less the grants' period, for one may have been due.
    pub(super) grace: f64,
    /// Time from the last seal to the end of authority.
    pub(super) seal: f64,
    /// Time from a stop that was ordered to standstill: the set-point's lease, and braking from full speed.
    pub(super) rest: f64,
    /// For how long after it ended something may be shown as if it were: a period of telemetry, and *Tf*.
    pub(super) shown: f64,
    /// Between two reports of a unit.
    pub(super) report: f64,
    /// Time from an operator's HOLD to the mode: the ways of a request, an order and the control period, without an
    /// attacker in them.
    pub(super) obeyed: f64,
    /// Largest distance of a teammate's claimed place from the end of its claimed motion, metres.
    pub(super) slack_m: f64,
}

/// A change of mode.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Change {
    pub(super) at_ms: f64,
    pub(super) from: String,
    pub(super) to: String,
}

/// Modes in which the unit may move by itself.
const DRIVING: [&str; 3] = ["READY", "PREPARE_TO_ACT", "DEGRADED"];
/// Time limit of two hops and their cores in the twin.
const TWO_HOPS_MS: u64 = 100;

impl Change {
    pub(super) fn from_row(row: &TransitionRow) -> Self {
        Self { at_ms: row.t_ms, from: row.from.to_string(), to: row.to.to_string() }
    }
}

impl Reference {
    /// Reference for the mission as it goes without a sequence.
    pub(super) fn from_nominal(nominal: &Tried, bounds: &Bounds) -> Self {
        Self {
            changes: nominal.trial.transitions.iter().map(Change::from_row).collect(),
            limits: Limits::from_bounds(bounds),
        }
    }
}

impl Limits {
    /// Limits by the bounds of a platform.
    pub(super) fn from_bounds(bounds: &Bounds) -> Self {
        let ms = |ms: u64| ms as f64;
        let braking = ms(u64::from(bounds.max_speed_mm_s)) * 1000.0 / ms(u64::from(bounds.braking_mm_s2));
        Self {
            hold: ms(bounds.to_hold_safe_ms),
            degraded: ms(bounds.to_degraded_ms + bounds.control_period_ms),
            lease: ms(bounds.lease_ms + 2 * bounds.control_period_ms),
            grace: ms(bounds.lease_ms.saturating_sub(2 * bounds.grant_period_ms + bounds.control_period_ms)),
            seal: ms(bounds.seal_limit_ms + 2 * bounds.control_period_ms),
            rest: ms(bounds.set_point_lease_ms + bounds.control_period_ms) + braking,
            report: ms(bounds.telemetry_period_ms),
            shown: ms(bounds.freshness_ms + 2 * bounds.telemetry_period_ms),
            obeyed: ms(bounds.control_period_ms + TWO_HOPS_MS),
            slack_m: f64::from(bounds.teammate_slack_mm) / 1000.0,
        }
    }
}

/// The mode at a moment, by its changes.
pub(super) fn mode_at(changes: &[Change], at_ms: f64) -> &str {
    changes.iter().take_while(|c| c.at_ms <= at_ms).last().map_or("IDLE", |c| c.to.as_str())
}

/// True if the unit may move by itself in this mode.
pub(super) fn drives(mode: &str) -> bool {
    DRIVING.contains(&mode)
}
