//! Participants of a trial: from a scenario and a seed to the cores' setups, the same for the twin and for live.
//!
//! Every variation of a seed is drawn here, once, in a fixed order. The twin makes the cores in its own thread, the
//! live launcher hands the same setups to processes; neither adds its own draw.

mod attack;
mod company;
mod contact;
mod control;
mod draw;
mod guest_bus;
mod keys;
mod member;
mod overpass;
mod process;
mod rogue;
mod scene;
mod script;
mod station;

use std::collections::BTreeMap;

use adversary::insider::InsiderRecorder;
use adversary::plan::Tampering;
use config::contact::Contacts;
use config::platform::Body;
use config::setup::Setup;
use evidence::anchors::{ClockAnchor, Life, TrustAnchors};
use evidence::cue::Cue;
use evidence::log::hex;
use evidence::mission::Script;
use evidence::progress::Route;
use evidence::{Plan, Planned, Under};
use guest::Guest;
use scenario::Scenario;
use wire::core::Topic;
use wire::id::{Boot, NodeId};
use wire::person::Role as Person;
use wire::policy::{Check, Requirement};
use wire::sign::Key;
use wire::sign::Secret;
use wire::trust::Validity;

use company::Company;
use draw::Draw;

pub use attack::is_attacked;
pub use guest_bus::TimedOrder;
pub use keys::RunSecret;
pub use member::{BusEndpoint, Host, Member, MemberRole};
pub use overpass::Overpass;
pub use process::{ProcessFault, ProcessFaultKind, Turn, next_turn, node_of};
pub use scene::needs_rendering;

/// Identities that may give commands, in every run. Only the rogue of some scenarios has the second one's key.
const OPERATORS: [NodeId; 2] = [NodeId::OPERATOR, NodeId::OPERATOR_2];

/// A secure session between two members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// End that dials.
    pub client: NodeId,
    /// End that listens.
    pub server: NodeId,
    /// True if the datagram relay is in the path.
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

/// Participants of one trial, with their keys, links, clocks and plans.
#[derive(Clone, Debug)]
pub struct Topology {
    /// The unit under test.
    pub under: Under,
    /// Members, in the order that breaks ties.
    pub members: Vec<Member>,
    /// Sessions.
    pub links: Vec<Link>,
    /// One clock a host, in the order of [`Host::ALL`].
    pub clocks: Vec<ClockDraw>,
    /// Processes that are to end, or to be kept from running.
    pub process_faults: Vec<ProcessFault>,
    /// Steps that wait for an event on the instrument plane.
    pub cues: Vec<Cue>,
    /// Injections for which the oracle needs receipts.
    pub planned: Vec<Plan>,
    /// Script of the operator, as the oracle presumes it.
    pub script: Script,
    /// Contact plan of the link between the unit and the gateway.
    pub contacts: Contacts,
    /// Validity of each identity with a limited mandate.
    pub mandates: Vec<Validity>,
    /// Length of the trial, microseconds.
    pub duration: u64,
    /// True if link and stage delays vary with the seed.
    pub varied_delays: bool,
    /// The keys under which guards sign their observations, and the launcher its notes.
    pub witnesses: BTreeMap<NodeId, Secret>,
    /// The guest that drives the unit under test.
    pub guest: Option<Guest>,
    /// Attacks on the bus of the guest's own programs, which its adapter carries out.
    pub bus_orders: Vec<TimedOrder>,
    /// Manipulation of the recording by the recorder's insider, and the seed of its place.
    pub tampering: Option<(Tampering, u64)>,
}

impl Topology {
    /// Faults of a user's detector in this run, in words.
    pub fn detector_faults(&self) -> Option<String> {
        self.members.iter().find_map(|member| {
            let MemberRole::Perception(config) = &member.role else { return None };
            config.detector.as_ref()?.faults.describe()
        })
    }

    /// The topology with a console for a person in this role at a live run, who reads its display in words. In a twin there
    /// is no reader. A person who may only look has no pen there, and neither has the script then.
    #[must_use]
    pub fn seating(mut self, role: Person) -> Topology {
        for member in &mut self.members {
            if let MemberRole::Console(config) = &mut member.role {
                (config.text, config.role) = (true, role);
            }
        }
        self
    }

    /// The world of the unit under test.
    pub fn world(&self) -> Option<&sim::SimConfig> {
        self.members.iter().find_map(|member| {
            let MemberRole::Sim(config) = &member.role else { return None };
            (config.node == self.under.sim).then_some(config)
        })
    }

    /// Route of the unit under test; without way points where its body has no way to go.
    pub fn route(&self) -> Route {
        let body = self.world().map(|world| &world.body);
        let config = self.members.iter().find_map(|member| {
            let MemberRole::Autonomy(config) = &member.role else { return None };
            (config.unit == self.under.unit).then_some(config)
        });
        let Some(config) = config.filter(|_| !matches!(body, Some(Body::Satellite(_)))) else {
            return Route::default();
        };
        // In DEGRADED wheels drive on slowly; a body in the air loiters.
        let in_degraded = matches!(body, Some(Body::Wheeled(_)));
        Route { points_mm: config.route.clone(), looped: config.looped, in_degraded }
    }

    /// State of the broker's table of rights, by the policy. All members have the same.
    pub fn rights(&self) -> Requirement {
        self.members.first().map_or(Requirement::Required, |member| member.setup.policy.check(Check::Rights))
    }

    /// Anchors of trust in the log: public keys of all signers, clocks of all stamps, and processes that owe no last
    /// signature. There is no head yet. Live the broker signs too; `live` has its secret and the greatest time from the
    /// writing of an entry to its delivery, microseconds. In the twin this is the longest suspension of the process.
    pub fn trust_anchors(&self, live: Option<(&Secret, u64)>) -> TrustAnchors {
        let key = |node: NodeId, secret: &Secret| (node, hex(&Key::from_bytes(&secret.0).public()));
        let members = self.members.iter().map(|m| key(m.node(), &m.setup.secret));
        let broker = live.map(|(secret, _)| key(NodeId::BROKER, secret));
        let witnesses = self.witnesses.iter().map(|(node, secret)| key(*node, secret));
        let killed = self.killed().into_iter();
        // A guard outlives its process in the twin; live it is a part of the process and ends with it.
        let lives = killed.flat_map(|node| [Some(node), self.ingress_of(node).filter(|_| live.is_some())]).flatten();
        TrustAnchors {
            keys: members.chain(broker).chain(witnesses).collect(),
            killed: lives.map(|node| Life { node, boot: Boot(1) }).collect(),
            clocks: self.clock_anchors(live.map(|(_, late_us)| late_us)),
            ..TrustAnchors::default()
        }
    }

    /// Live, guards and launcher use the recording's own clock; in the twin a member's guard uses that of its host.
    fn clock_anchors(&self, live_late_us: Option<u64>) -> BTreeMap<NodeId, ClockAnchor> {
        let of_host = |host: Host, late_us: u64| {
            let ClockDraw { zero_us, drift_ppm } = self.clocks[host as usize];
            ClockAnchor { zero_us, drift_ppm, late_us }
        };
        let late_us = |node: NodeId| live_late_us.unwrap_or_else(|| self.stopped(node));
        let mut clocks: BTreeMap<NodeId, ClockAnchor> =
            self.witnesses.keys().map(|node| (*node, ClockAnchor::default())).collect();
        clocks.insert(NodeId::BROKER, of_host(Host::Control, late_us(NodeId::BROKER)));
        for member in &self.members {
            clocks.insert(member.node(), of_host(member.host, late_us(member.node())));
            if let Some(guard) = member.node().guard().filter(|_| live_late_us.is_none()) {
                clocks.insert(guard, of_host(member.host, 0));
            }
        }
        clocks
    }

    /// Ingress observer of this node's sessions and streams; a participant in the broker's place has the broker's.
    pub fn ingress_of(&self, node: NodeId) -> Option<NodeId> {
        if node == self.broker() { NodeId::BROKER.guard() } else { node.guard() }
    }

    /// Processes that are to be suspended. The inputs of their cores are watched for the receipt.
    pub fn watched(&self) -> Vec<NodeId> {
        let suspended = |plan: &Plan| if let Planned::Suspend(node) = plan.what { Some(node) } else { None };
        self.planned.iter().filter_map(suspended).collect()
    }

    /// True if the recorder's disk is to be full for a time, and so the recording is looked at while it grows.
    pub fn fills(&self) -> bool {
        self.planned.iter().any(|plan| matches!(plan.what, Planned::Fill(_)))
    }

    /// The longest time for which `node` is to be kept from running, microseconds.
    pub fn stopped(&self, node: NodeId) -> u64 {
        let lasts = |fault: &ProcessFault| match fault.kind {
            ProcessFaultKind::Suspend { lasts, .. } => lasts,
            ProcessFaultKind::Kill { .. } | ProcessFaultKind::Fill { .. } => 0,
        };
        self.process_faults.iter().filter(|fault| fault.node == node).map(lasts).max().unwrap_or(0)
    }

    /// The insider who controls the recorder, when the scenario has one.
    pub fn hands(&self) -> Option<InsiderRecorder> {
        let (does, seed) = self.tampering?;
        let recorder = self.members.iter().find(|m| m.node() == NodeId::RECORDER)?;
        Some(InsiderRecorder::new(recorder.setup.key(), does, seed))
    }

    /// Router of the command plane: the broker, or the participant in its place.
    pub fn broker(&self) -> NodeId {
        let hostile = self.members.iter().any(|m| m.node() == NodeId::INSIDER_BROKER);
        if hostile { NodeId::INSIDER_BROKER } else { NodeId::BROKER }
    }

    /// Identities that may give commands, each with its end of validity, microseconds of the run.
    pub fn operators(&self) -> Vec<(NodeId, u64)> {
        let until = |node: NodeId| self.mandates.iter().find(|m| m.who == node).map_or(u64::MAX, |m| m.until_ms * 1000);
        OPERATORS.map(|node| (node, until(node))).to_vec()
    }

    /// Processes that are to end, and so owe no closing account.
    pub fn killed(&self) -> Vec<NodeId> {
        let ends = |fault: &&ProcessFault| matches!(fault.kind, ProcessFaultKind::Kill { .. });
        self.process_faults.iter().filter(ends).map(|fault| fault.node).collect()
    }
}

/// Lays out the topology of one trial.
pub fn lay_out(scenario: &Scenario, with: &scenario::Setup, seed: u64, secret: &RunSecret) -> Topology {
    let draw = Draw::from_scenario(scenario, seed);
    let public_keys = secret.public_keys();
    let contacted = contact::plan(scenario, with);
    let contacts = contacted.contacts.clone();
    let mut company = Company { scenario, with, seed, secret, public_keys, contacted, members: Vec::new() };
    company.vehicle_a(&draw);
    company.control(&draw);
    company.adversary(&draw);
    let members = company.finish();
    Topology {
        under: Under::A,
        links: links(scenario, &members),
        clocks: draw.clocks,
        process_faults: process::process_faults(scenario, draw.phase_ms),
        cues: attack::cues(scenario, draw.phase_ms),
        planned: attack::planned::plans(scenario, draw.phase_ms),
        script: script::presumed(scenario),
        contacts,
        mandates: station::mandates(scenario),
        duration: (scenario.duration_s.get() * 1e6) as u64,
        varied_delays: scenario.varies.delays,
        guest: with.guest.clone(),
        bus_orders: guest_bus::orders(scenario, draw.phase_ms),
        tampering: attack::tampering(scenario, seed),
        witnesses: witnesses(&members, secret),
        members,
    }
}

/// Keys of every guard that there is, and of the launcher.
fn witnesses(members: &[Member], secret: &RunSecret) -> BTreeMap<NodeId, Secret> {
    let guards = members.iter().filter_map(|member| member.node().guard());
    let other_nodes = NodeId::BROKER.guard().into_iter().chain([NodeId::CAMPAIGN]);
    guards.chain(other_nodes).map(|node| (node, secret.witness(node))).collect()
}

fn links(scenario: &Scenario, members: &[Member]) -> Vec<Link> {
    let has_node = |node: NodeId| members.iter().any(|m| m.node() == node);
    let mut links = vec![Link { client: NodeId::UNIT_A, server: NodeId::GATEWAY, relayed: true }];
    if has_node(NodeId::INSIDER_B) {
        links.push(Link { client: NodeId::INSIDER_B, server: NodeId::GATEWAY, relayed: false });
    }
    if has_node(NodeId::UNIT_C) {
        let server = if attack::third_is_silent(scenario) { NodeId::INSIDER_B } else { NodeId::GATEWAY };
        links.push(Link { client: NodeId::UNIT_C, server, relayed: false });
    }
    links
}

/// The sim's channel keys out of its setup. A channel that the setup lacks gets a key that no one else has.
pub fn sim_keys(setup: &Setup) -> sim::ChannelKeys {
    let channel_key = |topic: Topic, reader: usize| {
        // The order of `RunSecret::channels`: a channel's keys by reader.
        let listed = setup.channels.iter().filter(|c| c.topic == topic).nth(reader).map(|c| c.key.clone());
        listed.unwrap_or(wire::bus::ChannelKey(setup.secret.0))
    };
    let key = |topic: Topic| channel_key(topic, 0);
    sim::ChannelKeys {
        frames: key(Topic::Frames),
        candidates: key(Topic::Candidates),
        navigation: [channel_key(Topic::Navigation, 0), channel_key(Topic::Navigation, 1)],
        drive: key(Topic::Drive),
        act: key(Topic::Act),
    }
}
