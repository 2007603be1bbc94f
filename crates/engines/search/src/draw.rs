//! Sources of attack sequences: five strategies, each with one fixed way to draw.
//!
//! *Uniform* draws length, action types, moments and numbers evenly from the attack space: the baseline of a search. *Transitions*
//! begins every action where the unit changes mode in the run without an attack, as AVIS does (Taylor et al., "AVIS: In-Situ Model
//! Checking for Unmanned Aerial Vehicles", DSN 2021), numbers evenly. *Guided* deals the action types like cards, each once before
//! any comes again, from the second deal on every other one in proportion to its gains (a bandit by probability matching); draws
//! moments from changes, edges of bounds and evenly; and, as fresh sequences cease to show new situations, changes sequences that
//! did, or that came nearest to a limit. *Novelty* is the same without gains of action types and nearest sequences: those that showed
//! new situations are changed, as a fuzzer by coverage does. *Distance* makes three of four sequences from those that came nearest to
//! one limit of the oracle at a time (`climb`), the others as guided draws its fresh ones, without gains. Only the second gives any
//! sequence probability zero. The learned state is `learned`'s.

use std::collections::VecDeque;

use oracle::Approaches;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::{AttackSpace, Range};
use serde::{Deserialize, Serialize};
use wire::bounds::Bounds;

use super::climb::Climb;
use super::learned::{Known, Learned, Lesson, NEWEST, Near};
use super::moments::Moments;
use super::sequence::{Action, AttackSequence, move_of};

/// Out of ten sequences by novelty, how many are made from one that showed something new, when none of the newest fresh ones did.
const FROM_KNOWN: u32 = 7;
/// Out of ten of these, how many are made from one that came nearest to a limit, and not from one that was new.
const FROM_NEAREST: u32 = 5;
/// Out of four sequences by distance, how many are made from those that came nearest to a limit.
const FROM_HILLS: u32 = 3;
/// Share of moments that strategies that learn draw at changes: of ten, how many are a change of mode and a little after; how many of the others
/// the edge of a bound. The rest are drawn evenly.
const AT_CHANGES: u32 = 4;
const AT_EDGES: u32 = 3;
/// Time after a change of mode that still counts as at it, ticks.
const AFTER_CHANGE: u32 = 30;

/// Strategy for drawing sequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// Evenly.
    Uniform,
    /// At changes of mode.
    Transitions,
    /// Guidance by novelty, by the approach to limits and by the gains of action types.
    Guided,
    /// Guidance by novelty alone.
    Novelty,
    /// Guidance by the distance to one limit at a time.
    Distance,
}

impl Strategy {
    /// Every strategy; the first is the baseline of comparisons.
    pub const ALL: [Strategy; 5] =
        [Strategy::Uniform, Strategy::Transitions, Strategy::Guided, Strategy::Novelty, Strategy::Distance];

    /// True if a sequence depends on the results of earlier ones.
    pub fn learns(self) -> bool {
        match self {
            Strategy::Uniform | Strategy::Transitions => false,
            Strategy::Guided | Strategy::Novelty | Strategy::Distance => true,
        }
    }

    /// True if the strategy draws from the moments of the run without a sequence.
    pub(super) fn reads_moments(self) -> bool {
        match self {
            Strategy::Uniform => false,
            Strategy::Transitions | Strategy::Guided | Strategy::Novelty | Strategy::Distance => true,
        }
    }
}

/// Draws sequences.
#[derive(Debug)]
pub(super) struct Drawer<'a> {
    space: &'a AttackSpace,
    bounds: &'a Bounds,
    strategy: Strategy,
    rng: ChaCha8Rng,
    nominal: Moments,
    learned: Learned,
    climb: Climb,
    /// Sequences that were drawn and have no result yet, in order: true for one that was made from no other.
    drawn: VecDeque<bool>,
    /// Moves that are still to be dealt; never empty.
    deck: Vec<usize>,
    /// True if each was dealt once.
    all_dealt: bool,
}

impl<'a> Drawer<'a> {
    /// Drawer for the sequences over `space`; `nominal` are the moments of the run without any, and `approaches` is how near that run came to
    /// each limit.
    pub(super) fn new(
        space: &'a AttackSpace,
        bounds: &'a Bounds,
        strategy: Strategy,
        seed: u64,
        nominal: Moments,
        approaches: &Approaches,
    ) -> Self {
        Self {
            space,
            bounds,
            strategy,
            rng: ChaCha8Rng::seed_from_u64(seed),
            nominal,
            learned: Learned::new(space.moves.len(), approaches),
            climb: Climb::new(approaches),
            drawn: VecDeque::new(),
            deck: (0..space.moves.len()).collect(),
            all_dealt: false,
        }
    }

    /// Attack space of the sequences.
    pub(super) fn space(&self) -> &'a AttackSpace {
        self.space
    }

    /// The platform's bounds.
    pub(super) fn bounds(&self) -> &'a Bounds {
        self.bounds
    }

    /// Records the lesson of the first sequence not learned from yet.
    pub(super) fn learn(&mut self, lesson: Lesson) {
        let fresh = self.drawn.pop_front() == Some(true);
        if self.strategy == Strategy::Distance {
            self.climb.take(&lesson, fresh);
        }
        self.learned.take(lesson, fresh);
    }

    /// The next sequence.
    pub(super) fn sequence(&mut self) -> AttackSequence {
        let made = match self.strategy {
            Strategy::Uniform | Strategy::Transitions => None,
            Strategy::Guided | Strategy::Novelty => self.derived(),
            Strategy::Distance => {
                if self.uniform_below(4) < FROM_HILLS {
                    self.climbing()
                } else {
                    None
                }
            }
        };
        self.drawn.push_back(made.is_none());
        made.unwrap_or_else(|| {
            let longest = self.longest();
            let length = 1 + self.uniform_below(longest);
            let nominal = self.nominal.clone();
            AttackSequence::new((0..length).map(|_| self.action(&nominal)).collect())
        })
    }

    /// A sequence made from one that showed something new, or came nearest to a limit; none while fresh ones still do.
    fn derived(&mut self) -> Option<AttackSequence> {
        if self.learned.known().is_empty() || !self.fresh_is_stale() {
            return None;
        }
        let by_limit = self.strategy == Strategy::Guided && self.uniform_below(10) < FROM_NEAREST;
        let nearest = if by_limit { self.nearest() } else { None };
        Some(match nearest {
            Some(near) => self.nearer(&near),
            None => {
                let known = self.known();
                self.changed(&known)
            }
        })
    }

    /// The climbs to each limit.
    pub(super) fn climb(&mut self) -> &mut Climb {
        &mut self.climb
    }

    /// Draws whether to change a known sequence: more often, the fewer of the newest fresh sequences showed something new.
    fn fresh_is_stale(&mut self) -> bool {
        self.uniform_below(10 * NEWEST as u32) < FROM_KNOWN * self.learned.stale()
    }

    /// A sequence that showed something new: every other time one of the newest 16.
    fn known(&mut self) -> Known {
        let n = self.learned.known().len() as u32;
        let from = if self.uniform_below(2) == 0 { n.saturating_sub(16) } else { 0 };
        let i = from + self.uniform_below(n - from);
        self.learned.known()[i as usize].clone()
    }

    /// A sequence that came nearest to a limit, by its worth.
    fn nearest(&mut self) -> Option<Near> {
        let weights: Vec<u64> = self.learned.nearest().collect();
        let n = self.by_weight(&weights);
        self.learned.take_nearest(n)
    }

    pub(super) fn action(&mut self, moments: &Moments) -> Action {
        let kind = match self.strategy {
            Strategy::Uniform | Strategy::Transitions => self.uniform_below(self.space.moves.len() as u32) as usize,
            Strategy::Guided | Strategy::Novelty | Strategy::Distance => self.dealt(),
        };
        let begins = self.moment(moments);
        Action { begins, kind, places: self.places(kind, moments) }
    }

    /// A move: from the deck; guided, once each was dealt, every other time by its worth.
    fn dealt(&mut self) -> usize {
        if !self.all_dealt || self.strategy != Strategy::Guided || self.uniform_below(2) == 0 {
            let i = self.uniform_below(self.deck.len() as u32) as usize;
            let dealt = self.deck.swap_remove(i);
            if self.deck.is_empty() {
                self.all_dealt = true;
                self.deck.extend(0..self.space.moves.len());
            }
            return dealt;
        }
        let weights: Vec<u64> = self.learned.weights().collect();
        self.by_weight(&weights)
    }

    /// An index into `weights`, drawn in proportion to them.
    pub(super) fn by_weight(&mut self, weights: &[u64]) -> usize {
        let mut left = ((u128::from(self.rng.next_u32()) * u128::from(weights.iter().sum::<u64>())) >> 32) as u64;
        let position = weights.iter().position(|weight| match left.checked_sub(*weight) {
            Some(rest) => {
                left = rest;
                false
            }
            None => true,
        });
        position.unwrap_or(0)
    }

    pub(super) fn moment(&mut self, moments: &Moments) -> u32 {
        let (first, last) = self.space.begins();
        let even = |drawer: &mut Self| first + drawer.uniform_below(last - first + 1);
        match self.strategy {
            Strategy::Uniform => even(self),
            Strategy::Transitions => self.one_of(&moments.changes).unwrap_or(first),
            Strategy::Guided | Strategy::Novelty | Strategy::Distance => {
                let drawn = self.uniform_below(10);
                let moment = if drawn < AT_CHANGES {
                    let after = self.uniform_below(AFTER_CHANGE);
                    self.one_of(&moments.changes).map(|at| at + after)
                } else if drawn < AT_CHANGES + AT_EDGES {
                    self.one_of(&moments.edges)
                } else {
                    None
                };
                moment.map_or_else(|| even(self), |at| at.clamp(first, last))
            }
        }
    }

    pub(super) fn places(&mut self, count: usize, moments: &Moments) -> Vec<u32> {
        let action = Action { begins: 0, kind: count, places: Vec::new() };
        let ranges: Vec<Range> = move_of(self.space, &action).ranges().copied().collect();
        ranges.iter().map(|range| self.place(range, moments)).collect()
    }

    fn place(&mut self, range: &Range, moments: &Moments) -> u32 {
        let even = |drawer: &mut Self| drawer.uniform_below(range.last() + 1);
        match self.strategy {
            Strategy::Uniform | Strategy::Transitions => even(self),
            Strategy::Guided | Strategy::Novelty | Strategy::Distance => match self.uniform_below(3) {
                0 => range.last(),
                1 => self.one_of(&moments.lengths).map_or(0, |length| range.place(f64::from(length))),
                _ => even(self),
            },
        }
    }

    pub(super) fn longest(&self) -> u32 {
        self.space.longest.unsigned() as u32
    }

    fn one_of(&mut self, choices: &[u32]) -> Option<u32> {
        let i = self.uniform_below(choices.len() as u32) as usize;
        choices.get(i).copied()
    }

    /// Even below `n`, to within 2^-32; 0 where `n` is 0.
    pub(super) fn uniform_below(&mut self, n: u32) -> u32 {
        ((u64::from(self.rng.next_u32()) * u64::from(n)) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use oracle::{AT_LIMIT, Limit};
    use scenario::find_root;

    fn space() -> AttackSpace {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        AttackSpace::load(&root.join("scenarios/spaces/sensors.toml")).unwrap()
    }

    fn guided(space: &AttackSpace) -> Drawer<'_> {
        Drawer::new(space, &Bounds::GROUND, Strategy::Guided, 1, Moments::default(), &Approaches::new())
    }

    fn lesson(sequence: &AttackSequence, new: bool, approaches: Approaches) -> Lesson {
        Lesson { known: Known { sequence: sequence.clone(), moments: Moments::default() }, new, approaches }
    }

    fn kinds(drawer: &mut Drawer<'_>, actions: usize) -> Vec<usize> {
        let sequences = std::iter::repeat_with(|| drawer.sequence());
        sequences
            .flat_map(|sequence| sequence.actions().iter().map(|action| action.kind).collect::<Vec<_>>())
            .take(actions)
            .collect()
    }

    #[test]
    fn guided_drawing_deals_every_move_before_repeating() {
        let space = space();
        let mut first = kinds(&mut guided(&space), space.moves.len());
        first.sort_unstable();
        // The last sequence may be cut short by actions of the next round; those that were dealt are all different.
        first.dedup();
        assert!(first.len() >= space.moves.len() - space.longest.unsigned() as usize, "{first:?}");
    }

    /// Every move goes on being dealt.
    #[test]
    fn gaining_moves_are_dealt_more_often() {
        let space = space();
        let mut drawer = guided(&space);
        for _ in 0..200 {
            let sequence = drawer.sequence();
            let new = sequence.actions().iter().any(|action| action.kind == 0);
            drawer.learned.take(lesson(&sequence, new, Approaches::new()), false);
        }
        let mut counts = vec![0; space.moves.len()];
        (0..4_000).for_each(|_| counts[drawer.dealt()] += 1);
        let rest = &counts[1..];
        assert!(counts[0] > 2 * *rest.iter().max().unwrap() && *rest.iter().min().unwrap() > 0, "{counts:?}");
    }

    #[test]
    fn known_sequences_change_once_fresh_ones_are_stale() {
        let space = space();
        let changed = |new: bool| {
            let mut drawer = guided(&space);
            for i in 0..200 {
                let sequence = drawer.sequence();
                drawer.learn(lesson(&sequence, new || i == 0, Approaches::new()));
            }
            (0..100)
                .filter(|_| {
                    drawer.sequence();
                    !drawer.drawn.back().unwrap()
                })
                .count()
        };
        assert_eq!(changed(true), 0);
        let stale = changed(false);
        assert!((50..=90).contains(&stale), "{stale} of 100, where seven of ten are meant");
    }

    /// A limit without new situations on the way to it: only staying with the nearest sequence gets there.
    #[test]
    fn the_way_to_a_limit_is_climbed() {
        let space = space();
        let (first, last) = space.begins();
        let wanted = first + (last - first) / 3;
        let near = |sequence: &AttackSequence| {
            let off = sequence.actions().iter().map(|action| action.begins.abs_diff(wanted)).min().unwrap_or(last);
            AT_LIMIT.saturating_sub(1_000 * off)
        };
        let found = |seed: u64, climbs: bool| {
            let mut drawer =
                Drawer::new(&space, &Bounds::GROUND, Strategy::Guided, seed, Moments::default(), &Approaches::new());
            let mut new = true;
            let position = (1..=2_000_u32).find(|_| {
                let sequence = drawer.sequence();
                let way = near(&sequence);
                let approaches = Approaches::from([(Limit::Uplink, if climbs { way } else { 0 })]);
                drawer.learn(lesson(&sequence, std::mem::take(&mut new), approaches));
                way == AT_LIMIT
            });
            position.unwrap_or(2_000)
        };
        let sequences = |climbs: bool| (1..=10).map(|seed| found(seed, climbs)).sum::<u32>();
        let (climbing, blind) = (sequences(true), sequences(false));
        assert!(3 * climbing < 2 * blind, "{climbing} sequences against {blind}");
    }
}
