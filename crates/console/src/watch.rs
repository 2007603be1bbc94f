//! The display's challenges: an unguessable number a period, which the units repeat in their signed reports.
//!
//! It goes to the units by way of the gateway, which can keep it or delay it: both make reports look older, never
//! younger. Bounding ages with it is left to `intake`.

use sha2::{Digest, Sha256};
use wire::bounds::Bounds;
use wire::id::{Boot, Nonce};
use wire::sign::Secret;
use wire::time::{Instant, Span};

/// Time of the next challenge, and the secret it is drawn from.
#[derive(Clone, Debug)]
pub struct ChallengeClock {
    secret: Secret,
    boot: Boot,
    issued: u64,
    period: Span,
    next: Instant,
}

impl ChallengeClock {
    /// Challenges from `now` on, unpredictable without `secret`.
    pub fn new(secret: Secret, boot: Boot, bounds: &Bounds, now: Instant) -> Self {
        Self { secret, boot, issued: 0, period: Span::ms(bounds.challenge_period_ms), next: now }
    }

    /// Time at which the next one is due.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// The next one, if it is due.
    pub fn due(&mut self, now: Instant) -> Option<Nonce> {
        if now < self.next {
            return None;
        }
        self.next = now + self.period;
        self.issued += 1;
        let hash = Sha256::new()
            .chain_update(b"holdsafe display challenge v1")
            .chain_update(self.secret.0)
            .chain_update(self.boot.0.to_le_bytes())
            .chain_update(self.issued.to_le_bytes())
            .finalize();
        let first: [u8; 8] = *hash.first_chunk().expect("invariant: a SHA-256 has 32 bytes");
        Some(Nonce(u64::from_be_bytes(first).max(1)))
    }
}
