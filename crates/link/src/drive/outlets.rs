//! Where a core's outputs go, and the logs kept on the way.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Duration;

use serde_json::{Value, json};
use tokio::sync::mpsc;
use wire::core::{Input, Output, Topic};
use wire::id::{NodeId, SessionId};
use wire::time::Instant;

use super::{DriveError, Senders, cannot, say};
use crate::bus::{Domain, Publisher, Subscription};
use crate::clock::trace_us;
use crate::dtls::dial::{Dialler, dial};
use crate::dtls::listen::{Listener, listen};
use crate::dtls::session::{SessionCounters, Settings};
use crate::dtls::{DIAL_IDLE, LISTEN_IDLE, SessionHandle};
use crate::files;
use crate::guard::observe::Observation;
use crate::instrument::{self, Frame, Instrument};
use crate::mouth;
use crate::mqtt::Mqtt;
use crate::mqtt::server::MqttServer;
use crate::pki::{Credential, PkiError};
use crate::recorder::Recording;
use crate::relay::{DatagramRelay, StreamRelay};
use crate::sockets::kernel_drops;
use crate::spec::{MqttDial, ServiceSpec};
use crate::stream::StreamLog;
use crate::vet::list::Revocations;
use crate::witness::WitnessLog;

/// Every link of the process, by what the core may ask of it.
pub(super) struct Outlets {
    node: NodeId,
    mouth: Option<mouth::Writer<BufWriter<File>>>,
    /// What stands at the mouth of its sessions and streams.
    witness: Option<WitnessLog>,
    publishers: Vec<Publisher>,
    published: BTreeMap<Topic, [u64; 2]>,
    subscriptions: Vec<(Topic, Subscription)>,
    sessions: BTreeMap<SessionId, SessionHandle>,
    dtls: Option<Arc<SessionCounters>>,
    listener: Option<Listener>,
    dialler: Option<Dialler>,
    mqtt: Option<Mqtt>,
    /// What it takes to be a client of the command broker.
    plane: Option<Plane>,
    broker: Option<MqttServer>,
    datagrams: Option<DatagramRelay>,
    streams: Option<StreamRelay>,
    instrument: Option<Instrument>,
    recording: Option<Recording>,
    /// The last audit entry: what this process itself says of how far its chain went.
    last_entry: Vec<u8>,
    /// Whether buffered logs could not be handed over the last time.
    unflushed: bool,
    undeliverable: u64,
}

/// What it takes to be a client of the command broker.
struct Plane {
    to: MqttDial,
    revocations: Revocations,
    log: StreamLog,
    inputs: mpsc::Sender<Input>,
}

impl Plane {
    fn start(&self) -> Result<Mqtt, PkiError> {
        let Self { to, revocations, log, inputs } = self;
        let trust = (&to.credential, revocations);
        Mqtt::start(to.remote, to.own, to.expect, trust, to.subscribe.clone(), log.clone(), inputs.clone())
    }
}

impl Outlets {
    /// Opens every link of the specification.
    pub(super) fn open(spec: &ServiceSpec, senders: &Senders) -> Result<Self, DriveError> {
        let mut this = Self {
            node: spec.node,
            mouth: open_mouth(spec)?,
            witness: WitnessLog::create(spec).map_err(|e| cannot("guard's log")(&e))?,
            publishers: Vec::new(),
            published: BTreeMap::new(),
            subscriptions: Vec::new(),
            sessions: BTreeMap::new(),
            dtls: None,
            listener: None,
            dialler: None,
            mqtt: None,
            plane: None,
            broker: None,
            datagrams: None,
            streams: None,
            instrument: None,
            recording: None,
            last_entry: Vec::new(),
            unflushed: false,
            undeliverable: 0,
        };
        this.open_instruments(spec, senders)?;
        this.open_bus(spec, senders)?;
        this.open_sessions(spec, senders)?;
        this.open_relay(spec, senders)?;
        Ok(this)
    }

    fn open_instruments(&mut self, spec: &ServiceSpec, senders: &Senders) -> Result<(), DriveError> {
        if let Some(recorder) = &spec.recorder {
            instrument::serve(&recorder.socket, senders.frames.clone()).map_err(|e| cannot("recorder socket")(&e))?;
            self.recording = Some(Recording::new(recorder.directory.clone()));
        }
        if let Some(socket) = &spec.instrument {
            self.instrument = Some(Instrument::start(socket.clone()).map_err(|e| cannot("instrument")(&e))?);
        }
        Ok(())
    }

    fn open_bus(&mut self, spec: &ServiceSpec, senders: &Senders) -> Result<(), DriveError> {
        for bus in &spec.bus {
            let domain = Domain::new(&bus.root, &bus.prefix).map_err(|e| cannot("bus")(&e))?;
            let domain = domain.with_publishers(bus.publishers);
            for channel in &bus.publish {
                let publisher = domain.publisher(&channel.scope, channel.topic);
                self.publishers.push(publisher.map_err(|e| cannot("bus publisher")(&e))?);
                self.published.insert(channel.topic, [0, 0]);
            }
            for channel in &bus.subscribe {
                let subscription = domain.subscribe(&channel.scope, channel.topic, senders.inputs.clone());
                self.subscriptions.push((channel.topic, subscription.map_err(|e| cannot("bus subscription")(&e))?));
            }
        }
        Ok(())
    }

    fn open_sessions(&mut self, spec: &ServiceSpec, senders: &Senders) -> Result<(), DriveError> {
        let handles = Arc::new(AtomicU32::new(0));
        let counters = Arc::new(SessionCounters::default());
        let held = |credential: &Credential| Revocations::of(credential).map_err(|e| cannot("revocation list")(&e));
        let settings = |idle: Duration, credential: &Credential| -> Result<Settings, DriveError> {
            Ok(Settings {
                log: Some(senders.observations.clone()),
                sessions: handles.clone(),
                counters: counters.clone(),
                own: spec.own,
                ..Settings::new(spec.guard, idle, held(credential)?)
            })
        };
        if let Some(to) = &spec.listen {
            let sessions = senders.sessions.clone();
            let listener = listen(to.at, to.credential.clone(), settings(LISTEN_IDLE, &to.credential)?, sessions);
            self.listener = Some(listener.map_err(|e| cannot("dtls listener")(&e))?);
        }
        if let Some(to) = &spec.dial {
            let sessions = senders.sessions.clone();
            let settings = settings(DIAL_IDLE, &to.credential)?;
            self.dialler = Some(dial(to.remote, to.credential.clone(), to.expect, settings, sessions));
        }
        if spec.listen.is_some() || spec.dial.is_some() {
            self.dtls = Some(counters.clone());
        }
        if let Some(to) = &spec.mqtt {
            let (inputs, revocations) = (senders.inputs.clone(), held(&to.credential)?);
            let log = StreamLog::of(self.witness.as_ref());
            let plane = Plane { to: to.clone(), revocations, log, inputs };
            if !to.on_demand {
                self.mqtt = Some(plane.start().map_err(|e| cannot("mqtt")(&e))?);
            }
            self.plane = Some(plane);
        }
        if let Some(listen) = &spec.broker {
            let log = StreamLog::of(self.witness.as_ref());
            let broker = MqttServer::start(listen, log, senders.inputs.clone());
            self.broker = Some(broker.map_err(|e| cannot("mqtt server")(&e))?);
        }
        Ok(())
    }

    fn open_relay(&mut self, spec: &ServiceSpec, senders: &Senders) -> Result<(), DriveError> {
        let Some(relay) = &spec.relay else { return Ok(()) };
        if let Some(leg) = relay.datagram {
            let opened = DatagramRelay::open(leg, spec.own, senders.relayed.clone());
            self.datagrams = Some(opened.map_err(|e| cannot("datagram relay")(&e))?);
        }
        if let Some(leg) = relay.stream {
            let opened = StreamRelay::open(leg, senders.relayed.clone());
            self.streams = Some(opened.map_err(|e| cannot("stream relay")(&e))?);
        }
        Ok(())
    }

    /// What the `ready` line says: the addresses that were bound.
    pub(super) fn ready(&self, node: NodeId) -> Value {
        json!({
            "node": node,
            "pid": std::process::id(),
            "dtls": self.listener.as_ref().map(Listener::local),
            "relay_datagram": self.datagrams.as_ref().map(DatagramRelay::local),
            "relay_stream": self.streams.as_ref().map(StreamRelay::local),
            "mqtt": self.broker.as_ref().map(MqttServer::local),
        })
    }

    pub(super) fn opened(&mut self, handle: SessionHandle) {
        self.sessions.insert(handle.session, handle);
    }

    pub(super) fn closed(&mut self, session: SessionId) {
        self.sessions.remove(&session);
    }

    /// Writes an audit frame to the recording, or lets it wait there.
    pub(super) fn record(&mut self, frame: Frame) {
        if let Some(recording) = &mut self.recording {
            recording.receive(frame);
        }
    }

    /// The next audit entry that has come into the recording.
    pub(super) fn recorded(&mut self) -> Option<Vec<u8>> {
        self.recording.as_mut()?.written()
    }

    pub(super) fn note_input(&mut self, now: Instant, input: &Input) {
        if let Some(mouth) = &mut self.mouth
            && let Err(error) = mouth.input(now, input)
        {
            tracing::warn!(%error, "mouth log ended");
            self.mouth = None;
        }
    }

    pub(super) fn observed(&self, observation: &Observation) {
        if let Some(witness) = &self.witness {
            witness.observed(observation);
        }
    }

    /// Notes an output and carries it out. Nothing here waits.
    pub(super) fn carry_out(&mut self, output: Output) {
        if let Some(mouth) = &mut self.mouth
            && let Err(error) = mouth.output(&output)
        {
            tracing::warn!(%error, "mouth log ended");
            self.mouth = None;
        }
        match output {
            Output::Bus { topic, bytes } => self.publish(topic, &bytes),
            Output::Record { session, bytes } => match self.sessions.get(&session) {
                Some(handle) => {
                    handle.send(bytes);
                }
                None => self.undeliverable += 1,
            },
            Output::Publish { subject, bytes } => match (&self.mqtt, &self.broker) {
                (Some(mqtt), _) => mqtt.publish(subject, bytes),
                (None, Some(broker)) => broker.publish(subject, &bytes),
                (None, None) => self.undeliverable += 1,
            },
            Output::Datagram { side, bytes } => match &self.datagrams {
                Some(relay) => relay.emit(side, &bytes),
                None => self.undeliverable += 1,
            },
            Output::Stream { connection, side, bytes } => match &self.streams {
                Some(relay) => relay.emit(connection, side, bytes),
                None => self.undeliverable += 1,
            },
            Output::Reset { connection } => match &self.streams {
                Some(relay) => relay.reset(connection),
                None => self.undeliverable += 1,
            },
            // Without its sending end a session ends; its dialler opens the next.
            Output::Close { session } => self.closed(session),
            Output::Audit { bytes } => self.audit(bytes),
            Output::Join => self.join(),
            Output::Leave => self.mqtt = None,
            Output::Stranger { bytes } => match &self.datagrams {
                Some(relay) => relay.emit_stranger(&bytes),
                None => self.undeliverable += 1,
            },
            // Whoever follows the log is to have it now: what is shown ages.
            Output::Text { text, .. } => {
                self.flush();
                say("text", &json!(text));
            }
        }
    }

    fn join(&mut self) {
        match self.plane.as_ref().map(Plane::start) {
            Some(Ok(mqtt)) => self.mqtt = Some(mqtt),
            Some(Err(error)) => tracing::warn!(%error, "no session on the command plane"),
            None => self.undeliverable += 1,
        }
    }

    fn publish(&mut self, topic: Topic, bytes: &[u8]) {
        // A seal goes out only when what it seals has been handed to the operating system.
        if topic == Topic::Seals
            && let Some(recording) = &mut self.recording
            && !recording.flush()
        {
            self.undeliverable += 1;
            return;
        }
        let counts = self.published.entry(topic).or_default();
        for publisher in self.publishers.iter().filter(|p| p.topic() == topic) {
            match publisher.publish(bytes) {
                Ok(()) => counts[0] += 1,
                Err(error) => {
                    tracing::debug!(%error, "bus message not sent");
                    counts[1] += 1;
                }
            }
        }
    }

    fn audit(&mut self, bytes: Vec<u8>) {
        self.last_entry.clone_from(&bytes);
        let frame = Frame { trace_us: trace_us(), node: self.node, bytes };
        if let Some(recording) = &mut self.recording {
            recording.write(frame);
        } else if let Some(instrument) = &mut self.instrument {
            instrument.push(frame);
        } else {
            self.undeliverable += 1;
        }
    }

    /// Hands buffered logs to the operating system.
    pub(super) fn flush(&mut self) {
        let mouth = self.mouth.as_mut().map_or(Ok(()), mouth::Writer::flush);
        let witness = self.witness.as_ref().map_or(Ok(()), WitnessLog::flush);
        let flushed = mouth.and(witness);
        let failed = std::mem::replace(&mut self.unflushed, flushed.is_err());
        // Told once: a full disk says the same ten times a second.
        if let Err(error) = flushed
            && !failed
        {
            tracing::warn!(%error, "logs not flushed");
        }
    }

    /// Datagrams that the kernel dropped at the sockets of this process's sessions.
    fn kernel_drops(&self) -> Option<u64> {
        let listener = self.listener.as_ref().map(|l| kernel_drops(l.local()).unwrap_or(0));
        let dialler = self.dialler.as_ref().map(Dialler::kernel_drops);
        [listener, dialler].into_iter().flatten().reduce(|a, b| a + b)
    }

    /// Stops dialling, so that the closing account is the last word on what was sent.
    pub(super) async fn hang_up(&mut self) {
        if let Some(dialler) = &mut self.dialler {
            dialler.stop().await;
        }
    }

    /// Flushes everything and gives the closing account of the links.
    pub(super) fn finish(&mut self) -> Value {
        self.flush();
        let instrument = self.instrument.as_mut().map(Instrument::finish);
        let recording = self.recording.as_mut().map(Recording::finish);
        let bus: BTreeMap<&str, &[u64; 2]> = self.published.iter().map(|(t, counts)| (t.name(), counts)).collect();
        let received: Vec<(&str, u64)> = self.subscriptions.iter().map(|(t, s)| (t.name(), s.received())).collect();
        let (dtls, dropped) = (self.dtls.as_ref().map(|counters| counters.read()), self.kernel_drops());
        let sessions = dtls.map(|stats| (stats, dropped.unwrap_or(0)));
        json!({
            "dtls": dtls,
            "dtls_kernel_drops": dropped,
            "mqtt": self.mqtt.as_ref().map(Mqtt::stats),
            "bus_published_failed": bus,
            "bus_received": received,
            "relay_datagram": self.datagrams.as_ref().map(DatagramRelay::stats),
            "relay_datagram_kernel_drops": self.datagrams.as_ref().map(|r| kernel_drops(r.local())),
            "relay_stream": self.streams.as_ref().map(StreamRelay::stats),
            "instrument": instrument,
            "recording": recording,
            "head": instrument::head(&self.last_entry),
            "witness": self.witness.as_ref().map(|witness| witness.close(sessions)),
            "mouth_entries_dropped": self.mouth.as_ref().map(mouth::Writer::counts),
            "undeliverable": self.undeliverable,
        })
    }
}

fn open_mouth(spec: &ServiceSpec) -> Result<Option<mouth::Writer<BufWriter<File>>>, DriveError> {
    if spec.mouth_bytes == 0 {
        return Ok(None);
    }
    let file = files::create(&spec.run_dir.join("mouth").join(spec.log_name())).map_err(|e| cannot("mouth log")(&e))?;
    let header = mouth::Header { node: spec.node, boot: spec.boot, started: spec.started() };
    let writer = mouth::Writer::new(BufWriter::with_capacity(1 << 16, file), header, spec.mouth_bytes);
    Ok(Some(writer.map_err(|e| cannot("mouth log")(&e))?))
}
