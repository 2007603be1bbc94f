//! Effect of the open actions of a plan on one datagram on its way through the relay: lose it, change it, hold it, copy
//! it. Sending and its time are left to `datagram`.

use ground_truth::Action;
use rand_chacha::ChaCha8Rng;
use wire::core::Side;
use wire::time::Span;

use super::forge;
use crate::plan::{DatagramAction, MAX_HOLD_MS};
use crate::schedule::{chance, uniform_below};

/// The changing part of one action.
#[derive(Clone, Debug)]
pub(super) struct Actor {
    pub(super) rng: ChaCha8Rng,
    /// State of the burst-loss chain towards each side.
    pub(super) bad: [bool; 2],
}

/// A datagram on its way through the open actions.
pub(super) struct Passing {
    pub(super) bytes: Vec<u8>,
    pub(super) hold: Span,
    pub(super) copies: u32,
    pub(super) every: Span,
    /// Actions done, with the delay that they brought.
    pub(super) done: Vec<(Action, Span)>,
}

impl Passing {
    pub(super) fn new(bytes: &[u8]) -> Self {
        Self { bytes: bytes.to_vec(), hold: Span::ZERO, copies: 0, every: Span::ZERO, done: Vec::new() }
    }

    fn hold(&mut self, action: Action, delay: Span) {
        if delay > Span::ZERO {
            self.hold = self.hold + delay;
            self.done.push((action, delay));
        }
    }
}

impl Actor {
    pub(super) fn new(rng: ChaCha8Rng) -> Self {
        Self { rng, bad: [false; 2] }
    }

    /// Applies an open action to a datagram towards `side`; false when it is lost.
    pub(super) fn apply(
        &mut self,
        action: &DatagramAction,
        side: Side,
        since: Span,
        before: &[u8],
        passing: &mut Passing,
    ) -> bool {
        match *action {
            DatagramAction::Delay { ms, growth_us_per_s } => {
                let delay = Span(ms * 1000 + since.0.saturating_mul(growth_us_per_s) / 1_000_000);
                passing.hold(Action::Delay, delay.min(Span::ms(MAX_HOLD_MS)));
            }
            DatagramAction::Jitter { ms } => {
                passing.hold(Action::Delay, Span(uniform_below(&mut self.rng, ms * 1000 + 1)));
            }
            DatagramAction::Loss { permille } => return !chance(&mut self.rng, permille),
            DatagramAction::BurstLoss { enter_permille, leave_permille, loss_permille } => {
                let bad = &mut self.bad[side as usize];
                let turn = if *bad { leave_permille } else { enter_permille };
                *bad ^= chance(&mut self.rng, turn);
                return !(*bad && chance(&mut self.rng, loss_permille));
            }
            DatagramAction::Duplicate { copies, every_ms, permille } => {
                if chance(&mut self.rng, permille) {
                    (passing.copies, passing.every) = (passing.copies + copies, Span::ms(every_ms));
                }
            }
            DatagramAction::Reorder { permille, hold_ms } => {
                if chance(&mut self.rng, permille) {
                    passing.hold(Action::Reorder, Span::ms(hold_ms));
                }
            }
            DatagramAction::Corrupt { permille, damage } => {
                if chance(&mut self.rng, permille) {
                    passing.bytes = forge::damage(damage, &passing.bytes, before, &mut self.rng);
                    passing.done.push((Action::Corrupt, Span::ZERO));
                }
            }
            DatagramAction::Replay { .. } | DatagramAction::Reoriginate { .. } | DatagramAction::Inject { .. } => {}
        }
        true
    }
}
