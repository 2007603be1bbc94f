//! Search from a sequence on the edge of a finding to a robust case inside its region: far enough from the edge that the
//! jitter of a live run does not decide the outcome.
//!
//! The edge itself is the twin's. Live runs of robust cases are left to the caller.

use super::error::SearchError;
use super::sequence::{Action, AttackSequence, move_of};
use super::tried::{Cause, SearchConfig, Test};

/// Deviation of live times from the twin's, milliseconds: from the mean to the 95th percentile of the time from a loss to
/// DEGRADED over 59 live runs (`lab live --runs 59`: 194 and 197 ms, and 194 and 196), rounded up.
const LIVE_JITTER_MS: f64 = 5.0;

/// Multiple of it by which a sequence stays away from its edge.
const AWAY: f64 = 3.0;

impl SearchConfig {
    /// A sequence of the same action types, each number strengthened by that margin, numbers other than times by one step; `test`
    /// finds it for `cause` as it is, with everything that much earlier and later, and with every number strengthened as much
    /// again. `None` where the region is thinner, or the attack space ends before.
    ///
    /// # Errors
    ///
    /// Reason for which a sequence cannot be run.
    pub fn inside(
        &self,
        sequence: &AttackSequence,
        test: Test<'_>,
        cause: &Cause,
    ) -> Result<Option<AttackSequence>, SearchError> {
        let Some(stronger) = self.stronger(sequence) else { return Ok(None) };
        let distance = self.ticks();
        for shift in [0, distance, 2 * distance, -distance] {
            let sequences = [shift, shift - distance, shift + distance].map(|shift| self.shifted(&stronger, shift));
            let [Some(middle), Some(earlier), Some(later)] = sequences else { continue };
            // What is at its strongest has no edge above.
            let above = self.stronger(&middle).unwrap_or_else(|| middle.clone());
            if self.all_hold(&[&middle, &earlier, &later, &above], test, cause)? {
                return Ok(Some(middle));
            }
        }
        Ok(None)
    }

    fn all_hold(&self, sequences: &[&AttackSequence], test: Test<'_>, cause: &Cause) -> Result<bool, SearchError> {
        for sequence in sequences {
            if test(&self.try_sequence(sequence)?).as_ref() != Some(cause) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// None where a number that has an edge below it cannot be moved that far from it.
    fn stronger(&self, sequence: &AttackSequence) -> Option<AttackSequence> {
        sequence
            .actions()
            .iter()
            .map(|action| self.stronger_action(action))
            .collect::<Option<Vec<_>>>()
            .map(AttackSequence::new)
    }

    fn stronger_action(&self, action: &Action) -> Option<Action> {
        let action_type = move_of(&self.space, action);
        let places = action_type.ranges().zip(&action.places).enumerate().map(|(n, (range, place))| {
            let steps = if action_type.counts_time(n) { (AWAY * LIVE_JITTER_MS / range.step).ceil() as u32 } else { 1 };
            // The weakest of its range has no edge below.
            let reached = (place + steps).min(range.last());
            (*place == 0 || reached == place + steps).then_some(reached)
        });
        Some(Action { places: places.collect::<Option<_>>()?, ..action.clone() })
    }

    /// The distance to the edge, in ticks of the attack space.
    fn ticks(&self) -> i64 {
        (AWAY * LIVE_JITTER_MS / self.space.tick_ms.unsigned() as f64).ceil() as i64
    }

    /// Everything a given number of ticks later; none where that is not within the attack space's times.
    fn shifted(&self, sequence: &AttackSequence, ticks: i64) -> Option<AttackSequence> {
        let (first, last) = self.space.begins();
        let shifted = |action: &Action| {
            let begins = u32::try_from(i64::from(action.begins) + ticks).ok()?;
            (first..=last).contains(&begins).then(|| Action { begins, ..action.clone() })
        };
        sequence.actions().iter().map(shifted).collect::<Option<Vec<_>>>().map(AttackSequence::new)
    }
}
