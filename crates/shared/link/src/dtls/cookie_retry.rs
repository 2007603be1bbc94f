//! A dialler's answer to a cookie exchange ([`crate::guard::cookie`]): it returns the cookie, and then repeats its first hello. Both happen
//! below the library, which does not notice.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::guard::hello;

/// Number of answers in one attempt, bounded because anybody can send a cookie request.
const ANSWERS: u32 = 4;

/// State of one attempt to dial.
#[derive(Debug, Default)]
pub(super) struct CookieRetry {
    first: Mutex<Option<Vec<u8>>>,
    answered: AtomicU32,
}

impl CookieRetry {
    /// Notes an outgoing datagram; the first one is the hello.
    pub(super) fn note_sent(&self, datagram: &[u8]) {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert_with(|| datagram.to_vec());
    }

    /// Datagrams that answer a cookie request; `None` for any other datagram, which goes to the library.
    pub(super) fn answer(&self, datagram: &[u8]) -> Option<Vec<Vec<u8>>> {
        let cookie = hello::requested_cookie(datagram)?;
        // Dropped, and not passed on: the library cannot continue a handshake with this cookie (`guard::cookie`).
        if self.answered.fetch_add(1, Ordering::Relaxed) >= ANSWERS {
            return Some(Vec::new());
        }
        let first = self.first.lock().unwrap_or_else(PoisonError::into_inner).clone()?;
        Some(vec![hello::with_cookie(&first, cookie)?, first])
    }
}
