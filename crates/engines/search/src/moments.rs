//! Moments that may matter: the times of a run at which its state changes, and the edges of the bounds that begin
//! there.

use scenario::AttackSpace;
use wire::bounds::Bounds;

use super::tried::Tried;

/// The moments of one run, in ticks, in order, within the times at which the attack space begins anything.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Moments {
    /// The unit changes mode.
    pub changes: Vec<u32>,
    /// A bound that began with a change, or with the run, ends; one tick before, on it, one after.
    pub edges: Vec<u32>,
    /// Lengths of time that the bounds name; one tick less, just so, one more. Milliseconds.
    pub lengths: Vec<u32>,
}

impl Moments {
    /// Moments of a run.
    pub fn from_run(run: &Tried, space: &AttackSpace, bounds: &Bounds) -> Self {
        let tick = space.tick_ms.unsigned() as u32;
        let (first, last) = space.begins();
        let in_range = |mut ticks: Vec<u32>| {
            ticks.retain(|t| (first..=last).contains(t));
            ticks.sort_unstable();
            ticks.dedup();
            ticks
        };
        let neighbours = |ms: u32| [(ms / tick).saturating_sub(1), ms / tick, ms / tick + 1];
        let changes: Vec<u32> = run.changes_ms.iter().map(|ms| ms / tick).collect();
        let starts = || std::iter::once(0).chain(run.changes_ms.iter().copied());
        let edges =
            starts().flat_map(|moment| spans(bounds).into_iter().flat_map(move |span| neighbours(moment + span)));
        let mut lengths: Vec<u32> =
            spans(bounds).into_iter().flat_map(|ms| [ms.saturating_sub(tick), ms, ms + tick]).collect();
        lengths.sort_unstable();
        lengths.dedup();
        Self { edges: in_range(edges.collect()), changes: in_range(changes), lengths }
    }
}

/// The spans of time that the platform's bounds name, milliseconds.
fn spans(bounds: &Bounds) -> [u32; 11] {
    [
        bounds.freshness_ms,
        bounds.product_limit_ms,
        bounds.unrecovered_ms,
        bounds.lease_ms,
        bounds.to_degraded_ms,
        bounds.to_hold_safe_ms,
        bounds.seal_limit_ms,
        bounds.hysteresis_ms,
        bounds.command_limit_ms,
        bounds.echo_limit_ms,
        bounds.authority_ms,
    ]
    .map(|ms| u32::try_from(ms).unwrap_or(u32::MAX / 2))
}
