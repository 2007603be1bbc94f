//! Labelled frames for the trainer: the sensors' own planes with the truth about every visible object.
//!
//! The planes come from the same ray caster and the same noise as a live frame, so training data match live data.
//! Labels are ground truth and stay on the trainer's side.

use std::sync::Arc;

use config::platform::{Sensors, Vehicle};
use wire::id::ObjectId;
use wire::sensor::{Class, PixelBox};
use wire::time::{Instant, Span};

use crate::fault::Faults;
use crate::fidelity::Fidelity;
use crate::limits::SceneError;
use crate::plant::Plant;
use crate::scene::{Scene, StartPose};
use crate::sensor::{Imagers, rgb};
use crate::world::{STEP, Surface, World};
use ground_truth::print::Skin;

/// Steps in which the vehicle settles on its springs before the picture is taken.
const SETTLE: u64 = 40;

/// An object as a frame shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label {
    /// Number of the object.
    pub object: ObjectId,
    /// Class of the object.
    pub class: Class,
    /// The smallest box around the pixels that show it.
    pub bounds: PixelBox,
    /// Number of its pixels.
    pub pixels: u32,
    /// Depth of its nearest visible point, millimetres along the optical axis.
    pub range_mm: u32,
}

/// A frame with its labels, objects in order of their ids.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    /// Pixels in a row.
    pub width: u16,
    /// Number of pixel rows.
    pub height: u16,
    /// Row-major, 3 bytes a pixel.
    pub rgb: Vec<u8>,
    /// Row-major, u16 little-endian millimetres along the optical axis, 0 = no return.
    pub depth: Vec<u8>,
    /// Row-major, u16 little-endian centikelvin.
    pub thermal: Vec<u8>,
    /// Ring-major, u16 little-endian millimetres, 0 = no return.
    pub lidar: Vec<u8>,
    /// Labels of its objects.
    pub labels: Vec<Label>,
    /// Row-major: each pixel's part of a print.
    pub skin: Vec<Option<Skin>>,
}

/// The world of `scene` with a unit that stands at `pose`, come to rest.
pub fn settled(scene: &Scene, pose: StartPose) -> Result<(World, Plant), SceneError> {
    let scene = Scene { start: pose, ..scene.clone() };
    scene.check()?;
    let mut world = World::new(Arc::new(scene));
    let mut plant = Plant::new(&mut world, &pose, &Vehicle::GROUND, &Fidelity::SHIPPED);
    for k in 1..=SETTLE {
        plant.step(Instant(k * STEP.0), &mut world);
    }
    Ok((world, plant))
}

/// The frame that `sensors`, over a vehicle that stands at `pose`, would take of `scene` at the start of a run. `seed`
/// seeds the noise.
pub fn render(sensors: &Sensors, scene: &Scene, pose: StartPose, seed: u64) -> Result<Labelled, SceneError> {
    let faults = Faults::new(&[])?;
    let (world, plant) = settled(scene, pose)?;
    let mut imagers = Imagers::new(sensors.camera, sensors.lidar, seed);
    imagers.measure(1, &world, &plant, &faults, Span::ZERO);
    Ok(labelled(&imagers, &world))
}

/// The newest frame of `imagers`, with the visible objects of `world`.
pub(crate) fn labelled(imagers: &Imagers, world: &World) -> Labelled {
    let camera = imagers.camera();
    Labelled {
        width: camera.width,
        height: camera.height,
        rgb: imagers.rgb.clone(),
        depth: imagers.depth.clone(),
        thermal: imagers.thermal.clone(),
        lidar: imagers.ranges.clone(),
        labels: labels(imagers, world),
        skin: imagers.sweep().pixels().iter().map(|pixel| rgb::skin(pixel, world)).collect(),
    }
}

fn labels(imagers: &Imagers, world: &World) -> Vec<Label> {
    let objects = &world.scene().objects;
    let mut found: Vec<Option<Label>> = vec![None; objects.len()];
    let width = imagers.sweep().width();
    for (k, pixel) in imagers.sweep().pixels().iter().enumerate() {
        let Some((Surface::Object(object), metres)) = pixel.hit.map(|h| (h.surface, h.distance)) else { continue };
        let index = usize::from(object.0);
        let (x, y) = ((k % width) as u16, (k / width) as u16);
        let bounds = PixelBox { x0: x, y0: y, x1: x + 1, y1: y + 1 };
        let (class, range_mm) = (objects[index].class, (metres * 1000.0) as u32);
        let label = found[index].get_or_insert(Label { object, class, bounds, pixels: 0, range_mm });
        label.pixels += 1;
        label.range_mm = label.range_mm.min(range_mm);
        let b = &mut label.bounds;
        *b = PixelBox { x0: b.x0.min(x), y0: b.y0.min(y), x1: b.x1.max(x + 1), y1: b.y1.max(y + 1) };
    }
    found.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ground_truth::print::{COLUMNS, Print, ROWS};

    fn plain(plane: &[u8]) -> Vec<i32> {
        plane.chunks_exact(2).map(|b| i32::from(u16::from_le_bytes([b[0], b[1]]))).collect()
    }

    fn frame(print: Option<Print>) -> Labelled {
        let mut scene = Scene { objects: Scene::default().objects.split_off(2), ..Scene::default() };
        scene.objects[0].print = print;
        let [east, north] = scene.objects[0].path[0];
        render(&Sensors::GROUND, &scene, StartPose { east: east - 8.0, north, heading: 0.0 }, 5).unwrap()
    }

    /// The attacker's computed image equals the rendered one, to the rounding of a byte.
    #[test]
    fn print_changes_its_pixels_by_their_skin_alone() {
        let fields: Vec<[i8; 3]> = (0..ROWS * COLUMNS).map(|k| [(k % 41) as i8 - 20, 17, -9]).collect();
        let (none, neutral) = (frame(None), frame(Print::new(vec![[0; 3]; ROWS * COLUMNS])));
        assert_eq!((&none.rgb, none.skin.iter().flatten().count()), (&neutral.rgb, 0));
        let printed = frame(Print::new(fields.clone()));
        let mut shown = 0;
        for (k, skin) in neutral.skin.iter().enumerate() {
            let reckoned: [f32; 3] = skin.map_or([0.0; 3], |skin| {
                let field = fields[usize::from(skin.field)];
                core::array::from_fn(|channel| {
                    let paint = f32::from(skin.paint[channel]);
                    ((paint + f32::from(field[channel])).clamp(0.0, 255.0) - paint) * skin.light
                })
            });
            let [before, after] = [&neutral, &printed].map(|frame| &frame.rgb[3 * k..][..3]);
            for ((before, after), shift) in before.iter().zip(after).zip(reckoned) {
                let change = f32::from(*after) - f32::from(*before);
                assert!((change - shift).abs() <= 1.01, "pixel {k}: {change} {shift}");
            }
            shown += usize::from(skin.is_some());
        }
        assert!(shown > 500, "{shown}");
        assert_eq!(
            (&neutral.depth, &neutral.thermal, &neutral.lidar),
            (&printed.depth, &printed.thermal, &printed.lidar)
        );
    }

    #[test]
    fn heated_print_is_warm_field_by_field_only() {
        let heat: Vec<u8> = (0..ROWS * COLUMNS).map(|k| (k * 7 % 161) as u8).collect();
        let print = || Print::new(vec![[0; 3]; ROWS * COLUMNS]).unwrap();
        let cold = frame(print().heated(vec![0; ROWS * COLUMNS]));
        let warm = frame(print().heated(heat.clone()));
        let (mut shown, mut rest) = (0, 0);
        for ((skin, before), after) in warm.skin.iter().zip(plain(&cold.thermal)).zip(plain(&warm.thermal)) {
            let reckoned = skin.map_or(0.0, |skin| f32::from(heat[usize::from(skin.field)]) * 25.0 * skin.heat);
            assert!((after - before - reckoned as i32).abs() <= 1, "{before} {after} {reckoned}");
            (shown, rest) = (shown + usize::from(reckoned > 0.0), rest + usize::from(skin.is_none()));
        }
        assert!(shown > 500 && rest > 10_000, "{shown} {rest}");
        assert_eq!((&cold.rgb, &cold.depth), (&warm.rgb, &warm.depth));
        assert_eq!(print().heated(vec![0; 5]), None);
    }
}
