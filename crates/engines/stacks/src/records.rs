//! Attacks without a key on the records of an open association.
//!
//! Before, meanwhile and after, honest records go both ways; each holds its own number, so that one that comes out
//! twice or was never sent is known.

use std::collections::BTreeMap;
use std::time::Duration;

use link::guard::GuardMode;
use link::guard::observe::{Verdict, digest};
use link::guard::record::{HEADER, RawRecord, Split, split};
use link::memory::{Pair, Party, clear};
use link::pki::{Authority, Role};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::stack::{Deed, Handle};
use wire::core::Side;
use wire::id::PeerId;
use wire::policy::Requirement;

use super::StackError;
use super::judge::Showing;

/// Honest records each way, before the attack and after it.
const HONEST: u32 = 5;

/// Records sent and not yet put in, at most: fewer than the library's replay window, so that order alone loses none.
const GROUP: usize = 32;

/// Time for which withheld records are held back.
const KEPT: Duration = Duration::from_secs(60);

/// Handles the records of an open association.
pub(super) fn handled(one: &Handle, seed: u64) -> Result<Showing, StackError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let target = if rng.next_u32() & 1 == 0 { Side::Server } else { Side::Client };
    let mut trial = Handling::open(one.guard, target)?;
    trial.honest("before")?;
    trial.handle(one.deed, one.count.unsigned() as usize, &mut rng)?;
    trial.afterwards();
    Ok(trial.finish())
}

struct Handling {
    pair: Pair,
    target: Side,
    showing: Showing,
    /// The number of the next honest record.
    next: u32,
    /// Number of times that each record came out, by its bytes.
    out: BTreeMap<Vec<u8>, u32>,
    /// Every record that an honest end sent.
    sent: BTreeMap<Vec<u8>, Side>,
}

impl Handling {
    fn open(guard: Requirement, target: Side) -> Result<Self, StackError> {
        let authority = Authority::new()?;
        let mode = match guard {
            Requirement::Required => GuardMode::Required,
            Requirement::Waived => GuardMode::Waived,
        };
        let unit = Party { guard: mode, ..Party::honest(authority.issue(PeerId::UNIT_A, Role::Dials)?) };
        let gateway = Party { guard: mode, ..Party::honest(authority.issue(PeerId::GATEWAY, Role::Listens)?) };
        let mut pair = Pair::open([&unit, &gateway], PeerId::GATEWAY, clear())?;
        if pair.peer(Side::Client).is_err() || pair.peer(Side::Server).is_err() {
            return Err(StackError::NoAssociation);
        }
        // The handshake's own records are nobody's deed.
        pair.observed(Side::Client);
        pair.observed(Side::Server);
        let showing = Showing::new(true);
        Ok(Self { pair, target, showing, next: 0, out: BTreeMap::new(), sent: BTreeMap::new() })
    }

    /// The datagram of a new honest record towards `to`.
    fn record(&mut self, to: Side) -> Option<Vec<u8>> {
        self.next += 1;
        let record = format!("record {} to {to:?}", self.next).into_bytes();
        self.sent.insert(record.clone(), to);
        self.pair.send(to.opposite(), &record)
    }

    /// Puts a datagram in at the target, as an action.
    fn put(&mut self, datagram: &[u8]) {
        for piece in split(datagram) {
            let record = match piece {
                Split::Record(record) => record,
                Split::Remainder(bytes) => RawRecord::unframed(bytes),
            };
            self.showing.did_hash(u64::from_be_bytes(digest(record.bytes)));
        }
        self.deliver(self.target, datagram);
    }

    fn deliver(&mut self, side: Side, datagram: &[u8]) {
        for record in self.pair.put(side, datagram) {
            if self.sent.get(&record) != Some(&side) {
                self.showing.breaches.push(format!("a record of {} bytes that nobody sent came out", record.len()));
            }
            *self.out.entry(record).or_default() += 1;
            self.showing.delivered += 1;
        }
    }

    /// Sends honest records both ways before the attack. Those towards the target are noted as actions, for its log has
    /// them too.
    fn honest(&mut self, when: &str) -> Result<(), StackError> {
        for to in [Side::Server, Side::Client] {
            for _ in 0..HONEST {
                let datagram = self.record(to).ok_or(StackError::NoAssociation)?;
                if to == self.target {
                    self.put(&datagram);
                } else {
                    self.deliver(to, &datagram);
                }
                tracing::trace!(when, "honest record");
            }
        }
        Ok(())
    }

    /// Sends honest records both ways after the attack: one that does not come out was missed.
    fn afterwards(&mut self) {
        for to in [Side::Server, Side::Client] {
            for _ in 0..HONEST {
                let before = self.showing.delivered;
                match self.record(to) {
                    Some(datagram) => self.deliver(to, &datagram),
                    None => self.showing.missed.push(format!("an end takes no record towards {to:?} any more")),
                }
                if self.showing.delivered == before {
                    self.showing.missed.push(format!("an honest record towards {to:?} did not come out"));
                }
            }
        }
    }

    fn handle(&mut self, deed: Deed, count: usize, rng: &mut ChaCha8Rng) -> Result<(), StackError> {
        match deed {
            // Content types and alerts of RFC 6347 and RFC 5246: a fatal `handshake_failure`, `close_notify`,
            // application data.
            Deed::Alert => (0..count).for_each(|_| self.put(&plaintext(rng, 21, [2, 40]))),
            Deed::Close => (0..count).for_each(|_| self.put(&plaintext(rng, 21, [1, 0]))),
            Deed::Data => (0..count).for_each(|_| self.put(&plaintext(rng, 23, [1, 0]))),
            Deed::Replay | Deed::Duplicate | Deed::Reorder | Deed::Withhold => self.shuffle(deed, count, rng)?,
            Deed::Flip | Deed::Truncate | Deed::Extend | Deed::Splice => {
                for _ in 0..count {
                    let mut datagram = self.record(self.target).ok_or(StackError::NoAssociation)?;
                    let other = self.record(self.target).ok_or(StackError::NoAssociation)?;
                    damage(&mut datagram, &other, deed, rng);
                    self.put(&datagram);
                }
            }
        }
        Ok(())
    }

    /// Attacks that leave each datagram as it is: they choose its time and the number of its copies.
    fn shuffle(&mut self, deed: Deed, count: usize, rng: &mut ChaCha8Rng) -> Result<(), StackError> {
        let mut left = count;
        while left > 0 {
            let group = left.min(GROUP);
            left -= group;
            let mut datagrams = Vec::with_capacity(group);
            for _ in 0..group {
                datagrams.push(self.record(self.target).ok_or(StackError::NoAssociation)?);
            }
            if deed == Deed::Reorder {
                (1..group).rev().for_each(|i| datagrams.swap(i, rng.next_u32() as usize % (i + 1)));
            } else if deed == Deed::Withhold {
                self.pair.wait(KEPT);
            }
            let copies = if deed == Deed::Duplicate { 1 + rng.next_u32() % 8 } else { 0 };
            for datagram in &datagrams {
                (0..=copies).for_each(|_| self.put(datagram));
            }
            if deed == Deed::Replay {
                datagrams.iter().for_each(|datagram| self.put(datagram));
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Showing {
        for (record, n) in &self.out {
            if *n > 1 {
                let record = String::from_utf8_lossy(record);
                self.showing.breaches.push(format!("`{record}` came out {n} times"));
            }
        }
        let mut passed = 0;
        for seen in self.pair.observed(self.target) {
            self.showing.saw_hash(u64::from_be_bytes(seen.digest));
            if seen.verdict == Verdict::Passed {
                // Epoch 0 has handshakes and plaintext, which come out as no record.
                passed += u64::from(seen.epoch > 0);
            } else {
                let name = seen.verdict.logged().name().to_owned();
                *self.showing.guard_refused.entry(name).or_default() += 1;
            }
        }
        let out: u64 =
            self.out.iter().filter(|(r, _)| self.sent.get(*r) == Some(&self.target)).map(|(_, n)| u64::from(*n)).sum();
        // The library discards a record without a report: it is one that its guard passed and that did not come out.
        self.showing.refused_n("discarded", passed.saturating_sub(out));
        self.showing
    }
}

/// A record that anyone can write: a type, version DTLS 1.2, epoch 0, some sequence number, two bytes.
fn plaintext(rng: &mut ChaCha8Rng, content: u8, body: [u8; 2]) -> [u8; 15] {
    [content, 254, 253, 0, 0, 0, 0, 0, 0, 0, rng.next_u32() as u8, 0, 2, body[0], body[1]]
}

/// Changes one datagram; `other` is one that is lost for it.
fn damage(datagram: &mut Vec<u8>, other: &[u8], deed: Deed, rng: &mut ChaCha8Rng) {
    let below = |rng: &mut ChaCha8Rng, n: usize| rng.next_u32() as usize % n.max(1);
    if deed == Deed::Flip {
        let bit = below(rng, datagram.len() * 8);
        if let Some(byte) = datagram.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    } else if deed == Deed::Truncate {
        datagram.truncate(1 + below(rng, datagram.len() - 1));
    } else if deed == Deed::Extend {
        let more = 1 + below(rng, 64);
        datagram.extend((0..more).map(|n| n as u8));
    } else {
        // The head of one, the body of the other; both records have the same length but for a digit.
        datagram.truncate(HEADER);
        datagram.extend(other.get(HEADER..).unwrap_or_default());
    }
}
