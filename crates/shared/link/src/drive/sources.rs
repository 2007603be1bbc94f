//! The bounded queues that wake the loop.

use tokio::sync::mpsc;
use wire::core::Input;

use super::{Senders, Wake};
use crate::dtls::SessionEvent;
use crate::guard::observe::{Observation, ObservationLog};
use crate::instrument::Frame;
use crate::spec::Control;

/// Shared-memory messages and publications that may wait.
const INPUTS: usize = 256;
/// Relayed datagrams and stream pieces that may wait.
const RELAYED: usize = 1024;
/// Session events that may wait.
const SESSIONS: usize = 512;
/// Audit frames that may wait in the recorder.
const FRAMES: usize = 4096;
/// Guard observations that may wait.
const OBSERVATIONS: usize = 4096;

/// The receiving ends.
pub(super) struct Sources {
    inputs: mpsc::Receiver<Input>,
    relayed: mpsc::Receiver<Input>,
    sessions: mpsc::Receiver<SessionEvent>,
    frames: mpsc::Receiver<Frame>,
    observations: mpsc::Receiver<Observation>,
    acts: mpsc::Receiver<Vec<u8>>,
    controls: mpsc::Receiver<Control>,
}

/// Makes the queues.
pub(super) fn open(controls: mpsc::Receiver<Control>, acts: mpsc::Receiver<Vec<u8>>) -> (Sources, Senders) {
    let (inputs_tx, inputs) = mpsc::channel(INPUTS);
    let (relayed_tx, relayed) = mpsc::channel(RELAYED);
    let (sessions_tx, sessions) = mpsc::channel(SESSIONS);
    let (frames_tx, frames) = mpsc::channel(FRAMES);
    let (log, observations) = ObservationLog::new(OBSERVATIONS);
    let senders =
        Senders { inputs: inputs_tx, relayed: relayed_tx, sessions: sessions_tx, frames: frames_tx, observations: log };
    (Sources { inputs, relayed, sessions, frames, observations, acts, controls }, senders)
}

impl Sources {
    /// The next wake, from the first queue that has one. Cancelling the wait loses no event.
    pub(super) async fn next(&mut self) -> Wake {
        tokio::select! {
            Some(input) = self.inputs.recv() => Wake::Input(input),
            Some(input) = self.relayed.recv() => Wake::Input(input),
            Some(event) = self.sessions.recv() => Wake::Session(event),
            Some(frame) = self.frames.recv() => Wake::Audit(frame),
            Some(observation) = self.observations.recv() => Wake::Observed(observation),
            Some(bytes) = self.acts.recv() => Wake::Input(Input::Act { bytes }),
            Some(control) = self.controls.recv() => Wake::Control(control),
            else => std::future::pending().await,
        }
    }
}
