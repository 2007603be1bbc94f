//! The modelled hosts of a run as namespaces, and the level of confinement that its services reach.
//!
//! Each host is a process ([`sandbox::host`]) that its services find by its number; it ends with the run. Where the machine refuses
//! namespaces, services go without, and say so.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use link::loopback::LoopbackAddr;
use sandbox::Level;
use sandbox::host::{HostSpec, SHARED_KIB};
use sandbox::wire::Station;
use serde::{Deserialize, Serialize};
use topology::Host;
use wire::id::NodeId;

use super::child::{Child, Line, Services};

/// Time limit for a host's namespaces.
const READY: Duration = Duration::from_secs(10);

/// Levels of confinement that a run's services reached.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Levels(BTreeMap<String, Level>);

impl Levels {
    /// Notes the level of a service's start.
    pub(crate) fn note(&mut self, node: NodeId, level: Level) {
        self.0.insert(node.to_string(), level);
    }

    /// The lowest, in words, with the reasons of all.
    pub fn summary(&self) -> String {
        let names: Vec<&str> = self.0.values().map(Level::name).collect();
        let name = ["none", "partial", "full"].into_iter().find(|name| names.contains(name)).unwrap_or("none");
        let mut why: Vec<&str> = self.0.values().flat_map(|level| &level.why).map(String::as_str).collect();
        why.sort_unstable();
        why.dedup();
        if why.is_empty() { name.to_owned() } else { format!("{name} ({})", why.join("; ")) }
    }
}

/// The level that services reach on this machine, found by trying.
///
/// # Errors
/// No service can be confined, and none would start.
pub fn level(services: &Services) -> Result<Level, String> {
    let hosts = Hosts::start(services, vec![(Host::Control, Vec::new())], false, SHARED_KIB);
    let mut command = services.command("level");
    command.args(hosts.of(Host::Control).map(|pid| pid.to_string()));
    let output = command.output().map_err(|why| format!("cannot start {:?}: {why}", command.get_program()))?;
    let told = String::from_utf8_lossy(&output.stdout);
    match told.lines().find_map(Line::parse) {
        Some(Line::Ready(level)) => {
            let mut level = Level::deserialize(&level).map_err(|why| why.to_string())?;
            level.why.extend(hosts.refused.clone());
            Ok(level)
        }
        Some(Line::Refused(why)) => Err(why),
        Some(_) | None => Err(format!("the process that tries it ended: {}", output.status)),
    }
}

/// The hosts of one run.
pub(super) struct Hosts {
    running: BTreeMap<Host, Child>,
    apart: bool,
    refused: Option<String>,
}

impl Hosts {
    /// Makes the hosts, with the roots of their buses: on one network, or `apart` on a wire with the adversary at its bridge; each with
    /// shared memory of `shared_kib`.
    pub(super) fn start(services: &Services, roots: Vec<(Host, Vec<PathBuf>)>, apart: bool, shared_kib: u64) -> Self {
        let mut hosts = Self { running: BTreeMap::new(), apart, refused: None };
        // The router comes last, when all others have a network.
        let (router, others): (Vec<_>, Vec<_>) =
            roots.into_iter().partition(|(host, _)| apart && *host == Host::Adversary);
        for (host, memory) in others.into_iter().chain(router) {
            let beside = hosts.running.values().next().map(Child::pid);
            let mut spec = HostSpec {
                beside,
                shares_network: beside.is_some() && !apart,
                memory,
                shared_kib,
                ..HostSpec::default()
            };
            if apart && host == Host::Adversary {
                spec.router = Some(number(host));
                let station = |(host, child): (&Host, &Child)| Station { process: child.pid(), number: number(*host) };
                spec.stations = hosts.running.iter().map(station).collect();
            }
            match start(services, &spec) {
                Ok(child) => hosts.running.insert(host, child),
                Err(why) => return Self { running: BTreeMap::new(), apart: false, refused: Some(why) },
            };
        }
        hosts
    }

    /// The address of a host's services, with a port of the kernel's choice; none if all hosts are on one loopback interface.
    pub(super) fn address(&self, host: Host) -> Option<LoopbackAddr> {
        self.apart.then(|| LoopbackAddr::on_wire(number(host)))
    }

    /// The process that holds a host's namespaces.
    pub(super) fn of(&self, host: Host) -> Option<u32> {
        self.running.get(&host).map(Child::pid)
    }

    /// The reason why there are no namespaces.
    pub(super) fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }
}

/// A host's number on the wire.
fn number(host: Host) -> u8 {
    host as u8 + 1
}

fn start(services: &Services, spec: &HostSpec) -> Result<Child, String> {
    let (lines, answers) = channel();
    let mut child = Child::spawn(services, "host", NodeId::CAMPAIGN, &lines)?;
    let spec = serde_json::to_string(spec).map_err(|why| why.to_string())?;
    child.write(format!("{spec}\n").as_bytes());
    match answers.recv_timeout(READY) {
        Ok((_, Line::Ready(_))) => Ok(child),
        Ok((_, Line::Refused(why))) => Err(why),
        Ok(_) | Err(RecvTimeoutError::Disconnected) => Err("the host's process ended".into()),
        Err(RecvTimeoutError::Timeout) => Err(format!("no namespaces within {} s", READY.as_secs())),
    }
}
