//! The command plane's other end, for a core in place of the broker: MQTT 5 over mutual TLS 1.3.
//!
//! It accepts every certificate of the run, acknowledges publications at QoS 1, hands them to the core, and sends the
//! core's publications to the clients that subscribed to exactly that subject. It has no rights, keeps no order but
//! arrival's, and keeps no message for absent clients: the honest broker is the `broker` crate, which shares no code with
//! this.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use bytes::BytesMut;
use rumqttc::mqttbytes::Error as Malformed;
use rumqttc::mqttbytes::QoS;
use rumqttc::mqttbytes::v5::{
    ConnAck, ConnectReturnCode, Packet, PubAck, Publish, SubAck, Subscribe, SubscribeReasonCode,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio::task::JoinHandle;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;
use wire::core::{Input, Subject};
use wire::id::{PeerId, SessionId};

use super::MAX_PAYLOAD;
use crate::loopback::LoopbackAddr;
use crate::pki::{self, Credential, PkiError};
use crate::spec::BrokerListen;
use crate::stream::{Ingress, StreamLog};

/// Connections at once, at most.
const CONNECTIONS: usize = 32;
/// Publications that may wait for one client; further ones are lost.
const OUTBOUND: usize = 64;
/// Time limit of a handshake.
const HANDSHAKE: Duration = Duration::from_secs(3);
/// The largest packet, bytes; above the largest payload.
const MAX_PACKET: u32 = 16 * 1024;

/// A client's session, by the number of its connection.
struct Client {
    subjects: Vec<Subject>,
    to: mpsc::Sender<(Subject, Vec<u8>)>,
}

type Clients = Arc<Mutex<BTreeMap<SessionId, Client>>>;

/// A listening end, until this is dropped.
pub struct MqttServer {
    local: LoopbackAddr,
    clients: Clients,
    task: JoinHandle<()>,
}

impl MqttServer {
    /// Listens at the address in `listen`; publications go to `to`, arrivals on the streams are noted in `log`. Must be called
    /// inside a tokio runtime.
    ///
    /// # Errors
    ///
    /// When the port cannot be bound or the credential is unusable.
    pub fn start(listen: &BrokerListen, log: StreamLog, to: mpsc::Sender<Input>) -> std::io::Result<Self> {
        let acceptor = acceptor(&listen.credential).map_err(std::io::Error::other)?;
        let listener = std::net::TcpListener::bind(listen.at.socket())?;
        listener.set_nonblocking(true)?;
        let listener = TcpListener::from_std(listener)?;
        let local = LoopbackAddr::try_from(listener.local_addr()?).map_err(std::io::Error::other)?;
        let clients = Clients::default();
        let task = tokio::spawn(accept(listener, acceptor, log, clients.clone(), to));
        Ok(Self { local, clients, task })
    }

    /// Listening address.
    pub fn local(&self) -> LoopbackAddr {
        self.local
    }

    /// Sends a publication to the clients that subscribed to `subject`.
    pub fn publish(&self, subject: Subject, bytes: &[u8]) {
        let clients = self.clients.lock().unwrap_or_else(PoisonError::into_inner);
        for client in clients.values().filter(|client| client.subjects.contains(&subject)) {
            if client.to.try_send((subject, bytes.to_vec())).is_err() {
                tracing::debug!(?subject, "a client that is gone or does not read");
            }
        }
    }
}

impl Drop for MqttServer {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// A TLS 1.3 server that requires a client certificate of the same authority.
fn acceptor(credential: &Credential) -> Result<TlsAcceptor, PkiError> {
    let roots = Arc::new(credential.roots()?);
    let verifier = rustls::server::WebPkiClientVerifier::builder_with_provider(roots, crate::crypto::provider());
    let verifier = verifier.build().map_err(|e| rustls::Error::General(e.to_string()))?;
    let config = rustls::ServerConfig::builder_with_provider(crate::crypto::provider())
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_client_cert_verifier(verifier)
        .with_single_cert(credential.chain(), credential.key())?;
    Ok(TlsAcceptor::from(Arc::new(config)))
}

async fn accept(
    listener: TcpListener,
    acceptor: TlsAcceptor,
    log: StreamLog,
    clients: Clients,
    to: mpsc::Sender<Input>,
) {
    let slots = Arc::new(Semaphore::new(CONNECTIONS));
    let numbers = AtomicU32::new(0);
    while !to.is_closed() {
        let Ok((stream, _)) = listener.accept().await else { continue };
        let Ok(slot) = slots.clone().try_acquire_owned() else { continue };
        let session = SessionId(numbers.fetch_add(1, Ordering::Relaxed).wrapping_add(1));
        let (acceptor, log, clients, to) = (acceptor.clone(), log.clone(), clients.clone(), to.clone());
        tokio::spawn(async move {
            if let Err(error) = serve(stream, &acceptor, log, session, &clients, &to).await {
                tracing::debug!(%error, ?session, "client ended");
            }
            if forget(&clients, session) && to.send(Input::Closed { session }).await.is_err() {
                tracing::trace!("the core is gone");
            }
            drop(slot);
        });
    }
}

fn forget(clients: &Clients, session: SessionId) -> bool {
    clients.lock().unwrap_or_else(PoisonError::into_inner).remove(&session).is_some()
}

/// Serves one connection to its end.
async fn serve(
    stream: TcpStream,
    acceptor: &TlsAcceptor,
    log: StreamLog,
    session: SessionId,
    clients: &Clients,
    to: &mpsc::Sender<Input>,
) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let ingress = Ingress::new(stream, log);
    let witness = ingress.witness();
    let accepted = tokio::time::timeout(HANDSHAKE, acceptor.accept(ingress)).await?;
    let stream = accepted.inspect_err(|error| witness.failed(error))?;
    let leaf = stream.get_ref().1.peer_certificates().and_then(<[_]>::first);
    let peer = leaf.map(|leaf| pki::peer_of(leaf)).transpose().map_err(std::io::Error::other)?;
    let peer = peer.ok_or_else(|| std::io::Error::other("no certificate"))?;
    let (send, outbound) = mpsc::channel(OUTBOUND);
    let mut talk = Talk { stream, session, peer, clients, to, send, inbox: BytesMut::new(), last: 0, reported: false };
    talk.run(outbound).await.inspect_err(|error| witness.failed(error))
}

/// One client's connection.
struct Talk<'a> {
    stream: TlsStream<Ingress<TcpStream>>,
    session: SessionId,
    peer: PeerId,
    clients: &'a Clients,
    to: &'a mpsc::Sender<Input>,
    send: mpsc::Sender<(Subject, Vec<u8>)>,
    inbox: BytesMut,
    /// Packet id of the last publication to the client.
    last: u16,
    /// True if the core knows of the session.
    reported: bool,
}

impl Talk<'_> {
    async fn run(&mut self, mut outbound: mpsc::Receiver<(Subject, Vec<u8>)>) -> std::io::Result<()> {
        loop {
            tokio::select! {
                read = self.stream.read_buf(&mut self.inbox) => {
                    if read? == 0 || !self.packets().await? {
                        return Ok(());
                    }
                }
                Some((subject, bytes)) = outbound.recv() => {
                    self.last = self.last.checked_add(1).unwrap_or(1);
                    let mut publish = Publish::new(subject.topic(), QoS::AtLeastOnce, bytes, None);
                    publish.pkid = self.last;
                    self.write(&Packet::Publish(publish)).await?;
                }
            }
        }
    }

    /// Handles every whole packet received; false when it was the last.
    async fn packets(&mut self) -> std::io::Result<bool> {
        loop {
            match Packet::read(&mut self.inbox, Some(MAX_PACKET)) {
                Ok(packet) => {
                    if !self.packet(packet).await? {
                        return Ok(false);
                    }
                }
                Err(Malformed::InsufficientBytes(_)) => return Ok(true),
                Err(error) => return Err(std::io::Error::other(error)),
            }
        }
    }

    async fn packet(&mut self, packet: Packet) -> std::io::Result<bool> {
        match packet {
            Packet::Connect(..) => {
                let code = ConnectReturnCode::Success;
                self.write(&Packet::ConnAck(ConnAck { session_present: false, code, properties: None })).await?;
            }
            Packet::Subscribe(subscribe) => self.subscribe(subscribe).await?,
            Packet::Publish(publish) => self.published(publish).await?,
            Packet::PingReq => self.write(&Packet::PingResp).await?,
            Packet::Disconnect(_) => return Ok(false),
            // Acknowledgements, and packets that no client of ours sends.
            Packet::Auth(_)
            | Packet::ConnAck(_)
            | Packet::PubAck(_)
            | Packet::PingResp
            | Packet::SubAck(_)
            | Packet::PubRec(_)
            | Packet::PubRel(_)
            | Packet::PubComp(_)
            | Packet::Unsubscribe(_)
            | Packet::UnsubAck(_) => {}
        }
        Ok(true)
    }

    async fn subscribe(&mut self, subscribe: Subscribe) -> std::io::Result<()> {
        let return_codes = vec![SubscribeReasonCode::Success(QoS::AtLeastOnce); subscribe.filters.len()];
        self.write(&Packet::SubAck(SubAck { pkid: subscribe.pkid, return_codes, properties: None })).await?;
        let subjects = subscribe.filters.iter().filter_map(|filter| Subject::from_topic(&filter.path));
        {
            let mut clients = self.clients.lock().unwrap_or_else(PoisonError::into_inner);
            let new = || Client { subjects: Vec::new(), to: self.send.clone() };
            let client = clients.entry(self.session).or_insert_with(new);
            client.subjects.extend(subjects);
            client.subjects.sort_unstable();
            client.subjects.dedup();
        }
        // Reported with the first subscription and not with CONNECT: before it, the core's publications would reach nobody.
        if !std::mem::replace(&mut self.reported, true) {
            self.notify_core(Input::Opened { session: self.session, peer: self.peer }).await?;
        }
        Ok(())
    }

    async fn published(&mut self, publish: Publish) -> std::io::Result<()> {
        if publish.qos == QoS::AtLeastOnce {
            self.write(&Packet::PubAck(PubAck::new(publish.pkid, None))).await?;
        }
        let subject = std::str::from_utf8(&publish.topic).ok().and_then(Subject::from_topic);
        match subject {
            Some(subject) if publish.payload.len() <= MAX_PAYLOAD => {
                self.notify_core(Input::Published { subject, bytes: publish.payload.to_vec() }).await
            }
            Some(_) | None => Ok(()),
        }
    }

    async fn notify_core(&self, input: Input) -> std::io::Result<()> {
        self.to.send(input).await.map_err(std::io::Error::other)
    }

    async fn write(&mut self, packet: &Packet) -> std::io::Result<()> {
        let mut bytes = BytesMut::new();
        packet.write(&mut bytes, None).map_err(std::io::Error::other)?;
        self.stream.write_all(&bytes).await?;
        self.stream.flush().await
    }
}

#[cfg(test)]
mod tests {
    use wire::id::UnitId;

    use super::*;
    use crate::mqtt::Mqtt;
    use crate::pki::{Authority, Role};

    /// A client's publication reaches the core, and the core's its subscriber.
    #[tokio::test]
    async fn publications_pass_between_clients_and_core() {
        crate::crypto::init();
        let authority = Authority::new().unwrap();
        let credential = |peer| authority.issue(peer, Role::Both).unwrap();
        let (core, mut heard) = mpsc::channel(16);
        let listen = BrokerListen { at: LoopbackAddr::ANY_PORT, credential: credential(PeerId::BROKER) };
        let server = MqttServer::start(&listen, StreamLog::none(), core).unwrap();
        let client = |peer: PeerId, subject, to| {
            let (address, credential) = (server.local(), credential(peer));
            let revocations = crate::certificates::list::Revocations::from_credential(&credential).unwrap();
            let trust = (&credential, &revocations);
            Mqtt::start(address, peer, PeerId::BROKER, trust, vec![subject], StreamLog::none(), to).unwrap()
        };
        let (command, ack) = (Subject::Command(UnitId::A), Subject::Ack(UnitId::A));
        let (to_unit, mut unit) = mpsc::channel(16);
        let (to_gateway, mut gateway) = mpsc::channel(16);
        let _unit = client(PeerId::UNIT_A, command, to_unit);
        assert!(matches!(heard.recv().await, Some(Input::Opened { peer: PeerId::UNIT_A, .. })));
        let from_gateway = client(PeerId::GATEWAY, ack, to_gateway);
        assert!(matches!(heard.recv().await, Some(Input::Opened { peer: PeerId::GATEWAY, .. })));

        from_gateway.publish(command, b"order".to_vec());
        let published = Input::Published { subject: command, bytes: b"order".to_vec() };
        assert_eq!(heard.recv().await, Some(published.clone()));
        server.publish(command, b"another");
        server.publish(command, b"order");
        let second = Input::Published { subject: command, bytes: b"another".to_vec() };
        assert_eq!([unit.recv().await, unit.recv().await], [Some(second), Some(published)]);
        assert!(gateway.try_recv().is_err(), "what it publishes goes to those who subscribed, and to no one else");

        drop(from_gateway);
        assert!(matches!(heard.recv().await, Some(Input::Closed { .. })));
    }
}
