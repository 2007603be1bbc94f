//! One attack on one link, in lock-step: no message is sent before the receiver has reported the one before it.
//!
//! A round is a message of the true sender that the relay holds back, the attacker's message, and the one held back. Around a
//! restart of the receiver it is a message that the relay passes on and keeps, the restart of both ends, the attacker's message,
//! and a new one of the true sender.
//!
//! A parser of a byte stream may hold a message back until later bytes come. It counts as handed on, and as late; messages behind
//! the last round release it.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;
use serde::Serialize;

use crate::attack::{Attack, Captured, Link};
use crate::end::{EndFault, Receiver, Sender, Start};
use crate::frame::Frame;
use crate::signature::Key;

/// Most rounds of a trial.
pub const MOST_ROUNDS: u32 = 100_000;

/// Messages of the true sender behind the last round, in no count: together longer than the longest frame.
const CLOSING: u32 = 8;
/// Most messages that may still be handed on late.
const PENDING: usize = 32;

/// Key of every signed link: the attacker is without it, so its value is of no matter.
const KEY: Key = *b"a key that both ends of it share";

/// One trial.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// The attack.
    pub attack: Attack,
    /// The kind of link.
    pub link: Link,
    /// Messages of the attacker, at most [`MOST_ROUNDS`].
    pub rounds: u32,
    /// Seed of the attacker's chances.
    pub seed: u64,
    /// A broken receiver: see [`Start::accept_unsigned`].
    pub accept_unsigned: bool,
}

/// Counts of a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Messages of the attacker that provably arrived, and of these handed to the application.
    pub attacks: u64,
    /// See above.
    pub attacks_accepted: u64,
    /// Messages of the true sender that provably arrived after the first of the attacker's, and of these handed to the application.
    pub honest: u64,
    /// See above.
    pub honest_accepted: u64,
    /// Messages of either that were handed on after a later datagram had arrived; they are among the accepted.
    pub late: u64,
    /// Messages of either that did not provably arrive.
    pub undelivered: u64,
    /// Messages handed to the application that were no recent datagram.
    pub strays: u64,
}

/// Author of a datagram.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Author {
    Attacker,
    /// The true sender, in a round.
    Honest,
    /// The true sender, before the first round or after the last.
    Uncounted,
}

/// Progress of a trial: its counts and the attacker's memory.
struct Run<'a> {
    trial: Trial,
    start: Start,
    rng: ChaCha8Rng,
    counts: Counts,
    pending: VecDeque<(Author, Vec<u8>)>,
    sender: &'a mut dyn Sender,
    receiver: &'a mut dyn Receiver,
}

/// Runs a trial.
///
/// # Errors
/// When an end does not answer, or its sender sends no frame.
pub fn run(trial: Trial, sender: &mut dyn Sender, receiver: &mut dyn Receiver) -> Result<Counts, EndFault> {
    let key = match trial.link {
        Link::Unsigned => None,
        Link::Signed => Some(KEY),
    };
    let start = Start { key, behind_s: 0, accept_unsigned: trial.accept_unsigned };
    let rng = ChaCha8Rng::seed_from_u64(trial.seed);
    let mut run = Run { trial, start, rng, counts: Counts::default(), pending: VecDeque::new(), sender, receiver };
    match trial.attack.restarts_after_s() {
        Some(behind_s) => run.around_restarts(behind_s)?,
        None => run.in_one_session()?,
    }
    for _ in 0..CLOSING {
        run.passed_on()?;
    }
    Ok(run.counts)
}

impl Run<'_> {
    fn in_one_session(&mut self) -> Result<(), EndFault> {
        self.sender.start(&self.start)?;
        self.receiver.start(&self.start)?;
        let mut older = self.passed_on()?;
        let mut newest = self.passed_on()?;
        for round in 0..self.trial.rounds.min(MOST_ROUNDS) {
            let coming = self.next()?;
            self.attack(Captured { coming: &coming, newest: &newest, older: &older, round })?;
            self.honest(&coming)?;
            (older, newest) = (newest, coming);
        }
        Ok(())
    }

    fn around_restarts(&mut self, behind_s: u32) -> Result<(), EndFault> {
        let then = Start { behind_s, ..self.start };
        for round in 0..self.trial.rounds.min(MOST_ROUNDS) {
            self.sender.start(&then)?;
            self.receiver.start(&then)?;
            let newest = self.passed_on()?;
            self.sender.start(&self.start)?;
            self.receiver.start(&self.start)?;
            let coming = self.next()?;
            self.attack(Captured { coming: &coming, newest: &newest, older: &newest, round })?;
            self.honest(&coming)?;
        }
        Ok(())
    }

    /// The sender's next message; the receiver does not have it yet.
    fn next(&mut self) -> Result<Frame, EndFault> {
        let bytes = self.sender.send()?;
        let (frame, length) =
            Frame::read(&bytes).map_err(|refused| EndFault(format!("the sender's datagram: {refused}")))?;
        match length == bytes.len() {
            true => Ok(frame),
            false => Err(EndFault(format!(
                "byte {length} of the sender's datagram: expected its end, got {} bytes",
                bytes.len()
            ))),
        }
    }

    /// The frame passed on, and the receiver has it.
    fn passed_on(&mut self) -> Result<Frame, EndFault> {
        let frame = self.next()?;
        self.give(Author::Uncounted, frame.write())?;
        Ok(frame)
    }

    fn attack(&mut self, captured: Captured<'_>) -> Result<(), EndFault> {
        let datagram = self.trial.attack.datagram(captured, self.start.key.as_ref(), &mut self.rng);
        self.give(Author::Attacker, datagram)
    }

    fn honest(&mut self, frame: &Frame) -> Result<(), EndFault> {
        self.give(Author::Honest, frame.write())
    }

    /// Delivers a datagram, and counts the messages that the receiver then handed on.
    fn give(&mut self, author: Author, datagram: Vec<u8>) -> Result<(), EndFault> {
        let delivery = self.receiver.deliver(&datagram)?;
        if delivery.datagram.as_ref() != Some(&datagram) {
            self.counts.undelivered += 1;
            return Ok(());
        }
        match author {
            Author::Attacker => self.counts.attacks += 1,
            Author::Honest => self.counts.honest += 1,
            Author::Uncounted => {}
        }
        self.pending.truncate(PENDING - 1);
        self.pending.push_front((author, datagram));
        for frame in &delivery.accepted {
            self.hand_on(frame);
        }
        Ok(())
    }

    /// Counts a message that was handed on for the newest datagram with its bytes.
    fn hand_on(&mut self, frame: &[u8]) {
        let Some(place) = self.pending.iter().position(|(_, datagram)| datagram == frame) else {
            self.counts.strays += 1;
            return;
        };
        let author = self.pending[place].0;
        let datagram = &mut self.pending[place].1;
        // Handed on once: its bytes answer for no other message.
        datagram.clear();
        match author {
            Author::Attacker => self.counts.attacks_accepted += 1,
            Author::Honest => self.counts.honest_accepted += 1,
            Author::Uncounted => return,
        }
        self.counts.late += u64::from(place > 0);
    }
}
