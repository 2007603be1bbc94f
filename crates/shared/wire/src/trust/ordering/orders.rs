//! At most once and in order: memory of each operator's commands.
//!
//! A command's id is its operator's own counter. A thief of that operator's key could run the counter to its end and so
//! lock the operator out; hence three rules. A counter steps at most [`STEP`] ahead, so its end is out of reach and an
//! operator who goes on above the value in the unit's reports is heard. Each operator has its own counter. And a
//! command towards safe does not ask the counter: only the very same signed intent is refused, because to hold once
//! more is safe and to be kept from holding is not. Not the same *id*: a thief could use up the ids that the operator
//! will give next.

use core::marker::PhantomData;
use std::collections::VecDeque;

use super::Ordered;
use crate::command::{CommandKind, Intent};
use crate::id::{Boot, CommandId, NodeId, Sequence};
use crate::policy::{Check, Policy, Requirement};
use crate::refusal::Refusal;
use crate::trust::stage::Attributed;
use crate::trust::{AtGateway, AtUnit, Record};

/// An intent that was not seen before and is in order, as far as is known before its signature is verified; `S` came
/// before.
#[derive(Debug)]
pub struct NotRepeated<S>(PhantomData<S>);

/// The furthest ahead of an operator's newest command the next may be: commands that may be lost in a row.
const STEP: u64 = 64;
/// The highest sequence with which an operator is accepted for the first time after a start of the judging process. No
/// operator gets there, and from there the end of the counter is still out of reach.
const FIRST: u64 = 1 << 32;
/// Largest step of a console's boot, and the highest boot with which an operator is accepted for the first time.
const STEP_BOOT: u32 = 4;
const FIRST_BOOT: u32 = 1 << 16;
/// Commands of one operator that are remembered by the hash of their intents: more than the rates
/// ([`crate::trust::rate`]) let through in all classes before the nonces that they repeat have run out.
const KEPT: usize = 96;

/// Counters of the operators who have given a command.
#[derive(Clone, Debug, Default)]
pub struct Counters(Vec<Counter>);

#[derive(Clone, Debug)]
struct Counter {
    operator: NodeId,
    /// The furthest command.
    newest: Option<CommandId>,
    /// SHA-256 of the latest signed intents, oldest first.
    kept: VecDeque<[u8; 32]>,
}

impl Counters {
    fn counter(&self, operator: NodeId) -> Option<&Counter> {
        self.0.iter().find(|counter| counter.operator == operator)
    }

    /// Newest value of the counter of `operator`: a command above it is heard.
    pub fn newest(&self, operator: NodeId) -> Option<CommandId> {
        self.counter(operator).and_then(|counter| counter.newest)
    }

    /// Checks that the very same signed intent was not seen lately.
    fn unseen(&self, got: CommandId, hash: &[u8; 32]) -> Result<(), Refusal> {
        let seen = self.counter(got.operator).is_some_and(|counter| counter.kept.contains(hash));
        if seen { Err(Refusal::Repeated { kept: KEPT, got }) } else { Ok(()) }
    }

    /// Checks that an intent was not seen, and away from safe that it comes after all that were.
    fn check_order(&self, intent: &Intent, hash: &[u8; 32]) -> Result<(), Refusal> {
        let got = intent.id;
        self.unseen(got, hash)?;
        match self.newest(got.operator) {
            Some(last) if !intent.kind.towards_safe() && (got.boot, got.sequence) <= (last.boot, last.sequence) => {
                Err(Refusal::Duplicate { last, got })
            }
            Some(_) | None => Ok(()),
        }
    }

    /// Checks that an intent away from safe is no further ahead than an operator can have come.
    fn near_enough(&self, intent: &Intent) -> Result<(), Refusal> {
        if intent.kind.towards_safe() { Ok(()) } else { self.check_gap(intent.id) }
    }

    fn check_gap(&self, got: CommandId) -> Result<(), Refusal> {
        let last = self.newest(got.operator);
        let boot = Boot(last.map_or(FIRST_BOOT, |last| last.boot.0.saturating_add(STEP_BOOT)));
        let sequence = Sequence(match last {
            None => FIRST,
            Some(last) if got.boot == last.boot => last.sequence.0.saturating_add(STEP),
            Some(_) => STEP,
        });
        match (got.boot <= boot, got.sequence <= sequence) {
            (true, true) => Ok(()),
            (true, false) => Err(Refusal::Ahead { furthest: sequence, got }),
            (false, _) => Err(Refusal::AheadBoot { furthest: boot, got }),
        }
    }

    /// Value to which an accepted command moves its operator's counter. A HOLD of a boot too far ahead moves the
    /// counter by the one step allowed. Otherwise an operator with a console that restarted more often than that
    /// unheard would be refused until the judging process starts again; a few HOLDs bring the two together. A thief of
    /// the key gains no advantage: a HOLD of just that boot moves the counter as far, and is allowed as often.
    fn reached(&self, intent: &Intent) -> Option<CommandId> {
        match self.check_gap(intent.id) {
            Ok(()) => Some(intent.id),
            Err(Refusal::AheadBoot { furthest, .. }) if intent.kind == CommandKind::Hold => {
                Some(CommandId { boot: furthest, sequence: Sequence(0), ..intent.id })
            }
            Err(_) => None,
        }
    }

    fn note(&mut self, got: CommandId, hash: &[u8; 32], reached: Option<CommandId>) {
        let index = self.0.iter().position(|counter| counter.operator == got.operator).unwrap_or_else(|| {
            self.0.push(Counter { operator: got.operator, newest: None, kept: VecDeque::new() });
            self.0.len() - 1
        });
        let counter = &mut self.0[index];
        // A forgotten intent cannot come again: the nonce in it runs out before [`KEPT`] others have passed the rates.
        if counter.kept.len() == KEPT {
            counter.kept.pop_front();
        }
        counter.kept.push_back(*hash);
        let later =
            |id: &CommandId| counter.newest.is_none_or(|last| (id.boot, id.sequence) > (last.boot, last.sequence));
        if let Some(reached) = reached.filter(later) {
            counter.newest = Some(reached);
        }
    }
}

impl<S> Record<S, Intent> {
    /// Result of [`Record::accept_once`] in advance, asked before the signature is verified, so that repetitions cost
    /// little. `hash` is that of its signed bytes. The memory is left unchanged.
    pub fn not_repeated(
        self,
        policy: &Policy,
        counters: &Counters,
        hash: &[u8; 32],
    ) -> Result<Record<NotRepeated<S>, Intent>, Refusal> {
        let new = self.judged(policy, Check::Duplicate, |intent, _| counters.check_order(intent, hash))?;
        new.check(policy, Check::Jump, NotRepeated(PhantomData), |intent, _| counters.near_enough(intent))
    }
}

impl Record<Attributed<AtUnit>, Intent> {
    /// At most once and in order, whatever the transport repeats: away from safe after every command that this operator
    /// has given and not far ahead of them; towards safe not the same one again.
    pub fn accept_once(
        self,
        policy: &Policy,
        counters: &mut Counters,
        hash: &[u8; 32],
    ) -> Result<Record<Ordered, Intent>, Refusal> {
        let new = self.judged(policy, Check::Duplicate, |intent, _| counters.check_order(intent, hash))?;
        let near = new.check(policy, Check::Jump, Ordered(()), |intent, _| counters.near_enough(intent))?;
        if policy.check(Check::Duplicate) == Requirement::Required {
            let intent = &near.message;
            let reached = match policy.check(Check::Jump) {
                Requirement::Waived => Some(intent.id),
                Requirement::Required => counters.reached(intent),
            };
            counters.note(intent.id, hash, reached);
        }
        Ok(near)
    }
}

impl Record<Attributed<AtGateway>, Intent> {
    /// At most once, without an order among them: for a service that passes commands on and leaves their order to the
    /// unit.
    pub fn unrepeated(
        self,
        policy: &Policy,
        counters: &mut Counters,
        hash: &[u8; 32],
    ) -> Result<Record<Ordered, Intent>, Refusal> {
        let new = self.check(policy, Check::Duplicate, Ordered(()), |intent, _| counters.unseen(intent.id, hash))?;
        if policy.check(Check::Duplicate) == Requirement::Required {
            // No counter moves here: the order of commands is the unit's to judge.
            counters.note(new.message.id, hash, None);
        }
        Ok(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::Text;
    use crate::id::{Nonce, UnitId};
    use crate::trust::rate::{Allowance, RateClass};

    fn intent(boot: u32, sequence: u64, kind: CommandKind) -> Intent {
        let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(boot), sequence: Sequence(sequence) };
        Intent { id, unit: UnitId::A, nonce: Nonce(1), kind, reason: Text::default(), tag: None, shown: None }
    }

    /// Gives an intent with a hash made up of kind, sequence and boot in place of the hash of signed bytes.
    fn give(counters: &mut Counters, intent: &Intent) -> Result<(), Refusal> {
        let mut hash = [0; 32];
        hash[..8].copy_from_slice(&intent.id.sequence.0.to_le_bytes());
        hash[8..12].copy_from_slice(&intent.kind.name().as_bytes()[..4]);
        hash[12..16].copy_from_slice(&intent.id.boot.0.to_le_bytes());
        counters.check_order(intent, &hash)?;
        counters.near_enough(intent)?;
        counters.note(intent.id, &hash, counters.reached(intent));
        Ok(())
    }

    #[test]
    fn counter_end_is_out_of_reach() {
        let mut counters = Counters::default();
        let mut enable = |boot, n| give(&mut counters, &intent(boot, n, CommandKind::Enable));
        assert!(matches!(enable(1, u64::MAX), Err(Refusal::Ahead { furthest: Sequence(FIRST), .. })));
        assert!(matches!(enable(u32::MAX, 1), Err(Refusal::AheadBoot { furthest: Boot(FIRST_BOOT), .. })));
        assert_eq!(enable(1, 7), Ok(()));
        let got = |boot, sequence| intent(boot, sequence, CommandKind::Enable).id;
        let far = Refusal::Ahead { furthest: Sequence(7 + STEP), got: got(1, 8 + STEP) };
        assert_eq!(enable(1, 8 + STEP), Err(far));
        let far = Refusal::AheadBoot { furthest: Boot(1 + STEP_BOOT), got: got(2 + STEP_BOOT, 1) };
        assert_eq!(enable(2 + STEP_BOOT, 1), Err(far));
        assert_eq!(enable(2, 1 + STEP), Err(Refusal::Ahead { furthest: Sequence(STEP), got: got(2, 1 + STEP) }));
        assert_eq!(enable(1, 7 + STEP), Ok(()));
        assert!(matches!(enable(1, 8), Err(Refusal::Duplicate { .. })));
        assert_eq!(enable(2, 1), Ok(()));
    }

    /// A HOLD from far ahead moves no counter.
    #[test]
    fn hold_is_refused_only_as_exact_repetition() {
        let mut counters = Counters::default();
        assert_eq!(give(&mut counters, &intent(1, 40, CommandKind::Enable)), Ok(()));
        assert_eq!(give(&mut counters, &intent(1, 3, CommandKind::Hold)), Ok(()));
        let repeated = intent(1, 3, CommandKind::Hold);
        assert_eq!(give(&mut counters, &repeated), Err(Refusal::Repeated { kept: KEPT, got: repeated.id }));
        assert_eq!(give(&mut counters, &intent(1, u64::MAX, CommandKind::Hold)), Ok(()));
        assert_eq!(give(&mut counters, &intent(1, 41, CommandKind::Resume)), Ok(()));
    }

    #[test]
    fn command_memory_exceeds_rates_within_nonce_life() {
        let ms = crate::bounds::Bounds::GROUND.command_limit_ms;
        let passed = [RateClass::Away, RateClass::Withdraw, RateClass::Hold].map(|class| {
            let Allowance { burst, per_s } = class.allowance();
            u64::from(burst) + u64::from(per_s) * ms / 1000
        });
        assert!(passed.iter().sum::<u64>() < KEPT as u64, "{passed:?}");
    }

    #[test]
    fn hold_voids_earlier_withheld_commands() {
        let mut counters = Counters::default();
        assert_eq!(give(&mut counters, &intent(1, 9, CommandKind::Hold)), Ok(()));
        assert!(matches!(give(&mut counters, &intent(1, 8, CommandKind::Resume)), Err(Refusal::Duplicate { .. })));
    }

    /// A thief of the key has used up the next ids.
    #[test]
    fn used_up_ids_do_not_block_hold() {
        let mut counters = Counters::default();
        for n in 1..=9 {
            assert_eq!(give(&mut counters, &intent(1, n, CommandKind::Disarm)), Ok(()));
        }
        assert_eq!(give(&mut counters, &intent(1, 4, CommandKind::Hold)), Ok(()), "another command under a used id");
    }

    /// The console started too often unheard.
    #[test]
    fn few_holds_reconcile_an_unheard_console() {
        let mut counters = Counters::default();
        assert_eq!(give(&mut counters, &intent(1, 40, CommandKind::Enable)), Ok(()));
        let resume = |counters: &mut Counters| give(counters, &intent(10, 9, CommandKind::Resume));
        assert!(matches!(resume(&mut counters), Err(Refusal::AheadBoot { .. })));
        assert_eq!(give(&mut counters, &intent(10, 1, CommandKind::Hold)), Ok(()));
        assert!(matches!(resume(&mut counters), Err(Refusal::AheadBoot { furthest: Boot(9), .. })));
        assert_eq!(give(&mut counters, &intent(10, 2, CommandKind::Hold)), Ok(()));
        assert_eq!(resume(&mut counters), Ok(()));
    }

    /// A HOLD of a far boot moves the counter no further than one of the next boot does.
    #[test]
    fn hold_from_any_boot_moves_counter_boundedly() {
        for boot in [1 + STEP_BOOT, 2 + STEP_BOOT, u32::MAX] {
            let mut counters = Counters::default();
            assert_eq!(give(&mut counters, &intent(1, 40, CommandKind::Enable)), Ok(()));
            assert_eq!(give(&mut counters, &intent(boot, 0, CommandKind::Hold)), Ok(()));
            let reached = intent(1 + STEP_BOOT, 0, CommandKind::Hold).id;
            assert_eq!(counters.newest(NodeId::OPERATOR), Some(reached), "from {boot}");
        }
        let mut counters = Counters::default();
        assert_eq!(give(&mut counters, &intent(1, 40, CommandKind::Enable)), Ok(()));
        assert_eq!(give(&mut counters, &intent(u32::MAX, 0, CommandKind::Disarm)), Ok(()));
        assert_eq!(
            counters.newest(NodeId::OPERATOR),
            Some(intent(1, 40, CommandKind::Enable).id),
            "only a hold moves it"
        );
    }
}
