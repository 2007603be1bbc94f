//! A test client: rumqttc with its event loop in a task, and the certificates of a test run.

use std::sync::Arc;

use link::certificates::list::Revocations;
use link::crypto;
use link::loopback::LoopbackAddr;
use link::mqtt::Mqtt;
use link::pki::{Authority, Credential, Role, dns_name};
use link::stream::StreamLog;
use rumqttc::{
    AsyncClient, Broker, ConnectReturnCode, ConnectionError, Event, EventLoop, LastWill, MqttOptions, Packet,
    PublishNoticeError, PublishOptions, QoS, SubscribeNoticeError, TlsConfiguration, Transport,
};
use rustls::client::WantsClientCert;
use rustls::pki_types::ServerName;
use rustls::version::{TLS12, TLS13};
use rustls::{ClientConfig, ConfigBuilder, SupportedProtocolVersion};
use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot};
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use wire::core::{Input, Subject};
use wire::id::PeerId;

/// The authority of a test run.
pub(crate) struct RunPki {
    authority: Authority,
}

impl RunPki {
    pub(crate) fn new() -> Self {
        crypto::init();
        Self { authority: Authority::new().expect("an authority can be made") }
    }

    /// The broker's own credential.
    pub(crate) fn broker(&self) -> Credential {
        self.issue("broker", Role::Listens)
    }

    /// TLS configuration with which `peer` dials.
    pub(crate) fn tls(&self, peer: PeerId) -> ClientConfig {
        self.tls_trusting(peer, self)
    }

    /// A certificate of this authority, shown to a server of another.
    pub(crate) fn tls_trusting(&self, peer: PeerId, other: &RunPki) -> ClientConfig {
        with_certificate(other.trust(&TLS13), &self.issue(&peer.to_string(), Role::Dials))
    }

    /// TLS configuration with which the holder of `credential` dials.
    pub(crate) fn tls_with(&self, credential: &Credential) -> ClientConfig {
        with_certificate(self.trust(&TLS13), credential)
    }

    /// The next revocation list.
    pub(crate) fn revoke(&self, credential: &Credential) -> Vec<u8> {
        self.authority.revoke(&[credential]).expect("a list can be made")
    }

    pub(crate) fn tls_1_2(&self, peer: PeerId) -> ClientConfig {
        with_certificate(self.trust(&TLS12), &self.issue(&peer.to_string(), Role::Dials))
    }

    pub(crate) fn tls_without_certificate(&self) -> ClientConfig {
        self.trust(&TLS13).with_no_client_auth()
    }

    /// A client of the broker at `address` under its own name.
    pub(crate) async fn connect(&self, address: LoopbackAddr, peer: PeerId) -> Client {
        Client::open(address, &peer.to_string(), self.tls(peer), None).await.expect("admitted")
    }

    /// The client of the services, as `peer`.
    pub(crate) fn serve(&self, address: LoopbackAddr, peer: PeerId, hears: Subject, to: mpsc::Sender<Input>) -> Mqtt {
        let credential = self.issue(&peer.to_string(), Role::Dials);
        let trust = (&credential, &Revocations::from_credential(&credential).expect("it carries a list"));
        Mqtt::start(address, peer, PeerId::BROKER, trust, vec![hears], StreamLog::none(), to)
            .expect("a usable credential")
    }

    pub(crate) fn issue(&self, name: &str, role: Role) -> Credential {
        let holder = PeerId::from_name(name).expect("a name of the closed set");
        self.authority.issue(holder, role).expect("a credential can be issued")
    }

    fn trust(&self, version: &'static SupportedProtocolVersion) -> ConfigBuilder<ClientConfig, WantsClientCert> {
        let roots = self.broker().roots().expect("the authority reads");
        ClientConfig::builder_with_provider(crypto::provider())
            .with_protocol_versions(&[version])
            .expect("ring has the suites")
            .with_root_certificates(roots)
    }
}

fn with_certificate(
    builder: ConfigBuilder<ClientConfig, WantsClientCert>,
    own_credential: &Credential,
) -> ClientConfig {
    builder.with_client_auth_cert(own_credential.chain(), own_credential.key()).expect("certificate and key fit")
}

/// A connected MQTT client. Dropping it drops the connection.
#[derive(Debug)]
pub(crate) struct Client {
    client: AsyncClient,
    inbox: mpsc::Receiver<(String, Vec<u8>)>,
    task: tokio::task::JoinHandle<()>,
}

impl Drop for Client {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Client {
    /// Connects, or gives CONNACK's answer; `None` when there was no CONNACK.
    pub(crate) async fn open(
        address: LoopbackAddr,
        client_id: &str,
        tls: ClientConfig,
        will: Option<LastWill>,
    ) -> Result<Client, Option<ConnectReturnCode>> {
        let name = dns_name(PeerId::from_name("broker").expect("a name of the closed set"));
        let mut options = MqttOptions::new(client_id, Broker::tcp(name, address.port()));
        options.set_transport(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::new(tls))));
        options.set_socket_connector(move |_, _| async move {
            let stream = TcpStream::connect(address.socket()).await?;
            stream.set_nodelay(true)?;
            Ok(stream)
        });
        if let Some(will) = will {
            options.set_last_will(will);
        }
        let (client, events) = AsyncClient::builder(options).capacity(16).build();
        let (connected, answer) = oneshot::channel();
        let (delivered, inbox) = mpsc::channel(64);
        let task = tokio::spawn(run(events, connected, delivered));
        let client = Client { client, inbox, task };
        answer.await.expect("the event loop answers").map(|()| client)
    }

    /// Publishes at QoS 1 and waits for PUBACK.
    pub(crate) async fn publish(&self, topic: &str, payload: &[u8]) -> Result<(), PublishNoticeError> {
        let options = PublishOptions::new(QoS::AtLeastOnce);
        let sent = self.client.publish_tracked(topic, payload.to_vec(), options).await;
        match sent {
            Ok(notice) => notice.wait_completion_async().await,
            Err(_) => Err(PublishNoticeError::Recv),
        }
    }

    /// Publishes at QoS 0, which has no answer.
    pub(crate) async fn publish_unacknowledged(&self, topic: &str, payload: &[u8]) {
        let options = PublishOptions::new(QoS::AtMostOnce);
        self.client.publish(topic, payload.to_vec(), options).await.expect("queued");
    }

    /// Subscribes and waits for SUBACK.
    pub(crate) async fn subscribe(&self, filter: &str) -> Result<(), SubscribeNoticeError> {
        let sent = self.client.subscribe_tracked(filter, QoS::AtLeastOnce).await;
        match sent {
            Ok(notice) => notice.wait_completion_async().await,
            Err(_) => Err(SubscribeNoticeError::Recv),
        }
    }

    /// The next publication that arrived.
    pub(crate) async fn received(&mut self) -> (String, Vec<u8>) {
        self.inbox.recv().await.expect("the session stands")
    }

    pub(crate) fn inbox_is_empty(&self) -> bool {
        self.inbox.is_empty()
    }
}

async fn run(
    mut events: EventLoop,
    connected: oneshot::Sender<Result<(), Option<ConnectReturnCode>>>,
    delivered: mpsc::Sender<(String, Vec<u8>)>,
) {
    let mut connected = Some(connected);
    loop {
        match events.poll().await {
            Ok(Event::Incoming(Packet::ConnAck(_))) => {
                let _ = connected.take().map(|connected| connected.send(Ok(())));
            }
            Ok(Event::Incoming(Packet::Publish(publish))) => {
                let topic = String::from_utf8_lossy(&publish.topic).into_owned();
                if delivered.send((topic, publish.payload.to_vec())).await.is_err() {
                    return;
                }
            }
            Ok(_) => {}
            Err(error) => {
                let code = if let ConnectionError::ConnectionRefused(code) = error { Some(code) } else { None };
                let _ = connected.take().map(|connected| connected.send(Err(code)));
                return;
            }
        }
    }
}

/// A TLS connection before its first byte of content.
pub(crate) async fn raw_tls(address: LoopbackAddr, tls: ClientConfig) -> TlsStream<TcpStream> {
    let name = dns_name(PeerId::from_name("broker").expect("a name of the closed set"));
    let stream = TcpStream::connect(address.socket()).await.expect("accepted");
    let name = ServerName::try_from(name).expect("a host name");
    TlsConnector::from(Arc::new(tls)).connect(name, stream).await.expect("a certificate of the run")
}

/// CONNECT with a clean start, no properties and no will, at a protocol level below 5.
pub(crate) fn open_session_bytes(level: u8, client_id: &str) -> Vec<u8> {
    let mut body = vec![0, 4, b'M', b'Q', b'T', b'T', level, 0b10, 0, 60];
    body.extend((client_id.len() as u16).to_be_bytes());
    body.extend(client_id.as_bytes());
    let mut packet = vec![0x10, body.len() as u8];
    packet.extend(body);
    packet
}
