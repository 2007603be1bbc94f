//! The closed sets in which a scenario says what it is about: threats, interfaces, evidence, requirements, classes of objects.

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

/// Where an attack or fault enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Interface {
    /// DTLS between platform and gateway.
    TelemetryLink,
    /// What an admitted peer sends over it.
    TelemetryPeer,
    /// MQTT over TLS between gateway, broker and platform.
    CommandPlane,
    /// What the gateway tells the console, and the console asks of it.
    ConsoleFeed,
    /// The parser behind the gateway's boundary.
    GatewayParser,
    /// What the sensors give to perception.
    PerceptionInput,
    /// What perception gives to autonomy.
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

/// Where the evidence comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
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
        match self {
            Evidence::Model => "model",
            Evidence::Stack => "stack",
            Evidence::Live => "live",
        }
    }
}

/// What a scenario puts to the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Requirement {
    /// What is sensed is what is there.
    PerceptionIntegrity,
    /// What is received is from whom it says, fresh and once.
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

/// What an object is in truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// A vehicle.
    Vehicle,
    /// A person.
    Person,
    /// Something made to look like a vehicle.
    Decoy,
    /// Anything else in the way.
    Obstacle,
}
