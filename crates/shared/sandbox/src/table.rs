//! The table of rights, `services.toml`.

use std::collections::BTreeMap;

use serde::Deserialize;

/// The table's text.
pub const TEXT: &str = include_str!("../services.toml");

/// Something that a service reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Read {
    /// A user's detector, its labels, and the runtime's library.
    Model,
    /// Folders of the machine's libraries.
    Libraries,
    /// Description of the CPU's caches.
    Processor,
    /// The kernel's counts of dropped datagrams.
    Counters,
}

/// Target that a service writes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Write {
    /// The file of its own inputs.
    Journal,
    /// The file of deliveries on its links.
    Witness,
    /// The folder of the recording.
    Recording,
}

/// A part in the collection of audit entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Log {
    /// Connects to the recorder's socket.
    Sends,
    /// Is the recorder.
    Receives,
}

/// A use of the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Network {
    /// Datagrams.
    Udp,
    /// Listens on TCP ports.
    TcpListens,
    /// Connects to TCP ports.
    TcpConnects,
}

/// Rights of one service.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServiceRights {
    /// Files and folders that are read.
    #[serde(default)]
    pub read: Vec<Read>,
    /// Files and folders that are written.
    #[serde(default)]
    pub write: Vec<Write>,
    /// True if the service takes part in its host's bus.
    #[serde(default)]
    pub bus: bool,
    /// Part in the audit log; none without one.
    #[serde(default)]
    pub log: Option<Log>,
    /// Uses of the network.
    #[serde(default)]
    pub network: Vec<Network>,
    /// Address space, MiB.
    pub memory_mib: u64,
    /// Open files.
    pub descriptors: u64,
    /// Size of a file, MiB.
    pub file_mib: u64,
}

/// The rows by service.
///
/// # Panics
/// Never: a test reads the table that is built in.
#[expect(clippy::expect_used, reason = "the text is part of the program")]
pub fn rows() -> BTreeMap<String, ServiceRights> {
    toml::from_str(TEXT).expect("the table of rights")
}

/// The row of `service`.
pub fn row(service: &str) -> Option<ServiceRights> {
    rows().remove(service)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_service_has_a_row() {
        let rows = rows();
        for service in ["sim", "perception", "autonomy", "gateway", "broker", "console", "recorder", "adversary"] {
            let row = &rows[service];
            assert!(row.log.is_some() && row.memory_mib > 0 && row.descriptors >= 64, "{service}: {row:?}");
        }
        assert!(rows["sim"].network.is_empty() && rows["perception"].network.is_empty());
        assert_eq!(rows["recorder"].log, Some(Log::Receives));
    }
}
