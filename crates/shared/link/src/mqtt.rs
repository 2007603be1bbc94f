//! The command plane's client: MQTT 5 over mutual TLS 1.3. Its other end, for an adversary in place of the broker, is
//! [`server`].
//!
//! A session that another connection takes over is not distinguished from a cut: MQTT 5 has a reason code for it (0x8E), but
//! mosquitto 2.0.11 sends none, and this client library waits for more of a DISCONNECT that ends with its reason code.
//! In both cases the session is lost, and the core gets that as an input.
//!
//! Clean start, QoS 1, Nagle off, one certificate per connection, client identifier = certificate name. The driver
//! never waits for it: both directions are bounded queues. QoS 1 can deliver twice, a broker can lose messages, and a publisher's
//! name is not authenticated; all three are left to the cores.

pub mod server;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rumqttc::mqttbytes::QoS;
use rumqttc::mqttbytes::v5::Packet;
use rumqttc::{AsyncClient, Event, EventLoop, MqttOptions, PublishOptions, SessionMode, TlsConfiguration, Transport};
use serde::Serialize;
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use wire::core::{Input, Subject};
use wire::id::PeerId;

use crate::certificates::list::Revocations;
use crate::certificates::tls;
use crate::clock::trace_us;
use crate::loopback::LoopbackAddr;
use crate::pki::{Credential, PkiError, dns_name};
use crate::stream::{Ingress, StreamLog, Witness};

/// Publications that may wait to be sent.
pub const OUTBOUND: usize = 256;

/// The largest payload, in bytes; the broker's limit is above it.
pub const MAX_PAYLOAD: usize = 8 * 1024;

/// Longest silence before the client pings the broker, in seconds.
pub const KEEP_ALIVE_S: u16 = 5;

/// First and longest pause between connection attempts. A session shorter than the longest pause does not reset the pause to the first:
/// two holders of one certificate would otherwise displace each other without end, at full speed.
pub const PAUSES: (Duration, Duration) = (Duration::from_millis(50), Duration::from_millis(800));

/// Counts of publications by outcome.
#[derive(Debug, Default)]
struct Counters {
    connected: AtomicU64,
    subscribed: AtomicU64,
    published: AtomicU64,
    lost: AtomicU64,
    received: AtomicU64,
    refused: AtomicU64,
    ended: AtomicU64,
}

/// A reading of the counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MqttStats {
    /// Connections the broker accepted.
    pub connected: u64,
    /// Subscriptions that the broker answered.
    pub subscribed: u64,
    /// Publications handed to the client library.
    pub published: u64,
    /// Publications lost: too long, or no room.
    pub lost: u64,
    /// Publications received on a known subject.
    pub received: u64,
    /// Publications received on another topic or too long.
    pub refused: u64,
    /// Sessions that the network or the broker ended.
    pub ended: u64,
}

/// A connection that stays open until this is dropped.
pub struct Mqtt {
    outbound: mpsc::Sender<(Subject, Vec<u8>)>,
    counters: Arc<Counters>,
    task: JoinHandle<()>,
}

impl Mqtt {
    /// Connects to the broker at `address` as `client` and subscribes to `subjects`; arrivals are noted in `log`. Must be
    /// called inside a tokio runtime.
    ///
    /// # Errors
    /// When the credential is unusable.
    pub fn start(
        address: LoopbackAddr,
        client: PeerId,
        broker: PeerId,
        (credential, revocations): (&Credential, &Revocations),
        subjects: Vec<Subject>,
        log: StreamLog,
        to: mpsc::Sender<Input>,
    ) -> Result<Self, PkiError> {
        let tls = tls::client(credential, broker, revocations)?;
        Ok(Self::with_tls(tls, address, (client, broker), subjects, log, to))
    }

    /// Connects as [`Mqtt::start`] with an existing TLS configuration. Must be called inside a tokio runtime.
    pub fn with_tls(
        tls: rustls::ClientConfig,
        address: LoopbackAddr,
        (client, broker): (PeerId, PeerId),
        subjects: Vec<Subject>,
        log: StreamLog,
        to: mpsc::Sender<Input>,
    ) -> Self {
        let latest = Latest::default();
        let options = options(address, client, broker, tls, log, latest.clone());
        let (client, events) = AsyncClient::builder(options).capacity(OUTBOUND).build();
        let (outbound, to_send) = mpsc::channel(OUTBOUND);
        let counters = Arc::new(Counters::default());
        let task = tokio::spawn(run(client, events, subjects, latest, to_send, to, counters.clone()));
        Self { outbound, counters, task }
    }

    /// Queues a publication, or loses it; both are counted.
    pub fn publish(&self, subject: Subject, bytes: Vec<u8>) {
        if bytes.len() > MAX_PAYLOAD || self.outbound.try_send((subject, bytes)).is_err() {
            self.counters.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The counters so far.
    pub fn stats(&self) -> MqttStats {
        let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        MqttStats {
            connected: get(&self.counters.connected),
            subscribed: get(&self.counters.subscribed),
            published: get(&self.counters.published),
            lost: get(&self.counters.lost),
            received: get(&self.counters.received),
            refused: get(&self.counters.refused),
            ended: get(&self.counters.ended),
        }
    }
}

impl Drop for Mqtt {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// The witness of the newest connection.
type Latest = Arc<Mutex<Option<Witness>>>;

fn options(
    address: LoopbackAddr,
    client: PeerId,
    broker: PeerId,
    tls: rustls::ClientConfig,
    log: StreamLog,
    latest: Latest,
) -> MqttOptions {
    crate::crypto::init();
    // The name is checked against the broker's certificate; the connector below never resolves it.
    let mut options = MqttOptions::new(client.to_string(), (dns_name(broker), address.port()));
    options.set_transport(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::new(tls))));
    options.set_session_mode(SessionMode::Clean);
    options.set_keep_alive(KEEP_ALIVE_S);
    options.set_max_packet_size(Some(16 * 1024));
    options.set_socket_connector(move |_, _| {
        let (log, latest) = (log.clone(), latest.clone());
        async move {
            let stream = TcpStream::connect(address.socket()).await?;
            LoopbackAddr::try_from(stream.peer_addr()?).map_err(std::io::Error::other)?;
            stream.set_nodelay(true)?;
            let ingress = Ingress::new(stream, log);
            *latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(ingress.witness());
            Ok(ingress)
        }
    });
    options
}

async fn run(
    client: AsyncClient,
    events: EventLoop,
    subjects: Vec<Subject>,
    latest: Latest,
    to_send: mpsc::Receiver<(Subject, Vec<u8>)>,
    to: mpsc::Sender<Input>,
    counters: Arc<Counters>,
) {
    // Two futures, so that a publication never cancels a connection attempt inside the event loop.
    tokio::select! {
        () = send(&client, to_send, &counters) => {}
        () = poll(&client, events, &subjects, &latest, &to, &counters) => {}
    }
}

async fn send(client: &AsyncClient, mut to_send: mpsc::Receiver<(Subject, Vec<u8>)>, counters: &Counters) {
    while let Some((subject, bytes)) = to_send.recv().await {
        match client.try_publish(subject.topic(), bytes, PublishOptions::new(QoS::AtLeastOnce)) {
            Ok(()) => add(&counters.published),
            Err(_) => add(&counters.lost),
        }
    }
}

async fn poll(
    client: &AsyncClient,
    mut events: EventLoop,
    subjects: &[Subject],
    latest: &Latest,
    to: &mpsc::Sender<Input>,
    counters: &Counters,
) {
    let (mut pause, mut connected_at) = (PAUSES.0, None);
    while !to.is_closed() {
        match events.poll().await {
            Ok(Event::Incoming(Packet::ConnAck(_))) => {
                add(&counters.connected);
                connected_at = Some(trace_us());
                // With every connection: after a clean start the broker has no subscription of the last session.
                for subject in subjects {
                    if let Err(error) = client.try_subscribe(subject.topic(), QoS::AtLeastOnce) {
                        tracing::warn!(%error, "subscription not sent");
                    }
                }
            }
            Ok(Event::Incoming(Packet::Publish(publication))) => {
                let subject = std::str::from_utf8(&publication.topic).ok().and_then(Subject::from_topic);
                match subject {
                    Some(subject) if publication.payload.len() <= MAX_PAYLOAD => {
                        add(&counters.received);
                        if let Some(witness) = &*latest.lock().unwrap_or_else(PoisonError::into_inner) {
                            witness.delivered(&publication.payload);
                        }
                        let input = Input::Published { subject, bytes: publication.payload.to_vec() };
                        if to.send(input).await.is_err() {
                            return;
                        }
                    }
                    Some(_) | None => add(&counters.refused),
                }
            }
            Ok(Event::Incoming(Packet::SubAck(_))) => add(&counters.subscribed),
            Ok(event) => tracing::trace!(?event, "mqtt"),
            Err(error) => {
                tracing::debug!(%error, "broker not reached");
                if let Some(witness) = &*latest.lock().unwrap_or_else(PoisonError::into_inner) {
                    witness.failed(&error);
                }
                if let Some(since) = connected_at.take() {
                    add(&counters.ended);
                    if to.send(Input::SessionLost).await.is_err() {
                        return;
                    }
                    if Duration::from_micros(trace_us().saturating_sub(since)) >= PAUSES.1 {
                        pause = PAUSES.0;
                    }
                }
                tokio::time::sleep(pause).await;
                pause = (pause * 2).min(PAUSES.1);
            }
        }
    }
}

fn add(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
