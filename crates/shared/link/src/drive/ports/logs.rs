//! Logs that a process keeps of itself: the core's input journal, and the observations of the guards at its links.

use std::fs::File;
use std::io::{BufWriter, Result};

use serde_json::Value;
use wire::core::{Input, Output};
use wire::time::Instant;

use crate::drive::{DriveError, Opened};
use crate::dtls::session::SessionStats;
use crate::files;
use crate::guard::observe::Observation;
use crate::input_journal::{Header, Writer};
use crate::spec::ServiceSpec;
use crate::stream::StreamLog;
use crate::witness::WitnessLog;

type Journal = Writer<BufWriter<File>>;

/// Both logs, each only where the specification has it.
pub(in crate::drive) struct Logs {
    /// The input journal; none, too, after a failed write.
    journal: Option<Journal>,
    witness: Option<WitnessLog>,
    /// True if the last flush failed.
    unflushed: bool,
}

impl Logs {
    pub(super) fn open(spec: &ServiceSpec) -> std::result::Result<Self, DriveError> {
        let journal = (spec.journal_bytes > 0).then(|| journal(spec)).transpose().opened("input journal")?;
        Ok(Self { journal, witness: WitnessLog::create(spec).opened("guard's log")?, unflushed: false })
    }

    /// Log for the witnesses of byte streams.
    pub(super) fn streams(&self) -> StreamLog {
        StreamLog::from_witness(self.witness.as_ref())
    }

    pub(in crate::drive) fn input(&mut self, now: Instant, input: &Input) {
        self.note(|journal| journal.input(now, input));
    }

    pub(super) fn output(&mut self, output: &Output) {
        self.note(|journal| journal.output(output));
    }

    fn note(&mut self, write: impl FnOnce(&mut Journal) -> Result<()>) {
        if let Some(Err(error)) = self.journal.as_mut().map(write) {
            tracing::warn!(%error, "input journal ended");
            // No later retry: a journal with a gap cannot be replayed past it.
            self.journal = None;
        }
    }

    pub(in crate::drive) fn observed(&self, observation: &Observation) {
        if let Some(witness) = &self.witness {
            witness.observed(observation);
        }
    }

    /// Hands both logs to the operating system.
    pub(in crate::drive) fn flush(&mut self) {
        let journal = self.journal.as_mut().map_or(Ok(()), Journal::flush);
        let witness = self.witness.as_ref().map_or(Ok(()), WitnessLog::flush);
        let flushed = journal.and(witness);
        let failed = std::mem::replace(&mut self.unflushed, flushed.is_err());
        // Reported once: on a full disk the flush fails ten times a second.
        if let Err(error) = flushed
            && !failed
        {
            tracing::warn!(%error, "logs not flushed");
        }
    }

    /// Closes the guards' log with the account of the sessions; returns its head.
    pub(super) fn close(&self, sessions: Option<(SessionStats, u64)>) -> Option<Value> {
        self.witness.as_ref().map(|witness| witness.close(sessions))
    }

    /// Entries of the input journal that were written, and entries for which it had no room.
    pub(super) fn journal_counts(&self) -> Option<(u64, u64)> {
        self.journal.as_ref().map(Journal::counts)
    }
}

fn journal(spec: &ServiceSpec) -> Result<Journal> {
    let file = files::begin(&spec.journal())?;
    let header = Header { node: spec.node, boot: spec.boot, started: spec.started() };
    Writer::new(BufWriter::with_capacity(1 << 16, file), header, spec.journal_bytes)
}
