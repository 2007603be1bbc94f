//! Specifications of a run's processes, made from its topology.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use adversary::AdversaryConfig;
use console::process::ProcessConfig;
use console::site::{MAX_SIDE, Relief, Site, SiteBox};
use link::bus::enclave::{Enclaves, Rights, SignedEnclaves, channel};
use link::clock::{HostClock, trace_us};
use link::guard::GuardMode;
use link::loopback::LoopbackAddr;
use link::pki::{Authority, Credential, PkiError};
use link::spec::{
    BrokerListen, BusSpec, ChannelSpec, Confinement, DtlsDial, DtlsListen, MqttDial, RecorderSpec, RelayLeg, RelaySpec,
    ServiceSpec, WitnessSpec,
};
use recording::RunFolder;
use sandbox::Level;
use serde::Deserialize;
use serde_json::{Value, json};
use sim::scene::Scene;
use sim::terrain::Terrain;
use topology::{Host, Link, Member, MemberRole, RunSecret, Topology, sim_keys};
use wire::core::{Subject, Topic};
use wire::id::{Boot, NodeId, PeerId, UnitId};
use wire::policy::{BusProtection, Requirement};

use super::hosts::{Hosts, Levels};
use super::remains::{Remains, SCRATCH};

/// Reason for which a process has no specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SpecificationError {
    /// A service that it dials has announced no address.
    #[error("{node} has not said where its {kind} is")]
    NoAddress {
        /// The service.
        node: NodeId,
        /// Kind of the address.
        kind: &'static str,
    },
    /// It needs a certificate.
    #[error("{0} has no certificate")]
    NoCertificate(NodeId),
    /// The service that it dials has no certificate.
    #[error("the listening member has no certificate")]
    ListenerWithoutCertificate,
}

/// Paths of a run.
#[derive(Clone, Debug)]
pub(super) struct Places {
    /// Recording, input journals, guard logs.
    pub run_dir: PathBuf,
    /// True if these are kept after the run.
    kept: bool,
    /// Sockets and shared-memory roots; removed at the end.
    pub temporary: PathBuf,
    /// Start of every shared-memory name of this run.
    pub prefix: String,
    /// The address from which its processes send datagrams.
    pub sender: LoopbackAddr,
}

impl Places {
    /// Paths named after a run id of lower-case letters and digits; logs go to `keep`, if given, and datagrams leave
    /// from `sender`.
    pub(super) fn new(keep: Option<PathBuf>, id: &str, sender: LoopbackAddr) -> Self {
        let temporary = |start: &str| std::env::temp_dir().join(format!("{start}{id}"));
        Self {
            kept: keep.is_some(),
            // A confined service has another root folder, so a relative path would not lead there.
            run_dir: keep.map_or_else(|| temporary(SCRATCH), |keep| std::path::absolute(&keep).unwrap_or(keep)),
            temporary: temporary("holdsafe-"),
            prefix: format!("hs_{id}_"),
            sender,
        }
    }

    /// The remains.
    pub(super) fn remains(&self) -> Remains {
        let domains = [Host::VehicleA, Host::Control, Host::VehicleC].map(|host| self.domain(host)).to_vec();
        let scratch = (!self.kept).then(|| self.run_dir.clone());
        Remains { prefix: self.prefix.clone(), domains, folder: self.temporary.clone(), scratch }
    }

    /// Directory of the recorder.
    pub(super) fn recording(&self) -> PathBuf {
        RunFolder::new(&self.run_dir).recording()
    }

    fn domain(&self, host: Host) -> (String, PathBuf) {
        (format!("{}{}_", self.prefix, host as usize), self.temporary.join(scope(host)))
    }

    /// Socket of the recorder, in a separate folder that confined services see.
    fn socket(&self) -> PathBuf {
        self.temporary.join(LOG).join("instrument.sock")
    }
}

/// Subdirectory of the recorder's socket.
const LOG: &str = "log";

/// Subdirectory of a second station's channel, beside its host's own.
const SECOND_STATION: &str = "station-2";

fn scope(host: Host) -> &'static str {
    match host {
        Host::VehicleA => "vehicle",
        Host::Control => "control",
        Host::Insider => "insider",
        Host::VehicleC => "vehicle-c",
        Host::Adversary => "adversary",
    }
}

/// The clock of a host of this run.
pub(super) fn clock(topology: &Topology, host: Host) -> HostClock {
    let draw = topology.clocks[host as usize];
    HostClock { zero_us: draw.zero_us, drift_ppm: draw.drift_ppm as i32 }
}

/// Every certificate of a run. The authority's key is gone before the first service starts.
pub(super) fn credentials(topology: &Topology) -> Result<BTreeMap<NodeId, Credential>, PkiError> {
    let authority = Authority::new()?;
    let mut issued = BTreeMap::new();
    for member in &topology.members {
        if let Some(peer) = member.peer {
            issued.insert(member.node(), authority.issue(peer, link::pki::Role::Both)?);
        }
    }
    if topology.broker() == NodeId::BROKER {
        issued.insert(NodeId::BROKER, authority.issue(PeerId::BROKER, link::pki::Role::Listens)?);
    }
    Ok(issued)
}

/// Writes specifications as addresses become known.
pub(super) struct Specs<'a> {
    /// The participants.
    pub topology: &'a Topology,
    /// Paths.
    pub places: &'a Places,
    /// Start of the run, microseconds of trace time.
    pub start_us: u64,
    /// The record filter.
    pub guard: Requirement,
    /// Certificates.
    pub credentials: BTreeMap<NodeId, Credential>,
    /// True if the console opens a window.
    pub window: bool,
    /// The processes that hold the hosts' namespaces; none where services keep all their rights.
    pub hosts: Option<&'a Hosts>,
    /// The run's secret.
    pub secret: &'a RunSecret,
    /// Rights on the buses, signed.
    pub enclaves: Option<SignedEnclaves>,
    /// Levels of confinement that services have announced.
    pub levels: Levels,
    /// Addresses that services have announced, by node and kind.
    pub addresses: BTreeMap<(NodeId, &'static str), LoopbackAddr>,
}

impl Specs<'_> {
    /// Notes the addresses and the level of a `ready` line; gives the level.
    pub(super) fn ready(&mut self, node: NodeId, line: &Value) -> Level {
        let level = line.get("confinement").and_then(|level| Level::deserialize(level).ok());
        let level = level.unwrap_or_else(|| Level::none("not said"));
        self.levels.note(node, level.clone());
        for kind in ["dtls", "relay_datagram", "relay_stream", "mqtt"] {
            let address = line.get(kind).and_then(Value::as_str).and_then(|a| a.parse::<LoopbackAddr>().ok());
            if let Some(address) = address {
                self.addresses.insert((node, kind), address);
            }
        }
        level
    }

    fn address(&self, node: NodeId, kind: &'static str) -> Result<LoopbackAddr, SpecificationError> {
        self.addresses.get(&(node, kind)).copied().ok_or(SpecificationError::NoAddress { node, kind })
    }

    /// True if the policy asks for encrypted channels.
    fn confidential(&self) -> bool {
        let policies = self.topology.members.iter().map(|member| member.setup.policy.bus);
        policies.into_iter().any(|bus| bus == BusProtection::Confidential)
    }

    /// The rights of every service on the buses of its host, from now on; an attacker's process has none, and asks for none.
    pub(super) fn enclaves(&self, until_us: u64) -> Enclaves {
        let rights = |member: &Member| {
            let names = |channels: &[ChannelSpec]| channels.iter().map(|c| channel(&c.scope, c.topic)).collect();
            let all = self.bus(member);
            let channels_of = |get: fn(&BusSpec) -> &Vec<ChannelSpec>| {
                all.iter().flat_map(|bus| get(bus).clone()).collect::<Vec<_>>()
            };
            Rights {
                publishes: names(&channels_of(|bus| &bus.publish)),
                subscribes: names(&channels_of(|bus| &bus.subscribe)),
            }
        };
        let services = self.topology.members.iter().filter(|member| !is_hostile(member));
        let services = services.map(|member| (member.node().name().to_owned(), rights(member))).collect();
        Enclaves { from_us: trace_us(), until_us, services }
    }

    /// The address at which a host's services listen, with a port of the kernel's choice.
    fn listen_address(&self, host: Host) -> LoopbackAddr {
        self.hosts.and_then(|hosts| hosts.address(host)).unwrap_or(LoopbackAddr::ANY_PORT)
    }

    fn credential(&self, node: NodeId) -> Result<Credential, SpecificationError> {
        self.credentials.get(&node).cloned().ok_or(SpecificationError::NoCertificate(node))
    }

    fn plain(&self, node: NodeId, host: Host, seed: u64) -> ServiceSpec {
        let mut spec = ServiceSpec::new(node, Boot(1), seed, clock(self.topology, host), self.places.run_dir.clone());
        spec.start_us = self.start_us;
        spec.own = self.hosts.and_then(|hosts| hosts.address(host)).unwrap_or(self.places.sender);
        spec.confinement =
            self.hosts.as_ref().map(|hosts| Confinement { host: hosts.pid(host), ..Confinement::default() });
        spec.instrument = Some(self.places.socket());
        spec.witness = self.witness(node);
        spec.guard = match self.guard {
            Requirement::Required => GuardMode::Required,
            Requirement::Waived => GuardMode::Waived,
        };
        spec
    }

    /// Settings of the node's delivery witness.
    fn witness(&self, node: NodeId) -> Option<WitnessSpec> {
        let guard = self.topology.ingress_of(node)?;
        let secret = self.topology.witnesses.get(&guard)?.clone();
        let direct = |link: &Link| link.client == node && link.server == NodeId::GATEWAY && !link.relayed;
        Some(WitnessSpec { node: guard, secret, direct: self.topology.links.iter().any(direct) })
    }

    /// The specification of the broker.
    pub(super) fn broker(&self, secret: &wire::sign::Secret) -> Result<ServiceSpec, SpecificationError> {
        let mut spec = self.plain(NodeId::BROKER, Host::Control, 0);
        spec.broker =
            Some(BrokerListen { at: self.listen_address(Host::Control), credential: self.credential(NodeId::BROKER)? });
        spec.config = json!({ "secret": secret, "rights": self.topology.rights() });
        Ok(spec)
    }

    /// The specification of a member.
    pub(super) fn member(&self, member: &Member) -> Result<ServiceSpec, SpecificationError> {
        let node = member.node();
        let mut spec = self.plain(node, member.host, member.setup.seed);
        spec.bus = self.bus(member);
        spec.enclaves = self.enclaves.clone().filter(|_| !is_hostile(member));
        spec.config = config(self.topology, member, &self.places.run_dir, self.window.then(|| site(self.topology)));
        if matches!(member.role, MemberRole::Recorder) {
            spec.instrument = None;
            let directory = self.places.recording();
            let reports_awaited = !self.topology.cues.is_empty();
            spec.recorder = Some(RecorderSpec { socket: self.places.socket(), directory, reports_awaited });
        }
        for link in &self.topology.links {
            if link.server == node {
                let credential = self.credential(node)?;
                spec.listen = Some(DtlsListen { at: self.listen_address(member.host), credential });
            }
            if link.client == node {
                let remote = if link.relayed {
                    self.address(NodeId::RELAY_TELEMETRY, "relay_datagram")?
                } else {
                    self.address(link.server, "dtls")?
                };
                let server = self.topology.members.iter().find(|m| m.node() == link.server);
                let expect = server.and_then(|m| m.peer).ok_or(SpecificationError::ListenerWithoutCertificate)?;
                spec.dial = Some(DtlsDial { remote, expect, credential: self.credential(node)? });
            }
        }
        if node == NodeId::INSIDER_BROKER {
            spec.broker =
                Some(BrokerListen { at: self.listen_address(member.host), credential: self.credential(node)? });
        }
        if let Some(confinement) = &mut spec.confinement {
            confinement.models = models(&member.role);
            confinement.window = self.window && matches!(member.role, MemberRole::Console(_));
        }
        spec.relay = self.relay(member)?;
        spec.mqtt = self.mqtt(member)?;
        Ok(spec)
    }

    fn bus(&self, member: &Member) -> Vec<BusSpec> {
        if member.subscribes.is_empty() && member.publishes.is_empty() {
            return Vec::new();
        }
        let (host, endpoint) = (scope(member.host), member.endpoint);
        let spec_of = |scope: &str, inside: bool, topic: Topic| {
            let scope = if inside { format!("{scope}-inside") } else { scope.to_owned() };
            let holds = member.setup.channels.iter().any(|held| held.topic == topic);
            let cipher = (holds && self.confidential()).then(|| self.secret.cipher(member.host, &scope, topic));
            ChannelSpec { scope, topic, cipher }
        };
        // A channel has one producer, so a second station has another channel than the console, and the gateway reads both.
        let second = |m: &Member| {
            matches!(m.role, MemberRole::Adversary(AdversaryConfig::InsiderOperator(_)))
                && m.publishes.contains(&Topic::Intents)
        };
        let publish_scope = if second(member) { SECOND_STATION } else { host };
        let publish = member.publishes.iter().map(|t| spec_of(publish_scope, endpoint.writes_inside(*t), *t)).collect();
        let mut subscribe: Vec<_> =
            member.subscribes.iter().map(|t| spec_of(host, endpoint.reads_inside(*t), *t)).collect();
        if matches!(member.role, MemberRole::Gateway(_)) && self.topology.members.iter().any(second) {
            subscribe.push(spec_of(SECOND_STATION, false, Topic::Intents));
        }
        let (prefix, root) = self.places.domain(member.host);
        // A rogue starts first and makes its channels, with room for the genuine producers too.
        let publishers = if matches!(member.role, MemberRole::Adversary(AdversaryConfig::Rogue(_))) { 2 } else { 1 };
        vec![BusSpec { root, prefix, subscribe, publish, publishers }]
    }

    fn relay(&self, member: &Member) -> Result<Option<RelaySpec>, SpecificationError> {
        let leg = |upstream| RelayLeg { at: self.listen_address(member.host), upstream };
        if matches!(member.role, MemberRole::Adversary(AdversaryConfig::DatagramRelay(_))) {
            let upstream = self.address(NodeId::GATEWAY, "dtls")?;
            return Ok(Some(RelaySpec { datagram: Some(leg(upstream)), stream: None }));
        }
        if matches!(member.role, MemberRole::Adversary(AdversaryConfig::StreamRelay(_))) {
            let upstream = self.address(self.topology.broker(), "mqtt")?;
            return Ok(Some(RelaySpec { datagram: None, stream: Some(leg(upstream)) }));
        }
        Ok(None)
    }

    /// The unit under test reaches the broker through the stream relay; the others directly.
    fn mqtt(&self, member: &Member) -> Result<Option<MqttDial>, SpecificationError> {
        let (true, Some(peer)) = (member.commands, member.peer) else { return Ok(None) };
        let node = member.node();
        let remote = if node == NodeId::UNIT_A {
            self.address(NodeId::RELAY_COMMAND, "relay_stream")?
        } else {
            self.address(self.topology.broker(), "mqtt")?
        };
        let subscribe = match wire::trust::unit_of(peer) {
            Some(unit) => vec![Subject::Command(unit)],
            None if peer != PeerId::GATEWAY => Vec::new(),
            None => [UnitId::A, UnitId::B, UnitId::C].map(Subject::Ack).to_vec(),
        };
        let expect = PeerId::BROKER;
        let on_demand = member.role.joins_later();
        let credential = self.credential(node)?;
        Ok(Some(MqttDial { remote, own: peer, expect, credential, subscribe, on_demand }))
    }
}

/// True for a participant of an attacker.
fn is_hostile(member: &Member) -> bool {
    matches!(member.role, MemberRole::Adversary(_))
}

/// Third-party files that a participant reads.
fn models(role: &MemberRole) -> Vec<PathBuf> {
    let MemberRole::Perception(config) = role else { return Vec::new() };
    // A custom detector is no such file: its model is read by its own process.
    let files = config.runtime.iter().filter(|_| config.rendered);
    files.map(|file| std::path::absolute(&file.path).unwrap_or_else(|_| file.path.clone())).collect()
}

/// Configuration of a participant's process.
fn config(topology: &Topology, member: &Member, run: &Path, window: Option<Site>) -> Value {
    let setup = &member.setup;
    match &member.role {
        MemberRole::Sim(config) => {
            json!({ "sim": config, "keys": sim_keys(setup), "journal": setup.secret.0 })
        }
        MemberRole::Perception(config) => json!({ "setup": setup, "config": config }),
        MemberRole::Autonomy(config) => {
            let guest = topology.guest.as_ref().filter(|_| config.guest.is_some());
            let guest = guest.map(|guest| super::guest::carry(guest, run));
            json!({ "setup": setup, "config": config, "guest": guest })
        }
        MemberRole::Gateway(config) => json!({ "setup": setup, "config": config }),
        MemberRole::Console(config) => json!({ "setup": setup, "config": config, "window": window }),
        MemberRole::Recorder => json!(setup),
        MemberRole::Adversary(config) => json!({ "setup": setup, "config": config }),
    }
}

/// Configuration of the run's console, its window included.
pub(crate) fn console(topology: &Topology) -> Option<ProcessConfig> {
    topology.members.iter().find_map(|member| {
        let MemberRole::Console(config) = &member.role else { return None };
        Some(ProcessConfig { setup: member.setup.clone(), config: config.clone(), window: Some(site(topology)) })
    })
}

/// The site as the mission of the unit under test was planned on it.
pub(crate) fn site(topology: &Topology) -> Site {
    let mission = topology.members.iter().find_map(|member| {
        let MemberRole::Autonomy(mission) = &member.role else { return None };
        (mission.unit == UnitId::A).then_some(mission)
    });
    let Some(mission) = mission else { return Site::default() };
    let metres = |mm: i32| mm as f32 / 1000.0;
    let place = |(x_mm, y_mm): &(i32, i32)| [metres(*x_mm), metres(*y_mm)];
    let block = |block: &autonomy::MapBox| SiteBox {
        at: place(&(block.x_mm, block.y_mm)),
        half: block.half_mm.map(|mm| mm as f32 / 1000.0),
        yaw: block.heading_mrad as f32 / 1000.0,
    };
    let plane = Site {
        fence: mission.geofence.iter().map(place).collect(),
        route: mission.route.iter().map(place).collect(),
        looped: mission.looped,
        ..Site::default()
    };
    // From an orbit the scene is a region: it has neither walls nor hills.
    match topology.overpass() {
        Some(pass) => Site {
            scale_m: Some(pass.scale_m as f32),
            below: pass.below.iter().map(|place| place.map(|metres| metres as f32)).collect(),
            ..plane
        },
        None => Site {
            blocks: mission.obstacles.iter().map(block).collect(),
            relief: topology.world().map(|world| survey(&world.scene)),
            ..plane
        },
    }
}

/// The ground within the fence and a little beyond, as surveyed before the mission.
fn survey(scene: &Scene) -> Relief {
    let ground = Terrain::new(scene);
    let reach = |axis: usize| {
        let coordinates = || scene.geofence.iter().map(move |corner| corner[axis]);
        (coordinates().fold(f32::INFINITY, f32::min) - 4.0, coordinates().fold(f32::NEG_INFINITY, f32::max) + 4.0)
    };
    let ((west, east), (south, north)) = (reach(0), reach(1));
    let side = (east - west).max(north - south);
    let cell = if side.is_finite() { (side / (MAX_SIDE - 1) as f32).max(1.0) } else { 1.0 };
    let along = |from: f32, to: f32| {
        (0..MAX_SIDE).map(move |n| from + n as f32 * cell).take_while(move |coordinate| *coordinate < to + cell)
    };
    let columns = along(west, east).count();
    let heights = along(south, north).flat_map(|y| along(west, east).map(move |x| (x, y)));
    Relief { corner: [west, south], cell, columns, heights: heights.map(|(x, y)| ground.height(x, y)).collect() }
}

/// The hosts of a run, with the roots of their buses.
pub(super) fn roots(topology: &Topology, places: &Places) -> Vec<(Host, Vec<PathBuf>)> {
    let mut roots = BTreeMap::from([(Host::Control, true), (Host::Adversary, false)]);
    for member in &topology.members {
        *roots.entry(member.host).or_default() |= !member.publishes.is_empty() || !member.subscribes.is_empty();
    }
    roots.into_iter().map(|(host, bus)| (host, if bus { vec![places.domain(host).1] } else { Vec::new() })).collect()
}

/// The name of the program for a role.
pub(super) fn service(role: &MemberRole) -> &'static str {
    match role {
        MemberRole::Sim(_) => "sim",
        MemberRole::Perception(_) => "perception",
        MemberRole::Autonomy(_) => "autonomy",
        MemberRole::Gateway(_) => "gateway",
        MemberRole::Console(_) => "console",
        MemberRole::Recorder => "recorder",
        MemberRole::Adversary(_) => "adversary",
    }
}

/// Makes the folders of a run, readable by its owner only.
pub(super) fn make_folders(places: &Places) -> std::io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true).mode(0o700);
    builder.create(&places.run_dir)?;
    RunFolder::new(&places.run_dir).written_by_processes().iter().try_for_each(|folder| builder.create(folder))?;
    builder.create(&places.temporary)?;
    [Host::VehicleA, Host::Control, Host::VehicleC]
        .iter()
        .try_for_each(|h| builder.create(places.temporary.join(scope(*h))))?;
    builder.create(places.temporary.join(LOG))
}
