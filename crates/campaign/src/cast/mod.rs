//! Who takes part in a trial: from a scenario and a seed to the cores' setups, the same for the twin and for live.
//!
//! Everything a seed varies is drawn here, once, in a fixed order. The twin makes the cores in its own thread, the
//! live launcher hands the same setups to processes; neither adds anything of its own.

mod attack;
mod control;
mod keys;
mod peer;
mod process;
mod rogue;
mod scene;
mod script;
mod station;

use autonomy::AutonomyConfig;
use console::ConsoleConfig;
use gateway::GatewayConfig;
use perception::PerceptionConfig;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use sim::SimConfig;
use wire::core::Topic;
use wire::id::{Boot, NodeId, PeerId, UnitId, WorldId};
use wire::policy::{Check, Requirement};
use wire::setup::{Ablation, Secret, Setup};
use wire::sign::Key;
use wire::trust::Mandate;

use adversary::insider::InsiderRecorder;
use adversary::plan::{AdversaryConfig, Tampering};

use crate::cue::Cue;
use crate::custody::{Held, HeldClock, Life};
use crate::evidence::hex;
use crate::oracle::{Plan, Planned};
use crate::scenario::{self, Scenario};

pub use attack::is_attacked;
pub use keys::RunSecret;
pub use process::{Ordeal, OrdealKind, Turn, next_turn, node_of};

/// Who may give commands, in every run. Nobody holds the second one's key but the rogue of some scenarios.
const OPERATORS: [NodeId; 2] = [NodeId::OPERATOR, NodeId::OPERATOR_2];

/// A host: its nodes share a clock and shared memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Host {
    /// Unit A with its sim and perception, and the recorder.
    VehicleA,
    /// Gateway, broker and console.
    Control,
    /// The insider who holds unit B's credentials.
    Insider,
    /// Unit C.
    VehicleC,
    /// The relays.
    Adversary,
}

impl Host {
    /// Every host, in the order of the clock table.
    pub const ALL: [Host; 5] = [Host::VehicleA, Host::Control, Host::Insider, Host::VehicleC, Host::Adversary];
}

/// What a member does.
#[derive(Clone, Debug)]
pub enum Role {
    /// World, plant and sensors.
    Sim(SimConfig),
    /// Detector stages, corroboration, tracks.
    Perception(PerceptionConfig),
    /// The state machine of a unit.
    Autonomy(AutonomyConfig),
    /// The trust boundary of the control domain.
    Gateway(GatewayConfig),
    /// Display model and scripted operator.
    Console(ConsoleConfig),
    /// Follows and seals every chain.
    Recorder,
    /// An adversary in one of its roles.
    Adversary(AdversaryConfig),
}

/// Where a member sits on the shared memory of its host. Where a gateway insider takes part, what leaves the gateway and
/// what is meant for it is on channels *inside*, which the insider alone joins to those that everybody else uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seat {
    /// On the channels that everybody uses.
    #[default]
    Outside,
    /// On the channels inside: the honest half of a gateway.
    Inside,
    /// On both: it takes the feed from inside and brings intents there.
    Between,
}

impl Seat {
    /// Whether it reads `topic` inside.
    pub fn reads_inside(self, topic: Topic) -> bool {
        self == Seat::Inside || (self == Seat::Between && topic == Topic::Feed)
    }

    /// Whether it writes `topic` inside.
    pub fn writes_inside(self, topic: Topic) -> bool {
        self == Seat::Inside || (self == Seat::Between && topic == Topic::Intents)
    }
}

/// One process or core.
#[derive(Clone, Debug)]
pub struct Member {
    /// Where it runs.
    pub host: Host,
    /// What it does.
    pub role: Role,
    /// What every core is made from.
    pub setup: Setup,
    /// Channels it reads.
    pub subscribes: Vec<Topic>,
    /// Channels it writes.
    pub publishes: Vec<Topic>,
    /// Its certificate.
    pub peer: Option<PeerId>,
    /// Whether it is connected to the broker.
    pub commands: bool,
    /// Where it sits on its host's shared memory.
    pub seat: Seat,
}

impl Member {
    /// Who it is.
    pub fn node(&self) -> NodeId {
        self.setup.node
    }

    /// The same for one that is started again when the run has lasted for `ran` microseconds. Mandates are judged from the start
    /// of whoever judges them; they do not begin anew with it.
    #[must_use]
    pub fn again(&self, ran: u64) -> Member {
        let mut member = self.clone();
        let mandates = match &mut member.role {
            Role::Autonomy(config) => &mut config.mandates,
            Role::Gateway(config) => &mut config.mandates,
            Role::Sim(_) | Role::Perception(_) | Role::Console(_) | Role::Recorder | Role::Adversary(_) => {
                return member;
            }
        };
        mandates.iter_mut().for_each(|mandate| mandate.until_ms = mandate.until_ms.saturating_sub(ran.div_ceil(1000)));
        member
    }
}

impl Role {
    /// Whether it connects to the broker only when its core asks for it.
    pub fn joins_later(&self) -> bool {
        matches!(self, Role::Adversary(AdversaryConfig::SessionThief(_)))
    }

    /// Whether its core has steps that can be called: the adversaries', and the sensor faults of the sim.
    pub fn takes_cues(&self) -> bool {
        match self {
            Role::Sim(config) => config.faults.iter().any(|fault| fault.waits_ms.is_some()),
            Role::Adversary(config) => !matches!(config, AdversaryConfig::Rogue(_)),
            Role::Perception(_) | Role::Autonomy(_) | Role::Gateway(_) | Role::Console(_) | Role::Recorder => false,
        }
    }
}

/// A secure session between two members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// Who dials.
    pub client: NodeId,
    /// Who listens.
    pub server: NodeId,
    /// Whether the datagram relay is in the path.
    pub relayed: bool,
}

/// A clock's arbitrary zero and drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockDraw {
    /// Reading at the start, microseconds.
    pub zero_us: u64,
    /// Drift, parts per million.
    pub drift_ppm: i64,
}

/// Everybody and everything of one trial.
#[derive(Clone, Debug)]
pub struct Cast {
    /// Members, in the order that breaks ties.
    pub members: Vec<Member>,
    /// Sessions.
    pub links: Vec<Link>,
    /// One clock a host, in the order of [`Host::ALL`].
    pub clocks: Vec<ClockDraw>,
    /// Processes that are to end, or to be kept from running.
    pub ordeals: Vec<Ordeal>,
    /// Steps that wait for what the instrument plane tells.
    pub cues: Vec<Cue>,
    /// What the oracle needs receipts for.
    pub planned: Vec<Plan>,
    /// For how long identities are admitted.
    pub mandates: Vec<Mandate>,
    /// Length of the trial, microseconds.
    pub duration: u64,
    /// Whether link and stage delays vary with the seed.
    pub varied_delays: bool,
    /// What the recorder's insider does to the recording, and the seed of where.
    pub tampering: Option<(Tampering, u64)>,
}

impl Cast {
    /// Whether the broker's table of rights stands: the policy's word, which is the same for everybody.
    pub fn rights(&self) -> Requirement {
        self.members.first().map_or(Requirement::Required, |member| member.setup.policy.check(Check::Rights))
    }

    /// The public keys under which everybody's log is signed, the clocks by which it is stamped, and who owes no last
    /// signature; no head yet. The broker signs where it has a key. From an entry's own time to the one under which it is
    /// handed over, `late_us` may pass, and as long as the process is stopped meanwhile.
    pub fn held(&self, broker: Option<&Secret>, late_us: u64) -> Held {
        let key = |node: NodeId, secret: &Secret| (node, hex(&Key::from_bytes(&secret.0).public()));
        let members = self.members.iter().map(|m| key(m.node(), &m.setup.secret));
        let keys = members.chain(broker.map(|secret| key(NodeId::BROKER, secret))).collect();
        let hosts = self.members.iter().map(|m| (m.node(), m.host)).chain([(NodeId::BROKER, Host::Control)]);
        let clocks = hosts.map(|(node, host)| {
            let ClockDraw { zero_us, drift_ppm } = self.clocks[host as usize];
            (node, HeldClock { zero_us, drift_ppm, late_us: late_us + self.stopped(node) })
        });
        let killed = self.killed().into_iter().map(|node| Life { node, boot: Boot(1) });
        Held { keys, heads: Vec::new(), killed: killed.collect(), clocks: clocks.collect(), start_us: 0 }
    }

    /// Processes that are to be kept from running, whose cores' mouths are watched for it.
    pub fn watched(&self) -> Vec<NodeId> {
        let suspended = |plan: &Plan| if let Planned::Suspend(node) = plan.what { Some(node) } else { None };
        self.planned.iter().filter_map(suspended).collect()
    }

    /// Whether the recorder's disk is to be full for a time, and so the recording is looked at while it grows.
    pub fn fills(&self) -> bool {
        self.planned.iter().any(|plan| matches!(plan.what, Planned::Fill(_)))
    }

    /// The longest time for which `node` is kept from running, microseconds.
    fn stopped(&self, node: NodeId) -> u64 {
        let lasts = |ordeal: &Ordeal| match ordeal.kind {
            OrdealKind::Suspend { lasts, .. } => lasts,
            OrdealKind::Kill { .. } | OrdealKind::Fill { .. } => 0,
        };
        self.ordeals.iter().filter(|ordeal| ordeal.node == node).map(lasts).max().unwrap_or(0)
    }

    /// The insider whose hands the recorder is in, when the scenario has one.
    pub fn hands(&self) -> Option<InsiderRecorder> {
        let (does, seed) = self.tampering?;
        let recorder = self.members.iter().find(|m| m.node() == NodeId::RECORDER)?;
        Some(InsiderRecorder::new(recorder.setup.key(), does, seed))
    }

    /// Who routes the command plane: the broker, or the one who stands in its place.
    pub fn broker(&self) -> NodeId {
        let hostile = self.members.iter().any(|m| m.node() == NodeId::INSIDER_BROKER);
        if hostile { NodeId::INSIDER_BROKER } else { NodeId::BROKER }
    }

    /// Who may give commands, and until when, microseconds of the run.
    pub fn operators(&self) -> Vec<(NodeId, u64)> {
        let until = |who: NodeId| self.mandates.iter().find(|m| m.who == who).map_or(u64::MAX, |m| m.until_ms * 1000);
        OPERATORS.map(|who| (who, until(who))).to_vec()
    }

    /// Processes that are to end, and so owe no closing account.
    pub fn killed(&self) -> Vec<NodeId> {
        let ends = |ordeal: &&Ordeal| matches!(ordeal.kind, OrdealKind::Kill { .. });
        self.ordeals.iter().filter(ends).map(|ordeal| ordeal.node).collect()
    }
}

/// What one seed draws.
struct Draw {
    phase_ms: u64,
    shift_m: (f64, f64),
    clocks: Vec<ClockDraw>,
    noise: u64,
}

impl Draw {
    fn of(scenario: &Scenario, seed: u64) -> Draw {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let (from, to) = scenario.varies.phase_s();
        let phase_ms = ((from + (to - from) * unit()) * 1000.0) as u64;
        let reach = scenario.varies.object_shift_m.get();
        let shift_m = ((2.0 * unit() - 1.0) * reach, (2.0 * unit() - 1.0) * reach);
        let varied = scenario.varies.clocks;
        let clocks = Host::ALL.map(|_| {
            let (zero, drift) = (unit(), unit());
            let zero_us = 1_000_000_000 + if varied { (zero * 3.0e9) as u64 } else { 0 };
            ClockDraw { zero_us, drift_ppm: if varied { (drift * 100.0) as i64 - 50 } else { 0 } }
        });
        let noise = if scenario.varies.noise { seed } else { 0 };
        Draw { phase_ms, shift_m, clocks: clocks.to_vec(), noise }
    }
}

/// Puts the cast of one trial together.
pub fn cast(scenario: &Scenario, with: &scenario::Setup, seed: u64, secret: &RunSecret) -> Cast {
    let draw = Draw::of(scenario, seed);
    let public_keys = secret.public_keys();
    let mut company = Company { scenario, with, seed, secret, public_keys, members: Vec::new() };
    company.vehicle_a(&draw);
    company.control();
    company.adversary(&draw);
    let members = company.finish();
    Cast {
        links: links(scenario, &members),
        clocks: draw.clocks,
        ordeals: process::ordeals(scenario, draw.phase_ms),
        cues: attack::cues(scenario, draw.phase_ms),
        planned: attack::planned::of(scenario, draw.phase_ms),
        mandates: station::mandates(scenario),
        duration: (scenario.duration_s.get() * 1e6) as u64,
        varied_delays: scenario.varies.delays,
        tampering: attack::tampering(scenario, seed),
        members,
    }
}

fn links(scenario: &Scenario, members: &[Member]) -> Vec<Link> {
    let has = |node: NodeId| members.iter().any(|m| m.node() == node);
    let mut links = vec![Link { client: NodeId::UNIT_A, server: NodeId::GATEWAY, relayed: true }];
    if has(NodeId::INSIDER_B) {
        links.push(Link { client: NodeId::INSIDER_B, server: NodeId::GATEWAY, relayed: false });
    }
    if has(NodeId::UNIT_C) {
        let server = if attack::third_is_silent(scenario) { NodeId::INSIDER_B } else { NodeId::GATEWAY };
        links.push(Link { client: NodeId::UNIT_C, server, relayed: false });
    }
    links
}

struct Company<'a> {
    scenario: &'a Scenario,
    with: &'a scenario::Setup,
    seed: u64,
    secret: &'a RunSecret,
    public_keys: Vec<(NodeId, [u8; 32])>,
    members: Vec<Member>,
}

impl Company<'_> {
    fn setup(&self, node: NodeId, host: Host, topics: &[(Topic, NodeId)]) -> Setup {
        let ablation =
            (!self.with.policy.is_full()).then(|| Ablation { scenario: self.scenario.name.as_str().to_owned() });
        Setup {
            node,
            boot: Boot(1),
            world: WorldId(0),
            seed: self.seed ^ (node.index() as u64) << 56,
            policy: self.with.policy.clone(),
            bounds: self.with.bounds,
            secret: self.secret.of(keys::signer(node)),
            public_keys: self.public_keys.clone(),
            channels: self.secret.channels(host, node, topics),
            ablation,
            verified: None,
        }
    }

    fn add(
        &mut self,
        host: Host,
        role: Role,
        node: NodeId,
        reads: &[(Topic, NodeId)],
        writes: &[Topic],
    ) -> &mut Member {
        let topics: Vec<_> = reads.iter().copied().chain(writes.iter().map(|t| (*t, node))).collect();
        let setup = self.setup(node, host, &topics);
        let mut subscribes: Vec<Topic> = reads.iter().map(|(t, _)| *t).collect();
        subscribes.dedup(); // A topic with several producers is still one topic.
        let member = Member {
            host,
            role,
            setup,
            subscribes,
            publishes: writes.to_vec(),
            peer: None,
            commands: false,
            seat: Seat::Outside,
        };
        self.members.push(member);
        self.members.last_mut().expect("just pushed")
    }

    fn vehicle_a(&mut self, draw: &Draw) {
        self.vehicle(Host::VehicleA, UnitId::A, draw, None);
        let recorder = NodeId::RECORDER;
        self.add(Host::VehicleA, Role::Recorder, recorder, &[], &[Topic::Seals]);
    }

    /// Sim, perception and autonomy of one unit; a teammate starts elsewhere and is never rendered.
    fn vehicle(&mut self, host: Host, unit: UnitId, draw: &Draw, start: Option<&scenario::Pose>) {
        let under_test = unit == UnitId::A;
        let rendered = under_test && self.with.rendered;
        let (sim, perception) =
            if under_test { (NodeId::SIM, NodeId::PERCEPTION) } else { (NodeId::SIM_C, NodeId::PERCEPTION_C) };
        let node = unit.node();
        let faults = if under_test { attack::faults(self.scenario, draw.phase_ms) } else { Vec::new() };
        let world = scene::of(self.scenario, draw.shift_m, start);
        let seen = if rendered { Topic::Frames } else { Topic::Candidates };
        let config = SimConfig {
            node: sim,
            unit,
            boot: Boot(1),
            seed: draw.noise.wrapping_add(unit.node().index() as u64),
            rendered,
            witness: true,
            scene: world.clone(),
            faults,
            noise: sim::NoiseModel::default(),
            clock_ppm: draw.clocks[host as usize].drift_ppm as i32,
        };
        let writes = [Topic::Frames, Topic::Candidates, Topic::Navigation];
        self.add(host, Role::Sim(config), sim, &[(Topic::Drive, node), (Topic::Act, node)], &writes);
        let config = PerceptionConfig { rendered, ..PerceptionConfig::default() };
        self.add(
            host,
            Role::Perception(config),
            perception,
            &[(seen, sim), (Topic::Navigation, sim)],
            &[Topic::Tracks],
        );
        let config = self.autonomy(unit, &world);
        let reads = [(Topic::Navigation, sim), (Topic::Tracks, perception), (Topic::Seals, NodeId::RECORDER)];
        let member = self.add(host, Role::Autonomy(config), node, &reads, &[Topic::Drive, Topic::Act]);
        member.peer = peer_of(node);
        member.commands = true;
    }

    fn autonomy(&self, unit: UnitId, world: &sim::scene::Scene) -> AutonomyConfig {
        let silent = unit == UnitId::C && attack::third_is_silent(self.scenario);
        let others = [UnitId::A, UnitId::B, UnitId::C].into_iter().filter(|u| *u != unit);
        AutonomyConfig {
            unit,
            route: world.route.iter().map(|p| scene::millimetres(*p)).collect(),
            looped: false,
            geofence: world.geofence.iter().map(|p| scene::millimetres(*p)).collect(),
            obstacles: scene::map(world),
            teammates: others.collect(),
            operators: OPERATORS.to_vec(),
            mandates: station::mandates(self.scenario),
            supervisor: if silent { PeerId::UNIT_B } else { PeerId::GATEWAY },
        }
    }

    fn control(&mut self) {
        let units = vec![UnitId::A, UnitId::B, UnitId::C];
        let config = GatewayConfig {
            units: units.clone(),
            fanout: units,
            operators: OPERATORS.to_vec(),
            mandates: station::mandates(self.scenario),
        };
        let (gateway, console) = (NodeId::GATEWAY, NodeId::CONSOLE);
        let stations = std::iter::once(console).chain(station::channel(self.scenario));
        let reads: Vec<_> = stations.map(|station| (Topic::Intents, station)).collect();
        let member = self.add(Host::Control, Role::Gateway(config), gateway, &reads, &[Topic::Feed]);
        member.peer = peer_of(gateway);
        member.commands = true;
        if attack::gateway::plan(self.scenario, 0).is_some() {
            self.members.iter_mut().filter(|m| m.node() == gateway).for_each(|m| m.seat = Seat::Inside);
        }
        let (secret, revocations) = (self.secret.of(NodeId::OPERATOR), self.secret.revocations());
        let config = script::console(self.scenario, secret, revocations);
        self.add(Host::Control, Role::Console(config), console, &[(Topic::Feed, gateway)], &[Topic::Intents]);
    }

    /// An adversary on no channel.
    fn hostile(&mut self, host: Host, node: NodeId, config: AdversaryConfig) -> &mut Member {
        self.add(host, Role::Adversary(config), node, &[], &[])
    }

    fn adversary(&mut self, draw: &Draw) {
        let relay = attack::datagrams(self.scenario, draw.phase_ms);
        self.hostile(Host::Adversary, NodeId::RELAY_TELEMETRY, AdversaryConfig::DatagramRelay(relay));
        let stream = attack::stream(self.scenario, draw.phase_ms);
        self.hostile(Host::Adversary, NodeId::RELAY_COMMAND, AdversaryConfig::StreamRelay(stream));
        if let Some(config) = attack::teammate(self.scenario, draw.phase_ms) {
            let member = self.hostile(Host::Insider, NodeId::INSIDER_B, AdversaryConfig::InsiderTeammate(config));
            member.peer = Some(PeerId::UNIT_B);
        }
        if let Some(third) = self.scenario.unit.iter().find(|u| u.name.as_str() == "unit-c") {
            let start = third.start;
            self.vehicle(Host::VehicleC, UnitId::C, draw, Some(&start));
        }
        if let Some(config) = attack::broker::plan(self.scenario, draw.phase_ms) {
            let member = self.hostile(Host::Control, NodeId::INSIDER_BROKER, AdversaryConfig::InsiderBroker(config));
            member.peer = Some(PeerId::BROKER);
        }
        if let Some(config) = attack::gateway::plan(self.scenario, draw.phase_ms) {
            let reads = [(Topic::Feed, NodeId::GATEWAY), (Topic::Intents, NodeId::CONSOLE)];
            let insider = Role::Adversary(AdversaryConfig::InsiderGateway(config));
            let member = self.add(Host::Control, insider, NodeId::INSIDER_GATEWAY, &reads, &[]);
            member.publishes = vec![Topic::Feed, Topic::Intents];
            member.seat = Seat::Between;
        }
        if let Some(config) = station::plan(self.scenario, draw.phase_ms, self.secret) {
            let peer = config.certificate;
            let writes: &[Topic] = if peer.is_none() { &[Topic::Intents] } else { &[] };
            let (rogue, reads) = (NodeId::INSIDER_OPERATOR, [(Topic::Feed, NodeId::GATEWAY)]);
            let member = self.add(
                Host::Control,
                Role::Adversary(AdversaryConfig::InsiderOperator(config)),
                rogue,
                &reads,
                writes,
            );
            member.peer = peer;
            member.commands = peer.is_some();
        }
        if let Some(config) = station::thief(self.scenario, draw.phase_ms) {
            let peer = config.certificate;
            let member = self.hostile(Host::Control, NodeId::IMPOSTOR, AdversaryConfig::SessionThief(config));
            member.peer = Some(peer);
            member.commands = true;
        }
        if let Some(casting) = rogue::of(self.scenario, draw.phase_ms) {
            self.rogue(casting);
        }
    }

    /// A rogue hears and writes like anybody on its host; what it holds is its holder's, or nothing.
    fn rogue(&mut self, casting: rogue::Casting) {
        let rogue::Casting { host, node, holder, topics, config } = casting;
        let held = self.members.iter().find(|m| Some(m.node()) == holder).map(|m| m.setup.channels.clone());
        let member = self.hostile(host, node, AdversaryConfig::Rogue(config));
        member.setup.channels = held.unwrap_or_default();
        member.subscribes.clone_from(&topics);
        member.publishes = topics;
    }

    fn finish(self) -> Vec<Member> {
        self.members
    }
}

fn peer_of(node: NodeId) -> Option<PeerId> {
    PeerId::from_name(node.name())
}

/// The sim's channel keys out of its setup. A channel that the setup lacks gets a key that nobody else has.
pub fn sim_keys(setup: &Setup) -> sim::ChannelKeys {
    let of = |topic: Topic, reader: usize| {
        let listed = setup.channels.iter().filter(|c| c.topic == topic).nth(reader).map(|c| c.key.clone());
        listed.unwrap_or(wire::bus::ChannelKey(setup.secret.0))
    };
    let key = |topic: Topic| of(topic, 0);
    sim::ChannelKeys {
        frames: key(Topic::Frames),
        candidates: key(Topic::Candidates),
        navigation: [of(Topic::Navigation, 0), of(Topic::Navigation, 1)],
        drive: key(Topic::Drive),
        act: key(Topic::Act),
    }
}
