//! A dialler's answer to a cookie exchange ([`crate::guard::cookie`]): it sends the cookie back, and then its first hello
//! again, below the library and unknown to it.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::guard::hello;

/// Number of answers in one attempt: anybody can send a cookie request.
const ANSWERS: u32 = 4;

/// The memory of one attempt to dial.
#[derive(Debug, Default)]
pub(super) struct CookieRetry {
    first: Mutex<Option<Vec<u8>>>,
    answered: AtomicU32,
}

impl CookieRetry {
    /// Notes an outgoing datagram; the first of all is the hello.
    pub(super) fn out(&self, datagram: &[u8]) {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert_with(|| datagram.to_vec());
    }

    /// Datagrams that answer this one, which then is not the library's; `None` if it is.
    pub(super) fn answer(&self, datagram: &[u8]) -> Option<Vec<Vec<u8>>> {
        let cookie = hello::requested_cookie(datagram)?;
        if self.answered.fetch_add(1, Ordering::Relaxed) >= ANSWERS {
            return Some(Vec::new());
        }
        let first = self.first.lock().unwrap_or_else(PoisonError::into_inner).clone()?;
        Some(vec![hello::with_cookie(&first, cookie)?, first])
    }
}
