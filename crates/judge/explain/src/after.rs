//! Consequences of a change of mode: authority, the plant, the display.

use evidence::{Micros, Witnessed};
use ground_truth::{Any, Note};
use wire::event::Event;
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;

use super::{ChainStep, Change, LinkStage, Log, Split};

/// Speed below which the plant counts as standing, mm/s.
const STANDING: i32 = 50;

/// The links behind the transition, and how long they took.
pub(super) fn follow(log: &Log, change: &Change) -> (Vec<ChainStep>, Split) {
    let mut steps: Vec<ChainStep> = authority(log, change).into_iter().collect();
    let mut split = Split::default();
    let until = log.changes().iter().find(|c| c.at > change.at).map_or(Micros::MAX, |c| c.at);
    let before_end = |found: Option<(Micros, i32)>| found.filter(|(time, _)| *time < until);
    if let Some(limit) = speed_limit(log, change) {
        let plant = |wanted: &dyn Fn(i32, i32) -> bool| {
            before_end(log.first(NodeId::SIM, change.at, |event| match *event {
                Any::Instrument(Note::Truth { unit: UnitId::A, speed_mm_s, set_speed_mm_s, .. }) => {
                    wanted(speed_mm_s, set_speed_mm_s).then_some(speed_mm_s)
                }
                _ => None,
            }))
        };
        if let Some((at_us, speed)) = plant(&|_, set| set.abs() <= limit) {
            let what = format!("the plant follows at most {limit} mm/s, and goes {speed}");
            steps.push(ChainStep { stage: LinkStage::Actuation, at_us, by: NodeId::SIM, what });
            split.plant_us = Some(at_us - change.at);
        }
        if limit <= STANDING
            && let Some((at_us, _)) = plant(&|speed, _| speed.abs() <= STANDING)
        {
            steps.push(ChainStep {
                stage: LinkStage::Actuation,
                at_us,
                by: NodeId::SIM,
                what: "the plant stands".to_owned(),
            });
            split.standing_us = Some(at_us - change.at);
        }
    }
    let shown = before_end(log.first(NodeId::CONSOLE, change.at, |event| match *event {
        Any::Service(Event::Displayed { unit: UnitId::A, mode, .. }) => (mode == change.to).then_some(0),
        _ => None,
    }));
    if let Some((at_us, _)) = shown {
        let what = format!("{} is shown", change.to.name());
        steps.push(ChainStep { stage: LinkStage::Display, at_us, by: NodeId::CONSOLE, what });
        split.display_us = Some(at_us - change.at);
    }
    (steps, split)
}

/// The fastest that the mode lets the unit go, mm/s, where it is a restriction.
fn speed_limit(log: &Log, change: &Change) -> Option<i32> {
    match change.to {
        Mode::HoldSafe => Some(STANDING),
        Mode::Degraded => Some(i32::try_from(log.bounds.degraded_speed_mm_s).unwrap_or(i32::MAX)),
        Mode::Idle | Mode::Ready | Mode::PrepareToAct => None,
    }
}

/// Fate of authority at this change: it is written in the same step of the machine.
fn authority(log: &Log, change: &Change) -> Option<ChainStep> {
    // The step has one time on the unit's clock; what it wrote is taken in one entry after the other.
    let same_step = |w: &&Witnessed| i128::from(w.entry.at.0) == i128::from(change.at) + change.local;
    let what = log.entries_by(NodeId::UNIT_A).filter(same_step).find_map(|w| match w.entry.event {
        Any::Service(Event::Minted { authority, track, .. }) => {
            Some(format!("authority {authority} is minted on track {}", track.0))
        }
        Any::Service(Event::Revoked { authority, .. }) => Some(format!("authority {authority} is revoked")),
        Any::Service(Event::Acted { authority, .. }) => Some(format!("authority {authority} is used")),
        _ => None,
    })?;
    Some(ChainStep { stage: LinkStage::Authority, at_us: change.at, by: NodeId::UNIT_A, what })
}
