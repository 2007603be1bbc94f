//! Promises of the sim to the rest: repeatable, forkable, sensors that agree, faults confined to their targets.

#![expect(clippy::wildcard_enum_match_arm, reason = "a test picks the events it is about")]
#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use std::collections::BTreeMap;

use ground_truth::perturbation::{COLUMNS, Perturbation, ROWS};
use ground_truth::{Any, Entry, FaultKind, Note, Sensor, StepName};
use sim::fault::{Disturbance, Fault, Faults};
use sim::limits::SceneError;
use sim::plant::STANDSTILL;
use sim::scene::{Scene, StartPose};
use sim::{ChannelKeys, Sim, SimConfig};
use wire::bus::{ChannelKey, Sender};
use wire::codec::encode;
use wire::core::{Core, Input, Output, Topic};
use wire::drive::{Act, Drive};
use wire::event::{Event, wire_hash};
use wire::id::{Boot, CommandId, FrameId, NodeId, ObjectId, Sequence, TrackId, WorldId};
use wire::sensor::{Camera, Candidates, Class, Frames};
use wire::time::{Instant, Span};

#[test]
fn the_same_seed_gives_the_same_bytes() {
    for rendered in [false, true] {
        let run = |seed| Rig::new(SimConfig::new(seed, rendered)).run(2_000, Some((1500, 80_000)));
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}

#[test]
fn how_often_the_core_is_woken_changes_nothing() {
    let ask = Some((1500, 80_000));
    let sparse = Rig::new(SimConfig::new(7, false)).run(3_000, ask);
    let mut rig = Rig::new(SimConfig::new(7, false));
    rig.wake_every_ms = Some(3);
    assert_eq!(rig.run(3_000, ask), sparse);
}

#[test]
fn a_fork_continues_identically() {
    let mut rig = Rig::new(SimConfig::new(7, false));
    rig.run(3_000, Some((2000, 50_000)));
    let (sim, drive, acts) = (rig.sim.clone(), rig.drive.clone(), rig.acts.clone());
    let mut fork = Rig { sim, drive, acts, now: rig.now, wake_every_ms: None };
    assert_eq!(fork.run(3_000, Some((2500, -60_000))), rig.run(3_000, Some((2500, -60_000))));
}

#[test]
fn vehicle_follows_set_points_and_stops_after_lease() {
    let mut rig = Rig::new(SimConfig::new(7, false));
    rig.run(4_000, Some((2000, 0)));
    let (world, plant) = rig.sim.truth();
    assert!((plant.state(world).speed() - 2.0).abs() < 0.15);

    let after = rig.run(2_000, None);
    let (world, plant) = rig.sim.truth();
    assert!(plant.state(world).speed().abs() < STANDSTILL);
    let lapse = events(&after)
        .into_iter()
        .find_map(|(time, e)| matches!(e, Any::Instrument(Note::Truth { leased: false, .. })).then_some(time));
    let lapse = lapse.expect("the lapse is written down");
    // The last set-point is made at 4.0 s of the run, with a lease of 300 ms.
    assert_eq!(lapse.since(START), Span::ms(4_300));
}

#[test]
fn collision_is_told_once_with_the_speed_before_it() {
    let mut config = SimConfig::new(7, false);
    config.scene.objects.truncate(1);
    config.scene.objects[0].path = vec![[-4.0, -5.0]];
    let log = Rig::new(config).run(6_000, Some((2000, 0)));
    let collisions: Vec<(ObjectId, i32)> = events(&log)
        .into_iter()
        .filter_map(|(_, e)| match e {
            Any::Instrument(Note::Collided { object, speed_mm_s, .. }) => Some((object, speed_mm_s)),
            _ => None,
        })
        .collect();
    assert!(matches!(collisions[..], [(ObjectId(0), 1_500..)]), "{collisions:?}");
}

#[test]
fn a_set_point_under_another_key_moves_nothing() {
    let mut rig = Rig::new(SimConfig::new(7, false));
    rig.drive = Sender::new(Topic::Drive, NodeId::UNIT_A, Boot(1), ChannelKey([9; 32]));
    let log = rig.run(2_000, Some((2000, 0)));
    let (world, plant) = rig.sim.truth();
    assert!(plant.state(world).speed().abs() < STANDSTILL);
    assert!(events(&log).iter().any(|(_, e)| matches!(e, Any::Service(Event::Refused { .. }))));
}

#[test]
fn depth_colour_and_heat_show_one_object() {
    // A hot red box, 10 m ahead of the camera, on flat ground.
    let mut scene = Scene::default();
    scene.ground.amplitude = 0.0;
    scene.objects.truncate(1);
    scene.objects[0].path = vec![[13.0, 0.0]];
    scene.objects[0].heading = 0.0;
    scene.objects[0].class = Class::Obstacle;
    scene.objects[0].size = [4.0, 4.0, 4.0];
    scene.objects[0].colour = [220, 10, 10];
    scene.objects[0].kelvin = 340.0;
    let frame =
        sim::render(&config::platform::Sensors::GROUND, &scene, StartPose { east: 0.0, north: 0.0, heading: 0.0 }, 1)
            .unwrap();
    let u16_at = |plane: &[u8], k: usize| u16::from_le_bytes([plane[2 * k], plane[2 * k + 1]]);
    let label = frame.labels[0];
    assert_eq!(label.object, ObjectId(0));
    for k in 0..usize::from(frame.width) * usize::from(frame.height) {
        let (x, y) = ((k % 160) as u16, (k / 160) as u16);
        let red = frame.rgb[3 * k] / 2 > frame.rgb[3 * k + 1];
        let hot = u16_at(&frame.thermal, k) > 310 * 100;
        let near = (9_000..=14_500).contains(&u16_at(&frame.depth, k)) && y < 65;
        let b = label.bounds;
        let inside = (b.x0..b.x1).contains(&x) && (b.y0..b.y1).contains(&y);
        assert_eq!(red, hot, "pixel {x},{y}");
        assert_eq!(red && y < 65, near, "pixel {x},{y}");
        assert!(inside || !red, "pixel {x},{y}");
    }
    // Straight ahead, the box's near face is 11 m from the body origin and so 10 m from the camera.
    assert!(u16_at(&frame.depth, 60 * 160 + 80).abs_diff(10_000) < 150);
    assert!(u16_at(&frame.lidar, 7 * 360).abs_diff(11_000) < 150);
}

#[test]
fn sensor_fault_leaves_other_sensors_bytes_unchanged() {
    let clean = Rig::new(SimConfig::new(7, true)).run(1_000, None);
    for disturbance in [Disturbance::Dropout, Disturbance::Freeze, Disturbance::Occlusion { permille: 400 }] {
        let mut config = SimConfig::new(7, true);
        config.faults.push(Fault {
            sensor: Sensor::Thermal,
            disturbance,
            start_ms: 300,
            duration_ms: 300,
            step: None,
            waits_ms: None,
        });
        let log = Rig::new(config).run(1_000, None);
        for (clean, got) in planes(&clean).iter().zip(planes(&log)) {
            let faulty = (3..6).contains(&got.0.0);
            assert_eq!((clean.1[0].as_ref(), clean.1[1].as_ref()), (got.1[0].as_ref(), got.1[1].as_ref()));
            assert_eq!(clean.1[3], got.1[3]);
            assert_eq!(clean.1[2] == got.1[2], !faulty, "{:?} {disturbance:?}", got.0);
        }
        let edges: Vec<_> = events(&log)
            .into_iter()
            .filter_map(|(_, e)| match e {
                Any::Instrument(Note::Fault { sensor: Sensor::Thermal, active, frame, .. }) => Some((active, frame)),
                _ => None,
            })
            .collect();
        assert_eq!(edges, [(true, FrameId(3)), (false, FrameId(6))]);
    }
}

/// A run with one fault of `sensor`, from frame 6 to frame 12.
fn spoilt(rendered: bool, sensor: Sensor, disturbance: Disturbance) -> SimConfig {
    let mut config = SimConfig::new(7, rendered);
    let (start_ms, duration_ms) = (600, 700);
    config.faults.push(Fault { sensor, disturbance, start_ms, duration_ms, step: None, waits_ms: None });
    config
}

/// Faults reported in the messages on `topic`: which of them, and the fault that is reported to have changed it.
fn faults_reported(log: &[Output], topic: Topic) -> Vec<(usize, Sensor, FaultKind)> {
    let messages = log.iter().filter_map(|o| match o {
        Output::Bus { topic: of, bytes } if *of == topic => Some(wire_hash(bytes)),
        _ => None,
    });
    let messages: Vec<u64> = messages.collect();
    let altered = events(log).into_iter().filter_map(|(_, e)| match e {
        Any::Instrument(Note::Altered { sensor, kind, hash }) => {
            Some((messages.iter().position(|message| *message == hash).expect("a message"), sensor, kind))
        }
        _ => None,
    });
    altered.collect()
}

/// A message that would read the same without the fault is not.
#[test]
fn first_changed_message_of_a_fault_is_reported() {
    let jump = Disturbance::Jump { east_mm: 1, north_mm: 0 };
    for (rendered, sensor, disturbance) in [
        (false, Sensor::Rgb, Disturbance::Freeze),
        (false, Sensor::Thermal, Disturbance::Dropout),
        (false, Sensor::Lidar, Disturbance::Noise { factor: 2 }),
        (false, Sensor::Rgb, Disturbance::Chaff { count: 1 }),
        (false, Sensor::Localisation, Disturbance::Freeze),
        (false, Sensor::Localisation, jump),
        (false, Sensor::Localisation, Disturbance::TimeStep { us: 1 }),
        (false, Sensor::Odometry, Disturbance::Dropout),
        (false, Sensor::Odometry, Disturbance::Drift { east_mm_s: 1, north_mm_s: 0 }),
        (false, Sensor::Odometry, jump),
        (false, Sensor::Odometry, Disturbance::Scale { permille: 500 }),
        (true, Sensor::Rgb, Disturbance::Freeze),
        (true, Sensor::Thermal, Disturbance::Skew { frames: 4 }),
    ] {
        let topic = match (rendered, sensor) {
            (_, Sensor::Odometry | Sensor::Localisation) => Topic::Navigation,
            (true, _) => Topic::Frames,
            (false, _) => Topic::Candidates,
        };
        let clean = Rig::new(SimConfig::new(7, rendered)).run(1_500, None);
        let log = Rig::new(spoilt(rendered, sensor, disturbance)).run(1_500, None);
        let differ: Vec<bool> =
            bodies(&clean, topic).iter().zip(bodies(&log, topic)).map(|(clean, got)| *clean != got).collect();
        let counts: Vec<usize> = faults_reported(&log, topic).into_iter().map(|(message, ..)| message).collect();
        assert_eq!(counts.first().copied(), differ.iter().position(|differs| *differs), "{sensor:?} {disturbance:?}");
        assert!(counts.iter().all(|message| differ[*message]), "{sensor:?} {disturbance:?}: {counts:?}");
    }
}

#[test]
fn hidden_fault_is_not_reported_as_effective() {
    let mut config = spoilt(false, Sensor::Localisation, Disturbance::Dropout);
    let disturbance = Disturbance::Jump { east_mm: 3_000, north_mm: 0 };
    let jump = Fault {
        sensor: Sensor::Localisation,
        disturbance,
        start_ms: 800,
        duration_ms: 300,
        step: None,
        waits_ms: None,
    };
    config.faults.push(jump);
    let kinds: Vec<FaultKind> = faults_reported(&Rig::new(config).run(1_500, None), Topic::Navigation)
        .into_iter()
        .map(|(.., kind)| kind)
        .collect();
    assert_eq!(kinds, [FaultKind::Dropout]);
}

/// The other sensors show the present.
#[test]
fn late_camera_repeats_its_past_to_the_byte() {
    let clean = planes(&Rig::new(SimConfig::new(7, true)).run(1_500, None));
    for (sensor, own) in [(Sensor::Rgb, 0), (Sensor::Thermal, 2)] {
        let log = Rig::new(spoilt(true, sensor, Disturbance::Skew { frames: 5 })).run(1_500, None);
        for (FrameId(at), got) in planes(&log) {
            let seen = |plane| FrameId(if plane == own && (6..13).contains(&at) { at - 5 } else { at });
            (0..4).for_each(|plane| assert!(got[plane] == clean[&seen(plane)][plane], "{at} {plane} {sensor:?}"));
        }
    }
}

#[test]
fn perturbation_changes_colour_images_during_its_fault_only() {
    let clean = planes(&Rig::new(SimConfig::new(7, true)).run(1_500, None));
    let mut config = spoilt(true, Sensor::Rgb, Disturbance::Perturbation { strength: 6 });
    let fields = (0..ROWS * COLUMNS).map(|k| [(k % 41) as i8 - 20, 4, -128]).collect();
    config.scene.perturbation = Perturbation::new(fields);
    let pattern = config.scene.perturbation.clone().unwrap();
    let perturbed = planes(&Rig::new(config).run(1_500, None));
    for (FrameId(at), mut planes) in clean {
        if (6..13).contains(&at) {
            pattern.add(6, usize::from(Camera::GROUND.width), planes[0].as_mut().unwrap());
        }
        assert!(perturbed[&FrameId(at)] == planes, "{at}");
    }
}

/// The past is the list of another frame; chaff fills a list.
#[test]
fn past_and_chaff_work_on_unrendered_lists() {
    let lists = |log: &[Output]| -> Vec<Candidates> {
        bodies(log, Topic::Candidates).iter().map(|b| minicbor::decode(b).unwrap()).collect()
    };
    let clean = lists(&Rig::new(SimConfig::new(7, false)).run(1_500, None));
    let late = lists(&Rig::new(spoilt(false, Sensor::Thermal, Disturbance::Skew { frames: 5 })).run(1_500, None));
    let full = lists(&Rig::new(spoilt(false, Sensor::Rgb, Disturbance::Chaff { count: 32 })).run(1_500, None));
    for at in 0..clean.len() {
        let spoilt = (6..13).contains(&clean[at].frame.0);
        assert_eq!(late[at].thermal, clean[if spoilt { at - 5 } else { at }].thermal);
        assert_eq!((&late[at].rgb, &late[at].lidar), (&clean[at].rgb, &clean[at].lidar));
        let (own_detections, got) = (clean[at].rgb.as_deref().unwrap(), full[at].rgb.as_deref().unwrap());
        assert_eq!(got.len(), if spoilt { 32 } else { own_detections.len() });
        assert_eq!(&got[..own_detections.len()], own_detections, "what the stage is surer of is not displaced");
        assert!(got[own_detections.len()..].iter().all(|weak| (500..=650).contains(&weak.score)));
    }
}

#[test]
fn missing_perturbation_is_refused() {
    let config = spoilt(true, Sensor::Rgb, Disturbance::Perturbation { strength: 6 });
    let refused = Sim::new(&config, keys(), None, START).err();
    assert_eq!(refused, Some(SceneError::FaultDoesNotApply { index: 0 }));
}

/// Faults beyond the remembered frames, and image faults of sensors without pictures.
#[test]
fn inapplicable_faults_are_refused() {
    for (sensor, disturbance) in [
        (Sensor::Rgb, Disturbance::Skew { frames: 33 }),
        (Sensor::Rgb, Disturbance::Skew { frames: 0 }),
        (Sensor::Lidar, Disturbance::Skew { frames: 5 }),
        (Sensor::Rgb, Disturbance::Chaff { count: 33 }),
        (Sensor::Thermal, Disturbance::Chaff { count: 5 }),
        (Sensor::Rgb, Disturbance::Perturbation { strength: 101 }),
        (Sensor::Thermal, Disturbance::Perturbation { strength: 8 }),
    ] {
        let fault = Fault { sensor, disturbance, start_ms: 0, duration_ms: 1, step: None, waits_ms: None };
        assert!(Faults::new(&[fault]).is_err(), "{fault:?}");
    }
}

#[test]
fn drift_moves_the_fix_and_is_logged() {
    let mut config = SimConfig::new(7, false);
    let disturbance = Disturbance::Drift { east_mm_s: 1000, north_mm_s: 0 };
    config.faults.push(Fault {
        sensor: Sensor::Localisation,
        disturbance,
        start_ms: 500,
        duration_ms: 60_000,
        step: None,
        waits_ms: None,
    });
    let log = Rig::new(config).run(3_500, None);
    let bodies = bodies(&log, Topic::Navigation);
    let last = minicbor::decode::<wire::sensor::Navigation>(bodies.last().unwrap()).unwrap();
    assert!((last.fix.unwrap().pose.x_mm - -7_000).abs() < 400, "{last:?}");
    assert!(
        events(&log)
            .iter()
            .any(|(_, e)| matches!(e, Any::Instrument(Note::Fault { kind: FaultKind::Drift, active: true, .. })))
    );
}

#[test]
fn multi_sensor_step_begins_and_ends_once() {
    let mut config = SimConfig::new(7, false);
    // One after the other with a pause between them, and one that navigation and not the frames tell of.
    let parts = [
        (Sensor::Rgb, 500, 200),
        (Sensor::Thermal, 500, 400),
        (Sensor::Localisation, 800, 100),
        (Sensor::Lidar, 1300, 300),
    ];
    for (sensor, start_ms, duration_ms) in parts {
        let step = StepName::new("blind");
        let disturbance = Disturbance::Dropout;
        config.faults.push(Fault { sensor, disturbance, start_ms, duration_ms, step, waits_ms: None });
    }
    let log = Rig::new(config).run(2_500, None);
    let steps: Vec<(u64, bool)> = events(&log)
        .into_iter()
        .filter_map(|(time, e)| match e {
            Any::Instrument(Note::Step { begun, .. }) => Some((time.since(START).0 / 1000, begun)),
            _ => None,
        })
        .collect();
    assert_eq!(steps, [(500, true), (1600, false)]);
}

#[test]
fn unrendered_candidates_place_the_object_where_it_is() {
    let mut config = SimConfig::new(7, false);
    config.scene.objects.truncate(1);
    config.scene.objects[0].path = vec![[6.0, -5.0]];
    let log = Rig::new(config).run(3_000, None);
    let bodies = bodies(&log, Topic::Candidates);
    let frames: Vec<Candidates> = bodies.iter().map(|b| minicbor::decode(b).unwrap()).collect();
    let clusters: Vec<_> = frames.iter().flat_map(|f| f.lidar.as_ref().unwrap().iter()).collect();
    assert!(clusters.len() > 25);
    assert!(clusters.iter().all(|c| (c.x_mm - 15_500).abs() < 1_500 && c.y_mm.abs() < 800), "{clusters:?}");
    let vehicles = frames.iter().filter(|f| f.rgb.as_ref().unwrap().iter().any(|d| d.class == Class::Vehicle)).count();
    let warm = frames.iter().filter(|f| !f.thermal.as_ref().unwrap().is_empty()).count();
    assert!(vehicles > 22 && warm > 24, "{vehicles} {warm}");
}

#[test]
fn act_is_answered_with_the_nearest_true_object() {
    let mut rig = Rig::new(SimConfig::new(7, false));
    rig.run(500, None);
    let bytes = rig.act();
    assert_eq!(rig.acted(bytes), Some((Some(ObjectId(2)), Some(Class::Decoy), 600)));
}

/// The unit's mode may have changed meanwhile, for want of sensors.
#[test]
fn act_sent_before_a_stall_ended_is_refused() {
    let sent_and_stalled = |stall: Span| {
        let mut rig = Rig::new(SimConfig::new(7, false));
        rig.wake_every_ms = Some(10);
        rig.run(500, None);
        let before = rig.act();
        rig.now += stall;
        let late = rig.acted(before);
        let after = rig.act();
        (late.is_some(), rig.acted(after).is_some())
    };
    assert_eq!(sent_and_stalled(sim::STALL), (true, true));
    assert_eq!(sent_and_stalled(Span(sim::STALL.0 + 1)), (false, true));
}

#[test]
fn config_survives_json_and_refuses_unknown_keys() {
    let config = SimConfig::new(7, true);
    let json = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<SimConfig>(&json).unwrap(), config);
    assert!(serde_json::from_str::<SimConfig>(&json.replace("\"seed\"", "\"sede\"")).is_err());
}

/// Hosts have arbitrary zeros.
const START: Instant = Instant(77_000_123);

fn keys() -> ChannelKeys {
    let [frames, candidates, navigation, drive, act] = [0, 1, 2, 3, 4].map(|k| ChannelKey([k; 32]));
    ChannelKeys { frames, candidates, navigation: [navigation.clone(), navigation], drive, act }
}

/// A sim with a driver.
struct Rig {
    sim: Sim,
    drive: Sender,
    acts: Sender,
    now: Instant,
    wake_every_ms: Option<u64>,
}

impl Rig {
    fn new(config: SimConfig) -> Rig {
        let keys = keys();
        let drive = Sender::new(Topic::Drive, NodeId::UNIT_A, Boot(1), keys.drive.clone());
        let acts = Sender::new(Topic::Act, NodeId::UNIT_A, Boot(1), keys.act.clone());
        Rig { sim: Sim::new(&config, keys, None, START).unwrap(), drive, acts, now: START, wake_every_ms: None }
    }

    /// Runs on, asking for (mm/s, 10⁻⁶/m) every 50 ms under leases of 300 ms.
    fn run(&mut self, ms: u64, ask: Option<(i32, i32)>) -> Vec<Output> {
        let mut log = self.drain();
        for _ in 0..ms / 50 {
            let until = self.now + Span::ms(50);
            loop {
                let wish = self.wake_every_ms.map(|ms| self.now + Span::ms(ms)).or(self.sim.deadline());
                let Some(time) = wish.filter(|time| *time <= until) else { break };
                self.now = time;
                self.sim.handle(time, &Input::Timeout);
                log.extend(self.drain());
            }
            self.now = until;
            if let Some((speed_mm_s, curvature_um)) = ask {
                let set_point = wire::drive::SetPoint::Course { speed_mm_s, curvature_um };
                let drive = Drive { stamp: until, set_point, lease: Span::ms(300) };
                let bytes = self.drive.seal(until, &encode(&drive));
                self.sim.handle(until, &Input::Bus { topic: Topic::Drive, bytes });
            }
            log.extend(self.drain());
        }
        log
    }

    /// An act of the unit, sealed now.
    fn act(&mut self) -> Vec<u8> {
        let command = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(1) };
        let (stamp, track) = (self.now, TrackId(3));
        let act = Act { stamp, world: WorldId(0), authority: 1, track, x_mm: 18_600, y_mm: -15_000, command };
        self.acts.seal(stamp, &encode(&act))
    }

    /// The nearest true object, its class and its distance in mm, if the plant carries out an act that arrives now.
    fn acted(&mut self, bytes: Vec<u8>) -> Option<(Option<ObjectId>, Option<Class>, u32)> {
        self.sim.handle(self.now, &Input::Bus { topic: Topic::Act, bytes });
        events(&self.drain()).into_iter().find_map(|(_, e)| match e {
            Any::Instrument(Note::PlantAct { object, class, distance_mm, .. }) => Some((object, class, distance_mm)),
            _ => None,
        })
    }

    /// Entries of the journal bear the time at which they are handed over: the oracle takes another one for a delay.
    fn drain(&mut self) -> Vec<Output> {
        let out: Vec<Output> = std::iter::from_fn(|| self.sim.output()).collect();
        if self.wake_every_ms.is_none() {
            assert!(events(&out).iter().all(|(time, _)| *time == self.now), "at {:?}: {:?}", self.now, events(&out));
        }
        out
    }
}

fn events(log: &[Output]) -> Vec<(Instant, Any)> {
    let entries = log.iter().filter_map(|o| match o {
        Output::Audit { bytes } => Some(Entry::decode(bytes).unwrap()),
        _ => None,
    });
    entries.map(|e| (e.at, e.event)).collect()
}

fn bodies(log: &[Output], wanted: Topic) -> Vec<&[u8]> {
    let messages = log.iter().filter_map(|o| match o {
        Output::Bus { topic, bytes } if *topic == wanted => wire::bus::body(bytes),
        _ => None,
    });
    messages.collect()
}

type Planes = [Option<Vec<u8>>; 4];

fn planes(log: &[Output]) -> BTreeMap<FrameId, Planes> {
    let frames = bodies(log, Topic::Frames).into_iter().map(|b| minicbor::decode::<Frames>(b).unwrap());
    frames.map(|f| (f.frame, [f.rgb, f.depth, f.thermal, f.lidar].map(|p| p.map(|p| p.to_vec())))).collect()
}
