//! Ground truth for the oracle, on the instrument plane only; no service reads it.
//!
//! - Ten times a second: the unit's true pose and speed, the set-point as the plant holds it, its lease and the margin
//!   to its envelope; of a body that leaves the ground its whole motion and the margins to its own terms of safety;
//!   objects that the chassis has newly touched; places of moving objects; while a fault displaces localisation, the
//!   displacement.
//! - Once: places of standing objects, and the objects that bear a print.
//! - At once: a lease that began or lapsed; an act as received, with the true object nearest to the designated place;
//!   start and end of every sensor fault, with the first frame that it touches; messages that would read otherwise
//!   without a fault.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use ground_truth::{ALTERED_EVERY, FaultKind, Note, Sensor, StepName};
use minicbor::Encode;
use rapier3d::prelude::Vector;
use wire::audit::Journal;
use wire::core::Output;
use wire::drive::Act;
use wire::event::wire_hash;
use wire::id::{FrameId, ObjectId, UnitId};
use wire::motion::{Attitude, Motion};
use wire::time::{Instant, Span};

use crate::fault::{Effect, Fault, Faults, MAX_FAULTS, is_imaging};
use crate::plant::{Flight, Plant};
use crate::sensor::localisation::wrap_mrad;
use crate::world::World;

/// A reading without the faults of one kind on one sensor.
pub(crate) struct Otherwise {
    index: usize,
    sensor: Sensor,
    kind: FaultKind,
    body: Vec<u8>,
}

/// Writes truth into the sim's journal; without one it stays silent.
#[derive(Clone, Debug)]
pub(crate) struct Witness {
    journal: Option<Journal>,
    unit: UnitId,
    leased: bool,
    touches: BTreeSet<ObjectId>,
    /// Collisions that are not yet reported, with the speed towards each object, mm/s.
    collided: BTreeMap<ObjectId, i32>,
    faults_active: [bool; MAX_FAULTS],
    /// True while the step that begins with this fault is reported as under way.
    steps_open: [bool; MAX_FAULTS],
    /// Time at which a message that this fault changed was reported last.
    told: [Option<Instant>; MAX_FAULTS],
}

impl Witness {
    pub(crate) fn new(journal: Option<Journal>, unit: UnitId) -> Self {
        let (faults_active, steps_open) = ([false; MAX_FAULTS], [false; MAX_FAULTS]);
        Witness {
            journal,
            unit,
            leased: false,
            touches: BTreeSet::new(),
            collided: BTreeMap::new(),
            faults_active,
            steps_open,
            told: [None; MAX_FAULTS],
        }
    }

    /// Appends an event.
    pub(crate) fn write(&mut self, now: Instant, event: impl Encode<()>, out: &mut VecDeque<Output>) {
        if let Some(journal) = &mut self.journal {
            journal.write(now, event, out);
        }
    }

    /// Signs the chain: the last entry.
    pub(crate) fn close(&mut self, now: Instant, out: &mut VecDeque<Output>) {
        if let Some(journal) = &mut self.journal {
            journal.sign(now, out);
        }
    }

    /// The unit's truth, and where objects are: all of them, or those that move.
    pub(crate) fn state(
        &mut self,
        now: Instant,
        world: &World,
        plant: &Plant,
        all_objects: bool,
        out: &mut VecDeque<Output>,
    ) {
        if self.journal.is_none() {
            return;
        }
        self.unit(now, world, plant, out);
        for (object, speed_mm_s) in std::mem::take(&mut self.collided) {
            self.write(now, Note::Collided { unit: self.unit, object, speed_mm_s }, out);
        }
        for (index, (object, place)) in world.scene().objects.iter().zip(world.placements()).enumerate() {
            if all_objects || object.moves() {
                let (x_mm, y_mm) = (mm(place.centre.x), mm(place.centre.y));
                let object_id = ObjectId(index as u16);
                self.write(now, Note::Object { object: object_id, class: object.class, x_mm, y_mm }, out);
                if all_objects && object.print.is_some() {
                    self.write(now, Note::Printed { object: object_id }, out);
                }
            }
        }
    }

    /// The unit's truth at once, if its lease began or lapsed since it was last written.
    pub(crate) fn lease(&mut self, now: Instant, world: &World, plant: &Plant, out: &mut VecDeque<Output>) {
        if self.journal.is_some() && plant.set_point().is_some() != self.leased {
            self.unit(now, world, plant, out);
        }
    }

    /// Keeps collisions for the next entry of truth: objects that the chassis touches since this step, each with the
    /// greatest speed towards it just before.
    pub(crate) fn touch(&mut self, touches: &BTreeMap<ObjectId, Vector>, velocity: Vector) {
        for (&object, towards) in touches.iter().filter(|(object, _)| !self.touches.contains(object)) {
            let speed = mm(velocity.dot(*towards));
            self.collided.entry(object).and_modify(|most| *most = speed.max(*most)).or_insert(speed);
        }
        if !self.touches.iter().eq(touches.keys()) {
            self.touches = touches.keys().copied().collect();
        }
    }

    fn unit(&mut self, now: Instant, world: &World, plant: &Plant, out: &mut VecDeque<Output>) {
        let state = plant.state(world);
        let (east, north) = (state.position.x, state.position.y);
        self.leased = plant.set_point().is_some();
        let event = Note::Truth {
            unit: self.unit,
            x_mm: mm(east),
            y_mm: mm(north),
            yaw_mrad: wrap_mrad(state.yaw() * 1000.0),
            speed_mm_s: mm(state.speed()),
            set_speed_mm_s: plant.set_point().map_or(0, |s| mm(s.motion.speed())),
            leased: self.leased,
            fence_mm: mm(plant.margin(world)),
        };
        self.write(now, event, out);
        if let Some(flight) = plant.flight(world) {
            self.write(now, Note::Moves { unit: self.unit, motion: motion(&flight) }, out);
        }
        if let Some(margins) = plant.safety_margins(world) {
            let [safe, asked, energy, clearance] =
                [margins.safe, margins.asked, margins.energy, margins.clearance].map(permille);
            self.write(now, Note::Margins { unit: self.unit, safe, asked, energy, clearance }, out);
        }
    }

    /// Logs the displacement that faults impose on localisation, if any.
    pub(crate) fn imposed(&mut self, now: Instant, effect: &Effect, out: &mut VecDeque<Output>) {
        let mm = |axis: i64| axis.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        let [east_mm, north_mm] = effect.displaced_mm.map(mm);
        let time_us = effect.displaced_us;
        if (east_mm, north_mm, time_us) != (0, 0, 0) {
            self.write(now, Note::Imposed { stamp: now, east_mm, north_mm, time_us }, out);
        }
    }

    /// Readings as they would be without each active fault that is due for a report; `read` makes one.
    pub(crate) fn counterfactual(
        &self,
        now: Instant,
        run: Span,
        (faults, imaging): (&Faults, bool),
        read: impl Fn(&Faults) -> Vec<u8>,
    ) -> Vec<Otherwise> {
        let due = |index: usize| self.told[index].is_none_or(|time| now.since(time) >= ALTERED_EVERY);
        let of_these =
            |fault: &Fault| self.journal.is_some() && is_imaging(fault.sensor) == imaging && fault.active(run);
        let due = faults.all().iter().enumerate().filter(|(index, fault)| of_these(fault) && due(*index));
        due.map(|(index, fault)| {
            let (sensor, kind) = (fault.sensor, fault.kind());
            Otherwise { index, sensor, kind, body: read(&faults.without_fault(sensor, kind)) }
        })
        .collect()
    }

    /// Tells of the message `bytes`, which carries `body`, by each fault that changed it.
    pub(crate) fn altered(
        &mut self,
        now: Instant,
        counterfactuals: Vec<Otherwise>,
        body: &[u8],
        bytes: &[u8],
        out: &mut VecDeque<Output>,
    ) {
        for Otherwise { index, sensor, kind, .. } in counterfactuals.into_iter().filter(|o| o.body != body) {
            self.told[index] = Some(now);
            self.write(now, Note::Altered { sensor, kind, hash: wire_hash(bytes) }, out);
        }
    }

    /// An act as the plant received it.
    pub(crate) fn act(&mut self, now: Instant, act: &Act, world: &World, out: &mut VecDeque<Output>) {
        let nearest = world.nearest(act.x_mm as f32 / 1000.0, act.y_mm as f32 / 1000.0);
        let event = Note::PlantAct {
            authority: act.authority,
            command: act.command,
            object: nearest.map(|(id, _, _)| id),
            class: nearest.map(|(_, class, _)| class),
            distance_mm: nearest.map_or(u32::MAX, |(_, _, metres)| (metres * 1000.0) as u32),
        };
        self.write(now, event, out);
    }

    /// A step is reported once, however many of its faults there are: it begins with the first of them, here `active`,
    /// and ends when none of them is or will be.
    fn step(
        &mut self,
        now: Instant,
        run: Span,
        (step, active): (StepName, bool),
        faults: &Faults,
        out: &mut VecDeque<Output>,
    ) {
        let mut of_step = faults.all().iter().enumerate().filter(|(_, f)| f.step == Some(step));
        let Some((first, fault)) = of_step.next() else { return };
        let has_ended = |fault: &Fault| fault.waits_ms.is_none() && run >= fault.ends();
        let begun = match (self.steps_open[first], active) {
            (false, true) => true,
            (true, false) if has_ended(fault) && of_step.all(|(_, f)| has_ended(f)) => false,
            (_, _) => return,
        };
        self.steps_open[first] = begun;
        self.write(now, Note::Step { step, begun }, out);
    }

    /// Starts and ends of faults since the last reading of this kind; `frame` is the one about to be made.
    pub(crate) fn faults(
        &mut self,
        now: Instant,
        run: Span,
        (faults, imaging): (&Faults, bool),
        frame: FrameId,
        out: &mut VecDeque<Output>,
    ) {
        for (index, fault) in faults.all().iter().enumerate().filter(|(_, f)| is_imaging(f.sensor) == imaging) {
            let active = fault.active(run);
            if let Some(step) = fault.step {
                self.step(now, run, (step, active), faults, out);
            }
            if active != self.faults_active[index] {
                self.faults_active[index] = active;
                self.write(now, Note::Fault { sensor: fault.sensor, kind: fault.kind(), active, frame }, out);
            }
        }
    }
}

fn motion(flight: &Flight) -> Motion {
    let q = flight.attitude;
    Motion {
        position_mm: flight.place.map(|metres| (metres * 1000.0).round() as i64),
        attitude: Attitude::new([q.w, q.x, q.y, q.z].map(f64::from)),
        velocity_mm_s: flight.velocity.map(|speed| (speed * 1000.0).round() as i32),
        rates_urad_s: flight.rates.to_array().map(|rate| libm::roundf(rate * 1e6) as i32),
    }
}

/// A share as whole thousandths, within a thousand times the whole.
fn permille(share: f32) -> i32 {
    libm::roundf((share * 1000.0).clamp(-1e6, 1e6)) as i32
}

/// Metres (or metres a second) as whole thousandths.
fn mm(metres: f32) -> i32 {
    libm::roundf(metres * 1000.0) as i32
}
