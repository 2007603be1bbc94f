//! Sensor output, and perception's detections in it: images, a cloud, boxes.
//!
//! The bytes are those that passed between services. They are read here for viewing, and never to act on: no tag is checked, and
//! unreadable ones are counted and left out.

use std::io::{Seek, Write};

use foxglove::bytes::Bytes;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    CameraCalibration, CompressedImage, ImageAnnotations, PackedElementField, Point2, PointCloud, PointsAnnotation,
    RawImage, TextAnnotation, points_annotation,
};
use perception::corroborate::CorroborationLimits;
use perception::lidar::returns;
use wire::bus::body;
use wire::codec::decode;
use wire::core::Topic;
use wire::id::UnitId;
use wire::sensor::{Camera, Candidates, Class, Frames, Lidar, Modalities, Modality, PixelBox};
use wire::track::Tracks;

use crate::shape::{STRAIGHT, grey, of_class, pose};
use crate::{Micros, ViewError, Viewer, stamp};

/// Largest message that is read, bytes: a rendered frame with its envelope.
pub const LARGEST: usize = 512 * 1024;

/// Frame of reference of a unit's camera.
pub(crate) fn camera(unit: UnitId) -> String {
    format!("{unit}/camera")
}

/// Frame of reference of its LiDAR.
pub(crate) fn lidar(unit: UnitId) -> String {
    format!("{unit}/lidar")
}

pub(crate) fn of_modalities(modalities: Modalities) -> String {
    let named: Vec<&str> = Modality::ALL.into_iter().filter(|m| modalities.contains(*m)).map(Modality::name).collect();
    if named.is_empty() { "none".to_owned() } else { named.join("+") }
}

impl<W: Write + Seek> Viewer<W> {
    /// A message on the unit's shared memory, at the time at which its reader took it in.
    ///
    /// # Errors
    ///
    /// When the file cannot be extended.
    pub fn message(&mut self, time: Micros, topic: Topic, bytes: &[u8]) -> Result<(), ViewError> {
        let Some(body) = body(bytes) else {
            self.unread += 1;
            return Ok(());
        };
        match topic {
            Topic::Frames => match decode::<Frames<'_>>(body, LARGEST) {
                Ok(frames) => return self.frames(time, &frames),
                Err(_) => self.unread += 1,
            },
            Topic::Candidates => match decode::<Candidates>(body, LARGEST) {
                Ok(candidates) => return self.candidates(time, &candidates),
                Err(_) => self.unread += 1,
            },
            Topic::Tracks => match decode::<Tracks>(body, LARGEST) {
                Ok(tracks) => return self.tracks(time, &tracks),
                Err(_) => self.unread += 1,
            },
            Topic::Navigation | Topic::Drive | Topic::Act | Topic::Feed | Topic::Intents | Topic::Seals => {}
        }
        Ok(())
    }

    fn frames(&mut self, time: Micros, frames: &Frames<'_>) -> Result<(), ViewError> {
        let (width, height) = (frames.width, frames.height);
        let pixels = usize::from(width) * usize::from(height);
        let frame_id = camera(UnitId::A);
        if let Some(rgb) = frames.rgb.filter(|plane| pixels > 0 && plane.len() == 3 * pixels) {
            let data = png(width, height, rgb)
                .map_err(|e| ViewError::Message { topic: "/camera/rgb".to_owned(), why: e.to_string() })?;
            let image = CompressedImage {
                timestamp: Some(stamp(time)),
                frame_id: frame_id.clone(),
                data: Bytes::from(data),
                format: "png".to_owned(),
            };
            self.put(time, "/camera/rgb", &image)?;
        }
        for (plane, encoding, topic) in
            [(frames.depth, "16UC1", "/camera/depth"), (frames.thermal, "mono16", "/camera/thermal")]
        {
            let Some(plane) = plane.filter(|plane| pixels > 0 && plane.len() == 2 * pixels) else { continue };
            let image = RawImage {
                timestamp: Some(stamp(time)),
                frame_id: frame_id.clone(),
                width: u32::from(width),
                height: u32::from(height),
                encoding: encoding.to_owned(),
                step: 2 * u32::from(width),
                data: Bytes::copy_from_slice(plane),
            };
            self.put(time, topic, &image)?;
        }
        if let Some(ranges) = frames.lidar {
            self.put(time, "/lidar", &cloud(time, ranges))?;
        }
        self.put(time, "/camera/calibration", &calibration(time, width, height))?;
        let seen = self
            .stages
            .as_ref()
            .map(|stages| stages.candidates(frames, CorroborationLimits::default().score).candidates);
        seen.map_or(Ok(()), |seen| self.candidates(time, &seen))
    }

    /// The stages' detections, as boxes over the image.
    fn candidates(&mut self, time: Micros, of: &Candidates) -> Result<(), ViewError> {
        let rgb = of.rgb.iter().flat_map(|list| list.iter()).map(|d| (d.bounds, d.class, d.score));
        let warm = of.thermal.iter().flat_map(|list| list.iter()).map(|b| (b.bounds, b.class, b.score));
        for (topic, found) in [
            ("/camera/rgb/detections", rgb.collect::<Vec<_>>()),
            ("/camera/thermal/detections", warm.collect::<Vec<_>>()),
        ] {
            let points = found.iter().map(|(bounds, class, _)| outline(time, *bounds, *class)).collect();
            let texts = found.iter().map(|(bounds, class, score)| label(time, *bounds, *class, *score)).collect();
            let drawn = ImageAnnotations { timestamp: Some(stamp(time)), points, texts, ..ImageAnnotations::default() };
            self.put(time, topic, &drawn)?;
        }
        Ok(())
    }
}

fn outline(time: Micros, bounds: PixelBox, class: Class) -> PointsAnnotation {
    let [x0, y0, x1, y1] = [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(f64::from);
    PointsAnnotation {
        timestamp: Some(stamp(time)),
        r#type: points_annotation::Type::LineLoop as i32,
        points: [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| Point2 { x, y }).to_vec(),
        outline_color: Some(of_class(class, 1.0)),
        thickness: 1.0,
        ..PointsAnnotation::default()
    }
}

fn label(time: Micros, bounds: PixelBox, class: Class, score: u16) -> TextAnnotation {
    TextAnnotation {
        timestamp: Some(stamp(time)),
        position: Some(Point2 { x: f64::from(bounds.x0), y: f64::from(bounds.y0) }),
        text: format!("{} {} %", class.name(), score / 10),
        font_size: 6.0,
        text_color: Some(grey(1.0)),
        background_color: Some(grey(0.1)),
        ..TextAnnotation::default()
    }
}

/// The returns of the beams, in the LiDAR's frame, metres.
fn cloud(time: Micros, ranges: &[u8]) -> PointCloud {
    let points = returns(Lidar::GROUND, ranges).flatten();
    let data: Vec<u8> = points.flat_map(f32::to_le_bytes).collect();
    let field = |name: &str, offset: u32| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: NumericType::Float32 as i32,
    };
    PointCloud {
        timestamp: Some(stamp(time)),
        frame_id: lidar(UnitId::A),
        pose: Some(pose(0.0, 0.0, 0.0, STRAIGHT)),
        point_stride: 12,
        fields: vec![field("x", 0), field("y", 4), field("z", 8)],
        data: Bytes::from(data),
    }
}

/// The pinhole camera: no distortion, its principal point in the middle.
fn calibration(time: Micros, width: u16, height: u16) -> CameraCalibration {
    let focal = f64::from(Camera::GROUND.focal_px);
    let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
    CameraCalibration {
        timestamp: Some(stamp(time)),
        frame_id: camera(UnitId::A),
        width: u32::from(width),
        height: u32::from(height),
        distortion_model: String::new(),
        d: Vec::new(),
        k: vec![focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![focal, 0.0, cx, 0.0, 0.0, focal, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

fn png(width: u16, height: u16, rgb: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, u32::from(width), u32::from(height));
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(file)
}
