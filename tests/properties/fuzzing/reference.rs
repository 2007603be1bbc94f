//! What should happen, said without the cores: a few rules about words and the mission, from the bounds alone.
//!
//! It knows neither messages nor state machines. What it cannot foretell it leaves open; the oracle judges that.

use campaign::search::Tried;
use campaign::trial::TransitionRow;
use wire::bounds::Bounds;

/// The mission without any word, and the bounds.
pub(super) struct Reference {
    /// The unit's changes of mode.
    pub(super) changes: Vec<Change>,
    /// *Th*, milliseconds.
    pub(super) hold_ms: f64,
    /// Lease, a control period, and what a datagram under way may prolong it by.
    pub(super) lease_ms: f64,
    /// How long nothing may come without any consequence: the lease less the grants' period, for one may have been due.
    pub(super) grace_ms: f64,
}

/// A change of mode.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Change {
    pub(super) at_ms: f64,
    pub(super) from: String,
    pub(super) to: String,
}

impl Change {
    pub(super) fn of(row: &TransitionRow) -> Self {
        Self { at_ms: row.t_ms, from: row.from.to_string(), to: row.to.to_string() }
    }
}

/// What a word does, as far as the reference understands it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Deeds {
    /// Only what every boundary refuses by itself: old records, copies, plaintext.
    pub(super) only_refusable: bool,
    /// From when to when no grant can come through, milliseconds; the longest of these.
    pub(super) no_grant: Option<(f64, f64)>,
    /// All that it does is to keep datagrams back, and for so long at most.
    pub(super) only_silence_ms: Option<f64>,
    /// Only the display is lied to; no request is swallowed.
    pub(super) only_display: bool,
    /// The console does nothing for a time.
    pub(super) hangs_console: bool,
    /// The gateway's end, if that comes.
    pub(super) gateway_ends_ms: Option<f64>,
}

impl Reference {
    /// Of the mission as it goes without a word.
    pub(super) fn of(nominal: &Tried, bounds: &Bounds) -> Self {
        let ms = |ms: u64| ms as f64;
        Self {
            changes: nominal.trial.transitions.iter().map(Change::of).collect(),
            hold_ms: ms(bounds.to_hold_safe_ms),
            lease_ms: ms(bounds.lease_ms + 2 * bounds.control_period_ms),
            grace_ms: ms(bounds.lease_ms.saturating_sub(2 * bounds.grant_period_ms + bounds.control_period_ms)),
        }
    }

    /// The mission's mode at a moment.
    pub(super) fn mode_at(&self, at_ms: f64) -> &str {
        mode_at(&self.changes, at_ms)
    }
}

/// The mode at a moment, by its changes.
pub(super) fn mode_at(changes: &[Change], at_ms: f64) -> &str {
    changes.iter().take_while(|c| c.at_ms <= at_ms).last().map_or("IDLE", |c| c.to.as_str())
}
