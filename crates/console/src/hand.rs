//! The hand of the person at the console: each act judged here, once, against the picture.
//!
//! An accepted act becomes a [`Wish`], as a step of the script does; from there on both go one way, to a signed intent
//! and its confirmation. Towards safe one act is enough. Away from safe the order is prepared, which lapses after
//! [`PREPARED_FOR`] or with the first of its interlocks, and confirmed with a reason. A confirmed order is released to
//! the unit as soon as the gateway has staged it. Signing is left to `intent`, the conditions to `interlock`.

use std::collections::VecDeque;

use wire::codec::{self, Text};
use wire::command::IntentHash;
use wire::id::CommandId;
use wire::person::MAX_ACT;
use wire::time::Instant;

use crate::act::{Act, Alarm, Answer, MAX_ANSWERS, Numbered, Order, PREPARED_FOR, Prepared, Role, Shelf, Unable};
use crate::alarm::ShownGroup;
use crate::life::{Giver, Life, MAX_COMMANDS};
use crate::operator::Wish;
use crate::shown::{Shown, ShownUnit, basis_for};

/// Consequence of an act.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Consequence {
    /// No consequence.
    Nothing,
    /// An order is given.
    Wish(Wish),
    /// An alarm was taken note of.
    Note(Alarm, Instant),
    /// An alarm was put aside.
    Shelve(ShownGroup, Shelf),
    /// The sound was silenced.
    Silence,
}

/// The hand of the person at the console.
#[derive(Clone, Debug, Default)]
pub struct Hand {
    /// The last act's number.
    last: u64,
    prepared: Option<Prepared>,
    /// Confirmed intents that the gateway has not staged yet; at most [`MAX_COMMANDS`].
    confirmed: VecDeque<IntentHash>,
    answers: VecDeque<Answer>,
}

impl Hand {
    /// Reads an act. Its number counts from then on, whatever its result.
    pub fn read(&mut self, bytes: &[u8]) -> Result<Numbered, Unable> {
        let numbered: Numbered = codec::decode(bytes, MAX_ACT).map_err(|_| Unable::Malformed)?;
        if numbered.serial <= self.last {
            return Err(Unable::Repeated);
        }
        self.last = numbered.serial;
        Ok(numbered)
    }

    /// The consequence of `act`, judged by the shown values.
    pub fn judge(&mut self, numbered: &Numbered, shown: &Shown) -> Result<Consequence, Unable> {
        if shown.role == Role::View || shown.marks.replay {
            return Err(Unable::Role);
        }
        match numbered.act {
            Act::Now(order) if !order.towards_safe() => Err(Unable::TwoSteps),
            Act::Now(order) => self.now(order, shown),
            Act::Prepare(order) if order.towards_safe() => Err(Unable::OneStep),
            Act::Prepare(order) => self.prepare(numbered.serial, order, shown),
            Act::Confirm(order, reason) => self.confirm(order, reason, shown),
            Act::Withdraw => self.withdraw(),
            Act::Acknowledge(alarm, since) => note(alarm, since, shown),
            Act::Shelve(alarm, since, shelf, reason) => shelve((alarm, since), shelf, reason, shown),
            Act::Silence if shown.sound.motif.is_none() => Err(Unable::NoSound),
            Act::Silence => Ok(Consequence::Silence),
        }
    }

    fn now(&mut self, order: Order, shown: &Shown) -> Result<Consequence, Unable> {
        let deed = give(order, Text::new(""), shown)?;
        self.prepared = None;
        self.confirmed.clear();
        Ok(deed)
    }

    fn prepare(&mut self, serial: u64, order: Order, shown: &Shown) -> Result<Consequence, Unable> {
        shown.unable(&order).map_or(Ok(()), Err)?;
        self.prepared = Some(Prepared { serial, order, since: shown.at, until: shown.at + PREPARED_FOR });
        Ok(Consequence::Nothing)
    }

    fn confirm(&mut self, order: Order, reason: Text<64>, shown: &Shown) -> Result<Consequence, Unable> {
        let prepared = self.prepared.filter(|prepared| prepared.order == order).ok_or(Unable::NotPrepared)?;
        if shown.at >= prepared.until {
            return Err(Unable::Lapsed);
        }
        reasoned(&reason)?;
        let deed = give(order, reason, shown)?;
        self.prepared = None;
        Ok(deed)
    }

    fn withdraw(&mut self) -> Result<Consequence, Unable> {
        if self.prepared.take().is_none() && self.confirmed.is_empty() {
            return Err(Unable::NotPrepared);
        }
        self.confirmed.clear();
        Ok(Consequence::Nothing)
    }

    /// Links the person's order to its signed intent.
    pub fn link_intent(&mut self, intent: IntentHash) {
        if self.confirmed.len() >= MAX_COMMANDS {
            self.confirmed.pop_front();
        }
        self.confirmed.push_back(intent);
    }

    /// The next confirmed order that the gateway has staged. Each is released once.
    pub fn release(&mut self, shown: &Shown) -> Option<Wish> {
        let life = |intent: &IntentHash| shown.command(intent).map(|command| command.life);
        self.confirmed.retain(|intent| matches!(life(intent), Some(Life::Requested | Life::Staged)));
        let staged = self.confirmed.iter().position(|intent| life(intent) == Some(Life::Staged))?;
        self.confirmed.remove(staged).map(Wish::Release)
    }

    /// Drops the prepared order once its time is over or one of its interlocks fails.
    pub fn lapse(&mut self, shown: &Shown) -> Option<(Order, Unable)> {
        let Prepared { serial, order, until, .. } = self.prepared?;
        let refusal = if shown.at >= until { Unable::Lapsed } else { shown.unable(&order)? };
        self.prepared = None;
        self.answer(Answer { serial, at: shown.at, act: Some(Act::Prepare(order)), outcome: Err(refusal) });
        Some((order, refusal))
    }

    /// Keeps an answer to be shown.
    pub fn answer(&mut self, answer: Answer) {
        if self.answers.len() >= MAX_ANSWERS {
            self.answers.pop_front();
        }
        self.answers.push_back(answer);
    }

    /// The last act gave this command.
    pub fn gave(&mut self, command: CommandId) {
        if let Some(Answer { outcome: Ok(ok), .. }) = self.answers.back_mut() {
            *ok = Some(command);
        }
    }

    /// The prepared order.
    pub fn prepared(&self) -> Option<Prepared> {
        self.prepared
    }

    /// The last answers, oldest first.
    pub fn answers(&self) -> Vec<Answer> {
        self.answers.iter().copied().collect()
    }
}

/// An alarm is acknowledged once; a track that ended without one is taken note of in the same way.
fn note(alarm: Alarm, since: Instant, shown: &Shown) -> Result<Consequence, Unable> {
    let open = |group: &ShownGroup| (group.cause, group.since) == (alarm, since) && !group.acknowledged;
    let ended = |unit: &ShownUnit| {
        unit.lost.iter().any(|lost| {
            let named = Alarm::TrackLost(unit.unit, lost.boot, lost.track.get().0.id);
            (named, lost.since) == (alarm, since)
        })
    };
    let known = shown.alarms.iter().any(open) || shown.units.iter().any(ended);
    if known { Ok(Consequence::Note(alarm, since)) } else { Err(Unable::NoAlarm) }
}

/// An alarm that stands may be put aside for a reason, unless a HOLD_SAFE stands by it.
fn shelve(
    (alarm, since): (Alarm, Instant),
    shelf: Shelf,
    reason: Text<64>,
    shown: &Shown,
) -> Result<Consequence, Unable> {
    let stands = |group: &&ShownGroup| (group.cause, group.since) == (alarm, since) && group.standing;
    let group = shown.alarms.iter().find(stands).ok_or(Unable::NoAlarm)?;
    if group.hold_stands {
        return Err(Unable::HoldStands);
    }
    reasoned(&reason)?;
    Ok(Consequence::Shelve(group.clone(), shelf))
}

fn reasoned(reason: &Text<64>) -> Result<(), Unable> {
    if reason.as_str().trim().is_empty() { Err(Unable::NoReason) } else { Ok(()) }
}

fn give(order: Order, reason: Text<64>, shown: &Shown) -> Result<Consequence, Unable> {
    shown.unable(&order).map_or(Ok(()), Err)?;
    let wish = match order {
        Order::Revoke(who) => Wish::Revoke(who, Giver::Person),
        Order::Command(unit, kind) => {
            let basis = basis_for(kind, shown.unit(unit)).ok_or(Unable::Interlock)?;
            Wish::Intend { step: None, unit, kind, tag: None, basis, reason: reason.as_str().to_owned() }
        }
    };
    Ok(Consequence::Wish(wish))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beyond it, the newest.
    #[test]
    fn staged_orders_are_kept_up_to_their_bound() {
        let mut hand = Hand::default();
        for n in 0..MAX_COMMANDS as u8 + 3 {
            let confirmations = hand.confirmed.len();
            hand.link_intent([n; 32]);
            assert_eq!(hand.confirmed.len(), (confirmations + 1).min(MAX_COMMANDS));
        }
        assert_eq!(
            (hand.confirmed.front(), hand.confirmed.back()),
            (Some(&[3; 32]), Some(&[MAX_COMMANDS as u8 + 2; 32]))
        );
    }
}
