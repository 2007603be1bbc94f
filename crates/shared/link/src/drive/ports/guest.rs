//! The way of a core's requests to its guest, and of the answers back into the loop.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use wire::core::Input;

use super::super::{Attendant, Senders};

/// Requests that may wait: the core asks one at a time.
const REQUESTS: usize = 1;

/// A guest's attendant on a thread of its own; it ends with this.
pub(super) struct Guest(Option<(SyncSender<Vec<u8>>, JoinHandle<()>)>);

impl Guest {
    pub(super) fn open(attendant: Option<Attendant>, senders: &Senders) -> Self {
        let Some(mut attendant) = attendant else { return Self(None) };
        let (requests, asked) = sync_channel::<Vec<u8>>(REQUESTS);
        let inputs = senders.inputs.clone();
        let thread = std::thread::spawn(move || {
            while let Ok(request) = asked.recv() {
                if inputs.blocking_send(Input::Guest { bytes: attendant(&request) }).is_err() {
                    return;
                }
            }
        });
        Self(Some((requests, thread)))
    }

    /// Hands a request to the attendant. False without one, or when it has not taken the last.
    pub(super) fn ask(&self, request: Vec<u8>) -> bool {
        self.0.as_ref().is_some_and(|(requests, _)| requests.try_send(request).is_ok())
    }
}

impl Drop for Guest {
    /// Returns when the attendant has ended its guest; it may be waiting for one last answer, for as long as the guest's limit.
    fn drop(&mut self) {
        if let Some((requests, thread)) = self.0.take() {
            drop(requests);
            // The panic of an attendant has nobody to go to.
            let _panicked = thread.join();
        }
    }
}
