//! Audit events of the displayed values: one on every change, and at least one a period otherwise.

use wire::event::{Event, Freshness, ShownAs};
use wire::id::{CommandId, PeerId, TrackId, UnitId};
use wire::mode::{Guards, Mode};
use wire::time::{Instant, Span};

use crate::shown::{Shown, ShownUnit};

/// Longest time without a new report of a display.
pub const REPEAT: Span = Span::ms(200);

/// The part of the display that counts as a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Face {
    mode: Mode,
    authority: Option<TrackId>,
    freshness: Freshness,
    tracks_fresh: u8,
    tracks_stale: u8,
    failing: Guards,
    placed: bool,
}

/// The values last reported of each unit, of each command still shown, and of lost sessions.
#[derive(Clone, Debug, Default)]
pub struct Witness {
    units: Vec<(UnitId, Instant, Face)>,
    commands: Vec<(CommandId, ShownAs)>,
    losses: Vec<(PeerId, u32)>,
}

impl Witness {
    /// The events that are due for the values shown now.
    pub fn events_due(&mut self, shown: &Shown) -> Vec<Event> {
        let mut events: Vec<Event> = shown.units.iter().filter_map(|unit| self.unit(shown.at, unit)).collect();
        let commands = shown.commands.iter().map(|command| (command.id, command.life.shown_as())).collect();
        let before = std::mem::replace(&mut self.commands, commands);
        let changed = self.commands.iter().filter(|now| !before.contains(now));
        events.extend(changed.map(|(command, shown)| Event::CommandShown { command: *command, shown: *shown }));
        let before = std::mem::replace(&mut self.losses, shown.losses.clone());
        let more = self.losses.iter().filter(|now| !before.contains(now));
        events.extend(more.map(|(peer, times)| Event::LossesShown { peer: *peer, times: *times }));
        events
    }

    fn unit(&mut self, time: Instant, shown: &ShownUnit) -> Option<Event> {
        let face = face(shown);
        match self.units.iter_mut().find(|(unit, ..)| *unit == shown.unit) {
            Some((_, told, last)) if *last == face && time.since(*told) < REPEAT => return None,
            Some((_, told, last)) => (*told, *last) = (time, face),
            None => self.units.push((shown.unit, time, face)),
        }
        Some(Event::Displayed {
            unit: shown.unit,
            mode: face.mode,
            authority: face.authority,
            freshness: face.freshness,
            age: shown.state.age(),
            tracks_fresh: face.tracks_fresh,
            tracks_stale: face.tracks_stale,
            report: shown.report,
            failing: face.failing,
            place: face.placed.then_some(*shown.pose.get().0),
        })
    }
}

fn face(shown: &ShownUnit) -> Face {
    let (state, freshness) = shown.state.get();
    Face {
        mode: state.mode,
        authority: state.authority.map(|held| held.track),
        freshness,
        tracks_fresh: shown.tracks_labelled(&[Freshness::Fresh]),
        tracks_stale: shown.tracks_labelled(&[Freshness::Stale, Freshness::Lost]),
        failing: state.failing,
        placed: shown.pose.freshness() == Freshness::Fresh,
    }
}
