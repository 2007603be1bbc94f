//! The audit part: entries of this process and, in the recorder, of every other.

use serde_json::{Value, json};
use wire::id::NodeId;

use crate::clock::trace_us;
use crate::drive::{DriveError, Opened, Senders, print_line};
use crate::instrument::{self, Frame, Instrument, InstrumentStats};
use crate::recorder::{Recording, RecordingStats};
use crate::spec::ServiceSpec;

/// Destination of this process's entries.
enum Destination {
    Nowhere,
    /// To the recorder.
    Recorder(Instrument),
    /// This is the recorder.
    Recording(Box<Recording>),
}

/// The destination of entries, and the last entry: this process's own statement of its chain's head.
pub(in crate::drive) struct Audit {
    node: NodeId,
    destination: Destination,
    /// True if the launcher gets the entries that a step of an attack may wait for.
    reports_awaited: bool,
    last: Vec<u8>,
}

impl Audit {
    pub(super) fn open(spec: &ServiceSpec, senders: &Senders) -> Result<Self, DriveError> {
        let destination = match (&spec.recorder, &spec.instrument) {
            (Some(recorder), _) => {
                instrument::serve(&recorder.socket, senders.frames.clone()).opened("recorder socket")?;
                Destination::Recording(Box::new(Recording::new(recorder.directory.clone())))
            }
            (None, Some(socket)) => Destination::Recorder(Instrument::start(socket.clone()).opened("instrument")?),
            (None, None) => Destination::Nowhere,
        };
        let reports_awaited = spec.recorder.as_ref().is_some_and(|recorder| recorder.reports_awaited);
        Ok(Self { node: spec.node, destination, reports_awaited, last: Vec::new() })
    }

    /// Sends an entry of this process to its destination.
    pub(super) fn write(&mut self, bytes: Vec<u8>) -> bool {
        self.last.clone_from(&bytes);
        let frame = Frame { trace_us: trace_us(), node: self.node, bytes };
        match &mut self.destination {
            Destination::Recording(recording) => recording.write(frame),
            Destination::Recorder(instrument) => instrument.push(frame),
            Destination::Nowhere => return false,
        }
        true
    }

    /// Writes another process's frame to the recording, or queues it there.
    pub(in crate::drive) fn receive(&mut self, frame: Frame) {
        // Reported on receipt: a step of an attack does not depend on the recorder's disk.
        if self.reports_awaited && ground_truth::is_awaited(&frame.bytes) {
            print_line("entry", &json!(frame.bytes));
        }
        if let Some(recording) = self.recording() {
            recording.receive(frame);
        }
    }

    /// The recording, in the recorder.
    pub(in crate::drive) fn recording(&mut self) -> Option<&mut Recording> {
        match &mut self.destination {
            Destination::Recording(recording) => Some(recording),
            Destination::Recorder(_) | Destination::Nowhere => None,
        }
    }

    /// Closes the destination; returns the outcome of the entries, in the recording and at the recorder.
    pub(super) fn finish(&mut self) -> (Option<RecordingStats>, Option<InstrumentStats>) {
        match &mut self.destination {
            Destination::Recording(recording) => (Some(recording.finish()), None),
            Destination::Recorder(instrument) => (None, Some(instrument.finish())),
            Destination::Nowhere => (None, None),
        }
    }

    pub(super) fn head(&self) -> Value {
        instrument::head(&self.last)
    }
}
