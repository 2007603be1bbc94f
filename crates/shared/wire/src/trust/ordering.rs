//! Ordering: the only way from attributed to ordered.
//!
//! Evidence: the receiver's own session nonce, a boot counter that only rises, and a sequence that was not seen before.
//! State changes only when every judgement has passed, so a refused record leaves no trace in a window. The order of
//! commands is `orders`'.

pub(super) mod orders;

use std::collections::BTreeMap;

use super::stage::Live;
use super::{Attributed, BusMessage, Record, SessionRecord, SignedReport};
use crate::id::{Boot, NodeId, Nonce, PeerId, Sequence};
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;

/// A message of this session and boot that was not seen before.
#[derive(Debug)]
pub struct Ordered(());

/// An anti-replay window over one sender's sequence (the scheme of RFC 6479, with one 64-bit word).
#[derive(Clone, Debug)]
pub struct Window {
    boot: Boot,
    highest: Sequence,
    seen: u64,
    width: u8,
    jump: u64,
}

impl Window {
    /// Accepts sequences up to `width` (at most 64) behind the highest, each once, and at most `jump` ahead of it.
    /// Width 0 accepts rising sequences only.
    pub fn new(width: u8, jump: u64) -> Self {
        Self { boot: Boot(0), highest: Sequence(0), seen: 0, width: width.min(64), jump }
    }

    /// The highest sequence accepted in the newest boot.
    pub fn highest(&self) -> Sequence {
        self.highest
    }

    /// Judges without taking note.
    fn judge(&self, boot: Boot, got: Sequence) -> Result<(), Refusal> {
        if boot < self.boot {
            return Err(Refusal::Epoch { expected: self.boot, got: boot });
        }
        let (highest, seen) = if boot > self.boot { (Sequence(0), 0) } else { (self.highest, self.seen) };
        if got.0 > highest.0 {
            // The first record of a boot may have any sequence: a receiver that starts later than the sender has no
            // value to measure a step from.
            let first = highest == Sequence(0);
            if !first && got.0 - highest.0 > self.jump {
                return Err(Refusal::Jump { limit: self.jump, highest, got });
            }
            return Ok(());
        }
        let distance = highest.0 - got.0;
        let unseen = distance < u64::from(self.width) && distance < 64 && seen & (1 << distance) == 0 && got.0 > 0;
        if unseen { Ok(()) } else { Err(Refusal::Replayed { highest, got }) }
    }

    fn note(&mut self, boot: Boot, got: Sequence) {
        if boot > self.boot {
            (self.boot, self.highest, self.seen) = (boot, Sequence(0), 0);
        }
        if got > self.highest {
            let step = got.0 - self.highest.0;
            self.seen = if step < 64 { self.seen << step } else { 0 } | 1;
            self.highest = got;
        } else {
            self.seen |= 1 << (self.highest.0 - got.0);
        }
    }

    /// Judges and, if in order, takes note.
    ///
    /// # Errors
    /// An older boot, a sequence too far ahead, or one that was seen or is behind the window.
    pub fn admit(&mut self, boot: Boot, got: Sequence) -> Result<(), Refusal> {
        self.judge(boot, got)?;
        self.note(boot, got);
        Ok(())
    }
}

/// A window for each (peer, origin) pair: of the peers that the run has sessions with and the origins it has keys of.
#[derive(Clone, Debug)]
pub struct Windows {
    windows: BTreeMap<(PeerId, NodeId), Window>,
    width: u8,
    jump: u64,
}

impl Windows {
    /// All windows have this width and jump.
    pub fn new(width: u8, jump: u64) -> Self {
        Self { windows: BTreeMap::new(), width, jump }
    }

    fn window(&mut self, peer: PeerId, origin: NodeId) -> &mut Window {
        self.windows.entry((peer, origin)).or_insert_with(|| Window::new(self.width, self.jump))
    }
}

impl<'b> Attributed<SessionRecord<'b>> {
    /// Checks that it is of this session and not seen in it before.
    pub fn in_session(
        self,
        policy: &Policy,
        session: Nonce,
        window: &mut Window,
    ) -> Result<Record<Ordered, SessionRecord<'b>>, Refusal> {
        let our_record = self.judged(policy, Check::Session, |record, _| {
            let got = record.outer.session;
            if got == session { Ok(()) } else { Err(Refusal::Session { expected: session, got }) }
        })?;
        let (boot, sequence) = (our_record.message.outer.boot, our_record.message.outer.sequence);
        our_record.check(policy, Check::Sequence, Ordered(()), |_, _| window.admit(boot, sequence))
    }
}

impl<'b> Attributed<SignedReport<'b>> {
    /// Not seen from this peer for this origin before.
    pub fn from_origin(
        self,
        policy: &Policy,
        peer: PeerId,
        windows: &mut Windows,
    ) -> Result<Record<Ordered, SignedReport<'b>>, Refusal> {
        let report = &self.message.report;
        let (origin, boot, sequence) = (report.origin, report.boot, report.sequence);
        self.check(policy, Check::Sequence, Ordered(()), |_, _| windows.window(peer, origin).admit(boot, sequence))
    }
}

impl<'b, M> Record<Live, BusMessage<'b, M>> {
    /// Later than all that came before on this channel.
    pub fn on_channel(
        self,
        policy: &Policy,
        window: &mut Window,
    ) -> Result<Record<Ordered, BusMessage<'b, M>>, Refusal> {
        let (boot, sequence) = (self.message.header.boot, self.message.header.sequence);
        self.check(policy, Check::Sequence, Ordered(()), |_, _| window.admit(boot, sequence))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sequence_passes_once_whatever_the_order() {
        let mut window = Window::new(32, 600);
        for n in [5, 3, 4, 40, 39, 9] {
            assert_eq!(window.admit(Boot(1), Sequence(n)), Ok(()), "{n}");
            assert!(matches!(window.admit(Boot(1), Sequence(n)), Err(Refusal::Replayed { .. })), "{n} again");
        }
        assert!(matches!(window.admit(Boot(1), Sequence(8)), Err(Refusal::Replayed { .. })), "behind the window");
    }

    #[test]
    fn an_older_boot_is_refused_for_ever() {
        let mut window = Window::new(32, 600);
        window.admit(Boot(2), Sequence(1)).unwrap();
        let refusal = window.admit(Boot(1), Sequence(9));
        assert_eq!(refusal, Err(Refusal::Epoch { expected: Boot(2), got: Boot(1) }));
    }

    #[test]
    fn running_the_counter_ahead_is_refused() {
        let mut window = Window::new(32, 600);
        window.admit(Boot(1), Sequence(1)).unwrap();
        assert!(matches!(window.admit(Boot(1), Sequence(602)), Err(Refusal::Jump { .. })));
        window.admit(Boot(1), Sequence(601)).unwrap();
    }

    #[test]
    fn sequence_zero_is_never_accepted() {
        assert!(Window::new(32, 600).admit(Boot(1), Sequence(0)).is_err());
    }
}
