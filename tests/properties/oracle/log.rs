//! A log under construction: a quiet, whole run and the ways to break it, and the oracle's findings then.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use evidence::{Evidence, Plan, Planned, Under, Witnessed};
use ground_truth::{Any, Entry, FaultKind, GuardVerdict, Note, Sensor};
use oracle::{Approaches, Property, Verdict, approaches, judge};
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::core::Topic;
use wire::event::{Event, Freshness, Interface};
use wire::id::{Boot, CommandId, FrameId, NodeId, ObjectId, PeerId, RecordId, Sequence, TrackId, UnitId, WorldId};
use wire::mode::{Because, Cause, Guards, Mode};
use wire::policy::Waived;
use wire::sensor::{Camera, Class, Pose, ReceiverTime};
use wire::time::{Instant, Span};

/// A whole log holds authority from 2 s to its end.
pub(crate) const BOUNDS: Bounds = Bounds { authority_ms: 8000, ..Bounds::GROUND };

/// A log under construction; times in milliseconds.
#[derive(Clone)]
pub(crate) struct Log {
    pub(crate) entries: Vec<Witnessed>,
    pub(crate) planned: Vec<Plan>,
    /// Speed at which its places go east, mm/s.
    pace: u64,
}

impl Log {
    /// A quiet, whole run of ten seconds: enabled at 1 s, armed at 2 s, displayed all along, telemetry on time. Its places creep, so
    /// that they contradict no speed that a test states.
    pub(crate) fn whole() -> Log {
        Log::at_pace(40)
    }

    /// The log with places that go on at a metre a second, stops or not.
    pub(crate) fn under_way() -> Log {
        Log::at_pace(1000)
    }

    fn at_pace(pace: u64) -> Log {
        let mut log = Log { entries: Vec::new(), planned: Vec::new(), pace };
        log.command(1000, 1, CommandKind::Enable).transition(1000, Mode::Idle, Mode::Ready, Cause::Operator);
        log.command(2000, 2, CommandKind::Arm(TrackId(1))).transition(
            2000,
            Mode::Ready,
            Mode::PrepareToAct,
            Cause::Operator,
        );
        let minted = Event::Minted {
            world: WorldId(0),
            authority: 1,
            track: TrackId(1),
            command: command(2),
            waived: Waived::default(),
        };
        log.add(2000, NodeId::UNIT_A, minted);
        log.associated(50, 1, PeerId::UNIT_A).judged(50, Guards::default(), true, 1);
        for t in (250..10_000).step_by(250) {
            log.add(t, NodeId::RECORDER, Event::Sealed { entries: t, head: [0; 32] });
        }
        for t in (100..10_000).step_by(100) {
            let mode = log.mode(t);
            let speed = if mode == Mode::Idle { 0 } else { 1000 };
            log.report(t).displayed(t + 5, mode, t).heard(t).truth(t, speed, 5000);
            if t % 200 == 100 {
                log.located(t, log.way(t));
            }
        }
        log
    }

    /// Place of the unit at `ms`.
    pub(crate) fn way(&self, ms: u64) -> Pose {
        Pose { x_mm: (ms * self.pace / 1000) as i32, y_mm: 0, yaw_mrad: 0 }
    }

    pub(crate) fn add(&mut self, ms: u64, node: NodeId, event: impl Into<Any>) -> &mut Log {
        let event = event.into();
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(ms * 1000), event, previous: [0; 32] };
        self.entries.push(Witnessed { at: ms * 1000, entry });
        self
    }

    pub(crate) fn mode(&self, ms: u64) -> Mode {
        let to = |w: &Witnessed| match w.entry.event {
            Any::Service(Event::Transition { to, .. }) if w.at <= ms * 1000 => Some(to),
            _ => None,
        };
        self.entries.iter().rev().find_map(to).unwrap_or(Mode::Idle)
    }

    pub(crate) fn transition(&mut self, ms: u64, from: Mode, to: Mode, cause: Cause) -> &mut Log {
        let event = Event::Transition { from, to, cause, because: Because::Itself, failing: Guards::default() };
        self.add(ms, NodeId::UNIT_A, event)
    }

    pub(crate) fn command(&mut self, ms: u64, n: u64, kind: CommandKind) -> &mut Log {
        self.add(ms - 10, NodeId::CONSOLE, Event::Intended { command: command(n), kind, tag: None });
        self.add(ms, NodeId::UNIT_A, Event::Executed { command: command(n), kind, refused: None })
    }

    pub(crate) fn report(&mut self, ms: u64) -> &mut Log {
        let event = Event::Accepted {
            at: Interface::Uplink,
            record: record(ms),
            peer: PeerId::UNIT_A,
            age: Some(Span::ms(1)),
            waived: Waived::default(),
        };
        self.add(ms, NodeId::GATEWAY, event)
    }

    pub(crate) fn displayed(&mut self, ms: u64, mode: Mode, report: u64) -> &mut Log {
        let event = Event::Displayed {
            unit: UnitId::A,
            mode,
            authority: (mode == Mode::PrepareToAct).then_some(TrackId(1)),
            freshness: Freshness::Fresh,
            age: Span::ms(5),
            tracks_fresh: 1,
            tracks_stale: 0,
            report: record(report),
            failing: Guards::default(),
            place: Some(self.way(ms)),
        };
        self.add(ms, NodeId::CONSOLE, event)
    }

    /// The unit takes itself to be there, by a fix of then.
    pub(crate) fn located(&mut self, ms: u64, pose: Pose) -> &mut Log {
        let Pose { x_mm, y_mm, .. } = pose;
        let (stamp, time) = (Instant(ms * 1000), ReceiverTime(ms * 1000));
        let event = Event::Located { stamp, x_mm, y_mm, time, pose_x_mm: x_mm, pose_y_mm: y_mm, distrusted: false };
        self.add(ms, NodeId::UNIT_A, event)
    }

    /// The unit judges by these from `ms` on.
    pub(crate) fn judged(&mut self, ms: u64, failing: Guards, placed: bool, tracks: u8) -> &mut Log {
        self.add(ms, NodeId::UNIT_A, Event::Judged { failing, placed, tracks })
    }

    /// The unit has its association with the gateway, and `peer` this one at the gateway.
    pub(crate) fn associated(&mut self, ms: u64, association: u32, peer: PeerId) -> &mut Log {
        let guard = |node: NodeId| node.guard().expect("a node with a guard");
        let to_gateway = Note::Associated { association: 1, peer: PeerId::GATEWAY };
        self.add(ms, guard(NodeId::UNIT_A), to_gateway);
        self.add(ms, guard(NodeId::GATEWAY), Note::Associated { association, peer })
    }

    /// A datagram at both guards.
    pub(crate) fn heard(&mut self, ms: u64) -> &mut Log {
        for node in [NodeId::GATEWAY, NodeId::UNIT_A] {
            let hash = ms << 8 | node.index() as u64;
            self.saw(ms, node, hash, GuardVerdict::Passed);
        }
        self
    }

    pub(crate) fn saw(&mut self, ms: u64, node: NodeId, hash: u64, verdict: GuardVerdict) -> &mut Log {
        let event = Note::GuardSaw { association: 1, epoch: 1, sequence: ms, length: 100, hash, verdict };
        self.add(ms, node.guard().expect("a node with a guard"), event)
    }

    pub(crate) fn truth(&mut self, ms: u64, speed: i32, fence: i32) -> &mut Log {
        let event = Note::Truth {
            unit: UnitId::A,
            x_mm: self.way(ms).x_mm,
            y_mm: 0,
            yaw_mrad: 0,
            speed_mm_s: speed,
            set_speed_mm_s: speed,
            leased: true,
            fence_mm: fence,
        };
        self.add(ms, NodeId::SIM, event)
    }

    pub(crate) fn confirm_and_act(&mut self, ms: u64, class: Class, distance_mm: u32) -> &mut Log {
        self.command(ms, 3, CommandKind::Confirm(TrackId(1)));
        self.acted(ms, Guards::default()).plant_act(ms, class, distance_mm);
        self.transition(ms, Mode::PrepareToAct, Mode::Ready, Cause::Acted)
    }

    pub(crate) fn acted(&mut self, ms: u64, failing: Guards) -> &mut Log {
        let event = Event::Acted { world: WorldId(0), authority: 1, track: TrackId(1), command: command(3), failing };
        self.add(ms, NodeId::UNIT_A, event)
    }

    pub(crate) fn plant_act(&mut self, ms: u64, class: Class, distance_mm: u32) -> &mut Log {
        let event = Note::PlantAct {
            authority: 1,
            command: command(3),
            object: Some(ObjectId(1)),
            class: Some(class),
            distance_mm,
        };
        self.add(ms, NodeId::SIM, event)
    }

    pub(crate) fn thermal_fault(&mut self, from: u64, to: u64) -> &mut Log {
        self.planned.push(Planned::Fault(Sensor::Thermal, FaultKind::Dropout).into());
        let fault =
            |active| Note::Fault { sensor: Sensor::Thermal, kind: FaultKind::Dropout, active, frame: FrameId(1) };
        self.add(from, NodeId::SIM, fault(true)).add(to, NodeId::SIM, fault(false));
        self.altered(from, Sensor::Thermal, FaultKind::Dropout, NodeId::PERCEPTION)
    }

    /// The sim says at `ms` that a fault changed a message, and `reader`'s core receives it.
    pub(crate) fn altered(&mut self, ms: u64, sensor: Sensor, kind: FaultKind, reader: NodeId) -> &mut Log {
        let topic = if reader == NodeId::PERCEPTION { Topic::Candidates } else { Topic::Navigation };
        self.add(ms, NodeId::SIM, Note::Altered { sensor, kind, hash: ms });
        let sight = Note::MouthSaw { reader, at: Interface::Bus(topic), length: 9, hash: ms };
        self.add(ms + 1, NodeId::CAMPAIGN, sight)
    }

    /// Drops displays and later modes from `ms` on, to be written again.
    pub(crate) fn cut_display(&mut self, ms: u64) -> &mut Log {
        self.entries.retain(|w| !(w.at >= ms * 1000 && matches!(w.entry.event, Any::Service(Event::Displayed { .. }))));
        self
    }

    pub(crate) fn judge(&self) -> Verdict {
        self.judge_with(Vec::new())
    }

    pub(crate) fn judge_with(&self, killed: Vec<NodeId>) -> Verdict {
        judge(&self.evidence(killed))
    }

    /// Approach to each limit.
    pub(crate) fn approaches(&self) -> Approaches {
        approaches(&self.evidence(Vec::new()))
    }

    pub(crate) fn evidence(&self, killed: Vec<NodeId>) -> Evidence {
        let mut entries = self.entries.clone();
        entries.sort_by_key(|w| w.at);
        Evidence {
            under: Under::A,
            entries,
            broken_log: None,
            log_flaws: Vec::new(),
            differences: Vec::new(),
            bounds: BOUNDS,
            camera: Camera::GROUND,
            planned: self.planned.clone(),
            duration: 10_000_000,
            stall_limit: u64::MAX,
            operators: vec![(NodeId::OPERATOR, u64::MAX), (NodeId::OPERATOR_2, 7_000_000)],
            script: evidence::mission::Script::default(),
            route: evidence::progress::Route::default(),
            contacts: config::contact::Contacts::default(),
            killed,
        }
    }

    pub(crate) fn breaks(&self) -> Vec<Property> {
        let mut broken: Vec<Property> = self.judge().findings.iter().map(|f| f.property).collect();
        broken.sort_unstable();
        broken.dedup();
        broken
    }

    /// `node` was killed on purpose at `ms`.
    pub(crate) fn killed(&mut self, ms: u64, node: NodeId) -> &mut Log {
        self.planned.push(Planned::Kill(node).into());
        let is_event =
            |w: &Witnessed| w.entry.node == node && matches!(w.entry.event, Any::Service(Event::Located { .. }));
        self.entries.retain(|w| w.at <= ms * 1000 || !is_event(w));
        self.add(ms, NodeId::CAMPAIGN, Note::Ended { node, killed: true, signal: None })
    }

    /// The plant holds a set-point of `requested` and drives at `speed`.
    pub(crate) fn driven(&mut self, ms: u64, requested: i32, speed: i32) -> &mut Log {
        self.truth(ms, speed, 5000);
        if let Some(Any::Instrument(Note::Truth { set_speed_mm_s, .. })) =
            self.entries.last_mut().map(|w| &mut w.entry.event)
        {
            *set_speed_mm_s = requested;
        }
        self
    }

    /// Removes the entries that `test` finds between two times, these left out.
    pub(crate) fn remove_between(&mut self, from: u64, to: u64, test: impl Fn(&Witnessed) -> bool) -> &mut Log {
        self.entries.retain(|w| !(w.at > from * 1000 && w.at < to * 1000 && test(w)));
        self
    }

    /// The operator stops the unit: it is informed, reports it and holds.
    pub(crate) fn held(&mut self, ms: u64) -> &mut Log {
        self.command(ms, 9, CommandKind::Hold).cut_display(ms);
        let from = self.mode(ms);
        self.transition(ms, from, Mode::HoldSafe, Cause::Operator).plant_stops(ms)
    }

    /// The unit's state after a DISARM.
    pub(crate) fn disarmed(&mut self, ms: u64) -> &mut Log {
        self.cut_display(ms).transition(ms, Mode::PrepareToAct, Mode::Ready, Cause::Operator)
    }

    /// Takes the plant's lease at `ms`; it brakes and stands a second later.
    pub(crate) fn plant_stops(&mut self, ms: u64) -> &mut Log {
        for w in &mut self.entries {
            if let Any::Instrument(Note::Truth { speed_mm_s, set_speed_mm_s, leased, .. }) = &mut w.entry.event
                && w.at >= ms * 1000
            {
                (*set_speed_mm_s, *leased) = (0, false);
                *speed_mm_s = if w.at >= (ms + 1000) * 1000 { 0 } else { 500 };
            }
        }
        self
    }

    /// Leaves the plant where it is at `ms`.
    pub(crate) fn plant_rests(&mut self, ms: u64) -> &mut Log {
        let place = self.way(ms).x_mm;
        for w in self.entries.iter_mut().filter(|w| w.at >= ms * 1000) {
            if let Any::Instrument(Note::Truth { x_mm, .. }) = &mut w.entry.event {
                *x_mm = place;
            }
        }
        self
    }

    /// Lets the plant creep at 48 mm/s from `ms` on.
    pub(crate) fn plant_creeps(&mut self, ms: u64) -> &mut Log {
        let from = self.way(ms).x_mm;
        for w in &mut self.entries {
            if let Any::Instrument(Note::Truth { x_mm, speed_mm_s, set_speed_mm_s, .. }) = &mut w.entry.event
                && w.at >= ms * 1000
            {
                (*speed_mm_s, *set_speed_mm_s) = (48, 48);
                *x_mm = from + (48 * (w.at / 1000 - ms) / 1000) as i32;
            }
        }
        self
    }

    /// Broken obligations, under the judge that knows that `node` is dead.
    pub(crate) fn breaks_with_dead(&self, node: NodeId) -> Vec<Property> {
        let verdict = self.judge_with(vec![node]);
        verdict.findings.iter().map(|f| f.property).collect()
    }
}

pub(crate) fn command(n: u64) -> CommandId {
    CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(n) }
}

pub(crate) fn record(ms: u64) -> RecordId {
    RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(ms) }
}
