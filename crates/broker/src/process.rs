//! The process around the live broker: a service spec in, a `ready` line out, audit entries to the recorder.
//!
//! It ends when the launcher says `finish`, or at once when the launcher's end of the pipe is gone. Serving is
//! [`crate::server`]; the names of events in the audit log are [`crate::audit`].

use std::collections::VecDeque;
use std::io;
use std::process::ExitCode;
use std::time::Duration;

use link::clock::{HostClock, trace_us};
use link::drive::print_line;
use link::instrument::{Frame, Instrument};
use link::spec::{Control, ServiceSpec, SpecError, watch};
use link::stream::StreamLog;
use link::witness::WitnessLog;
use serde::{Deserialize, Serialize};
use serde_json::json;
use thiserror::Error;
use wire::audit::Journal;
use wire::core::Output;
use wire::event::Event as Audited;
use wire::id::NodeId;
use wire::policy::Requirement;
use wire::sign::Key;
use wire::sign::Secret;

use crate::audit::audited;
use crate::gate::Event;
use crate::server::{Server, ServerLimits, StartError};

/// Longest time that the runtime may take to end remaining tasks.
const RUNTIME_LIMIT: Duration = Duration::from_millis(200);

/// The broker's own part of its service spec.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The key that signs the broker's audit chain; without one the chain is not signed.
    #[serde(default)]
    pub secret: Option<Secret>,
    /// State of the table of rights.
    #[serde(default)]
    pub rights: Requirement,
}

/// Reason that the process did not serve.
#[derive(Debug, Error)]
pub enum ProcessError {
    /// The specification cannot be read.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The specification has no `broker` part.
    #[error("expected a specification of a broker, got one without a `broker` part")]
    NotBroker,
    /// The `config` part does not parse.
    #[error("broker config does not parse: {0}")]
    Config(#[from] serde_json::Error),
    /// The runtime or the watch on standard input failed.
    #[error("process: {0}")]
    Io(#[from] io::Error),
    /// The server did not start.
    #[error(transparent)]
    Start(#[from] StartError),
}

/// The whole process, from standard input to exit status.
pub fn main() -> ExitCode {
    match link::confined::from_stdin("broker").map_err(ProcessError::from).and_then(|spec| run(&spec)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => link::drive::refuse("broker", &why.to_string()),
    }
}

fn run(spec: &ServiceSpec) -> Result<(), ProcessError> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    let outcome = runtime.block_on(serve(spec));
    runtime.shutdown_timeout(RUNTIME_LIMIT);
    outcome
}

async fn serve(spec: &ServiceSpec) -> Result<(), ProcessError> {
    let listen = spec.broker.as_ref().ok_or(ProcessError::NotBroker)?;
    let config = Option::<Config>::deserialize(&spec.config)?.unwrap_or_default();
    let limits = ServerLimits { rights: config.rights, ..ServerLimits::default() };
    let mut log = Log::open(spec, config)?;
    let mut controls = watch()?;
    let witness = WitnessLog::create(spec)?;
    let streams = StreamLog::from_witness(witness.as_ref());
    let mut server = Server::start(listen.at, &listen.credential, limits, streams).await?;
    let address = server.address();
    print_line(
        "ready",
        &json!({ "node": spec.node, "confinement": spec.level(), "pid": std::process::id(), "mqtt": address, "port": address.port() }),
    );
    loop {
        tokio::select! {
            event = server.event() => match event {
                Some(event) => log.note(&event),
                None => break,
            },
            control = controls.recv() => match control {
                // What the services still send is carried to the end; steps, acts and the host are not its business.
                Some(Control::Quiesce | Control::Cue(_) | Control::Act(_) | Control::HostWait(_)) => {}
                Some(Control::Finish) | None => break,
            },
        }
    }
    server.stop().await;
    while let Some(event) = server.event().await {
        log.note(&event);
    }
    log.finish(server.lost_events(), witness.as_ref());
    Ok(())
}

/// The broker's audit chain and its way to the recorder.
struct Log {
    node: NodeId,
    clock: HostClock,
    journal: Journal,
    instrument: Option<Instrument>,
    last_entry: Vec<u8>,
}

impl Log {
    fn open(spec: &ServiceSpec, config: Config) -> Result<Self, ProcessError> {
        let key = config.secret.map(|secret| Key::from_bytes(&secret.0));
        let instrument = spec.instrument.clone().map(Instrument::start).transpose()?;
        let journal = Journal::new(spec.node, spec.boot, key);
        let mut log = Self { node: spec.node, clock: spec.clock, journal, instrument, last_entry: Vec::new() };
        log.write(Audited::Started);
        Ok(log)
    }

    fn note(&mut self, event: &Event) {
        tracing::debug!(?event, "broker");
        self.write(audited(event));
    }

    fn write(&mut self, event: Audited) {
        let mut entries = VecDeque::new();
        self.journal.write(self.clock.now(), event, &mut entries);
        self.send(entries);
    }

    fn send(&mut self, entries: VecDeque<Output>) {
        let Some(instrument) = &mut self.instrument else { return };
        for entry in entries {
            if let Output::Audit { bytes } = entry {
                self.last_entry.clone_from(&bytes);
                instrument.push(Frame { trace_us: trace_us(), node: self.node, bytes });
            }
        }
    }

    fn finish(mut self, lost_events: u64, witness: Option<&WitnessLog>) {
        let mut entries = VecDeque::new();
        self.journal.sign(self.clock.now(), &mut entries);
        self.send(entries);
        let links = json!({
            "instrument": self.instrument.as_mut().map(Instrument::finish),
            "head": link::instrument::head(&self.last_entry),
            "witness": witness.map(|witness| witness.close(None)),
        });
        print_line("stats", &json!({ "node": self.node, "lost_events": lost_events, "links": links }));
    }
}
