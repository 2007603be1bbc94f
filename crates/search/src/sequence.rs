//! A sequence: moves of an attack space, each with its beginning and its numbers; and the scenario that it makes of another.

use std::fmt::Write;

use scenario::{AttackSpace, Move, Scenario};
use serde::Serialize;

/// One move at one moment.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Action {
    /// Start, in ticks of the attack space.
    pub begins: u32,
    /// Which move, by its place in the attack space.
    pub kind: usize,
    /// The places of its numbers in their ranges, the length first where it lasts.
    pub places: Vec<u32>,
}

/// The attack sequence of one trial, in order of time.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct AttackSequence(Vec<Action>);

impl AttackSequence {
    /// Of these actions, in whatever order they come.
    pub fn new(mut actions: Vec<Action>) -> Self {
        actions.sort();
        Self(actions)
    }

    /// Its actions, by time.
    pub fn actions(&self) -> &[Action] {
        &self.0
    }

    /// The sequences of `n` of its actions.
    pub fn subsequences(&self, n: usize) -> Vec<AttackSequence> {
        let all = 0..1_u32 << self.0.len().min(16);
        let chosen = all.filter(|set| set.count_ones() as usize == n);
        chosen
            .map(|set| {
                let kept = self.0.iter().enumerate().filter(|(i, _)| set >> i & 1 == 1);
                AttackSequence(kept.map(|(_, action)| action.clone()).collect())
            })
            .collect()
    }

    /// `base` with the actions of this sequence in it.
    ///
    /// # Errors
    ///
    /// The action that does not fit `base`, in words.
    pub fn in_scenario(&self, space: &AttackSpace, base: &Scenario) -> Result<Scenario, String> {
        let tick = space.tick_ms.unsigned();
        let entry = |action: &Action| {
            let of = move_of(space, action);
            (of.table.as_str().to_owned(), of.entry(u64::from(action.begins) * tick, &action.places))
        };
        base.with_entries(&space.with, self.0.iter().map(entry))
    }

    /// Its actions, for people: `cut at 4.00 s for 0.55 s, hold at 5.10 s (by_ms = 300)`.
    pub fn told(&self, space: &AttackSpace) -> String {
        let tick = space.tick_ms.unsigned();
        let tell = |action: &Action| {
            let of = move_of(space, action);
            let begins = u64::from(action.begins) * tick;
            let mut text = format!("{} at {:.2} s", of.name.as_str(), begins as f64 / 1000.0);
            let mut values = of.ranges().zip(&action.places).map(|(range, place)| range.at(*place));
            if of.lasts_ms.is_some() {
                // Writing to a string does not fail.
                let _ = write!(text, " for {} s", seconds(values.next().unwrap_or_default()));
            }
            for (number, value) in of.varies.iter().zip(values) {
                let _ = write!(text, " ({} = {value})", number.key.as_str());
            }
            text
        };
        if self.0.is_empty() { "nothing".to_owned() } else { self.0.iter().map(tell).collect::<Vec<_>>().join(", ") }
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
