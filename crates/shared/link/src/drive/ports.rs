//! The ports of a process, composed of the parts that its specification names.
//!
//! A part is one kind of link; it knows its own links and no others. The assignment of outputs to parts is here and
//! nowhere else.

mod audit;
mod command;
mod guest;
mod logs;
mod memory;
mod relay;
mod telemetry;

use serde_json::{Value, json};
use wire::core::{Output, Topic};

use self::audit::Audit;
use self::command::Command;
use self::guest::Guest;
use self::logs::Logs;
use self::memory::Memory;
use self::relay::Relay;
use self::telemetry::Telemetry;
use super::{Attendant, DriveError, Senders, print_line};
use crate::sockets::kernel_drops;
use crate::spec::ServiceSpec;

/// Every link of the process, and the logs of its traffic.
pub(super) struct Ports {
    pub(super) logs: Logs,
    memory: Memory,
    pub(super) telemetry: Telemetry,
    command: Command,
    relay: Relay,
    pub(super) audit: Audit,
    guest: Guest,
    undeliverable: u64,
}

impl Ports {
    /// Opens every link of the specification.
    pub(super) fn open(
        spec: &ServiceSpec,
        senders: &Senders,
        attendant: Option<Attendant>,
    ) -> Result<Self, DriveError> {
        let logs = Logs::open(spec)?;
        Ok(Self {
            audit: Audit::open(spec, senders)?,
            memory: Memory::open(spec, senders)?,
            telemetry: Telemetry::open(spec, senders)?,
            command: Command::open(spec, logs.streams(), senders)?,
            relay: Relay::open(spec, senders)?,
            guest: Guest::open(attendant, senders),
            logs,
            undeliverable: 0,
        })
    }

    /// The `ready` line: the addresses that were bound.
    pub(super) fn ready(&self, spec: &ServiceSpec) -> Value {
        json!({
            "node": spec.node,
            "confinement": spec.level(),
            "pid": std::process::id(),
            "dtls": self.telemetry.local(),
            "relay_datagram": self.relay.datagrams().map(|relay| relay.local()),
            "relay_stream": self.relay.streams().map(|relay| relay.local()),
            "mqtt": self.command.broker().map(|broker| broker.local()),
        })
    }

    /// Carries outputs out after they are on file: a killed process leaves no act without an entry. No step waits.
    pub(super) fn carry_out(&mut self, outputs: Vec<Output>) {
        outputs.iter().for_each(|output| self.logs.output(output));
        self.logs.flush();
        outputs.into_iter().for_each(|output| self.carry_out_one(output));
    }

    fn carry_out_one(&mut self, output: Output) {
        let carried = match output {
            // A seal goes out only after the entries that it seals were handed to the operating system.
            Output::Bus { topic: Topic::Seals, .. } if self.audit.recording().is_some_and(|r| !r.flush()) => false,
            Output::Record { session, bytes } => self.telemetry.send(session, bytes),
            Output::Publish { subject, bytes } => self.command.publish(subject, bytes),
            Output::Join => self.command.join(),
            Output::Datagram { side, bytes } => self.relay.datagrams().map(|relay| relay.emit(side, &bytes)).is_some(),
            Output::Stranger { bytes } => {
                self.relay.datagrams().map(|relay| relay.emit_from_unknown_peer(&bytes)).is_some()
            }
            Output::Stream { connection, side, bytes } => {
                self.relay.streams().map(|relay| relay.emit(connection, side, bytes)).is_some()
            }
            Output::Reset { connection } => self.relay.streams().map(|relay| relay.reset(connection)).is_some(),
            Output::Audit { bytes } => self.audit.write(bytes),
            Output::Guest { bytes } => self.guest.request(bytes),
            // The memory part counts its losses itself.
            Output::Bus { topic, bytes } => return self.memory.publish(topic, &bytes),
            // A session that is over already needs no closing, which is no loss.
            Output::Close { session } => return self.telemetry.close(session),
            Output::Leave => return self.command.leave(),
            Output::Text { text, .. } => return print_line("text", &json!(text)),
        };
        self.undeliverable += u64::from(!carried);
    }

    /// Flushes everything and returns the closing account of the links.
    pub(super) fn finish(&mut self) -> Value {
        self.logs.flush();
        let (recording, instrument) = self.audit.finish();
        let sessions = self.telemetry.account();
        json!({
            "dtls": sessions.map(|(stats, _)| stats),
            "dtls_kernel_drops": sessions.map(|(_, dropped)| dropped),
            "mqtt": self.command.session().map(|session| session.stats()),
            "bus_published_failed": self.memory.published(),
            "bus_received": self.memory.received(),
            "relay_datagram": self.relay.datagrams().map(|relay| relay.stats()),
            "relay_datagram_kernel_drops": self.relay.datagrams().and_then(|relay| kernel_drops(relay.local())),
            "relay_stream": self.relay.streams().map(|relay| relay.stats()),
            "instrument": instrument,
            "recording": recording,
            "head": self.audit.head(),
            "witness": self.logs.close(sessions),
            "mouth_entries_dropped": self.logs.journal_counts(),
            "undeliverable": self.undeliverable,
        })
    }
}
