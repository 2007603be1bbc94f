//! The stack as a whole, one binary: DTLS over an in-memory network in paused time, the accept loop on real sockets,
//! shared memory, and readers of files and pipes.

#[cfg(test)]
mod stack {
    mod network;

    mod accept;
    mod association;
    mod bus;
    #[cfg(feature = "foxglove")]
    mod foxglove;
    mod hostile;
    mod logs;
    mod openssl;
    mod recorder;
    mod spec;
    mod unknown_peers;
    mod vetting;
    mod web;
}
