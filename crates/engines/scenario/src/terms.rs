//! The closed sets that classify a scenario: threats, interfaces, evidence, requirements, classes of objects.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// STRIDE, by letter or in full.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stride {
    /// S.
    Spoofing,
    /// T.
    Tampering,
    /// R.
    Repudiation,
    /// I.
    InformationDisclosure,
    /// D.
    DenialOfService,
    /// E.
    ElevationOfPrivilege,
}

impl Stride {
    /// Its letter.
    pub fn letter(self) -> char {
        match self {
            Stride::Spoofing => 'S',
            Stride::Tampering => 'T',
            Stride::Repudiation => 'R',
            Stride::InformationDisclosure => 'I',
            Stride::DenialOfService => 'D',
            Stride::ElevationOfPrivilege => 'E',
        }
    }
}

/// Interface at which an attack or fault enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema, strum::IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Interface {
    /// DTLS between platform and gateway.
    TelemetryLink,
    /// Messages that an admitted peer sends over it.
    TelemetryPeer,
    /// MQTT over TLS between gateway, broker and platform.
    CommandPlane,
    /// Reports of the gateway to the console, and requests of the console to the gateway.
    ConsoleFeed,
    /// The parser behind the gateway's boundary.
    GatewayParser,
    /// Output of the sensors to perception.
    PerceptionInput,
    /// Output of perception to autonomy.
    PerceptionOutput,
    /// Localisation.
    Localisation,
    /// A process.
    Process,
    /// The host.
    Host,
    /// No interface: a control.
    Control,
}

impl Interface {
    /// The folders of shipped scenarios, in order.
    pub const FOLDERS: [&str; 8] =
        ["command", "console", "control", "host", "localisation", "perception", "process", "telemetry"];

    /// The folder that a shipped scenario on it lies in.
    pub fn folder(self) -> &'static str {
        match self {
            Interface::TelemetryLink | Interface::TelemetryPeer | Interface::GatewayParser => "telemetry",
            Interface::CommandPlane => "command",
            Interface::ConsoleFeed => "console",
            Interface::PerceptionInput | Interface::PerceptionOutput => "perception",
            Interface::Localisation => "localisation",
            Interface::Process => "process",
            Interface::Host => "host",
            Interface::Control => "control",
        }
    }
}

/// Source of the evidence.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema, strum::IntoStaticStr,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Evidence {
    /// The twin's link model.
    Model,
    /// Real DTLS, TLS or broker in memory, paused time.
    Stack,
    /// Processes and sockets.
    Live,
}

impl Evidence {
    /// Its name.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Requirement that a scenario puts to the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Requirement {
    /// The sensed world is the real one.
    PerceptionIntegrity,
    /// A received message is from its claimed origin, fresh and once.
    CommunicationTrust,
    /// Loss of trust is noticed and acted upon in time.
    RuntimeAssurance,
}

impl Requirement {
    /// Its name, in words.
    pub fn name(self) -> &'static str {
        match self {
            Requirement::PerceptionIntegrity => "perception integrity",
            Requirement::CommunicationTrust => "communication trust",
            Requirement::RuntimeAssurance => "runtime assurance",
        }
    }
}
