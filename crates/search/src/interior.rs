//! From a word on its edge to one inside its region: far enough from where it ceases to be a finding that the jitter of a live
//! run does not decide.
//!
//! The edge itself is the twin's. Live runs of what is here are left to whoever asks for them.

use super::tried::{Cause, Ground, Test};
use super::word::{Letter, Word, move_of};

/// How much later or earlier than in the twin something happens live, milliseconds: from the mean to the 95th percentile of
/// the time from a loss to DEGRADED over 59 live runs (`lab live --runs 59`: 194 and 197 ms, and 194 and 196),
/// rounded up.
const LIVE_JITTER_MS: f64 = 5.0;

/// How many times that a word stays away from its edge.
const AWAY: f64 = 3.0;

impl Ground {
    /// A word of the same moves, each number strengthened by that far, what counts no time by one step; which `test` finds for
    /// `cause` as it is, with everything that far earlier and later, and with every number as much stronger again. None where there
    /// is none: the region is thinner, or the alphabet ends before.
    ///
    /// # Errors
    /// Why a word cannot be run.
    pub fn inside(&self, word: &Word, test: Test<'_>, cause: &Cause) -> Result<Option<Word>, String> {
        let Some(stronger) = self.stronger(word) else { return Ok(None) };
        let away = self.ticks();
        for shift in [0, away, 2 * away, -away] {
            let around = [shift, shift - away, shift + away].map(|shift| self.shifted(&stronger, shift));
            let [Some(middle), Some(earlier), Some(later)] = around else { continue };
            // What is at its strongest has no edge above.
            let above = self.stronger(&middle).unwrap_or_else(|| middle.clone());
            if self.all_hold(&[&middle, &earlier, &later, &above], test, cause)? {
                return Ok(Some(middle));
            }
        }
        Ok(None)
    }

    fn all_hold(&self, words: &[&Word], test: Test<'_>, cause: &Cause) -> Result<bool, String> {
        for word in words {
            if test(&self.try_word(word)?).as_ref() != Some(cause) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// None where a number that has an edge below it cannot be moved that far from it.
    fn stronger(&self, word: &Word) -> Option<Word> {
        word.letters().iter().map(|letter| self.stronger_letter(letter)).collect::<Option<Vec<_>>>().map(Word::new)
    }

    fn stronger_letter(&self, letter: &Letter) -> Option<Letter> {
        let of = move_of(&self.alphabet, letter);
        let places = of.ranges().zip(&letter.places).enumerate().map(|(n, (range, place))| {
            let steps = if of.counts_time(n) { (AWAY * LIVE_JITTER_MS / range.step).ceil() as u32 } else { 1 };
            // The weakest of its range has no edge below.
            let reached = (place + steps).min(range.last());
            (*place == 0 || reached == place + steps).then_some(reached)
        });
        Some(Letter { places: places.collect::<Option<_>>()?, ..letter.clone() })
    }

    /// The distance to the edge, in ticks of the alphabet.
    fn ticks(&self) -> i64 {
        (AWAY * LIVE_JITTER_MS / self.alphabet.tick_ms.unsigned() as f64).ceil() as i64
    }

    /// Everything so many ticks later; none where that is not within the alphabet's times.
    fn shifted(&self, word: &Word, ticks: i64) -> Option<Word> {
        let (first, last) = self.alphabet.begins();
        let shifted = |letter: &Letter| {
            let begins = u32::try_from(i64::from(letter.begins) + ticks).ok()?;
            (first..=last).contains(&begins).then(|| Letter { begins, ..letter.clone() })
        };
        word.letters().iter().map(shifted).collect::<Option<Vec<_>>>().map(Word::new)
    }
}
