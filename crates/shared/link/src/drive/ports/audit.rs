//! The audit part: entries of this process and, in the recorder, of every other.

use serde_json::{Value, json};
use wire::id::NodeId;

use crate::clock::trace_us;
use crate::drive::{DriveError, Opened, Senders, say};
use crate::instrument::{self, Frame, Instrument, InstrumentStats};
use crate::recorder::{Recording, RecordingStats};
use crate::spec::ServiceSpec;

/// Destination of this process's entries.
enum Way {
    Nowhere,
    /// To the recorder.
    Recorder(Instrument),
    /// This is the recorder.
    Recording(Box<Recording>),
}

/// The way of entries, and the last of them: this process's own statement of its chain's head.
pub(in crate::drive) struct Audit {
    node: NodeId,
    way: Way,
    /// True if the launcher is told of entries that are waited for.
    tell: bool,
    last: Vec<u8>,
}

impl Audit {
    pub(super) fn open(spec: &ServiceSpec, senders: &Senders) -> Result<Self, DriveError> {
        let way = match (&spec.recorder, &spec.instrument) {
            (Some(recorder), _) => {
                instrument::serve(&recorder.socket, senders.frames.clone()).opened("recorder socket")?;
                Way::Recording(Box::new(Recording::new(recorder.directory.clone())))
            }
            (None, Some(socket)) => Way::Recorder(Instrument::start(socket.clone()).opened("instrument")?),
            (None, None) => Way::Nowhere,
        };
        let tell = spec.recorder.as_ref().is_some_and(|recorder| recorder.tell);
        Ok(Self { node: spec.node, way, tell, last: Vec::new() })
    }

    /// Sends an entry of this process on its way.
    pub(super) fn write(&mut self, bytes: Vec<u8>) -> bool {
        self.last.clone_from(&bytes);
        let frame = Frame { trace_us: trace_us(), node: self.node, bytes };
        match &mut self.way {
            Way::Recording(recording) => recording.write(frame),
            Way::Recorder(instrument) => instrument.push(frame),
            Way::Nowhere => return false,
        }
        true
    }

    /// Writes another process's frame to the recording, or lets it wait there.
    pub(in crate::drive) fn receive(&mut self, frame: Frame) {
        if self.tell && ground_truth::is_awaited(&frame.bytes) {
            say("entry", &json!(frame.bytes));
        }
        if let Some(recording) = self.recording() {
            recording.receive(frame);
        }
    }

    /// The recording, in the recorder.
    pub(in crate::drive) fn recording(&mut self) -> Option<&mut Recording> {
        match &mut self.way {
            Way::Recording(recording) => Some(recording),
            Way::Recorder(_) | Way::Nowhere => None,
        }
    }

    /// Ends the way of entries; returns their outcome, in the recording and at the recorder.
    pub(super) fn finish(&mut self) -> (Option<RecordingStats>, Option<InstrumentStats>) {
        match &mut self.way {
            Way::Recording(recording) => (Some(recording.finish()), None),
            Way::Recorder(instrument) => (None, Some(instrument.finish())),
            Way::Nowhere => (None, None),
        }
    }

    pub(super) fn head(&self) -> Value {
        instrument::head(&self.last)
    }
}
