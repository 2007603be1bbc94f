//! Perception of one unit: frames or candidates in, corroborated tracks out.
//!
//! - [`stages`] make candidates of a rendered frame: [`detector`] (an ONNX file that [`onnx`] has checked, decoded by
//!   [`head`]), [`thermal`], [`depth`], [`lidar`]. In the unrendered twin the candidates come over the
//!   bus; everything after them is the same code.
//! - [`mod@attitude`] makes sightings of attitude sensors, on a platform that looks at stars and not at objects.
//! - [`sight`] asks a detector in this process or another one, and notes the faults of one of others.
//! - [`content`] tells new sensor content from repeated; a sensor that repeats itself has given no product.
//! - [`corroborate`] sets the modalities against each other, [`tracker`] follows the objects they agree on, [`pose`]
//!   places it in the world, [`nearby`] the things around by LiDAR alone, [`provenance`] records the products of each
//!   stage, [`reasons`] the doubts and the followed objects.
//! - [`Perception`] is the core: one [`Topic::Tracks`] message for each processed frame, also when modalities are
//!   missing, because liveness downstream rests on products. Consequences are autonomy's to decide.

pub mod attitude;
pub mod bands;
mod boxes;
pub mod brought;
pub mod cold;
pub mod content;
pub mod corroborate;
pub mod crop;
pub mod depth;
pub mod detector;
pub mod fused;
pub mod grid;
pub mod head;
pub mod letterbox;
pub mod lidar;
pub mod model;
pub mod nearby;
pub mod onnx;
pub mod pose;
pub mod process;
pub mod provenance;
pub mod reasons;
pub mod runtime;
pub mod sight;
pub mod stages;
pub mod thermal;
pub mod tracker;
pub mod yolo;

use std::collections::VecDeque;
use std::sync::Arc;

use config::platform::Sensors;
use config::setup::{NoChannel, Setup};
use spacecraft::orbit::OrbitError;
use wire::account::Accounts;
use wire::audit::Journal;
use wire::bearing::Bearings;
use wire::bus::Sender;
use wire::codec::{self, List};
use wire::core::{Core, Input, Output, Topic};
use wire::crop::{CAMERAS, Crop};
use wire::event::{Event, Interface, PICTURED_EVERY};
use wire::id::{FrameId, WorldId};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Refusal;
use wire::sensor::{Camera, Candidates, Frames, Modalities, Modality, Navigation, ProductMode};
use wire::time::Instant;
use wire::track::{StageProduct, Tracks};
use wire::trust::BusGate;

use crate::attitude::{SkyConfig, Watch};
use crate::brought::Brought;
use crate::cold::Cold;
use crate::content::{Contents, Prints};
use crate::corroborate::{CorroborationLimits, Sighting};
use crate::detector::{Detector, DetectorError};
use crate::fused::Disputed;
use crate::model::ModelRef;
use crate::nearby::Followed;
use crate::pose::Ego;
use crate::provenance::Provenance;
use crate::reasons::Reasons;
use crate::stages::{StageClaims, Stages};
use crate::tracker::{MAX_TRACKS, Tracker};

/// Number of colour detections in a frame from which on their number is reported, so at most 21 times in a boot. No
/// scene has that many objects in view.
pub const CROWD: usize = 12;
/// Frames from one set of crops to the next: half a second's.
const CROPPED_EVERY: u64 = 5;

/// Run-specific choices about perception.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PerceptionConfig {
    /// Kind of input: rendered frames ([`Topic::Frames`]), or candidates in their place ([`Topic::Candidates`]).
    pub rendered: bool,
    /// A detector in place of the built-in one, loaded by the maker of the core.
    pub detector: Option<Brought>,
    /// An ONNX Runtime library in place of the pure-Rust backend, by path and hash. Only a live process adopts one.
    pub runtime: Option<ModelRef>,
    /// The platform's sensors.
    pub sensors: Sensors,
    /// Limits of corroboration.
    pub limits: CorroborationLimits,
    /// Sky of a platform with attitude sensors in place of images ([`wire::bearing::Bearings`] on
    /// [`Topic::Candidates`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky: Option<SkyConfig>,
}

/// Reason for which a core could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PerceptionError {
    /// The setup lacks a channel.
    #[error(transparent)]
    Channel(#[from] NoChannel),
    /// A built-in detector was refused.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// The orbital elements describe no orbit.
    #[error(transparent)]
    Orbit(#[from] OrbitError),
    /// The configuration names a detector that the caller has not loaded.
    #[error("the configuration names the detector {0}, which has to be loaded first")]
    NotLoaded(String),
}

/// The perception core.
#[derive(Clone)]
pub struct Perception {
    setup: Setup,
    config: PerceptionConfig,
    camera: Camera,
    /// Modalities with objections that the policy passes over.
    unheard: Modalities,
    /// Present where the policy requires that memory.
    cold: Option<Cold>,
    /// Present when frames come rendered.
    stages: Option<Stages>,
    /// Present where attitude sensors take the place of images.
    watch: Option<Watch>,
    observations: BusGate,
    navigation: BusGate,
    tracks: Sender,
    ego: Ego,
    tracker: Tracker<MAX_TRACKS>,
    nearby: Followed,
    contents: Contents,
    /// Most colour detections in a frame so far.
    most: usize,
    provenance: Provenance,
    reasons: Reasons,
    accounts: Accounts,
    journal: Journal,
    quiet: bool,
    out: VecDeque<Output>,
}

impl Perception {
    /// A core that starts at `now` with no tracks; if rendered, with the configured detector or else the built-in one.
    ///
    /// # Errors
    /// The setup lacks a channel, the built-in detector was refused, or the configured one is not loaded.
    pub fn new(setup: Setup, config: PerceptionConfig, now: Instant) -> Result<Self, PerceptionError> {
        let detector = match &config.detector {
            _ if !config.rendered => return Self::make(setup, config, None, now),
            None => None,
            Some(brought @ Brought { loaded: Some(_), .. }) => brought.watched(),
            Some(other) => return Err(PerceptionError::NotLoaded(other.model.path.display().to_string())),
        };
        // A custom detector proposes by itself.
        let stages = match detector {
            None if setup.policy.check(Check::Fusion) == Requirement::Waived => {
                Stages::shipped(&config.sensors)?.by_colour()
            }
            None => Stages::shipped(&config.sensors)?,
            Some(detector) => {
                Stages::new(&config.sensors, detector, Arc::new(Detector::thermal(&config.sensors.camera)?))
            }
        };
        Self::make(setup, config, Some(stages), now)
    }

    fn make(
        setup: Setup,
        config: PerceptionConfig,
        stages: Option<Stages>,
        now: Instant,
    ) -> Result<Self, PerceptionError> {
        let limit = setup.bounds.product_limit();
        let source = if config.rendered { Topic::Frames } else { Topic::Candidates };
        let mut core = Perception {
            observations: setup.gate(source, limit)?,
            navigation: setup.gate(Topic::Navigation, limit)?,
            tracks: setup.sender(Topic::Tracks)?,
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
            camera: config.sensors.camera,
            unheard: unheard(&setup.policy),
            cold: (setup.policy.check(Check::Steady) == Requirement::Required).then(Cold::default),
            stages,
            watch: config.sky.as_ref().map(Watch::new).transpose()?,
            ego: Ego::default(),
            tracker: Tracker::default(),
            nearby: Followed::default(),
            contents: Contents::default(),
            most: 0,
            provenance: Provenance::default(),
            reasons: Reasons::default(),
            accounts: Accounts::default(),
            quiet: false,
            out: VecDeque::new(),
            setup,
            config,
        };
        core.journal.write(now, Event::Started, &mut core.out);
        Ok(core)
    }

    /// Copy of the core for a forked world. A loaded model is shared.
    #[must_use]
    pub fn fork(&self, world: WorldId) -> Self {
        Self { setup: Setup { world, ..self.setup.clone() }, ..self.clone() }
    }

    fn bus(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        let judged = if topic == self.observations.topic {
            self.observe(now, bytes)
        } else if topic == Topic::Navigation {
            self.navigate(now, bytes)
        } else {
            return;
        };
        let interface = Interface::Bus(topic);
        match judged {
            Ok(()) => self.accounts.accepted(interface),
            Err(refusal) => {
                if let Some(event) = self.accounts.refused(interface, None, &refusal) {
                    self.journal.write(now, event, &mut self.out);
                }
            }
        }
    }

    fn navigate(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let accepted = self.navigation.admit::<Navigation>(&self.setup.policy, now, bytes)?;
        self.ego.note(accepted.message());
        if let Some(watch) = &mut self.watch {
            watch.note(accepted.message());
        }
        Ok(())
    }

    fn observe(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        if self.watch.is_some() {
            return self.look_up(now, bytes);
        }
        let policy = &self.setup.policy;
        let (StageClaims { candidates, disputed }, prints, frames) = match &self.stages {
            Some(stages) => {
                let accepted = self.observations.admit::<Frames<'_>>(policy, now, bytes)?;
                let frames = accepted.message();
                let prints = content::of_frames(frames);
                if let (frame, Some(hash)) = (frames.frame, prints[Modality::Rgb as usize])
                    && frame.0.is_multiple_of(PICTURED_EVERY)
                {
                    self.journal.write(now, Event::Pictured { frame, hash }, &mut self.out);
                }
                (stages.candidates(frames, self.config.limits.score), prints, Some(*frames))
            }
            None => {
                let candidates = self.observations.admit::<Candidates>(policy, now, bytes)?.into_parts().0;
                let prints = content::of_candidates(&candidates);
                (StageClaims { candidates, disputed: Disputed::default() }, prints, None)
            }
        };
        self.crowd(now, &candidates);
        let candidates = self.renewed(now, candidates, &prints);
        self.process(now, &candidates, disputed, frames.as_ref());
        Ok(())
    }

    /// Attitude sensors in place of images: provenance, repetition and tracks are the same.
    fn look_up(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let bearings = self.observations.admit::<Bearings>(&self.setup.policy, now, bytes)?.into_parts().0;
        let repeats = self.repeats(now, (bearings.frame, bearings.stamp), &content::of_bearings(&bearings));
        let bearings = repeats.into_iter().fold(bearings, Bearings::without_modality);
        let (frame, stamp) = (bearings.frame, bearings.stamp);
        self.present(now, (frame, stamp), bearings.present());
        let ego = self.ego.pose_at(stamp, self.setup.bounds.product_limit());
        let judged = self.watch.as_ref().map(|watch| watch.judge(&bearings, ego.as_ref(), self.unheard));
        let sightings = judged.unwrap_or_default();
        self.tracker.update(frame, stamp, ego.as_ref(), &sightings);
        self.send_tracks(now, (frame, stamp), bearings.mode, List::default());
        Ok(())
    }

    /// Reports a number of colour detections above any before in this boot.
    fn crowd(&mut self, now: Instant, candidates: &Candidates) {
        let seen = candidates.rgb.as_ref().map_or(0, |found| found.len());
        if seen >= CROWD && seen > self.most {
            self.most = seen;
            let event = Event::Crowded { frame: candidates.frame, detections: seen as u8 };
            self.journal.write(now, event, &mut self.out);
        }
    }

    /// The candidates without modalities that repeat themselves: those have given no product since their content was
    /// new.
    fn renewed(&mut self, now: Instant, candidates: Candidates, prints: &Prints) -> Candidates {
        let repeats = self.repeats(now, (candidates.frame, candidates.stamp), prints);
        repeats.into_iter().fold(candidates, provenance::without_modality)
    }

    /// The modalities that repeat themselves in this frame, where that check is required.
    fn repeats(&mut self, now: Instant, (frame, stamp): (FrameId, Instant), prints: &Prints) -> Vec<Modality> {
        let product = StageProduct { frame, stamp };
        let required = self.setup.policy.check(Check::Content) == Requirement::Required;
        for (modality, first) in self.contents.note(product, prints) {
            let event = Event::Repeated { modality, frame: product.frame, first: first.frame };
            self.journal.write(now, event, &mut self.out);
            if required {
                self.provenance.withdraw(modality, first);
            }
        }
        Modality::ALL.into_iter().filter(|m| required && self.contents.repeats(*m)).collect()
    }

    /// Judges and tracks the candidates of one frame, and sends the tracks.
    fn process(&mut self, now: Instant, candidates: &Candidates, disputed: Disputed, frames: Option<&Frames<'_>>) {
        let (frame, stamp) = (candidates.frame, candidates.stamp);
        self.present(now, (frame, stamp), provenance::present(candidates));
        let mut judged =
            corroborate::corroborate(&self.camera, &self.config.limits, self.unheard, candidates, disputed);
        let ego = self.ego.pose_at(stamp, self.setup.bounds.product_limit());
        if let Some(cold) = &mut self.cold {
            cold.judge(stamp, ego.as_ref(), &mut judged);
        }
        let sightings: Vec<Sighting> = judged.iter().filter_map(|j| j.sighting).collect();
        self.tracker.update(frame, stamp, ego.as_ref(), &sightings);
        self.nearby.update((frame, stamp), ego.as_ref(), candidates.lidar.as_deref());
        let events = self.reasons.note(&self.camera, candidates, &judged, &self.tracker.tracks());
        events.for_each(|event| self.journal.write(now, event, &mut self.out));
        let crops = frames.map_or(List::default(), |frames| self.crops(frames));
        self.send_tracks(now, (frame, stamp), candidates.mode, crops);
    }

    /// Crops of one vehicle, in each [`CROPPED_EVERY`]th frame; several vehicles take turns.
    fn crops(&self, frames: &Frames<'_>) -> List<Crop, CAMERAS> {
        let frame = frames.frame;
        let vehicles: Vec<_> = self.tracker.vehicles_in(frame).collect();
        if vehicles.is_empty() || !frame.0.is_multiple_of(CROPPED_EVERY) {
            return List::default();
        }
        let (track, bounds) = vehicles[(frame.0 / CROPPED_EVERY) as usize % vehicles.len()];
        crop::crops(frames, track, &bounds)
    }

    /// Notes the products of a frame, and tells of a change.
    fn present(&mut self, now: Instant, (frame, stamp): (FrameId, Instant), present: Modalities) {
        if let Some(present) = self.provenance.note(frame, stamp, present) {
            self.journal.write(now, Event::FrameSeen { frame, present }, &mut self.out);
        }
    }

    /// Sends the tracks of a frame.
    fn send_tracks(
        &mut self,
        now: Instant,
        (frame, stamp): (FrameId, Instant),
        mode: ProductMode,
        crops: List<Crop, CAMERAS>,
    ) {
        let (products, tracks, nearby) = (self.provenance.products(), self.tracker.tracks(), self.nearby.things());
        if !self.quiet {
            let tracks = Tracks { frame, stamp, mode, products, tracks, crops, nearby };
            let bytes = self.tracks.seal(now, &codec::encode(&tracks));
            self.out.push_back(Output::Bus { topic: Topic::Tracks, bytes });
        }
    }

    fn finish(&mut self, now: Instant) {
        self.accounts.close(now, &mut self.journal, &mut self.out);
        self.journal.sign(now, &mut self.out);
    }
}

fn unheard(policy: &Policy) -> Modalities {
    let objections =
        [(Check::Extent, Modality::Depth), (Check::Cluster, Modality::Lidar), (Check::Warmth, Modality::Thermal)];
    let waived = objections.into_iter().filter(|(check, _)| policy.check(*check) == Requirement::Waived);
    waived.fold(Modalities::default(), |set, (_, modality)| set.with_modality(modality))
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
            | Input::Audit { .. }
            | Input::SessionLost
            | Input::Guest { .. }
            | Input::Act { .. }
            | Input::HostWait { .. }
            | Input::Cue { .. } => {}
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
