//! Sim and perception together, standing still before a few objects: rendered frames through the shipped detector and
//! unrendered candidates lead to tracks of the same things in the same places.

use config::setup::{Channel, Setup};
use perception::{Perception, PerceptionConfig};
use sim::scene::{Object, Scene, StartPose};
use sim::{ChannelKeys, Sim, SimConfig};
use wire::bounds::Bounds;
use wire::bus::ChannelKey;
use wire::core::{Core, Input, Output, Topic};
use wire::id::{Boot, NodeId, WorldId};
use wire::policy::Policy;
use wire::sensor::Class;
use wire::sign::Secret;
use wire::time::{Instant, Span};
use wire::track::{Track, Tracks};

/// Class, place, heading and temperature of the objects that stand there.
const THINGS: [(Class, [f32; 2], f32, f32); 4] = [
    (Class::Vehicle, [2.0, -2.0], 1.2, 318.0),
    (Class::Person, [-1.0, -6.0], 0.0, 306.0),
    (Class::Decoy, [3.0, -11.0], 0.7, 289.0),
    (Class::Obstacle, [-3.0, -0.5], 0.3, 288.0),
];

#[test]
fn rendered_and_unrendered_runs_give_same_tracks() {
    for rendered in [false, true] {
        let tracks = run(rendered, Span::s(4));
        for (class, place, ..) in THINGS {
            let own_tracks: Vec<&Track> = tracks.iter().filter(|t| distance(t, place) < 2.0).collect();
            assert!(own_tracks.iter().any(|t| t.class == class), "rendered {rendered}: no {class:?} in {tracks:#?}");
        }
        let vehicles: Vec<&Track> = tracks.iter().filter(|t| t.class == Class::Vehicle).collect();
        assert_eq!(vehicles.len(), 1, "rendered {rendered}: {vehicles:#?}");
        assert!(vehicles[0].confidence >= Bounds::GROUND.designation_confidence, "rendered {rendered}: {vehicles:#?}");
    }
}

#[test]
fn rendered_run_repeats_to_the_last_bit() {
    assert_eq!(run(true, Span::ms(800)), run(true, Span::ms(800)));
}

fn distance(track: &Track, [east, north]: [f32; 2]) -> f32 {
    let (dx, dy) = (track.x_mm as f32 / 1000.0 - east, track.y_mm as f32 / 1000.0 - north);
    (dx * dx + dy * dy).sqrt()
}

fn scene() -> Scene {
    let base = Scene::default();
    let object = |(class, place, heading, kelvin): (Class, [f32; 2], f32, f32)| {
        let model = base.objects.iter().find(|o| o.class == class).expect("the default scene has one of each class");
        Object { path: vec![place], heading, kelvin, speed: 0.0, ..model.clone() }
    };
    let start = StartPose { east: -10.0, north: -5.0, heading: 0.0 };
    Scene { start, objects: THINGS.map(object).to_vec(), ..base }
}

/// The tracks of the last frame.
fn run(rendered: bool, length: Span) -> Vec<Track> {
    let key = |topic: Topic| ChannelKey([topic as u8; 32]);
    let keys = ChannelKeys {
        frames: key(Topic::Frames),
        candidates: key(Topic::Candidates),
        navigation: [key(Topic::Navigation), key(Topic::Navigation)],
        drive: key(Topic::Drive),
        act: key(Topic::Act),
    };
    let start = Instant(1_000_000);
    let config = SimConfig { scene: scene(), ..SimConfig::new(7, rendered) };
    let mut sim = Sim::new(&config, keys, None, start).expect("a valid scene");
    let mut perception = Perception::new(setup(key), PerceptionConfig { rendered, ..Default::default() }, start)
        .expect("the shipped detector");
    let (mut now, mut last) = (start, Vec::new());
    while now < start + length {
        now = sim.deadline().expect("a sim always has a next step").max(now);
        sim.handle(now, &Input::Timeout);
        while let Some(output) = sim.output() {
            if let Output::Bus { topic, bytes } = output {
                perception.handle(now, &Input::Bus { topic, bytes });
            }
        }
        while let Some(output) = perception.output() {
            if let Output::Bus { topic: Topic::Tracks, bytes } = output {
                let body = wire::bus::body(&bytes).expect("a bus message");
                let message: Tracks = wire::codec::decode(body, 4096).expect("its own message");
                last = message.tracks.to_vec();
            }
        }
    }
    last
}

fn setup(key: impl Fn(Topic) -> ChannelKey) -> Setup {
    let channel = |topic, producer| Channel { topic, producer, key: key(topic) };
    Setup {
        node: NodeId::PERCEPTION,
        boot: Boot(1),
        world: WorldId(0),
        seed: 1,
        policy: Policy::default(),
        bounds: Bounds::GROUND,
        secret: Secret([7; 32]),
        public_keys: Vec::new(),
        channels: vec![
            channel(Topic::Frames, NodeId::SIM),
            channel(Topic::Candidates, NodeId::SIM),
            channel(Topic::Navigation, NodeId::SIM),
            channel(Topic::Tracks, NodeId::PERCEPTION),
        ],
        ablation: None,
        verifier: None,
    }
}
