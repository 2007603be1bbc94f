//! The core fed with synthetic candidates over sealed messages, as the twin feeds it.

use config::setup::Channel;
use wire::bounds::Bounds;
use wire::bus::ChannelKey;
use wire::codec::List;
use wire::id::{Boot, FrameId, NodeId};
use wire::policy::Policy;
use wire::sensor::{
    Blob, Class, Cluster, DepthSample, Detection, Fix, Modality, Odometry, PixelBox, Pose, ProductMode,
};
use wire::sign::Secret;
use wire::time::Span;
use wire::track::Track;

use super::*;
use crate::fused::Disputed;

/// A unit at (100 m, 50 m) that faces north and observes the objects put before it, ten times a second.
struct Rig {
    core: Perception,
    candidates: Sender,
    navigation: Sender,
    now: Instant,
    frame: u64,
    outputs: Vec<Output>,
}

/// An object ahead: the body-frame place of its near surface and each modality's response.
#[derive(Clone, Copy)]
struct Thing {
    class: Class,
    forward: f64,
    left: f64,
    size: [f64; 2],
    depth_error: f64,
    peak_ck: Option<u16>,
    lidar: bool,
    depth: bool,
}

const VEHICLE: Thing = Thing {
    class: Class::Vehicle,
    forward: 12.0,
    left: 1.0,
    size: [4.2, 1.6],
    depth_error: 0.0,
    peak_ck: Some(31_400),
    lidar: true,
    depth: true,
};

impl Rig {
    fn new() -> Self {
        let key = |topic, producer| Channel { topic, producer, key: ChannelKey([topic as u8; 32]) };
        let setup = |node| Setup {
            node,
            boot: Boot(1),
            world: WorldId(0),
            seed: 1,
            policy: Policy::default(),
            bounds: Bounds::GROUND,
            secret: Secret([7; 32]),
            public_keys: Vec::new(),
            channels: vec![
                key(Topic::Candidates, NodeId::SIM),
                key(Topic::Navigation, NodeId::SIM),
                key(Topic::Navigation, NodeId::SIM),
                key(Topic::Tracks, NodeId::PERCEPTION),
            ],
            ablation: None,
            verifier: None,
        };
        let sim = setup(NodeId::SIM);
        let now = Instant(5_000_000);
        Rig {
            core: Perception::new(setup(NodeId::PERCEPTION), PerceptionConfig::default(), now).unwrap(),
            candidates: sim.sender(Topic::Candidates).unwrap(),
            navigation: sim.sender(Topic::Navigation).unwrap(),
            now,
            frame: 0,
            outputs: Vec::new(),
        }
    }

    fn navigate(&mut self) {
        let pose = Pose { x_mm: 100_000, y_mm: 50_000, yaw_mrad: 1571 };
        let reading = Navigation {
            stamp: self.now,
            fix: Some(Fix { pose, sigma_mm: 50, time: Default::default() }),
            odometry: Some(Odometry { speed_mm_s: 0, yaw_rate_mrad_s: 0 }),
            spatial: None,
        };
        let bytes = self.navigation.seal(self.now, &codec::encode(&reading));
        self.core.handle(self.now, &Input::Bus { topic: Topic::Navigation, bytes });
    }

    /// Sends one frame; `edit` may take products away before.
    fn frame(&mut self, things: &[Thing], edit: impl Fn(&mut Candidates)) -> Tracks {
        self.now += Span::ms(100);
        self.frame += 1;
        self.navigate();
        let mut candidates = candidates(FrameId(self.frame), self.now, things);
        edit(&mut candidates);
        let bytes = self.candidates.seal(self.now, &codec::encode(&candidates));
        self.core.handle(self.now, &Input::Bus { topic: Topic::Candidates, bytes });
        let mut tracks = None;
        while let Some(output) = self.core.output() {
            if let Output::Bus { topic: Topic::Tracks, bytes } = &output {
                let body = &bytes[wire::bus::HEADER_LEN..bytes.len() - wire::bus::TAG_LEN];
                tracks = Some(codec::decode(body, 4096).unwrap());
            }
            self.outputs.push(output);
        }
        tracks.expect("a message for each frame")
    }

    fn frames(&mut self, n: u32, things: &[Thing], edit: impl Fn(&mut Candidates)) -> Vec<Track> {
        let mut last = Vec::new();
        for _ in 0..n {
            last = self.frame(things, &edit).tracks.to_vec();
        }
        last
    }
}

fn bounds(thing: &Thing) -> PixelBox {
    let camera = Camera::GROUND;
    let (focal, depth) = (f64::from(camera.focal_px), thing.forward - f64::from(camera.forward_m));
    let (column, foot) = (80.0 - thing.left / depth * focal, 60.0 + f64::from(camera.up_m) / depth * focal);
    let (half, high) = (0.5 * thing.size[0] / depth * focal, thing.size[1] / depth * focal);
    let px = |v: f64| v.round().max(0.0) as u16;
    PixelBox { x0: px(column - half), y0: px(foot - high), x1: px(column + half), y1: px(foot) }
}

fn candidates(frame: FrameId, stamp: Instant, things: &[Thing]) -> Candidates {
    // A live sensor's readings never repeat themselves.
    let noise = (frame.0 % 40) as u16;
    let detections: List<Detection, 32> =
        things.iter().map(|t| Detection { class: t.class, score: 880 + noise, bounds: bounds(t) }).collect();
    let depth = things.iter().enumerate().filter(|(_, t)| t.depth).map(|(index, t)| DepthSample {
        detection: index as u8,
        median_mm: ((t.forward - 1.0 + t.depth_error) * 1000.0) as u16 + noise,
    });
    let blob = |t: &Thing| {
        t.peak_ck.map(|peak_ck| Blob {
            bounds: bounds(t),
            mean_ck: peak_ck - 500 + noise,
            peak_ck,
            class: t.class,
            score: 900,
        })
    };
    let clusters = things.iter().filter(|t| t.lidar).map(|t| Cluster {
        x_mm: (t.forward * 1000.0) as i32 + i32::from(noise),
        y_mm: (t.left * 1000.0) as i32,
        width_mm: (t.size[0] * 900.0) as u16,
        height_mm: (t.size[1] * 850.0) as u16,
    });
    Candidates {
        frame,
        stamp,
        mode: ProductMode::Live,
        rgb: Some(detections),
        depth: Some(depth.collect()),
        thermal: Some(things.iter().filter_map(blob).collect()),
        lidar: Some(clusters.collect()),
        grain: None,
    }
}

/// Near its true place.
#[test]
fn consistent_object_becomes_one_stable_track() {
    let mut rig = Rig::new();
    assert!(rig.frames(2, &[VEHICLE], |_| {}).is_empty(), "tentative until the third update");
    let id = rig.frames(1, &[VEHICLE], |_| {})[0].id;
    let tracks = rig.frames(20, &[VEHICLE], |_| {});
    assert_eq!(tracks.len(), 1);
    assert_eq!((tracks[0].id, tracks[0].class), (id, Class::Vehicle));
    assert!(tracks[0].confidence > 800, "{}", tracks[0].confidence);
    // Facing north: 12 m forward plus half the vehicle's depth is north, 1 m left is west.
    let (east, north) = (f64::from(tracks[0].x_mm) / 1000.0, f64::from(tracks[0].y_mm) / 1000.0);
    assert!((east - 99.0).abs() < 0.3 && (north - 62.9).abs() < 0.6, "{east} {north}");
    assert_eq!(tracks[0].supported.count(), 4);
}

#[test]
fn colour_alone_never_becomes_a_track() {
    let ghost = Thing { lidar: false, depth: false, peak_ck: None, ..VEHICLE };
    assert!(Rig::new().frames(50, &[ghost], |_| {}).is_empty());
    let only_rgb = |c: &mut Candidates| (c.depth, c.thermal, c.lidar) = (None, None, None);
    assert!(Rig::new().frames(50, &[VEHICLE], only_rgb).is_empty());
}

#[test]
fn depth_that_disagrees_with_lidar_vetoes() {
    let torn = Thing { depth_error: 4.0, ..VEHICLE };
    assert!(Rig::new().frames(50, &[torn], |_| {}).is_empty());
    let judged = corroborate::corroborate(
        &Camera::GROUND,
        &CorroborationLimits::default(),
        Modalities::default(),
        &candidates(FrameId(1), Instant(0), &[torn]),
        Disputed::default(),
    );
    assert!(judged[0].vetoed.contains(Modality::Depth) && judged[0].vetoed.contains(Modality::Lidar));
    assert_eq!(judged[0].sighting, None);
}

#[test]
fn cold_vehicle_decoy_is_vetoed() {
    let decoy = Thing { peak_ck: None, ..VEHICLE };
    assert!(Rig::new().frames(50, &[decoy], |_| {}).is_empty());
    // One that turns cold under a standing track takes its confidence.
    let mut rig = Rig::new();
    let before = rig.frames(20, &[VEHICLE], |_| {})[0];
    let after = rig.frames(20, &[decoy], |_| {})[0];
    assert_eq!(after.id, before.id);
    assert!(after.vetoed.contains(Modality::Thermal) && after.confidence < 200, "{}", after.confidence);
    let wrong = Thing { peak_ck: Some(45_000), ..VEHICLE };
    assert!(Rig::new().frames(50, &[wrong], |_| {}).is_empty());
}

/// A missing modality is reported once, and so is its return.
#[test]
fn missing_modality_ages_its_product() {
    let mut rig = Rig::new();
    rig.frames(5, &[VEHICLE], |_| {});
    let message = rig.frame(&[VEHICLE], |c| c.thermal = None);
    assert_eq!(message.frame, FrameId(6), "a message for each frame, whatever is missing");
    assert_eq!(message.products[Modality::Thermal as usize].unwrap().frame, FrameId(5));
    assert_eq!(message.products[Modality::Lidar as usize].unwrap().frame, FrameId(6));
    rig.frames(3, &[VEHICLE], |c| c.thermal = None);
    rig.frames(3, &[VEHICLE], |_| {});
    let seen = rig.outputs.iter().filter_map(|output| {
        let Output::Audit { bytes } = output else { return None };
        let Event::FrameSeen { frame, present } = wire::audit::Entry::decode(bytes).unwrap().event else { return None };
        Some((frame.0, present.count()))
    });
    assert_eq!(seen.collect::<Vec<_>>(), [(1, 4), (6, 3), (10, 4)]);
}

/// Journal entries of modalities that repeat themselves: the modality, the frame, and the earlier frame it equals.
fn repeated(rig: &Rig) -> Vec<(Modality, u64, u64)> {
    let reported = rig.outputs.iter().filter_map(|output| {
        let Output::Audit { bytes } = output else { return None };
        let event = wire::audit::Entry::decode(bytes).unwrap().event;
        let Event::Repeated { modality, frame, first } = event else { return None };
        Some((modality, frame.0, first.0))
    });
    reported.collect()
}

/// Since its content was new; its journal reports that once.
#[test]
fn frozen_modality_gives_no_product() {
    let frozen = candidates(FrameId(9), Instant(0), &[VEHICLE]).thermal;
    let mut rig = Rig::new();
    rig.frames(8, &[VEHICLE], |_| {});
    let product = |message: &Tracks| message.products[Modality::Thermal as usize].unwrap().frame.0;
    let shown: Vec<u64> = (0..8).map(|_| product(&rig.frame(&[VEHICLE], |c| c.thermal.clone_from(&frozen)))).collect();
    assert_eq!(shown, [9, 10, 11, 12, 9, 9, 9, 9], "as old as its content, once that is known");
    assert_eq!(product(&rig.frame(&[VEHICLE], |_| {})), 17, "and fresh with the first new one");
    assert_eq!(repeated(&rig), [(Modality::Thermal, 13, 9)]);
}

/// Without the check both pass as live.
#[test]
fn frozen_colour_withdraws_its_depth() {
    let frozen = candidates(FrameId(9), Instant(0), &[VEHICLE]).rgb;
    for requirement in [Requirement::Required, Requirement::Waived] {
        let mut rig = Rig::new();
        rig.core.setup.policy.boundary.insert(Check::Content, requirement);
        rig.frames(8, &[VEHICLE], |_| {});
        let tracks = rig.frames(30, &[VEHICLE], |c| c.rgb.clone_from(&frozen));
        assert_eq!(tracks.is_empty(), requirement == Requirement::Required, "{tracks:?}");
        let depth = rig.frame(&[VEHICLE], |c| c.rgb.clone_from(&frozen)).products[Modality::Depth as usize];
        assert_eq!(depth.unwrap().frame, FrameId(39), "the depth camera itself lives");
        assert_eq!(repeated(&rig), [(Modality::Rgb, 13, 9)]);
    }
}

#[test]
fn objects_keep_identities_that_are_never_reused() {
    let person = Thing { class: Class::Person, left: -4.0, size: [0.5, 1.75], peak_ck: Some(30_400), ..VEHICLE };
    let mut rig = Rig::new();
    let ids = |tracks: &[Track]| tracks.iter().map(|t| (t.id.0, t.class)).collect::<Vec<_>>();
    let both = [(1, Class::Vehicle), (2, Class::Person)];
    assert_eq!(ids(&rig.frames(10, &[VEHICLE, person], |_| {})), both);
    assert_eq!(ids(&rig.frames(10, &[person, VEHICLE], |_| {})), both);
    assert_eq!(ids(&rig.frames(11, &[person], |_| {})), both[1..]);
    assert_eq!(ids(&rig.frames(10, &[person, VEHICLE], |_| {})), [(2, Class::Person), (3, Class::Vehicle)]);
}

#[test]
fn replayed_product_is_refused_and_feeds_no_track() {
    let mut rig = Rig::new();
    rig.now += Span::ms(100);
    let recorded = Candidates { mode: ProductMode::Replay, ..candidates(FrameId(1), rig.now, &[VEHICLE]) };
    let bytes = rig.candidates.seal(rig.now, &codec::encode(&recorded));
    rig.core.handle(rig.now, &Input::Bus { topic: Topic::Candidates, bytes });
    let outputs: Vec<Output> = std::iter::from_fn(|| rig.core.output()).collect();
    assert!(!outputs.iter().any(|o| matches!(o, Output::Bus { .. })));
    let refused = wire::event::Account::Refused(Interface::Bus(Topic::Candidates), wire::refusal::Reason::Product);
    assert_eq!(rig.core.accounts.total(refused), 1);
}

#[test]
fn repetition_and_fork_are_equal_bitwise() {
    let run = |rig: &mut Rig| {
        rig.frames(15, &[VEHICLE, Thing { left: -3.0, forward: 9.0, ..VEHICLE }], |_| {});
        rig.outputs.clone()
    };
    let (mut first, mut second) = (Rig::new(), Rig::new());
    assert_eq!(run(&mut first), run(&mut second));
    first.core = first.core.fork(WorldId(1));
    assert_eq!(run(&mut first), run(&mut second));
}
