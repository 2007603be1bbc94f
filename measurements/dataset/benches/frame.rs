//! Cost of one frame from the first ray to the track, stage by stage: CPU time of one thread, random held-out scenes.
//!
//! Run with `cargo bench --manifest-path measurements/Cargo.toml --bench frame`. With `-- --python PYTHON` the same rays and images go
//! to MuJoCo's `mj_multiRay` and to Python's onnxruntime in one run (`tools/referee/frame.py`), between two measurements here, and the scene to `mj_step` with a
//! vehicle of the same size on it; with `-- --runtime LIBRARY` the model runs in that ONNX Runtime library here too.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use config::platform::Sensors;
use dataset::cells::{self, Split};
use dataset::example::Example;
use link::clock::thread_cpu_us;
use perception::corroborate::{CorroborationLimits, Sighting, corroborate};
use perception::detector::{Detector, DetectorError};
use perception::fused::{SAY, claims, image};
use perception::lidar::Scanner;
use perception::pose::Ego;
use perception::tracker::{MAX_TRACKS, Tracker};
use perception::{depth, runtime, thermal};
use serde_json::json;
use sim::fault::Faults;
use sim::plant::{Plant, SetPoint};
use sim::sensor::Imagers;
use sim::sensor::camera::{REACH, Sweep, eye, ray};
use sim::world::{STEP, World};
use wire::id::FrameId;
use wire::sensor::{Camera, Candidates, Fix, Frames, Lidar, Modalities, Navigation, Pose, ProductMode, ReceiverTime};
use wire::time::{Instant, Span};

const FRAMES: u64 = 300;
/// Frames that are not counted.
const WARM_UP: u64 = 20;
/// Times that the rays of one scene are cast, and that one image is looked at.
const CASTS: usize = 200;
const IMAGES: usize = 50;
/// Steps of the world with the vehicle under way, and its speed, m/s.
const STEPS: u64 = 1_000;
const SPEED: f32 = 2.0;

const STAGES: [&str; 8] = [
    "sensors: rays and images",
    "colour network",
    "fused network",
    "thermal network",
    "depth samples",
    "LiDAR clusters",
    "corroboration",
    "tracker",
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let after =
        |name: &str| arguments.iter().position(|a| a == name).and_then(|k| arguments.get(k + 1)).map(PathBuf::from);
    if let Some(library) = after("--runtime") {
        runtime::adopt(&library)?;
    }
    println!("{}", runtime::describe()?);
    let detector = Detector::built_in(&Camera::GROUND)?;
    stages(&detector)?;
    let (world, plant) = settled(0)?;
    let image = Example::new(&Sensors::GROUND, cells::named("clear")?, Split::HeldOut, 0)?.frame.rgb;
    detect_in_process(&world, &plant, &detector, &image)?;
    if let Some(python) = after("--python") {
        referee(&python, &world, &plant, &image)?;
        detect_in_process(&world, &plant, &detector, &image)?;
    }
    Ok(())
}

/// A frame as perception is given it.
fn frames<'a>(imagers: &'a Imagers, camera: Camera, (frame, stamp): (FrameId, Instant)) -> Frames<'a> {
    let (width, height) = (camera.width, camera.height);
    let [rgb, depth, thermal, lidar] =
        [&imagers.rgb, &imagers.depth, &imagers.thermal, &imagers.ranges].map(|plane| Some(plane[..].into()));
    Frames { frame, stamp, width, height, rgb, depth, thermal, lidar }
}

fn detect_in_process(world: &World, plant: &Plant, detector: &Detector, image: &[u8]) -> Result<(), Box<dyn Error>> {
    let (rays, inference) = (rays(world, plant) / 1e6, inference(detector, image)? * 1e3);
    println!("here: {rays:.2} million rays a second; an inference with what is made of it {inference:.3} ms");
    let (rate, way) = stepped()?;
    println!("here: {rate:.0} simulated seconds of bare rapier a CPU second, {way:.1} m of way");
    Ok(())
}

/// Simulated seconds a CPU second with only the world and the vehicle, straight ahead; and the distance, metres.
fn stepped() -> Result<(f64, f32), Box<dyn Error>> {
    let (mut world, mut plant) = settled(0)?;
    let start = plant.state(&world).position;
    let (took, ()) = timed(|| {
        for k in 1..=STEPS {
            let now = Instant(k * STEP.0);
            plant.accept(now, SetPoint::course((SPEED, 0.0), now + STEP));
            plant.step(now, &mut world);
        }
    });
    let way = (plant.state(&world).position - start).length();
    Ok(((STEPS * STEP.0) as f64 / 1e6 / took.as_secs_f64(), way))
}

/// Frames through every stage, each on its own.
fn stages(detector: &Detector) -> Result<(), Box<dyn Error>> {
    let (camera, limits, scanner) = (Camera::GROUND, CorroborationLimits::default(), Scanner::new(&Lidar::GROUND));
    let pose = Pose { x_mm: 0, y_mm: 0, yaw_mrad: 0 };
    let (mut ego, network) = (Ego::default(), Detector::thermal(&Camera::GROUND)?);
    let fused = Detector::fused(&camera)?.ok_or("no fused network for this camera")?;
    let mut took: Vec<[Duration; STAGES.len()]> = Vec::new();
    let mut tracker = Tracker::<MAX_TRACKS>::default();
    for k in 0..FRAMES + WARM_UP {
        let (world, plant) = settled(k)?;
        let faults = Faults::new(&[])?;
        let mut imagers = Imagers::new(camera, Lidar::GROUND, k);
        let (frame, stamp) = (FrameId(k + 1), Instant((k + 1) * 50_000));
        let (sensing, ()) = timed(|| imagers.measure(k + 1, &world, &plant, &faults, Span::ZERO));
        let (detecting, seen) = timed(|| detector.detect(&imagers.rgb, SAY));
        let seen = seen?;
        let frames = frames(&imagers, camera, (frame, stamp));
        let (fusing, claimed) = timed(|| {
            let proposed = fused.detect(&image(&frames).unwrap_or_default(), limits.score)?;
            Ok::<_, DetectorError>(claims(&proposed, &seen, limits.score))
        });
        let (rgb, disputed) = claimed?;
        let (warming, thermal) = timed(|| thermal::blobs(&network, &imagers.thermal, camera.width, camera.height));
        let (sampling, depth) = timed(|| depth::samples(&imagers.depth, camera.width, camera.height, &rgb));
        let (clustering, lidar) = timed(|| scanner.clusters(&imagers.ranges));
        ego.note(&Navigation {
            stamp,
            fix: Some(Fix { pose, sigma_mm: 100, time: ReceiverTime(0) }),
            odometry: None,
            spatial: None,
        });
        let all =
            Candidates { frame, stamp, mode: ProductMode::Live, rgb: Some(rgb), depth, thermal, lidar, grain: None };
        let (judging, judged) = timed(|| corroborate(&camera, &limits, Modalities::default(), &all, disputed));
        let sightings: Vec<Sighting> = judged.iter().filter_map(|j| j.sighting).collect();
        let (tracking, ()) = timed(|| tracker.update(frame, stamp, ego.pose_at(stamp, STEP).as_ref(), &sightings));
        took.push([sensing, detecting, fusing, warming, sampling, clustering, judging, tracking]);
    }
    let counted = &took[WARM_UP as usize..];
    for (stage, name) in STAGES.iter().enumerate() {
        row(name, counted.iter().map(|frame| frame[stage]).collect());
    }
    row("whole frame", counted.iter().map(|frame| frame.iter().sum()).collect());
    Ok(())
}

fn row(name: &str, mut durations: Vec<Duration>) {
    durations.sort();
    let at = |share: f64| durations[((durations.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
    println!("{name:26} p50 {:7.3} ms   p99 {:7.3} ms   n {}", at(0.5), at(0.99), durations.len());
}

fn timed<T>(run: impl FnOnce() -> T) -> (Duration, T) {
    let before = thread_cpu_us();
    let given = run();
    (Duration::from_micros(thread_cpu_us() - before), given)
}

fn settled(number: u64) -> Result<(World, Plant), Box<dyn Error>> {
    let (scene, start) = dataset::draw::scene(cells::named("clear")?, Split::HeldOut, number)?;
    Ok(sim::settled(&scene, start)?)
}

/// Rays of the camera a second.
fn rays(world: &World, plant: &Plant) -> f64 {
    let mut sweep = Sweep::new(&Camera::GROUND);
    let (state, view) = (plant.state(world), world.view(plant.body()));
    let (took, ()) = timed(|| (0..CASTS).for_each(|_| sweep.cast(&Camera::GROUND, &state, &view)));
    (sweep.pixels().len() * CASTS) as f64 / took.as_secs_f64()
}

/// Equal rays and an equal image, elsewhere.
fn referee(python: &Path, world: &World, plant: &Plant, image: &[u8]) -> Result<(), Box<dyn Error>> {
    let (camera, state) = (Camera::GROUND, plant.state(world));
    let mut sweep = Sweep::new(&camera);
    sweep.cast(&camera, &state, &world.view(plant.body()));
    let centre = |k: usize| [(k % sweep.width()) as f32 + 0.5, (k / sweep.width()) as f32 + 0.5];
    let rays: Vec<_> =
        (0..sweep.pixels().len()).map(|k| (state.rotation * ray(&camera, centre(k))).to_array()).collect();
    let ranges: Vec<_> = sweep.pixels().iter().map(|pixel| pixel.hit.map(|hit| hit.distance)).collect();
    let cells = world.terrain().cells();
    let terrain =
        (0..=cells).map(|row| (0..=cells).map(|column| world.terrain().height_at(row, column)).collect::<Vec<_>>());
    let objects = world.scene().objects.iter().zip(world.placements()).map(|(object, place)| {
        json!({ "class": object.class.name(), "size": object.size, "centre": place.centre.to_array(), "facing": place.facing })
    });
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let value = json!({
        "side": world.terrain().side(), "terrain": terrain.collect::<Vec<_>>(), "objects": objects.collect::<Vec<_>>(), "reach": REACH,
        "eye": eye(&camera, &state).to_array(), "rays": rays, "ranges": ranges, "image": image, "casts": CASTS, "images": IMAGES,
        "steps": STEPS, "step": STEP.as_ms() / 1e3, "speed": SPEED, "at": state.position.to_array(), "yaw": state.yaw(),
        "model": root.join("crates/perception/models/detector.onnx"),
    });
    let file = std::env::temp_dir().join(format!("holdsafe-frame-{}.json", std::process::id()));
    std::fs::write(&file, value.to_string())?;
    let ran = Command::new(python).arg(root.join("tools/referee/frame.py")).arg(&file).status();
    std::fs::remove_file(&file)?;
    if ran?.success() { Ok(()) } else { Err("the referee failed".into()) }
}

/// Seconds of an inference with its decoding.
fn inference(detector: &Detector, image: &[u8]) -> Result<f64, Box<dyn Error>> {
    let mut took = Vec::new();
    for _ in 0..IMAGES {
        let (time, found) = timed(|| detector.detect(image, 500));
        found?;
        took.push(time);
    }
    took.sort();
    Ok(took[IMAGES / 2].as_secs_f64())
}
