//! From a scenario's tables on shared memory to the rogue that carries them out: its host, its keys, its actions.

use adversary::plan::{RogueConfig, RogueMove, Says, Spot};
use scenario::{Channel, Holder, Point, Saying, Scenario, Seconds};
use wire::core::Topic;
use wire::id::NodeId;

use super::Host;
use super::start::start_ms;

/// A rogue to be put on a host.
pub(super) struct Casting {
    /// Host.
    pub(super) host: Host,
    /// Identity in the log.
    pub(super) node: NodeId,
    /// Node of the keys it holds.
    pub(super) holder: Option<NodeId>,
    /// The channels it hears and writes.
    pub(super) topics: Vec<Topic>,
    /// Its actions.
    pub(super) config: RogueConfig,
}

/// The rogue of a scenario, when it has one. All its tables agree on host and holder (`scenario::check`).
pub(super) fn of(s: &Scenario, phase: u64) -> Option<Casting> {
    let forged = s.forge.iter().map(|f| {
        let spot = spot(f.place_m.as_ref());
        let says = match f.says {
            Saying::Echo => Says::Echo,
            Saying::Beat => Says::Beat,
            Saying::Vehicle => Says::Vehicle(spot),
            Saying::Synthetic => Says::Synthetic(spot),
            Saying::PlayedBack => Says::PlayedBack(spot),
            Saying::Elsewhere => Says::Elsewhere(spot),
        };
        let every_ms = f.every_ms.unsigned();
        (f.topic, f.holder, one(f.topic, start_ms(f, phase), f.duration_s, every_ms, says))
    });
    let again = s.republish.iter().map(|r| {
        let says = Says::Recorded { lag_ms: r.lag_ms.unsigned() };
        (r.topic, None, one(r.topic, start_ms(r, phase), r.duration_s, r.every_ms.unsigned(), says))
    });
    let altered = s.alter.iter().map(|a| {
        let says = Says::Altered(spot(Some(&a.place_m)));
        (Channel::Tracks, a.holder, one(Channel::Tracks, start_ms(a, phase), a.duration_s, 100, says))
    });
    let all: Vec<(Channel, Option<Holder>, RogueMove)> = forged.chain(again).chain(altered).collect();
    let (first, holder, _) = all.first()?;
    let mut topics: Vec<Topic> = all.iter().map(|(channel, ..)| topic(*channel)).collect();
    topics.sort();
    topics.dedup();
    Some(Casting {
        host: if first.on_control() { Host::Control } else { Host::VehicleA },
        node: if *holder == Some(Holder::Perception) { NodeId::INSIDER_PERCEPTION } else { NodeId::IMPOSTOR },
        holder: holder.map(node_of),
        topics,
        config: RogueConfig { moves: all.into_iter().map(|(_, _, plan)| plan).collect() },
    })
}

fn one(channel: Channel, at_ms: u64, duration_s: Seconds, every_ms: u64, says: Says) -> RogueMove {
    let duration_ms = (duration_s.get() * 1000.0) as u64;
    RogueMove { topic: topic(channel), producer: producer(channel), at_ms, duration_ms, every_ms, says }
}

fn spot(place: Option<&Point>) -> Spot {
    let mm = |metres: f64| (metres * 1000.0) as i32;
    place.map_or(Spot::default(), |[x, y]| Spot { x_mm: mm(x.get()), y_mm: mm(y.get()) })
}

fn topic(channel: Channel) -> Topic {
    match channel {
        Channel::Candidates => Topic::Candidates,
        Channel::Frames => Topic::Frames,
        Channel::Navigation => Topic::Navigation,
        Channel::Tracks => Topic::Tracks,
        Channel::Drive => Topic::Drive,
        Channel::Act => Topic::Act,
        Channel::Seals => Topic::Seals,
        Channel::Feed => Topic::Feed,
        Channel::Intents => Topic::Intents,
    }
}

fn producer(channel: Channel) -> NodeId {
    match channel {
        Channel::Candidates | Channel::Frames | Channel::Navigation => NodeId::SIM,
        Channel::Tracks => NodeId::PERCEPTION,
        Channel::Drive | Channel::Act => NodeId::UNIT_A,
        Channel::Seals => NodeId::RECORDER,
        Channel::Feed => NodeId::GATEWAY,
        Channel::Intents => NodeId::CONSOLE,
    }
}

fn node_of(holder: Holder) -> NodeId {
    match holder {
        Holder::Sim => NodeId::SIM,
        Holder::Perception => NodeId::PERCEPTION,
        Holder::Autonomy => NodeId::UNIT_A,
        Holder::Recorder => NodeId::RECORDER,
        Holder::Gateway => NodeId::GATEWAY,
        Holder::Console => NodeId::CONSOLE,
    }
}
