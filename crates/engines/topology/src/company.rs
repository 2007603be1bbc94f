//! The members of one trial, put together in the order that breaks ties: the vehicle under test, control, adversaries.

use adversary::plan::AdversaryConfig;
use autonomy::{AutonomyConfig, GuestConfig};
use config::contact::Contacts;
use config::platform::Body;
use config::setup::{Ablation, Setup};
use gateway::GatewayConfig;
use gateway::fanout::Interest;
use guest::Conduct;
use guest::file::Protocol;
use perception::PerceptionConfig;
use perception::attitude::{Catalogued, SkyConfig};
use perception::brought::Brought;
use scenario::Scenario;
use sim::SimConfig;
use sim::scene::Scene;
use wire::core::Topic;
use wire::guest::{Place, StartPose};
use wire::id::{Boot, NodeId, PeerId, UnitId, WorldId};
use wire::mode::Guard;
use wire::policy::{Check, Policy, Requirement};
use wire::time::Span;

use super::contact::Contacted;
use super::draw::Draw;
use super::keys::{self, RunSecret};
use super::member::{BusEndpoint, Host, Member, MemberRole};
use super::{OPERATORS, attack, rogue, scene, script, station};

/// Participants on their way into a topology.
pub(super) struct Company<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) with: &'a scenario::Setup,
    pub(super) seed: u64,
    pub(super) secret: &'a RunSecret,
    pub(super) public_keys: Vec<(NodeId, [u8; 32])>,
    pub(super) contacted: Contacted,
    pub(super) members: Vec<Member>,
}

impl Company<'_> {
    fn setup(&self, node: NodeId, host: Host, topics: &[(Topic, NodeId)]) -> Setup {
        let ablation =
            (!self.with.policy.is_full()).then(|| Ablation { scenario: self.scenario.name.as_str().to_owned() });
        Setup {
            node,
            boot: Boot(1),
            world: WorldId(0),
            // Nodes of one trial differ in the top byte, trials of one campaign in the low ones: no two share a seed.
            seed: self.seed ^ (node.index() as u64) << 56,
            policy: self.with.policy.clone(),
            bounds: self.with.misset.unwrap_or(self.with.bounds),
            secret: self.secret.signing_secret(keys::signer(node)),
            public_keys: self.public_keys.clone(),
            channels: self.secret.channels(host, node, topics),
            ablation,
            verifier: None,
        }
    }

    fn add(
        &mut self,
        host: Host,
        role: MemberRole,
        node: NodeId,
        reads: &[(Topic, NodeId)],
        writes: &[Topic],
    ) -> &mut Member {
        let topics: Vec<_> = reads.iter().copied().chain(writes.iter().map(|t| (*t, node))).collect();
        let setup = self.setup(node, host, &topics);
        let mut subscribes: Vec<Topic> = reads.iter().map(|(t, _)| *t).collect();
        subscribes.dedup(); // Producers of one topic are adjacent in `reads`.
        let member = Member {
            host,
            role,
            setup,
            subscribes,
            publishes: writes.to_vec(),
            peer: None,
            commands: false,
            endpoint: BusEndpoint::Outside,
        };
        self.members.push(member);
        self.members.last_mut().expect("just pushed")
    }

    pub(super) fn vehicle_a(&mut self, draw: &Draw) {
        self.vehicle(Host::VehicleA, UnitId::A, draw, None);
        let recorder = NodeId::RECORDER;
        self.add(Host::VehicleA, MemberRole::Recorder, recorder, &[], &[Topic::Seals]);
    }

    /// Pass and catalogue of a platform that looks at stars: the places of all that stands still.
    fn sky(&self, world: &Scene) -> Option<SkyConfig> {
        let Body::Satellite(numbers) = self.with.platform.body() else { return None };
        let objects = world.objects.iter().filter(|object| !object.moves());
        let catalogued = objects.filter_map(|object| {
            let [east, north] = *object.path.first()?;
            Some(Catalogued { class: object.class, place_m: [f64::from(east), f64::from(north)] })
        });
        Some(SkyConfig {
            pass: numbers.pass(),
            started_us: sim::sensor::localisation::EPOCH_US,
            catalogue: catalogued.collect(),
            view_m: numbers.view_m,
        })
    }

    /// Sim, perception and autonomy of one unit; a teammate starts elsewhere and is never rendered.
    fn vehicle(&mut self, host: Host, unit: UnitId, draw: &Draw, start: Option<&scenario::Pose>) {
        let under_test = unit == UnitId::A;
        let rendered = under_test && self.with.rendered && self.with.platform.has_camera();
        let (sim, perception) =
            if under_test { (NodeId::SIM, NodeId::PERCEPTION) } else { (NodeId::SIM_C, NodeId::PERCEPTION_C) };
        let node = unit.node();
        let faults = if under_test { attack::faults(self.scenario, draw.phase_ms) } else { Vec::new() };
        let world = scene::build_scene(self.scenario, draw.shift_m, start);
        let seen = if rendered { Topic::Frames } else { Topic::Candidates };
        let config = SimConfig {
            node: sim,
            unit,
            boot: Boot(1),
            seed: draw.noise.wrapping_add(unit.node().index() as u64),
            rendered,
            witness: true,
            scene: world.clone(),
            body: self.with.platform.body(),
            sensors: self.with.platform.sensors(),
            faults,
            noise: sim::NoiseModel::default(),
            fidelity: scene::fidelity(&self.scenario.models),
            clock_ppm: draw.clocks[host as usize].drift_ppm as i32,
        };
        let writes = [Topic::Frames, Topic::Candidates, Topic::Navigation];
        self.add(host, MemberRole::Sim(config), sim, &[(Topic::Drive, node), (Topic::Act, node)], &writes);
        let detector = self.with.detector.as_ref().filter(|_| rendered).map(Brought::for_run);
        let config = PerceptionConfig {
            rendered,
            detector,
            sensors: self.with.platform.seen_from(),
            sky: self.sky(&world),
            ..PerceptionConfig::default()
        };
        self.add(
            host,
            MemberRole::Perception(config),
            perception,
            &[(seen, sim), (Topic::Navigation, sim)],
            &[Topic::Tracks],
        );
        let config = self.autonomy(unit, &world);
        let bare = config.guest.as_ref().is_some_and(|guest| guest.bare);
        let unguarded = bare.then(|| self.unguarded());
        let ablation = Ablation { scenario: self.scenario.name.as_str().to_owned() };
        let reads = [(Topic::Navigation, sim), (Topic::Tracks, perception), (Topic::Seals, NodeId::RECORDER)];
        let member = self.add(host, MemberRole::Autonomy(config), node, &reads, &[Topic::Drive, Topic::Act]);
        if let Some(policy) = unguarded {
            member.setup.policy = policy;
            member.setup.ablation = Some(ablation);
        }
        member.peer = peer_of(node);
        member.commands = true;
    }

    fn autonomy(&self, unit: UnitId, world: &sim::scene::Scene) -> AutonomyConfig {
        let silent = unit == UnitId::C && attack::third_is_silent(self.scenario);
        let other_units = [UnitId::A, UnitId::B, UnitId::C].into_iter().filter(|u| *u != unit);
        AutonomyConfig {
            unit,
            route: world.route.iter().map(|p| scene::millimetres(*p)).collect(),
            looped: false,
            geofence: world.geofence.iter().map(|p| scene::millimetres(*p)).collect(),
            obstacles: scene::map(world),
            teammates: other_units.collect(),
            operators: OPERATORS.to_vec(),
            mandates: station::mandates(self.scenario),
            contacts: self.contacts(unit),
            supervisor: if silent { PeerId::UNIT_B } else { PeerId::GATEWAY },
            limits: self.with.platform.limits(),
            guest: self.guest(unit, world),
        }
    }

    /// Contact plan of a unit; teammates are always in contact.
    fn contacts(&self, unit: UnitId) -> Contacts {
        if unit == UnitId::A { self.contacted.contacts.clone() } else { Contacts::default() }
    }

    /// The guest that drives the unit under test.
    fn guest(&self, unit: UnitId, world: &sim::scene::Scene) -> Option<GuestConfig> {
        let guest = self.with.guest.as_ref().filter(|_| unit == UnitId::A)?;
        let limits = &guest.program.limits;
        Some(GuestConfig {
            name: guest.program.name.clone(),
            bare: guest.conduct == Conduct::Bare,
            start_limit: Span::ms(limits.start_ms),
            step_limit: Span::ms(limits.step_ms),
            start: Some(self.start(world)).filter(|_| guest.program.protocol >= Protocol::V2),
        })
    }

    /// Pose at the start, as surveyed; a body in the air starts at the height that it flies at.
    fn start(&self, world: &sim::scene::Scene) -> StartPose {
        let (x_mm, y_mm) = scene::millimetres([world.start.east, world.start.north]);
        let aloft = self.with.platform.limits().aloft;
        StartPose {
            at: Place(x_mm, y_mm),
            yaw_mrad: (world.start.heading * 1000.0) as i32,
            height_mm: aloft.map(|aloft| aloft.cruise_mm as i32),
        }
    }

    /// The policy of a bare guest's unit: none of its own checks looks at what the guest is given, or stops it.
    fn unguarded(&self) -> Policy {
        let mut policy = self.with.policy.clone();
        policy.guards.extend(Guard::ALL.map(|guard| (guard, Requirement::Waived)));
        policy.boundary.insert(Check::Freshness, Requirement::Waived);
        policy
    }

    pub(super) fn control(&mut self, draw: &Draw) {
        let units = vec![UnitId::A, UnitId::B, UnitId::C];
        let rest = |of: UnitId| units.iter().copied().filter(|unit| *unit != of).collect();
        let config = GatewayConfig {
            interests: units.iter().map(|unit| Interest { unit: *unit, hears: rest(*unit) }).collect(),
            units,
            operators: OPERATORS.to_vec(),
            mandates: station::mandates(self.scenario),
            contacts: vec![(UnitId::A, self.contacted.contacts.clone())],
        };
        let (gateway, console) = (NodeId::GATEWAY, NodeId::CONSOLE);
        let stations = std::iter::once(console).chain(station::channel(self.scenario));
        let reads: Vec<_> = stations.map(|station| (Topic::Intents, station)).collect();
        let member = self.add(Host::Control, MemberRole::Gateway(config), gateway, &reads, &[Topic::Feed]);
        member.peer = peer_of(gateway);
        member.commands = true;
        if attack::gateway(self.scenario, 0).is_some() {
            self.members.iter_mut().filter(|m| m.node() == gateway).for_each(|m| m.endpoint = BusEndpoint::Inside);
        }
        let (secret, revocations) = (self.secret.signing_secret(NodeId::OPERATOR), self.secret.revocations());
        let config = script::console(self.scenario, draw, secret, revocations);
        self.add(Host::Control, MemberRole::Console(config), console, &[(Topic::Feed, gateway)], &[Topic::Intents]);
    }

    /// Adds an adversary without a channel.
    fn hostile(&mut self, host: Host, node: NodeId, config: AdversaryConfig) -> &mut Member {
        self.add(host, MemberRole::Adversary(config), node, &[], &[])
    }

    pub(super) fn adversary(&mut self, draw: &Draw) {
        let relay = attack::datagrams(self.scenario, draw.phase_ms, self.contacted.medium.clone());
        self.hostile(Host::Adversary, NodeId::RELAY_TELEMETRY, AdversaryConfig::DatagramRelay(relay));
        let stream = attack::stream(self.scenario, draw.phase_ms, self.contacted.medium.clone());
        self.hostile(Host::Adversary, NodeId::RELAY_COMMAND, AdversaryConfig::StreamRelay(stream));
        if let Some(config) = attack::teammate(self.scenario, draw.phase_ms) {
            let member = self.hostile(Host::Insider, NodeId::INSIDER_B, AdversaryConfig::InsiderTeammate(config));
            member.peer = Some(PeerId::UNIT_B);
        }
        if let Some(third) = self.scenario.unit.iter().find(|u| u.name.as_str() == "unit-c") {
            let start = third.start;
            self.vehicle(Host::VehicleC, UnitId::C, draw, Some(&start));
        }
        if let Some(config) = attack::broker(self.scenario, draw.phase_ms) {
            let member = self.hostile(Host::Control, NodeId::INSIDER_BROKER, AdversaryConfig::InsiderBroker(config));
            member.peer = Some(PeerId::BROKER);
        }
        if let Some(config) = attack::gateway(self.scenario, draw.phase_ms) {
            let reads = [(Topic::Feed, NodeId::GATEWAY), (Topic::Intents, NodeId::CONSOLE)];
            let insider = MemberRole::Adversary(AdversaryConfig::InsiderGateway(config));
            let member = self.add(Host::Control, insider, NodeId::INSIDER_GATEWAY, &reads, &[]);
            member.publishes = vec![Topic::Feed, Topic::Intents];
            member.endpoint = BusEndpoint::Between;
        }
        if let Some(config) = station::plan(self.scenario, draw.phase_ms, self.secret) {
            let peer = config.certificate;
            let writes: &[Topic] = if peer.is_none() { &[Topic::Intents] } else { &[] };
            let (rogue, reads) = (NodeId::INSIDER_OPERATOR, [(Topic::Feed, NodeId::GATEWAY)]);
            let member = self.add(
                Host::Control,
                MemberRole::Adversary(AdversaryConfig::InsiderOperator(config)),
                rogue,
                &reads,
                writes,
            );
            // It reads the feed without judging it. The key would let it write there in the gateway's name.
            member.setup.channels.retain(|channel| channel.topic != Topic::Feed);
            member.peer = peer;
            member.commands = peer.is_some();
        }
        if let Some(config) = station::thief(self.scenario, draw.phase_ms) {
            let peer = config.certificate;
            let member = self.hostile(Host::Control, NodeId::IMPOSTOR, AdversaryConfig::SessionThief(config));
            member.peer = Some(peer);
            member.commands = true;
        }
        if let Some(casting) = rogue::casting(self.scenario, draw.phase_ms) {
            self.rogue(casting);
        }
    }

    /// Adds the rogue: a process that reads and writes channels of its host, with the keys of its holder or with none.
    fn rogue(&mut self, casting: rogue::Casting) {
        let rogue::Casting { host, node, holder, topics, config } = casting;
        let held = self.members.iter().find(|m| Some(m.node()) == holder).map(|m| m.setup.channels.clone());
        let member = self.hostile(host, node, AdversaryConfig::Rogue(config));
        member.setup.channels = held.unwrap_or_default();
        member.subscribes.clone_from(&topics);
        member.publishes = topics;
    }

    pub(super) fn finish(self) -> Vec<Member> {
        self.members
    }
}

fn peer_of(node: NodeId) -> Option<PeerId> {
    PeerId::from_name(node.name())
}
