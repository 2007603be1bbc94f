//! The ground, true objects standing and moving on it, and the unit's tracks.

use std::io::{Seek, Write};

use foxglove::messages::{
    CubePrimitive, Duration, FrameTransform, FrameTransforms, LinePrimitive, SceneEntity, SceneUpdate, SpherePrimitive,
    TextPrimitive, line_primitive,
};
use sim::scene::Point;
use wire::id::{ObjectId, UnitId};
use wire::sensor::{Camera, Class, Lidar};
use wire::track::{Track, Tracks};

use crate::sensed::{camera, lidar, of_modalities};
use crate::shape::{OPTICAL, STRAIGHT, grey, heading, metres, of_class, point, pose, vector};
use crate::{Micros, ViewError, Viewer, stamp};

/// The frame that everything is in.
pub(crate) const WORLD: &str = "world";
/// A unit's body as it is drawn: length, width and height, metres.
pub(crate) const BODY: [f64; 3] = [2.0, 1.2, 0.8];
/// An object of unknown size, metres.
const UNKNOWN: [f64; 3] = [1.0, 1.0, 1.0];
/// A track that is not reported again is gone after this, milliseconds: it is reported ten times a second.
const TRACK_LASTS_MS: u32 = 500;
/// The smallest sphere that a track is drawn as, metres across.
const SMALLEST: f64 = 0.3;

impl<W: Write + Seek> Viewer<W> {
    /// The fence and the route, once.
    pub(crate) fn ground(&mut self) -> Result<(), ViewError> {
        let Some(scene) = &self.scene else { return Ok(()) };
        let line = |id: &str, points: &[Point], kind: line_primitive::Type, light: f64| {
            let points = points.iter().map(|[x, y]| point(f64::from(*x), f64::from(*y), 0.05)).collect();
            let line = LinePrimitive {
                r#type: kind as i32,
                pose: Some(pose(0.0, 0.0, 0.0, STRAIGHT)),
                thickness: 2.0,
                scale_invariant: true,
                points,
                color: Some(grey(light)),
                ..LinePrimitive::default()
            };
            SceneEntity { lines: vec![line], ..entity(0, WORLD, id) }
        };
        let entities = vec![
            line("geofence", &scene.geofence, line_primitive::Type::LineLoop, 0.9),
            line("route", &scene.route, line_primitive::Type::LineStrip, 0.5),
        ];
        self.put(0, "/truth", &SceneUpdate { deletions: Vec::new(), entities })
    }

    /// A unit is here.
    pub(crate) fn moved(&mut self, time: Micros, unit: UnitId, mm: [i32; 2], yaw_mrad: i16) -> Result<(), ViewError> {
        let [x, y] = mm.map(metres);
        let body = transform(time, WORLD, &unit.to_string(), [x, y, 0.0], heading(f64::from(yaw_mrad) / 1e3));
        let mut transforms = vec![body];
        if !self.placed.contains(&unit) {
            self.placed.push(unit);
            self.body(time, unit)?;
            let (eye, scan) = (Camera::GROUND, Lidar::GROUND);
            let eye_at = [f64::from(eye.forward_m), 0.0, f64::from(eye.up_m)];
            transforms.push(transform(time, &unit.to_string(), &camera(unit), eye_at, OPTICAL));
            transforms.push(transform(
                time,
                &unit.to_string(),
                &lidar(unit),
                [0.0, 0.0, f64::from(scan.up_m)],
                STRAIGHT,
            ));
        }
        self.put(time, "/tf", &FrameTransforms { transforms })
    }

    fn body(&mut self, time: Micros, unit: UnitId) -> Result<(), ViewError> {
        let [length, width, height] = BODY;
        let cube = CubePrimitive {
            pose: Some(pose(0.0, 0.0, height / 2.0, STRAIGHT)),
            size: Some(vector(length, width, height)),
            color: Some(grey(0.8)),
        };
        let name = unit.to_string();
        let body = SceneEntity { frame_locked: true, cubes: vec![cube], ..entity(time, &name, &name) };
        self.put(time, "/truth", &SceneUpdate { deletions: Vec::new(), entities: vec![body] })
    }

    /// Writes the true place and class of an object.
    pub(crate) fn object(
        &mut self,
        time: Micros,
        object: ObjectId,
        class: Class,
        mm: [i32; 2],
    ) -> Result<(), ViewError> {
        let known = self.scene.as_ref().and_then(|scene| scene.objects.get(usize::from(object.0)));
        let ([length, width, height], yaw) =
            known.map_or((UNKNOWN, 0.0), |of| (of.size.map(f64::from), f64::from(of.heading)));
        let [x, y] = mm.map(metres);
        let cube = CubePrimitive {
            pose: Some(pose(x, y, height / 2.0, heading(yaw))),
            size: Some(vector(length, width, height)),
            color: Some(of_class(class, 0.6)),
        };
        let text = words(class.name().to_owned(), [x, y, height + 0.4]);
        let id = format!("object-{}", object.0);
        let entities = vec![SceneEntity { cubes: vec![cube], texts: vec![text], ..entity(time, WORLD, &id) }];
        self.put(time, "/truth", &SceneUpdate { deletions: Vec::new(), entities })
    }

    /// Writes perception's tracks.
    pub(crate) fn tracks(&mut self, time: Micros, tracks: &Tracks) -> Result<(), ViewError> {
        let entities = tracks.tracks.iter().map(|track| of_track(time, track)).collect();
        self.put(time, "/tracks", &SceneUpdate { deletions: Vec::new(), entities })
    }
}

/// A track: two standard deviations around its place, its class and confidence, and its modalities.
fn of_track(time: Micros, track: &Track) -> SceneEntity {
    let (x, y) = (metres(track.x_mm), metres(track.y_mm));
    let across = (4.0 * f64::from(track.sigma_mm) / 1e3).max(SMALLEST);
    let sphere = SpherePrimitive {
        pose: Some(pose(x, y, 0.5, STRAIGHT)),
        size: Some(vector(across, across, across)),
        color: Some(of_class(track.class, 0.4)),
    };
    let line = match track.vetoed.count() {
        0 => String::new(),
        _ => format!(", against it {}", of_modalities(track.vetoed)),
    };
    let (name, share) = (track.class.name(), track.confidence / 10);
    let text = format!("{name} {share} %, for it {}{line}", of_modalities(track.supported));
    SceneEntity {
        lifetime: Some(Duration::new(0, TRACK_LASTS_MS * 1_000_000)),
        spheres: vec![sphere],
        texts: vec![words(text, [x, y, 1.6])],
        ..entity(time, WORLD, &format!("track-{}", track.id.0))
    }
}

pub(crate) fn words(text: String, [x, y, z]: [f64; 3]) -> TextPrimitive {
    TextPrimitive {
        pose: Some(pose(x, y, z, STRAIGHT)),
        billboard: true,
        font_size: 12.0,
        scale_invariant: true,
        color: Some(grey(1.0)),
        text,
    }
}

pub(crate) fn entity(time: Micros, frame: &str, id: &str) -> SceneEntity {
    SceneEntity {
        timestamp: Some(stamp(time)),
        frame_id: frame.to_owned(),
        id: id.to_owned(),
        ..SceneEntity::default()
    }
}

fn transform(
    time: Micros,
    parent: &str,
    child: &str,
    [x, y, z]: [f64; 3],
    rotation: foxglove::messages::Quaternion,
) -> FrameTransform {
    FrameTransform {
        timestamp: Some(stamp(time)),
        parent_frame_id: parent.to_owned(),
        child_frame_id: child.to_owned(),
        translation: Some(vector(x, y, z)),
        rotation: Some(rotation),
    }
}
