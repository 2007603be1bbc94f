//! The two ends of a link, as a trial sees them: both are other authors' software.

use crate::signature::Key;

/// Configuration with which an end starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// The link's key; `None` on an unsigned link.
    pub key: Option<Key>,
    /// Seconds by which the end's clock is behind the host's.
    pub behind_s: u32,
    /// A broken receiver: with a key, it accepts unsigned messages too. To show that a trial notices.
    pub accept_unsigned: bool,
}

/// Reason for which an end gave no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct EndFault(pub String);

/// Observation of a receiving end at one datagram.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Delivery {
    /// The datagram as the end's socket gave it; `None` if none came in time.
    pub datagram: Option<Vec<u8>>,
    /// Frames of the messages that were handed to the application, in order.
    pub accepted: Vec<Vec<u8>>,
}

/// The end whose messages are true.
pub trait Sender {
    /// Starts it, or starts it again: an earlier life leaves nothing behind.
    ///
    /// # Errors
    /// When it does not answer.
    fn start(&mut self, start: &Start) -> Result<(), EndFault>;

    /// Its next message, as it left its socket.
    ///
    /// # Errors
    /// When none came.
    fn send(&mut self) -> Result<Vec<u8>, EndFault>;
}

/// The end under attack.
pub trait Receiver {
    /// Starts it, or starts it again: an earlier life leaves nothing behind.
    ///
    /// # Errors
    /// When it does not answer.
    fn start(&mut self, start: &Start) -> Result<(), EndFault>;

    /// Gives it a datagram, and waits for its observation.
    ///
    /// # Errors
    /// When it does not answer.
    fn deliver(&mut self, datagram: &[u8]) -> Result<Delivery, EndFault>;
}
