//! The modelled hosts of a run as namespaces, and the level of confinement that its services reach.
//!
//! Each host is a process ([`sandbox::host`]) that its services find by its number; it ends with the run. Where the machine refuses
//! namespaces, services run without them, and report it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use link::loopback::LoopbackAddr;
use sandbox::Level;
use sandbox::host::{HostSpec, SHARED_KIB};
use sandbox::wire::Station;
use serde::{Deserialize, Serialize};
use topology::Host;
use wire::id::NodeId;

use super::child::{Child, Line, Services, StartError};

/// Time limit for a host's namespaces.
const READY: Duration = Duration::from_secs(10);

/// Reason for which there are no namespaces, or no level of confinement is known.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// A process cannot be started.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A specification or a level is no JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// The process refused, for this reason.
    #[error("{0}")]
    Refused(String),
    /// The process that tries a service's confinement ended without an answer.
    #[error("the process that tries it ended: {0}")]
    ProbeEnded(ExitStatus),
    /// A host's process ended without an answer.
    #[error("the host's process ended")]
    Ended,
    /// A host's process gave no answer in time.
    #[error("no namespaces within {} s", READY.as_secs())]
    Late,
}

/// Levels of confinement that a run's services reached.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Levels(BTreeMap<String, Level>);

impl Levels {
    /// Notes the level of a service's start.
    pub(crate) fn note(&mut self, node: NodeId, level: Level) {
        self.0.insert(node.to_string(), level);
    }

    /// The lowest level, with the reasons of all.
    pub fn summary(&self) -> String {
        let names: Vec<&str> = self.0.values().map(Level::name).collect();
        let name = ["none", "partial", "full"].into_iter().find(|name| names.contains(name)).unwrap_or("none");
        let mut reasons: Vec<&str> = self.0.values().flat_map(|level| &level.why).map(String::as_str).collect();
        reasons.sort_unstable();
        reasons.dedup();
        if reasons.is_empty() { name.to_owned() } else { format!("{name} ({})", reasons.join("; ")) }
    }
}

/// The level that services reach on this machine, found by trying.
///
/// # Errors
/// No service can be confined, and none would start.
pub fn level(services: &Services) -> Result<Level, HostError> {
    let hosts = Hosts::start(services, vec![(Host::Control, Vec::new())], false, SHARED_KIB);
    let mut command = services.command("level");
    command.args(hosts.pid(Host::Control).map(|pid| pid.to_string()));
    let output = command.output().map_err(|error| StartError::spawn(&command, error))?;
    let text = String::from_utf8_lossy(&output.stdout);
    match text.lines().find_map(Line::parse) {
        Some(Line::Ready(level)) => {
            let mut level = Level::deserialize(&level)?;
            level.why.extend(hosts.refused.clone());
            Ok(level)
        }
        Some(Line::Refused(reason)) => Err(HostError::Refused(reason)),
        Some(_) | None => Err(HostError::ProbeEnded(output.status)),
    }
}

/// The hosts of one run.
pub(super) struct Hosts {
    running: BTreeMap<Host, Child>,
    /// True if each host has a separate network, on a wire.
    separate: bool,
    refused: Option<String>,
}

impl Hosts {
    /// Makes the hosts, with the roots of their buses: on one network, or `separate` on a wire with the adversary at its bridge; each with
    /// shared memory of `shared_kib`.
    pub(super) fn start(
        services: &Services,
        roots: Vec<(Host, Vec<PathBuf>)>,
        separate: bool,
        shared_kib: u64,
    ) -> Self {
        let mut hosts = Self { running: BTreeMap::new(), separate, refused: None };
        // The router comes last: it joins the networks of all other hosts.
        let (router, networked): (Vec<_>, Vec<_>) =
            roots.into_iter().partition(|(host, _)| separate && *host == Host::Adversary);
        for (host, memory) in networked.into_iter().chain(router) {
            let first = hosts.running.values().next().map(Child::pid);
            let mut spec = HostSpec {
                beside: first,
                shares_network: first.is_some() && !separate,
                memory,
                shared_kib,
                ..HostSpec::default()
            };
            if separate && host == Host::Adversary {
                spec.router = Some(wire_number(host));
                let station =
                    |(host, child): (&Host, &Child)| Station { process: child.pid(), number: wire_number(*host) };
                spec.stations = hosts.running.iter().map(station).collect();
            }
            match start(services, &spec) {
                Ok(child) => hosts.running.insert(host, child),
                Err(error) => {
                    return Self { running: BTreeMap::new(), separate: false, refused: Some(error.to_string()) };
                }
            };
        }
        hosts
    }

    /// The address of a host's services, with a port of the kernel's choice; none if all hosts are on one loopback interface.
    pub(super) fn address(&self, host: Host) -> Option<LoopbackAddr> {
        self.separate.then(|| LoopbackAddr::on_wire(wire_number(host)))
    }

    /// The process that holds a host's namespaces.
    pub(super) fn pid(&self, host: Host) -> Option<u32> {
        self.running.get(&host).map(Child::pid)
    }

    /// The reason why there are no namespaces.
    pub(super) fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }
}

/// A host's number on the wire.
fn wire_number(host: Host) -> u8 {
    host as u8 + 1
}

fn start(services: &Services, spec: &HostSpec) -> Result<Child, HostError> {
    let (lines, answers) = channel();
    let mut child = Child::spawn(services, "host", NodeId::CAMPAIGN, &lines)?;
    let spec = serde_json::to_string(spec)?;
    child.write(format!("{spec}\n").as_bytes());
    match answers.recv_timeout(READY) {
        Ok((_, Line::Ready(_))) => Ok(child),
        Ok((_, Line::Refused(reason))) => Err(HostError::Refused(reason)),
        Ok(_) | Err(RecvTimeoutError::Disconnected) => Err(HostError::Ended),
        Err(RecvTimeoutError::Timeout) => Err(HostError::Late),
    }
}
