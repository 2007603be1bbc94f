//! Attacks on the byte streams of the command plane by the relay between a client and the broker.
//!
//! The relay sees TLS only; it can hold, slow, end and damage, not read.

use super::attack::attacks;
use super::value::{Millis, Share, Whole};

attacks! {
    /// Holds bytes back by a fixed time.
    StreamDelay {
        /// The time.
        by_ms: Millis,
    }

    /// Keeps all bytes until the window ends; the connection stays open.
    Stall {}

    /// Lets bytes through at a rate.
    Throttle {
        /// The rate.
        bytes_per_s: Whole<1, 10_000_000>,
    }

    /// Ends one direction; the other stays open.
    HalfClose {}

    /// Resets connections at the start of the window.
    Reset {}

    /// Resets connections and refuses new ones until the window ends.
    Cut {}

    /// Flips one random bit in some pieces.
    StreamCorrupt {
        /// Probability for each piece.
        share: Share,
    }
}
