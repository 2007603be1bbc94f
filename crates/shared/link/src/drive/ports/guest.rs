//! The guest part: a core's requests to its guest, and the answers back into the loop.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use wire::core::Input;

use super::super::{Attendant, Senders};

/// Requests that may wait: the core sends one at a time.
const REQUESTS: usize = 1;

/// A guest's attendant on its thread, which ends with this.
pub(super) struct Guest(Option<(SyncSender<Vec<u8>>, JoinHandle<()>)>);

impl Guest {
    pub(super) fn open(attendant: Option<Attendant>, senders: &Senders) -> Self {
        let Some(mut attendant) = attendant else { return Self(None) };
        let (requests, pending) = sync_channel::<Vec<u8>>(REQUESTS);
        let inputs = senders.inputs.clone();
        let thread = std::thread::spawn(move || {
            while let Ok(request) = pending.recv() {
                if inputs.blocking_send(Input::Guest { bytes: attendant(&request) }).is_err() {
                    return;
                }
            }
        });
        Self(Some((requests, thread)))
    }

    /// Queues a request for the attendant. False without an attendant, or while an earlier request waits.
    pub(super) fn request(&self, request: Vec<u8>) -> bool {
        self.0.as_ref().is_some_and(|(requests, _)| requests.try_send(request).is_ok())
    }
}

impl Drop for Guest {
    /// Returns when the attendant has ended its guest; the attendant may wait for a last answer, up to the guest's limit.
    fn drop(&mut self) {
        if let Some((requests, thread)) = self.0.take() {
            // The closed queue ends the thread; joined before that it would never end.
            drop(requests);
            // A panic of the attendant has no receiver here.
            let _panicked = thread.join();
        }
    }
}
