//! Perception of one unit: frames or candidates in, corroborated tracks out.
//!
//! - Candidates come over the bus in the unrendered twin; everything after them is the same code as for frames.
//! - [`corroborate`] sets the modalities against each other, [`tracker`] follows what they agree on, [`pose`] places it
//!   in the world, [`provenance`] says which stage gave what and when.
//! - [`Perception`] is the core: one [`Topic::Tracks`] message for each processed frame, also when modalities are
//!   missing, because liveness downstream rests on products. What follows from that is autonomy's to decide.

pub mod corroborate;
pub mod pose;
pub mod provenance;
pub mod tracker;

use std::collections::VecDeque;

use wire::account::Accounts;
use wire::audit::Journal;
use wire::bus::Sender;
use wire::codec;
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Event, Interface};
use wire::id::WorldId;
use wire::refusal::Refusal;
use wire::sensor::{Camera, Candidates, Navigation};
use wire::setup::{NoChannel, Setup};
use wire::time::Instant;
use wire::track::Tracks;
use wire::trust::BusGate;

use crate::corroborate::{Limits, Sighting};
use crate::pose::Ego;
use crate::provenance::Provenance;
use crate::tracker::Tracker;

/// What a run may choose about perception.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PerceptionConfig {
    /// Whether frames come rendered ([`Topic::Frames`]) or candidates in their place ([`Topic::Candidates`]).
    pub rendered: bool,
    /// Limits of corroboration.
    pub limits: Limits,
}

/// Why a core could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PerceptionError {
    /// The setup lacks a channel.
    #[error(transparent)]
    Channel(#[from] NoChannel),
}

/// The perception core.
pub struct Perception {
    setup: Setup,
    config: PerceptionConfig,
    camera: Camera,
    observations: BusGate,
    navigation: BusGate,
    tracks: Sender,
    ego: Ego,
    tracker: Tracker,
    provenance: Provenance,
    accounts: Accounts,
    journal: Journal,
    quiet: bool,
    out: VecDeque<Output>,
}

impl Perception {
    /// A core that starts at `now` with no tracks.
    ///
    /// # Errors
    /// The setup lacks a channel that perception reads or writes.
    pub fn new(setup: Setup, config: PerceptionConfig, now: Instant) -> Result<Self, PerceptionError> {
        let limit = setup.bounds.product_limit();
        let source = if config.rendered { Topic::Frames } else { Topic::Candidates };
        let mut core = Perception {
            observations: setup.gate(source, limit)?,
            navigation: setup.gate(Topic::Navigation, limit)?,
            tracks: setup.sender(Topic::Tracks)?,
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
            camera: Camera::GROUND,
            ego: Ego::default(),
            tracker: Tracker::default(),
            provenance: Provenance::default(),
            accounts: Accounts::default(),
            quiet: false,
            out: VecDeque::new(),
            setup,
            config,
        };
        core.journal.write(now, Event::Started, &mut core.out);
        Ok(core)
    }

    /// The same core in a forked world. A loaded model is shared.
    #[must_use]
    pub fn fork(&self, world: WorldId) -> Self {
        Perception {
            setup: Setup { world, ..self.setup.clone() },
            config: self.config.clone(),
            camera: self.camera,
            observations: self.observations.clone(),
            navigation: self.navigation.clone(),
            tracks: self.tracks.clone(),
            ego: self.ego,
            tracker: self.tracker.clone(),
            provenance: self.provenance,
            accounts: self.accounts.clone(),
            journal: self.journal.fork(),
            quiet: self.quiet,
            out: self.out.clone(),
        }
    }

    fn bus(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        let judged = if topic == self.observations.topic {
            self.observe(now, bytes)
        } else if topic == Topic::Navigation {
            self.navigate(now, bytes)
        } else {
            return;
        };
        let at = Interface::Bus(topic);
        match judged {
            Ok(()) => self.accounts.accepted(at),
            Err(refusal) => {
                let event = self.accounts.refused(at, None, &refusal);
                self.journal.write(now, event, &mut self.out);
            }
        }
    }

    fn navigate(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let accepted = self.navigation.admit::<Navigation>(&self.setup.policy, now, bytes)?;
        self.ego.note(accepted.message());
        Ok(())
    }

    fn observe(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let accepted = self.observations.admit::<Candidates>(&self.setup.policy, now, bytes)?;
        let (candidates, _) = accepted.into_parts();
        provenance::admit(&self.setup.policy, candidates.mode)?;
        self.process(now, &candidates);
        Ok(())
    }

    /// One frame's candidates, through corroboration and tracking to the message.
    fn process(&mut self, now: Instant, candidates: &Candidates) {
        let (frame, stamp) = (candidates.frame, candidates.stamp);
        if let Some(present) = self.provenance.note(frame, stamp, provenance::present(candidates)) {
            self.journal.write(now, Event::FrameSeen { frame, present }, &mut self.out);
        }
        let judged = corroborate::corroborate(&self.camera, &self.config.limits, candidates);
        let sightings: Vec<Sighting> = judged.iter().filter_map(|j| j.sighting).collect();
        let ego = self.ego.at(stamp, self.setup.bounds.product_limit());
        self.tracker.update(frame, stamp, ego.as_ref(), &sightings);
        let message = Tracks {
            frame,
            stamp,
            mode: candidates.mode,
            products: self.provenance.products(),
            tracks: self.tracker.tracks(),
        };
        if !self.quiet {
            let bytes = self.tracks.seal(now, &codec::encode(&message));
            self.out.push_back(Output::Bus { topic: Topic::Tracks, bytes });
        }
    }

    fn finish(&mut self, now: Instant) {
        self.accounts.close(now, &mut self.journal, &mut self.out);
        self.journal.sign(now, &mut self.out);
    }
}

impl Core for Perception {
    fn handle(&mut self, now: Instant, input: &Input) {
        match input {
            Input::Bus { topic, bytes } => self.bus(now, *topic, bytes),
            Input::Quiesce => self.quiet = true,
            Input::Finish => self.finish(now),
            Input::Timeout
            | Input::Opened { .. }
            | Input::Record { .. }
            | Input::Closed { .. }
            | Input::Published { .. }
            | Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. } => {}
        }
    }

    fn deadline(&self) -> Option<Instant> {
        None
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}

#[cfg(test)]
mod tests;
