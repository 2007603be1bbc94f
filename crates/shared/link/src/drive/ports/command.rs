//! The command part: a client of the command broker, or a core in the broker's place.

use tokio::sync::mpsc;
use wire::core::{Input, Subject};

use crate::certificates::list::Revocations;
use crate::drive::{DriveError, Opened, Senders};
use crate::mqtt::Mqtt;
use crate::mqtt::server::MqttServer;
use crate::spec::{MqttDial, ServiceSpec};
use crate::stream::StreamLog;

/// The process's end of the command plane.
pub(super) enum Command {
    Absent,
    Client(Client),
    Broker(MqttServer),
}

/// A client with its session, which it may open and close.
pub(super) struct Client {
    to: MqttDial,
    revocations: Revocations,
    log: StreamLog,
    inputs: mpsc::Sender<Input>,
    session: Option<Mqtt>,
}

impl Client {
    fn join(&mut self) -> Result<(), DriveError> {
        let Self { to, revocations, log, inputs, .. } = self;
        let trust = (&to.credential, &*revocations);
        let session =
            Mqtt::start(to.remote, to.own, to.expect, trust, to.subscribe.clone(), log.clone(), inputs.clone());
        self.session = Some(session.opened("mqtt")?);
        Ok(())
    }
}

impl Command {
    pub(super) fn open(spec: &ServiceSpec, log: StreamLog, senders: &Senders) -> Result<Self, DriveError> {
        let inputs = senders.inputs.clone();
        match (&spec.mqtt, &spec.broker) {
            (None, None) => Ok(Command::Absent),
            (None, Some(listen)) => MqttServer::start(listen, log, inputs).map(Command::Broker).opened("mqtt server"),
            (Some(to), None) => {
                let revocations = Revocations::from_credential(&to.credential).opened("revocation list")?;
                let mut client = Client { to: to.clone(), revocations, log, inputs, session: None };
                if !to.on_demand {
                    client.join()?;
                }
                Ok(Command::Client(client))
            }
            (Some(_), Some(_)) => Err("client and broker in one process").opened("mqtt"),
        }
    }

    pub(super) fn broker(&self) -> Option<&MqttServer> {
        match self {
            Command::Broker(broker) => Some(broker),
            Command::Client(_) | Command::Absent => None,
        }
    }

    /// The client's session.
    pub(super) fn session(&self) -> Option<&Mqtt> {
        match self {
            Command::Client(client) => client.session.as_ref(),
            Command::Broker(_) | Command::Absent => None,
        }
    }

    pub(super) fn publish(&self, subject: Subject, bytes: Vec<u8>) -> bool {
        let broker = self.broker().map(|broker| broker.publish(subject, &bytes));
        broker.or_else(|| self.session().map(|session| session.publish(subject, bytes))).is_some()
    }

    /// Opens a session, under the certificate of the process; false when it is no client.
    pub(super) fn join(&mut self) -> bool {
        let Command::Client(client) = self else { return false };
        if let Err(error) = client.join() {
            tracing::warn!(%error, "no session on the command plane");
        }
        true
    }

    /// Closes the session, if there is one.
    pub(super) fn leave(&mut self) {
        if let Command::Client(client) = self {
            client.session = None;
        }
    }
}
