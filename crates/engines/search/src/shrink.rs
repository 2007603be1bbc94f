//! Reduction of a found sequence to its clearest form: the fewest actions, at canonical moments, with the smallest numbers
//! that keep class and cause; and the margin of each number.
//!
//! The order of tries is fixed, and each step takes the first success rather than a better one, so equivalent sequences end
//! as the same sequence. Where a single action suffices at a moment that the run without an attack has, the search for it
//! ignores the found sequence: only its cause is left then. Numbers are halved between a success and a failure: they find an
//! edge, and the only one where more is never less.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::SearchError;
use super::moments::Moments;
use super::sequence::{Action, AttackSequence, move_of};
use super::tried::{Cause, SearchConfig, Test};

/// A sequence shrunk.
#[derive(Clone, Debug)]
pub struct Shrunk {
    /// The sequence.
    pub sequence: AttackSequence,
    /// Trials that it took.
    pub executions: u64,
    /// Margin of each number to its edge.
    pub margins: Vec<Margin>,
}

/// A number that suffices, and the nearest weaker one, which does not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margin {
    /// The move.
    pub of: String,
    /// `duration_ms`, or the number's key.
    pub number: String,
    /// Value on the edge that suffices; milliseconds for a length.
    pub holds: f64,
    /// Next weaker value, which fails; `None` where the weakest of the range suffices.
    pub fails: Option<f64>,
}

/// Most choices of moments for several moves that are tried together.
const MOST_TOGETHER: usize = 36;

struct Shrinker<'a> {
    config: &'a SearchConfig,
    test: Test<'a>,
    cause: &'a Cause,
    tried: BTreeMap<AttackSequence, bool>,
}

impl SearchConfig {
    /// Shrinks a sequence that `test` found for `cause`; `moments` belong to the run without any sequence.
    ///
    /// # Errors
    /// Why a sequence cannot be run.
    pub fn shrink(
        &self,
        sequence: &AttackSequence,
        test: Test<'_>,
        cause: &Cause,
        moments: &Moments,
    ) -> Result<Shrunk, SearchError> {
        let mut shrinker = Shrinker { config: self, test, cause, tried: BTreeMap::from([(sequence.clone(), true)]) };
        let mut actions = match shrinker.single_move(moments)? {
            Some(actions) => actions,
            None => shrinker.canonical(sequence, moments)?,
        };
        let mut margins = Vec::new();
        for i in 0..actions.len() {
            let (smaller, of) = shrinker.smallest_numbers(actions, i)?;
            actions = smaller;
            margins.extend(of);
        }
        // The given sequence was tried by the caller.
        Ok(Shrunk { sequence: AttackSequence::new(actions), executions: shrinker.tried.len() as u64 - 1, margins })
    }
}

/// The actions with another in place of action `i`: each keeps its place here, wherever it is in time.
fn replace_action(actions: &[Action], i: usize, action: Action) -> Vec<Action> {
    let mut actions = actions.to_vec();
    actions[i] = action;
    actions
}

/// The action types.
fn kinds(actions: &[Action]) -> Vec<usize> {
    actions.iter().map(|action| action.kind).collect()
}

impl Shrinker<'_> {
    fn holds(&mut self, sequence: &AttackSequence) -> Result<bool, SearchError> {
        if let Some(known) = self.tried.get(sequence) {
            return Ok(*known);
        }
        let holds = (self.test)(&self.config.try_sequence(sequence)?).as_ref() == Some(self.cause);
        self.tried.insert(sequence.clone(), holds);
        Ok(holds)
    }

    /// The first of the sequences that holds.
    fn first(&mut self, sequences: impl IntoIterator<Item = Vec<Action>>) -> Result<Option<Vec<Action>>, SearchError> {
        for actions in sequences {
            if self.holds(&AttackSequence::new(actions.clone()))? {
                return Ok(Some(actions));
            }
        }
        Ok(None)
    }

    /// The earliest move of the attack space that does it by itself, at its strongest, at the first moment of the attack space or at a
    /// change of mode.
    fn single_move(&mut self, moments: &Moments) -> Result<Option<Vec<Action>>, SearchError> {
        let (first, _) = self.config.space.begins();
        let begins: Vec<u32> = std::iter::once(first).chain(moments.changes.iter().copied()).collect();
        let mut actions: Vec<Action> = begins.into_iter().flat_map(|moment| self.strongest(moment)).collect();
        actions.sort_by_key(|action| (action.kind, action.begins));
        self.first(actions.into_iter().map(|action| vec![action]))
    }

    /// The fewest actions of a sequence, each the simplest that does it, at its canonical moment.
    fn canonical(&mut self, sequence: &AttackSequence, moments: &Moments) -> Result<Vec<Action>, SearchError> {
        let mut actions = self.fewest(sequence)?;
        // Action types only become fewer, or earlier ones of the attack space, from round to round.
        loop {
            let before = kinds(&actions);
            let together = self.together(&actions, moments)?;
            let separate = together.is_none();
            actions = together.unwrap_or(actions);
            for i in 0..actions.len() {
                actions = self.simplest(actions, i)?;
                if separate {
                    actions = self.canonical_moment(actions, i, moments)?;
                }
            }
            // An action that was needed at its found strength may not be at the strongest.
            actions = self.fewest(&AttackSequence::new(actions))?;
            if kinds(&actions) == before {
                break;
            }
        }
        Ok(self.together(&actions, moments)?.unwrap_or(actions))
    }

    /// An equal set of action types, all at their strongest, at the first canonical moments that suffice. The requirement on
    /// one of several depends on the others: taken together, only their types are left of the way they were found.
    fn together(&mut self, actions: &[Action], moments: &Moments) -> Result<Option<Vec<Action>>, SearchError> {
        let (first, _) = self.config.space.begins();
        let begins: Vec<u32> = std::iter::once(first).chain(moments.changes.iter().copied()).collect();
        let mut sequences = vec![Vec::new()];
        for action in actions {
            let places = move_of(&self.config.space, action).strongest();
            let later = |sequence: Vec<Action>| {
                let next = |moment: &u32| Action { begins: *moment, kind: action.kind, places: places.clone() };
                begins.iter().map(|moment| [&sequence[..], &[next(moment)]].concat()).collect::<Vec<_>>()
            };
            // The product of moments is cut to its first choices, in canonical order. The rest is left to the search
            // action by action.
            sequences = sequences.into_iter().flat_map(later).take(MOST_TOGETHER).collect();
        }
        self.first(sequences)
    }

    /// The fewest of its actions that suffice, in the order of the attack space: their order in time as found has no effect.
    fn fewest(&mut self, sequence: &AttackSequence) -> Result<Vec<Action>, SearchError> {
        let fewer = (1..sequence.actions().len()).flat_map(|n| sequence.subsequences(n));
        let fewer = self.first(fewer.map(|fewer| fewer.actions().to_vec()))?;
        let mut actions = fewer.unwrap_or_else(|| sequence.actions().to_vec());
        actions.sort_by_key(|action| (action.kind, action.begins));
        Ok(actions)
    }

    /// The actions with the earliest move of the attack space that suffices in place of action `i`, at its strongest;
    /// without one unchanged.
    fn simplest(&mut self, actions: Vec<Action>, i: usize) -> Result<Vec<Action>, SearchError> {
        // Up to the action's own move, whose strongest numbers are tried too: moves behind it are no simpler.
        let other_actions = self.strongest(actions[i].begins).into_iter().take(actions[i].kind + 1);
        let rest: Vec<_> = other_actions.map(|other| replace_action(&actions, i, other)).collect();
        Ok(self.first(rest)?.unwrap_or(actions))
    }

    /// The actions with action `i` at the first moment that suffices: the first of the attack space, then each change
    /// of mode in order. Without one it is the earliest that suffices, by halving.
    fn canonical_moment(
        &mut self,
        actions: Vec<Action>,
        i: usize,
        moments: &Moments,
    ) -> Result<Vec<Action>, SearchError> {
        let found = actions[i].begins;
        let (first, _) = self.config.space.begins();
        let moved = |begins: u32| replace_action(&actions, i, Action { begins, ..actions[i].clone() });
        let candidates = std::iter::once(first).chain(moments.changes.iter().copied());
        if let Some(actions) = self.first(candidates.filter(|moment| *moment <= found).map(moved))? {
            return Ok(actions);
        }
        let before = moments.changes.iter().rev().find(|moment| **moment < found).copied().unwrap_or(first);
        self.edge(before, found, moved).map(moved)
    }

    /// Each number of action `i`, in turn, as small as it can be.
    fn smallest_numbers(
        &mut self,
        mut actions: Vec<Action>,
        i: usize,
    ) -> Result<(Vec<Action>, Vec<Margin>), SearchError> {
        let mut margins = Vec::new();
        for n in 0..actions[i].places.len() {
            let action = actions[i].clone();
            let candidate = |place: u32| {
                let mut places = action.places.clone();
                places[n] = place;
                replace_action(&actions, i, Action { places, ..action.clone() })
            };
            let weakest = self.holds(&AttackSequence::new(candidate(0)))?;
            let place = if weakest { 0 } else { self.edge(0, action.places[n], candidate)? };
            margins.push(self.margin(&action, n, place));
            actions = candidate(place);
        }
        Ok((actions, margins))
    }

    fn margin(&self, action: &Action, n: usize, place: u32) -> Margin {
        let action_type = move_of(&self.config.space, action);
        let lasts = action_type.lasts_ms.is_some();
        let range = action_type.ranges().nth(n).expect("invariant: an action has a place for each range of its move");
        let key = || action_type.varies[n - usize::from(lasts)].key.as_str().to_owned();
        Margin {
            of: action_type.name.as_str().to_owned(),
            number: if lasts && n == 0 { "duration_ms".to_owned() } else { key() },
            holds: range.value_at(place),
            fails: place.checked_sub(1).map(|weaker| range.value_at(weaker)),
        }
    }

    /// The least of `(low, high]` that holds, where `low` does not and `high` does.
    fn edge(&mut self, mut low: u32, mut high: u32, sequence: impl Fn(u32) -> Vec<Action>) -> Result<u32, SearchError> {
        while high > low + 1 {
            let middle = low + (high - low) / 2;
            if self.holds(&AttackSequence::new(sequence(middle)))? {
                high = middle;
            } else {
                low = middle;
            }
        }
        Ok(high)
    }

    /// Each move, at its strongest, to begin then.
    fn strongest(&self, begins: u32) -> Vec<Action> {
        let moves = self.config.space.moves.iter().enumerate();
        moves.map(|(kind, action_type)| Action { begins, kind, places: action_type.strongest() }).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::tried::Tried;
    use super::*;
    use evidence::trial::Outcome;
    use scenario::{AttackSpace, Range, Setup, find_root};

    fn config() -> SearchConfig {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let scenario = scenario::load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        let space = AttackSpace::load(&root.join("scenarios/spaces/path.toml")).unwrap();
        SearchConfig::new(scenario, setup, 1, space).unwrap()
    }

    fn kind(config: &SearchConfig, name: &str) -> usize {
        config.space.moves.iter().position(|action_type| action_type.name.as_str() == name).unwrap()
    }

    /// Every sequence with a silence of half a second and a delay of at least 300 ms in it, at any time, is a finding.
    #[test]
    #[ignore = "long: many sequences"]
    fn equivalent_sequences_shrink_to_the_same_one() {
        let config = config();
        let (silence, delay, copies) =
            (kind(&config, "command-stall"), kind(&config, "hold-up"), kind(&config, "copy"));
        let cause = Cause { outcome: Outcome::Unsafe, broken: "both".to_owned() };
        let test = |tried: &Tried| {
            let has_kind = |kind: usize, n: usize, least: f64| {
                let ranges: Vec<Range> = config.space.moves[kind].ranges().copied().collect();
                let mut same_kind = tried.sequence.actions().iter().filter(|action| action.kind == kind);
                same_kind.any(|action| ranges[n].value_at(action.places[n]) >= least)
            };
            (has_kind(silence, 0, 500.0) && has_kind(delay, 1, 300.0)).then(|| cause.clone())
        };
        let action = |kind: usize, begins: u32, places: &[u32]| Action { kind, begins, places: places.to_vec() };
        let found = [
            vec![action(silence, 600, &[300]), action(delay, 300, &[20, 150])],
            vec![action(delay, 700, &[390, 299]), action(silence, 200, &[60]), action(copies, 400, &[10, 3])],
        ];
        let moments = Moments { changes: vec![100, 250], ..Moments::default() };
        let shrunk =
            found.map(|actions| config.shrink(&AttackSequence::new(actions), &test, &cause, &moments).unwrap());
        assert_eq!(shrunk[0].sequence, shrunk[1].sequence);
        let text = shrunk[0].sequence.describe(&config.space);
        assert_eq!(text, "hold-up at 0.50 s for 0.05 s (by_ms = 300), command-stall at 0.50 s for 0.50 s");
        assert!(shrunk.iter().all(|shrunk| shrunk.executions <= 100), "{shrunk:?}");
        let edge = |margin: &Margin| (margin.number.clone(), margin.holds, margin.fails);
        let edges: Vec<_> = shrunk[0].margins.iter().map(edge).collect();
        let expected =
            [("duration_ms", 50.0, None), ("by_ms", 300.0, Some(290.0)), ("duration_ms", 500.0, Some(490.0))];
        assert_eq!(edges, expected.map(|(number, holds, fails)| (number.to_owned(), holds, fails)));
    }
}
