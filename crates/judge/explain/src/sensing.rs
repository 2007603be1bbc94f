//! Losses of perception: products of stages, the unit's place, the designated track.

use evidence::Micros;
use ground_truth::{Any, Note, Sensor};
use wire::core::Topic;
use wire::event::{Event, Interface};
use wire::id::NodeId;
use wire::mode::{Because, Cause, Guard};
use wire::refusal::Reason;
use wire::sensor::{Modalities, Modality};

use super::chain::{from, of_unit};
use super::{Change, FaultSite, LinkStage, Log, Origin};

/// Longest pause between entries of the plant's state.
const WORLD_SPEAKS: Micros = 250_000;
/// Time from the moment at which a product is too old to the judgement that finds it so, on a busy host.
const NOTICED: Micros = 200_000;
/// Time before a loss within which a refusal may have led to it.
const LEADING: Micros = 700_000;

/// A stage gives no fresh product.
pub(super) fn product(log: &Log, change: &Change, guard: Guard) -> Origin {
    let since = silent_since(change);
    if let Some(origin) = no_world(log, change) {
        return origin;
    }
    if let Some((time, frame, modality)) = missing(log, change, |m| Guard::from_modality(m) == guard) {
        return lacking(log, change, time, frame, modality);
    }
    if let Some(origin) = went_back(log, change, since) {
        return origin;
    }
    let stopped = format!("no product of perception since the frame of {} ms", since / 1000);
    let refused =
        refused_on(log, change, since.saturating_sub(LEADING), &[Topic::Tracks, Topic::Candidates, Topic::Frames]);
    from(NodeId::UNIT_A, FaultSite::Perception, since, stopped).refusing(NodeId::UNIT_A, &refused)
}

/// A product so old would have been missed long before, had none come meanwhile: those that came are as old.
fn went_back(log: &Log, change: &Change, since: Micros) -> Option<Origin> {
    let missed = since + log.bounds.product_limit_ms.max(log.bounds.track_limit_ms) * 1000 + NOTICED;
    let by_itself = matches!(change.cause, Cause::Lost(_)) && change.at > missed;
    let name = format!("perception's products went back to those of the frame of {} ms", since / 1000);
    by_itself.then(|| of_unit(FaultSite::Perception, change.at, name))
}

/// The unit does not know its place, or the time.
pub(super) fn place(log: &Log, change: &Change, guard: Guard) -> Origin {
    if let Some(origin) = no_world(log, change) {
        return origin;
    }
    let seen = log.last(NodeId::UNIT_A, change.at, |event| match *event {
        Any::Service(Event::NavigationSeen { fix, odometry }) => Some((fix, odometry)),
        _ => None,
    });
    let missing = |since: Micros, sensor: Sensor, name: &str| {
        let origin = of_unit(FaultSite::Sensor(sensor), since, format!("navigation comes without {name}"));
        origin.with_link(LinkStage::Health, since, NodeId::UNIT_A, format!("the unit has to do without {name}"))
    };
    match seen {
        Some((since, (false, _))) => return missing(since, Sensor::Localisation, "a fix"),
        Some((since, (true, false))) => return missing(since, Sensor::Odometry, "odometry"),
        Some((_, (true, true))) | None => {}
    }
    let since = silent_since(change);
    if let Because::Silence(_) = change.because {
        let refused = refused_on(log, change, since.saturating_sub(LEADING), &[Topic::Navigation]);
        return from(NodeId::UNIT_A, FaultSite::World, since, "no navigation since then")
            .refusing(NodeId::UNIT_A, &refused);
    }
    let disturbed = |name| of_unit(FaultSite::Sensor(Sensor::Localisation), distrusted_since(log, change), name);
    // With one source of each the unit cannot tell which of the two is wrong.
    let either = |name| disturbed(name).or(FaultSite::Sensor(Sensor::Odometry));
    match guard {
        Guard::TimeBase => disturbed("the receiver's time does not run with this host's clock"),
        Guard::Drift => either("fix and odometry disagree: the one drifts away from where the other leads"),
        _ => either("fix and odometry disagree: the one is not where the other leads"),
    }
}

/// The designated track is gone or no longer good enough.
pub(super) fn designation(log: &Log, change: &Change) -> Origin {
    if let Some(origin) = no_world(log, change) {
        return origin;
    }
    if let Some((since, frame, modality)) = missing(log, change, |_| true) {
        return lacking(log, change, since, frame, modality);
    }
    if let Some(origin) = misled(log, change) {
        return origin;
    }
    let since = silent_since(change);
    let refused = refused_on(log, change, since.saturating_sub(LEADING), &[Topic::Tracks, Topic::Candidates]);
    let name = match change.because {
        Because::Frame(frame) => format!("the designated track is too weak from frame {} on", frame.0),
        Because::Silence(_) => "the designated track was not seen again".to_owned(),
        _ => "the designated track is not what was designated".to_owned(),
    };
    of_unit(FaultSite::Track, since, name).refusing(NodeId::UNIT_A, &refused)
}

/// Perception has lost the world's own navigation to an impostor who speaks in its name: it refuses that as of an older boot, and
/// does so permanently, since a boot only rises. From then on it places tracks wrongly, or not at all.
fn misled(log: &Log, change: &Change) -> Option<Origin> {
    let (since, ()) = log.first(NodeId::PERCEPTION, 0, |event| match event {
        Any::Service(Event::Refused { at: Interface::Bus(Topic::Navigation), reason: Reason::Epoch, .. }) => Some(()),
        _ => None,
    })?;
    let name = "perception refuses the world's navigation as of an older boot, and goes by somebody else's";
    let refused = refused_on(log, change, since.saturating_sub(LEADING), &[Topic::Navigation]);
    let origin = from(NodeId::PERCEPTION, FaultSite::Sensor(Sensor::Localisation), since, name)
        .refusing(NodeId::UNIT_A, &refused)
        .with_link(
            LinkStage::Health,
            silent_since(change).max(since),
            NodeId::UNIT_A,
            "the designated track is not seen where it was",
        );
    (since <= change.at).then_some(origin)
}

/// Refusals of the unit on these channels of its host.
pub(super) fn refused_on(log: &Log, change: &Change, from: Micros, topics: &[Topic]) -> Vec<(Micros, String)> {
    let on_bus = |interface: Interface, _| matches!(interface, Interface::Bus(topic) if topics.contains(&topic));
    log.refused(NodeId::UNIT_A, on_bus, from, change.at)
}

/// Time since which no message came, where the unit reports it; else the time of its judgement.
fn silent_since(change: &Change) -> Micros {
    if let Because::Silence(stamp) = change.because { change.on_trace(stamp) } else { change.at }
}

/// The world stood still or is gone: the plant, which is part of it, writes no more, or did not for a time.
fn no_world(log: &Log, change: &Change) -> Option<Origin> {
    let truth = |event: &Any| matches!(event, Any::Instrument(Note::Truth { .. })).then_some(());
    let (last, ()) = log.last(NodeId::SIM, change.at, truth)?;
    let since = (change.at - last > WORLD_SPEAKS).then_some(last).or_else(|| pause(log, change))?;
    Some(from(
        NodeId::SIM,
        FaultSite::World,
        since,
        "the vehicle's world gave nothing: no frames, no navigation, no plant",
    ))
}

/// The beginning of a pause of the world behind which the loss was found.
fn pause(log: &Log, change: &Change) -> Option<Micros> {
    let since = silent_since(change);
    let spoken =
        log.entries_by(NodeId::SIM).filter(|w| w.at + WORLD_SPEAKS >= since && w.at <= change.at).map(|w| w.at);
    let spoken: Vec<Micros> = spoken.collect();
    spoken.windows(2).find(|pair| pair[1] - pair[0] > WORLD_SPEAKS).map(|pair| pair[0])
}

/// The frame from which on a modality that `wanted` picks is lacking at the change, or was until shortly before it: a modality whole again
/// when its loss is found was lacking all the same, if it went after its last product. With its time, the frame, and the modality.
fn missing(log: &Log, change: &Change, wanted: impl Fn(Modality) -> bool) -> Option<(Micros, u64, Modality)> {
    let since = silent_since(change);
    let frames = log.entries_by(NodeId::PERCEPTION).filter(|w| w.at <= change.at);
    let frames: Vec<(Micros, u64, Modalities)> = frames
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::FrameSeen { frame, present }) => Some((w.at, frame.0, present)),
            _ => None,
        })
        .collect();
    let lacks = |modality: Modality| {
        let last = frames.iter().rposition(|(.., present)| !present.contains(modality))?;
        let run = frames[..=last].iter().rev().take_while(|(.., present)| !present.contains(modality));
        let (time, frame, _) = run.last()?;
        (last + 1 == frames.len() || *time >= since).then_some((*time, *frame, modality))
    };
    Modality::ALL.into_iter().filter(|m| wanted(*m)).find_map(lacks)
}

fn lacking(log: &Log, change: &Change, since: Micros, frame: u64, modality: Modality) -> Origin {
    let name = modality.name();
    let limit = log.bounds.product_limit_ms;
    let like = log.last(NodeId::PERCEPTION, since, |event| match *event {
        Any::Service(Event::Repeated { modality: m, frame: at, first }) if (m, at.0) == (modality, frame) => {
            Some(first.0)
        }
        _ => None,
    });
    let noticed = since;
    // It is noticed after several frames; it went wrong behind the one that the unit has a fresh product of.
    let (since, label) = match like {
        Some((_, first)) => {
            let label = format!("{name} shows in frame {frame} what it showed in frame {first}, under new stamps");
            (silent_since(change).min(since), label)
        }
        None => (since, format!("frames come without {name} from frame {frame} on")),
    };
    from(NodeId::PERCEPTION, FaultSite::Sensor(Sensor::from_modality(modality)), since, label).with_link(
        LinkStage::Health,
        silent_since(change).max(noticed),
        NodeId::UNIT_A,
        format!("no fresh product of {name}; one may be {limit} ms old"),
    )
}

/// Since when the unit says that it does not use fixes; else when it judged.
fn distrusted_since(log: &Log, change: &Change) -> Micros {
    let located = log.entries_by(NodeId::UNIT_A).filter(|w| w.at <= change.at);
    let flags = located.filter_map(|w| match w.entry.event {
        Any::Service(Event::Located { distrusted, .. }) => Some((w.at, distrusted)),
        _ => None,
    });
    let flags: Vec<(Micros, bool)> = flags.collect();
    let run = flags.iter().rev().take_while(|(_, distrusted)| *distrusted);
    run.last().map_or(change.at, |(time, _)| *time)
}
