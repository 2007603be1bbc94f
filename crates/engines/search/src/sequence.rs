//! Attack sequences: moves of an attack space, each with its start and its numbers; and the scenario that a sequence
//! makes of another.

use std::fmt::Write;

use scenario::{AttackSpace, Move, Scenario, SettingsError};
use serde::Serialize;

/// One move at one moment.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Action {
    /// Start, in ticks of the attack space.
    pub begins: u32,
    /// Index of the move in the attack space.
    pub kind: usize,
    /// The places of its numbers in their ranges, the length first where it lasts.
    pub places: Vec<u32>,
}

/// Fault of an action that comes from outside.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// A number of actions that the attack space does not allow.
    #[error("{got} actions; a sequence has 1 to {longest}")]
    Length {
        /// Most actions.
        longest: usize,
        /// Its actions.
        got: usize,
    },
    /// An action type that is not there.
    #[error("action {action}: move {got}; the last is {last}")]
    Move {
        /// Index of the action.
        action: usize,
        /// The last action type.
        last: usize,
        /// The one asked for.
        got: usize,
    },
    /// An action that begins too early or too late.
    #[error("action {action}: begins at tick {got}; the attack space has {first} to {last}")]
    Begin {
        /// Index of the action.
        action: usize,
        /// The first tick.
        first: u32,
        /// The last.
        last: u32,
        /// The one asked for.
        got: u32,
    },
    /// An action with more or fewer numbers than its type.
    #[error("action {action}: {got} places; its move has {expected}")]
    Numbers {
        /// Index of the action.
        action: usize,
        /// Numbers of its action type.
        expected: usize,
        /// Its own.
        got: usize,
    },
    /// A number beyond its range.
    #[error("action {action}: place {got} of number {number}; the last is {last}")]
    Place {
        /// Index of the action.
        action: usize,
        /// Index of the number.
        number: usize,
        /// The last place of its range.
        last: u32,
        /// The one asked for.
        got: u32,
    },
}

/// The attack sequence of one trial, in order of time.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct AttackSequence(Vec<Action>);

impl AttackSequence {
    /// Sequence of these actions, in whatever order they come.
    pub fn new(mut actions: Vec<Action>) -> Self {
        actions.sort();
        Self(actions)
    }

    /// Sequence of actions from outside, each of them checked against `space`.
    ///
    /// # Errors
    /// The first fault.
    pub fn checked(space: &AttackSpace, actions: Vec<Action>) -> Result<Self, Unfit> {
        let (longest, got) = (space.longest.unsigned() as usize, actions.len());
        if got == 0 || got > longest {
            return Err(Unfit::Length { longest, got });
        }
        let (first, last) = space.begins();
        for (i, action) in actions.iter().enumerate() {
            let (kind, begins) = (action.kind, action.begins);
            let action_type =
                space.moves.get(kind).ok_or(Unfit::Move { action: i, last: space.moves.len() - 1, got: kind })?;
            if begins < first || begins > last {
                return Err(Unfit::Begin { action: i, first, last, got: begins });
            }
            let ends = action_type.strongest();
            if action.places.len() != ends.len() {
                return Err(Unfit::Numbers { action: i, expected: ends.len(), got: action.places.len() });
            }
            for (number, (place, last)) in action.places.iter().zip(ends).enumerate() {
                if *place > last {
                    return Err(Unfit::Place { action: i, number, last, got: *place });
                }
            }
        }
        Ok(Self::new(actions))
    }

    /// Its actions, by time.
    pub fn actions(&self) -> &[Action] {
        &self.0
    }

    /// The sequences of `n` of its actions.
    pub fn subsequences(&self, n: usize) -> Vec<AttackSequence> {
        // A sequence has at most 6 actions: the bound only keeps the shift in range.
        let all = 0..1_u32 << self.0.len().min(16);
        let chosen = all.filter(|set| set.count_ones() as usize == n);
        chosen
            .map(|set| {
                let remaining = self.0.iter().enumerate().filter(|(i, _)| set >> i & 1 == 1);
                AttackSequence(remaining.map(|(_, action)| action.clone()).collect())
            })
            .collect()
    }

    /// `base` with the actions of this sequence in it.
    ///
    /// # Errors
    ///
    /// The action that does not fit `base`, in words.
    pub fn in_scenario(&self, space: &AttackSpace, base: &Scenario) -> Result<Scenario, SettingsError> {
        let tick = space.tick_ms.unsigned();
        let entry = |action: &Action| {
            let action_type = move_of(space, action);
            (action_type.table.as_str().to_owned(), action_type.entry(u64::from(action.begins) * tick, &action.places))
        };
        base.with_entries(&space.with, self.0.iter().map(entry))
    }

    /// Its actions, for people: `cut at 4.00 s for 0.55 s, hold at 5.10 s (by_ms = 300)`.
    pub fn describe(&self, space: &AttackSpace) -> String {
        let tick = space.tick_ms.unsigned();
        let text_of = |action: &Action| {
            let action_type = move_of(space, action);
            let begins = u64::from(action.begins) * tick;
            let mut text = format!("{} at {:.2} s", action_type.name.as_str(), begins as f64 / 1000.0);
            let mut values = action_type.ranges().zip(&action.places).map(|(range, place)| range.value_at(*place));
            if action_type.lasts_ms.is_some() {
                // Writing to a string does not fail.
                let _ = write!(text, " for {} s", seconds(values.next().unwrap_or_default()));
            }
            for (number, value) in action_type.varies.iter().zip(values) {
                let _ = write!(text, " ({} = {value})", number.key.as_str());
            }
            text
        };
        if self.0.is_empty() { "nothing".to_owned() } else { self.0.iter().map(text_of).collect::<Vec<_>>().join(", ") }
    }
}

/// Milliseconds as seconds: hundredths, and thousandths where there are any.
fn seconds(ms: f64) -> String {
    let places = if ms % 10.0 == 0.0 { 2 } else { 3 };
    format!("{:.places$}", ms / 1000.0)
}

/// The move of an action.
pub(super) fn move_of<'a>(space: &'a AttackSpace, action: &Action) -> &'a Move {
    &space.moves[action.kind]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn action(begins: u32, kind: usize) -> Action {
        Action { begins, kind, places: Vec::new() }
    }

    #[test]
    fn sequence_is_independent_of_action_order() {
        assert_eq!(
            AttackSequence::new(vec![action(5, 0), action(2, 1)]),
            AttackSequence::new(vec![action(2, 1), action(5, 0)])
        );
    }

    #[test]
    fn subsequences_are_every_choice_of_actions_once() {
        let sequence = AttackSequence::new((0..4).map(|i| action(i, 0)).collect());
        let counts: Vec<usize> = (0..=4).map(|n| sequence.subsequences(n).len()).collect();
        assert_eq!(counts, [1, 4, 6, 4, 1]);
        assert_eq!(sequence.subsequences(4), [sequence]);
    }
}
