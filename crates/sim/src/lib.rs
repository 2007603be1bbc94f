//! Simulation of one unit: world, plant, sensors, sensor faults and ground truth.
//!
//! [`Sim`] is a deterministic core: time in, bytes out. It knows neither perception nor autonomy. It publishes
//! `Navigation` 20 times a second and, 10 times a second, `Frames` (rendered) or `Candidates` (unrendered); it obeys
//! leased set-points; its reports to the oracle are in `truth`.
//!
//! Physics is stepped lazily: the world advances in fixed steps up to the time of each input, and the core asks to be
//! woken only when something is due that another can see. The result is a function of the inputs and their times, not
//! of how often the core is woken.
//!
//! Code map: `scene` (the objects, with their `weather`) → `world` (physics, rays) → `plant` (drives) → `sensor`,
//! `candidates` (measure) → `fault` (spoils) → `truth` (tells). `fidelity`: assumed errors of these models.

mod candidates;
mod chaff;
mod channel;
pub mod fault;
pub mod fidelity;
pub mod limits;
mod mover;
mod noise;
mod occlusion;
mod past;
pub mod plant;
pub mod process;
mod render;
pub mod ride;
pub mod scene;
pub mod sensor;
pub mod terrain;
mod truth;
mod wander;
pub mod weather;
pub mod wind;
pub mod world;

use std::collections::VecDeque;
use std::sync::Arc;

use config::platform::{Body, Sensors};
use ground_truth::{Sensor, StepName};
use serde::{Deserialize, Serialize};
use wire::audit::Journal;
use wire::codec::encode;
use wire::core::{Core, Input, Output, Topic};
use wire::drive::Drive;
use wire::event::{Event, PICTURED_EVERY, wire_hash};
use wire::id::{Boot, FrameId, NodeId, UnitId};
use wire::refusal::Refusal;
use wire::sensor::{Camera, Frames, Navigation};
use wire::sign::Key;
use wire::time::{Instant, Span};

pub use candidates::NoiseModel;
pub use channel::{ChannelKeys, FRESHNESS, STALL};
pub use render::{Label, Labelled, render, settled};

use crate::candidates::Stages;
use crate::channel::Channels;
use crate::fault::{Disturbance, Fault, Faults, imaging};
use crate::fidelity::Fidelity;
use crate::limits::SceneError;
use crate::plant::{BodyMotion, Plant, SetPoint};
use crate::scene::Scene;
use crate::sensor::Imagers;
use crate::sensor::bearings::Bearers;
use crate::sensor::localisation::Navigators;
use crate::sensor::spatial::Altimeters;
use crate::truth::Witness;
use crate::world::{STEP, World};

/// Steps between navigation readings (20 Hz).
const NAVIGATION_STEPS: u64 = 5;
/// Time between navigation readings.
const NAVIGATION_PERIOD: Span = Span(NAVIGATION_STEPS * STEP.0);
/// Steps between frames (10 Hz), and between entries of truth.
const FRAME_STEPS: u64 = 10;
/// Most steps one input may cause; a host that overslept by more is caught up in several.
const MAX_CATCH_UP: u64 = 100;
/// The furthest from true time that a host's clock may run, parts per million.
const MAX_CLOCK_PPM: i32 = 100_000;

/// Everything a sim is made from, apart from its keys and its clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimConfig {
    /// Name of this sim on its channels and in its journal.
    pub node: NodeId,
    /// The unit of this body; its autonomy is the only one the plant obeys.
    pub unit: UnitId,
    /// Boot counter of the sim.
    #[serde(default)]
    pub boot: Boot,
    /// Seed of all noise.
    pub seed: u64,
    /// Frames from ray casts (true) or candidates from ground truth.
    pub rendered: bool,
    /// True if it writes a journal with ground truth. The platform under test's does; a teammate's need not.
    pub witness: bool,
    /// World of the run.
    pub scene: Scene,
    /// Body of the unit.
    #[serde(default)]
    pub body: Body,
    /// Sensors of the body.
    #[serde(default)]
    pub sensors: Sensors,
    /// Faults of the sensors.
    #[serde(default)]
    pub faults: Vec<Fault>,
    /// Noise of the unrendered mode; uncalibrated.
    #[serde(default)]
    pub noise: NoiseModel,
    /// Assumed errors of the models of sensors and plant.
    #[serde(default)]
    pub fidelity: Fidelity,
    /// Drift of this host's clock against true time, parts per million; the receiver gives true time.
    #[serde(default)]
    pub clock_ppm: i32,
}

impl SimConfig {
    /// The platform under test in the default scene.
    pub fn new(seed: u64, rendered: bool) -> Self {
        SimConfig {
            node: NodeId::SIM,
            unit: UnitId::A,
            boot: Boot(1),
            seed,
            rendered,
            witness: true,
            scene: Scene::default(),
            body: Body::default(),
            sensors: Sensors::GROUND,
            faults: Vec::new(),
            noise: NoiseModel::default(),
            fidelity: Fidelity::SHIPPED,
            clock_ppm: 0,
        }
    }
}

/// Source of the readings of a frame.
#[derive(Clone)]
enum Eyes {
    Rendered(Box<Imagers>),
    Unrendered(Box<Stages>),
    /// Attitude sensors, which look at no object.
    Bearings(Box<Bearers>),
}

impl Eyes {
    /// The encoded readings of this frame, under these faults.
    fn read(
        &mut self,
        (frame, time): (FrameId, Instant),
        world: &World,
        plant: &Plant,
        faults: &Faults,
        run: Span,
    ) -> Vec<u8> {
        match self {
            Eyes::Rendered(imagers) => {
                imagers.measure(frame.0, world, plant, faults, run);
                frames(imagers, frame, time, imaging(faults, run).map(|effect| !effect.dropout))
            }
            Eyes::Unrendered(stages) => encode(&stages.observe((frame, time), world, plant, faults, run)),
            Eyes::Bearings(bearers) => match plant.sky() {
                Some((attitude, sky)) => encode(&bearers.read((frame, time), (attitude, &sky), faults, run)),
                None => Vec::new(),
            },
        }
    }
}

/// Core of the simulation of one unit.
#[derive(Clone)]
pub struct Sim {
    start: Instant,
    steps: u64,
    frame: FrameId,
    stopped: bool,
    /// End of the last stall ([`channel::STALL`]).
    resumed: Instant,
    world: World,
    plant: Plant,
    faults: Faults,
    navigators: Navigators,
    altimeters: Altimeters,
    eyes: Eyes,
    channels: Channels,
    witness: Witness,
    out: VecDeque<Output>,
}

impl Sim {
    /// A sim with a run that starts at `start` on its host's clock. `key` signs its journal.
    pub fn new(config: &SimConfig, keys: ChannelKeys, key: Option<Key>, start: Instant) -> Result<Self, SceneError> {
        config.scene.check()?;
        if !config.rendered {
            config.scene.unrendered()?;
        }
        let Fidelity { noise, .. } = config.fidelity;
        config.fidelity.check()?;
        let faults = Faults::new(&config.faults)?.with_noise(noise).wandering(config.seed);
        // What has nothing to add must not say that it added something.
        let adds = |fault: &Fault| matches!(fault.disturbance, Disturbance::Perturbation { .. });
        if let (Some(index), None) = (config.faults.iter().position(adds), &config.scene.perturbation) {
            return Err(SceneError::FaultDoesNotApply { index });
        }
        let mut world = World::new(Arc::new(config.scene.clone()));
        let plant = Plant::from_body(&mut world, &config.scene.start, &config.body, &config.fidelity, config.seed)?;
        let Sensors { camera, lidar } = config.sensors;
        let eyes = if let Body::Satellite(numbers) = &config.body {
            let height_m = plant.flight(&world).map_or(1.0, |flight| flight.place[2]);
            Eyes::Bearings(Box::new(Bearers::new(config.seed, &faults, (numbers.scale_m, height_m))))
        } else if config.rendered {
            Eyes::Rendered(Box::new(Imagers::new(camera, lidar, config.seed).remembering(&faults)))
        } else {
            Eyes::Unrendered(Box::new(Stages::new(config.noise.times(noise), camera, lidar, config.seed, &faults)))
        };
        let journal = config.witness.then(|| Journal::new(config.node, config.boot, key));
        let mut sim = Sim {
            start,
            steps: 0,
            frame: FrameId(0),
            stopped: false,
            resumed: start,
            world,
            plant,
            faults,
            navigators: Navigators::new(config.seed, config.clock_ppm.clamp(-MAX_CLOCK_PPM, MAX_CLOCK_PPM)),
            altimeters: Altimeters::new(config.seed),
            eyes,
            channels: Channels::new(keys, (config.node, config.boot), config.unit.node()),
            witness: Witness::new(journal, config.unit),
            out: VecDeque::new(),
        };
        sim.witness.write(start, Event::Started, &mut sim.out);
        sim.witness.state(start, &sim.world, &sim.plant, true, &mut sim.out);
        Ok(sim)
    }

    /// Draws the noise of later readings from `seed`; past measurements stay.
    pub fn reseed(&mut self, seed: u64) {
        self.navigators.reseed(seed);
        self.altimeters.reseed(seed);
        match &mut self.eyes {
            Eyes::Rendered(imagers) => imagers.reseed(seed),
            Eyes::Unrendered(stages) => stages.reseed(seed),
            Eyes::Bearings(bearers) => bearers.reseed(seed),
        }
    }

    /// The world and the plant in it, for a reviewer's view.
    pub fn truth(&self) -> (&World, &Plant) {
        (&self.world, &self.plant)
    }

    /// Time at which a given number of steps will have been made.
    fn time_of(&self, steps: u64) -> Instant {
        self.start + Span(steps * STEP.0)
    }

    /// Steps the world up to `now`, publishing due messages on the way.
    fn advance(&mut self, now: Instant) {
        let due = now.since(self.start).0 / STEP.0;
        let last = due.min(self.steps + MAX_CATCH_UP);
        if !self.stopped && now.since(self.time_of(self.steps)) > STALL {
            self.resumed = now;
        }
        while !self.stopped && self.steps < last {
            self.steps += 1;
            let time = self.time_of(self.steps);
            let velocity = self.plant.state(&self.world).velocity;
            let lapsed = self.plant.step(time, &mut self.world).is_some();
            self.witness.touch(&self.plant.touches(&self.world), velocity);
            if lapsed {
                self.witness.lease(time, &self.world, &self.plant, &mut self.out);
            }
            self.publish(time);
        }
    }

    fn publish(&mut self, time: Instant) {
        let run = time.since(self.start);
        if self.steps.is_multiple_of(NAVIGATION_STEPS) {
            self.navigate(time, run);
        }
        if self.steps.is_multiple_of(FRAME_STEPS) {
            self.look(time, run);
            self.witness.state(time, &self.world, &self.plant, false, &mut self.out);
            self.witness.imposed(time, &self.faults.effect_at(run, Sensor::Localisation), &mut self.out);
        }
    }

    fn navigate(&mut self, time: Instant, run: Span) {
        let next = FrameId(self.frame.0 + 1);
        self.witness.faults(time, run, (&self.faults, false), next, &mut self.out);
        let (state, flight) = (self.plant.state(&self.world), self.plant.flight(&self.world));
        let sunlit = self.plant.sky().map(|(_, sky)| sky.sun.is_some());
        let reading = self.steps / NAVIGATION_STEPS;
        let read = |navigators: &mut Navigators, altimeters: &mut Altimeters, faults: &Faults| {
            let (fix, odometry) = navigators.read(reading, &state, faults, run);
            let fix = fix.filter(|_| flight.as_ref().is_none_or(|flight| flight.placed));
            let spatial = flight.as_ref().map(|flight| altimeters.read(reading, (&state, flight, sunlit), faults, run));
            encode(&Navigation { stamp: time, fix, odometry, spatial })
        };
        // On clones: a reading that is not sent must not become the content that a later freeze or skew repeats.
        let otherwise = |calm: &Faults| read(&mut self.navigators.clone(), &mut self.altimeters.clone(), calm);
        let counterfactual = self.witness.counterfactual(time, run, (&self.faults, false), otherwise);
        let body = read(&mut self.navigators, &mut self.altimeters, &self.faults);
        let bytes = self.channels.navigation.seal(time, &body);
        self.witness.altered(time, counterfactual, &body, &bytes, &mut self.out);
        self.out.push_back(Output::Bus { topic: Topic::Navigation, bytes });
    }

    fn look(&mut self, time: Instant, run: Span) {
        self.frame = FrameId(self.frame.0 + 1);
        self.witness.faults(time, run, (&self.faults, true), self.frame, &mut self.out);
        let (frame, world, plant) = (self.frame, &self.world, &self.plant);
        let read = |eyes: &mut Eyes, faults: &Faults| eyes.read((frame, time), world, plant, faults, run);
        let reading = |calm: &Faults| read(&mut self.eyes.clone(), calm);
        let counterfactual = self.witness.counterfactual(time, run, (&self.faults, true), reading);
        let body = read(&mut self.eyes, &self.faults);
        let (topic, channel) = match &self.eyes {
            Eyes::Rendered(imagers) => {
                let [rgb, ..] = imaging(&self.faults, run);
                let altered = || rgb.perturbation.is_some() || imagers.show_a_print(&self.world);
                if self.frame.0.is_multiple_of(PICTURED_EVERY) && altered() {
                    let event = Event::Pictured { frame: self.frame, hash: wire_hash(&imagers.rgb) };
                    self.witness.write(time, event, &mut self.out);
                }
                (Topic::Frames, &mut self.channels.frames)
            }
            Eyes::Unrendered(_) | Eyes::Bearings(_) => (Topic::Candidates, &mut self.channels.candidates),
        };
        let bytes = channel.seal(time, &body);
        self.witness.altered(time, counterfactual, &body, &bytes, &mut self.out);
        self.out.push_back(Output::Bus { topic, bytes });
    }

    fn obey(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        let judged = match topic {
            Topic::Drive => self.channels.drive(now, bytes).and_then(|drive| self.follow(now, &drive)),
            Topic::Act => self
                .channels
                .act(now, self.resumed, bytes)
                .map(|act| self.witness.act(now, &act, &self.world, &mut self.out)),
            // Channels that no launcher connects to a sim.
            Topic::Frames
            | Topic::Candidates
            | Topic::Navigation
            | Topic::Tracks
            | Topic::Feed
            | Topic::Intents
            | Topic::Seals => Ok(()),
        };
        if let Err(refusal) = judged {
            self.channels.note(now, topic, &refusal, &mut self.witness, &mut self.out);
        }
    }

    fn follow(&mut self, now: Instant, drive: &Drive) -> Result<(), Refusal> {
        let motion = BodyMotion::from(drive.set_point);
        if !self.plant.accept(now, SetPoint { motion, until: drive.stamp + drive.lease }) {
            return Err(Refusal::Schema { at: 1 });
        }
        self.witness.lease(now, &self.world, &self.plant, &mut self.out);
        Ok(())
    }
}

impl Core for Sim {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.advance(now);
        match input {
            Input::Bus { topic, bytes } => self.obey(now, *topic, bytes),
            Input::Cue { step } => {
                if let Some(step) = StepName::new(step.as_str()) {
                    self.faults.call(step, now.since(self.start));
                }
            }
            Input::Quiesce => self.stopped = true,
            Input::Finish => {
                self.stopped = true;
                self.channels.account(now, &mut self.witness, &mut self.out);
                self.witness.close(now, &mut self.out);
            }
            Input::Timeout
            | Input::HostWait { .. }
            | Input::Opened { .. }
            | Input::Record { .. }
            | Input::Closed { .. }
            | Input::Published { .. }
            | Input::SessionLost
            | Input::Guest { .. }
            | Input::Act { .. }
            | Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. } => {}
        }
    }

    fn deadline(&self) -> Option<Instant> {
        if self.stopped {
            return None;
        }
        let reading = self.time_of((self.steps / NAVIGATION_STEPS + 1) * NAVIGATION_STEPS);
        let lapse = self.plant.set_point().map(|s| {
            let steps = s.until.since(self.start).0.div_ceil(STEP.0);
            // Not before the next step: only a step lets a lease lapse, and a deadline that has passed would call the
            // core without end.
            self.time_of(steps.max(self.steps + 1))
        });
        Some(lapse.map_or(reading, |time| time.min(reading)))
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}

/// The encoded frame, with the modalities that are `present`.
fn frames(imagers: &Imagers, frame: FrameId, stamp: Instant, present: [bool; 4]) -> Vec<u8> {
    let planes = [&imagers.rgb, &imagers.depth, &imagers.thermal, &imagers.ranges];
    let [rgb, depth, thermal, lidar] =
        core::array::from_fn(|k| present[k].then(|| <&minicbor::bytes::ByteSlice>::from(planes[k].as_slice())));
    let Camera { width, height, .. } = imagers.camera();
    encode(&Frames { frame, stamp, width, height, rgb, depth, thermal, lidar })
}
