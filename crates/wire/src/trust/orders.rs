//! At most once and in order: what is remembered of each operator's commands.
//!
//! A command's id is its operator's own counter. Whoever holds that operator's key could run the counter to its end and
//! so lock the operator out; hence three rules. A counter steps at most [`STEP`] ahead, so its end is out of reach and an
//! operator who goes on above what the unit says it saw is heard. Each operator has a counter of its own. And what leads
//! towards safe does not ask the counter: only the very same signed intent is refused, because to hold once more is safe
//! and to be kept from holding is not. Not the same *id*: a thief could use up the ids that the operator will give next.

use std::collections::VecDeque;

use super::{Attributed, Fresh, Ordered};
use crate::command::Intent;
use crate::id::{CommandId, NodeId};
use crate::policy::{Check, Policy, Requirement};
use crate::refusal::Refusal;

/// The furthest ahead of an operator's newest command the next may be: commands that may be lost in a row.
const STEP: u64 = 64;
/// The highest sequence of a command from which on an operator is heard for the first time, after a start of ours. No
/// operator gets there, and from there the end of the counter is still out of reach.
const FIRST: u64 = 1 << 32;
/// The same of consoles' boots: how far they step, and with which an operator is heard for the first time.
const STEP_BOOT: u32 = 4;
const FIRST_BOOT: u32 = 1 << 16;
/// Commands of one operator that are remembered by the hash of their intents: more than the rates ([`super::rate`]) let
/// through before the nonces that they repeat have run out.
const KEPT: usize = 64;

/// The commands of every operator; bounded by the closed set of identities.
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
    fn of(&self, operator: NodeId) -> Option<&Counter> {
        self.0.iter().find(|counter| counter.operator == operator)
    }

    /// Whether the unit has counted this command or one after it, so that whoever goes on above it is heard.
    pub fn counted(&self, id: CommandId) -> bool {
        let newest = self.of(id.operator).and_then(|counter| counter.newest);
        newest.is_some_and(|newest| (id.boot, id.sequence) <= (newest.boot, newest.sequence))
    }

    /// The very same signed intent was not seen lately.
    fn unseen(&self, got: CommandId, hash: &[u8; 32]) -> Result<(), Refusal> {
        let seen = self.of(got.operator).is_some_and(|counter| counter.kept.contains(hash));
        if seen { Err(Refusal::Duplicate { last: got, got }) } else { Ok(()) }
    }

    /// It was not seen, and away from safe it comes after all that were.
    fn after(&self, intent: &Intent, hash: &[u8; 32]) -> Result<(), Refusal> {
        let got = intent.id;
        self.unseen(got, hash)?;
        match self.of(got.operator).and_then(|counter| counter.newest) {
            Some(last) if !intent.kind.towards_safe() && (got.boot, got.sequence) <= (last.boot, last.sequence) => {
                Err(Refusal::Duplicate { last, got })
            }
            Some(_) | None => Ok(()),
        }
    }

    /// Away from safe it is no further ahead than an operator can have come.
    fn near_enough(&self, intent: &Intent) -> Result<(), Refusal> {
        if intent.kind.towards_safe() { Ok(()) } else { self.near(intent.id) }
    }

    fn near(&self, got: CommandId) -> Result<(), Refusal> {
        let last = self.of(got.operator).and_then(|counter| counter.newest);
        let (limit, from, boots) = match last {
            None => (FIRST, 0, FIRST_BOOT),
            Some(last) if got.boot == last.boot => (STEP, last.sequence.0, 0),
            Some(last) => (STEP, 0, last.boot.0.saturating_add(STEP_BOOT)),
        };
        let same = last.is_some_and(|last| last.boot == got.boot);
        let near = got.sequence.0.saturating_sub(from) <= limit && (same || got.boot.0 <= boots);
        if near { Ok(()) } else { Err(Refusal::Ahead { limit, last, got }) }
    }

    fn note(&mut self, got: CommandId, hash: &[u8; 32], advance: bool) {
        let at = self.0.iter().position(|counter| counter.operator == got.operator).unwrap_or_else(|| {
            self.0.push(Counter { operator: got.operator, newest: None, kept: VecDeque::new() });
            self.0.len() - 1
        });
        let counter = &mut self.0[at];
        if counter.kept.len() == KEPT {
            counter.kept.pop_front();
        }
        counter.kept.push_back(*hash);
        let later = counter.newest.is_none_or(|last| (got.boot, got.sequence) > (last.boot, last.sequence));
        if later && advance {
            counter.newest = Some(got);
        }
    }
}

impl Fresh<Intent> {
    /// What [`Attributed::once`] will find, asked before the signature is verified, so that repetitions cost little.
    /// `hash` is that of its signed bytes. Nothing is remembered.
    pub fn not_repeated(self, policy: &Policy, counters: &Counters, hash: &[u8; 32]) -> Result<Fresh<Intent>, Refusal> {
        let new: Fresh<Intent> = self.check(policy, Check::Duplicate, |intent, _| counters.after(intent, hash))?;
        new.check(policy, Check::Jump, |intent, _| counters.near_enough(intent))
    }
}

impl Attributed<Intent> {
    /// At most once and in order, whatever the transport repeats: away from safe after every command that this operator
    /// has given and not far ahead of them; towards safe not the same one again.
    pub fn once(self, policy: &Policy, counters: &mut Counters, hash: &[u8; 32]) -> Result<Ordered<Intent>, Refusal> {
        let new: Attributed<Intent> = self.check(policy, Check::Duplicate, |intent, _| counters.after(intent, hash))?;
        let near: Ordered<Intent> = new.check(policy, Check::Jump, |intent, _| counters.near_enough(intent))?;
        if policy.check(Check::Duplicate) == Requirement::Required {
            let id = near.message.id;
            // A hold from far ahead is obeyed and does not move the counter.
            let advance = policy.check(Check::Jump) == Requirement::Waived || counters.near(id).is_ok();
            counters.note(id, hash, advance);
        }
        Ok(near)
    }

    /// At most once, without an order among them: for whoever passes commands on and leaves their order to the unit.
    pub fn unrepeated(
        self,
        policy: &Policy,
        counters: &mut Counters,
        hash: &[u8; 32],
    ) -> Result<Ordered<Intent>, Refusal> {
        let new: Ordered<Intent> =
            self.check(policy, Check::Duplicate, |intent, _| counters.unseen(intent.id, hash))?;
        if policy.check(Check::Duplicate) == Requirement::Required {
            counters.note(new.message.id, hash, false);
        }
        Ok(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::Text;
    use crate::command::CommandKind;
    use crate::id::{Boot, Nonce, Sequence, UnitId};

    fn intent(boot: u32, sequence: u64, kind: CommandKind) -> Intent {
        let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(boot), sequence: Sequence(sequence) };
        Intent { id, unit: UnitId::A, nonce: Nonce(1), kind, reason: Text::default() }
    }

    /// With the hash of the signed bytes, which here is made up of kind and sequence.
    fn give(counters: &mut Counters, intent: &Intent) -> Result<(), Refusal> {
        let mut hash = [0; 32];
        hash[..8].copy_from_slice(&intent.id.sequence.0.to_le_bytes());
        hash[8..12].copy_from_slice(&intent.kind.name().as_bytes()[..4]);
        counters.after(intent, &hash)?;
        counters.near_enough(intent)?;
        counters.note(intent.id, &hash, counters.near(intent.id).is_ok());
        Ok(())
    }

    #[test]
    fn the_end_of_the_counter_is_out_of_reach_from_anywhere() {
        let mut counters = Counters::default();
        let mut enable = |boot, n| give(&mut counters, &intent(boot, n, CommandKind::Enable));
        assert!(matches!(enable(1, u64::MAX), Err(Refusal::Ahead { last: None, .. })));
        assert!(matches!(enable(u32::MAX, 1), Err(Refusal::Ahead { .. })));
        assert_eq!(enable(1, 7), Ok(()));
        assert!(matches!(enable(1, 7 + STEP + 1), Err(Refusal::Ahead { .. })));
        assert!(matches!(enable(2 + STEP_BOOT, 1), Err(Refusal::Ahead { .. })));
        assert_eq!(enable(1, 7 + STEP), Ok(()));
        assert!(matches!(enable(1, 8), Err(Refusal::Duplicate { .. })));
        assert_eq!(enable(2, 1), Ok(()));
    }

    #[test]
    fn a_hold_is_refused_only_if_it_is_the_same_one_and_one_from_far_ahead_moves_nothing() {
        let mut counters = Counters::default();
        assert_eq!(give(&mut counters, &intent(1, 40, CommandKind::Enable)), Ok(()));
        assert_eq!(give(&mut counters, &intent(1, 3, CommandKind::Hold)), Ok(()));
        assert!(matches!(give(&mut counters, &intent(1, 3, CommandKind::Hold)), Err(Refusal::Duplicate { .. })));
        assert_eq!(give(&mut counters, &intent(1, u64::MAX, CommandKind::Hold)), Ok(()));
        assert_eq!(give(&mut counters, &intent(1, 41, CommandKind::Resume)), Ok(()));
    }

    #[test]
    fn a_hold_makes_void_what_was_given_before_it_and_kept_back() {
        let mut counters = Counters::default();
        assert_eq!(give(&mut counters, &intent(1, 9, CommandKind::Hold)), Ok(()));
        assert!(matches!(give(&mut counters, &intent(1, 8, CommandKind::Resume)), Err(Refusal::Duplicate { .. })));
    }

    #[test]
    fn a_thief_who_uses_up_the_next_ids_does_not_keep_the_operator_from_holding() {
        let mut counters = Counters::default();
        for n in 1..=9 {
            assert_eq!(give(&mut counters, &intent(1, n, CommandKind::Disarm)), Ok(()));
        }
        assert_eq!(give(&mut counters, &intent(1, 4, CommandKind::Hold)), Ok(()), "another command under a used id");
    }

    #[test]
    fn what_did_not_move_the_counter_is_not_counted() {
        let mut counters = Counters::default();
        let far = intent(1, u64::MAX, CommandKind::Hold);
        assert_eq!(give(&mut counters, &far), Ok(()));
        assert!(!counters.counted(far.id));
        let near = intent(1, 7, CommandKind::Hold);
        assert_eq!(give(&mut counters, &near), Ok(()));
        assert!(counters.counted(near.id) && !counters.counted(far.id));
    }
}
