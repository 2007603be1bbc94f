//! The colour camera: Lambert shading of painted surfaces under one sun, haze with distance, noise by the pixel.
//!
//! Paint depends on the class and on where on the object a ray ended: vehicles have dark windows and wheels, persons
//! legs and a head, decoys the windows of a vehicle but no wheels. Telling them apart is the detector's business.

use rapier3d::prelude::Vector;
use wire::id::ObjectId;
use wire::sensor::Class;

use crate::fault::Effect;
use crate::noise::Noise;
use crate::scene::Object;
use crate::sensor::camera::{Pixel, REACH, Sweep};
use crate::sensor::{covered, thermal};
use crate::terrain::{lattice, smooth};
use crate::weather::Weather;
use crate::world::{Hit, Placement, Surface, World};
use ground_truth::print::{self, Skin};

/// Unit vector to the sun.
const SUN: Vector = Vector::new(0.48, -0.36, 0.8);
const AMBIENT: f32 = 0.4;
const SKY: [f32; 3] = [176.0, 198.0, 222.0];
const COVER: [u8; 3] = [14, 13, 12];
/// Half width of the noise, of 255.
const NOISE: f32 = 6.0;
/// Strokes in an image for each mm/h of rain, and how much brighter one is.
const STREAKS: f32 = 3.0;
const STREAK: u8 = 45;

/// Writes the plane: 3 bytes a pixel.
pub(crate) fn expose(sweep: &Sweep, world: &World, noise: &mut Noise, effect: &Effect, plane: &mut [u8]) {
    let covered = covered(effect, sweep.width());
    noise.fill(plane);
    let weather = &world.scene().weather;
    let gain = NOISE * effect.noise * weather.gain() / 128.0;
    for (k, (pixel, out)) in sweep.pixels().iter().zip(plane.chunks_exact_mut(3)).enumerate() {
        if k % sweep.width() < covered {
            out.copy_from_slice(&COVER);
            continue;
        }
        let colour = shade(pixel, world);
        for (channel, byte) in colour.iter().zip(out) {
            *byte = (channel + (f32::from(*byte) - 127.5) * gain).clamp(0.0, 255.0) as u8;
        }
    }
    if !weather.is_clear() {
        streaks(weather, sweep.width(), noise, plane);
        smear(weather, sweep.width(), plane);
    }
}

/// Drops that fall close to the lens: short bright strokes.
fn streaks(weather: &Weather, width: usize, noise: &mut Noise, plane: &mut [u8]) {
    let rows = plane.len() / (3 * width).max(1);
    let count = (weather.rain_mm_h * STREAKS) as usize;
    for _ in 0..count {
        let (x, y) = (noise.uniform() * width as f32, noise.uniform() * rows as f32);
        let length = 3 + (noise.uniform() * 8.0) as usize;
        for row in (y as usize)..(y as usize + length).min(rows) {
            let index = 3 * (row * width + x as usize);
            for byte in plane.iter_mut().skip(index).take(3) {
                *byte = byte.saturating_add(STREAK);
            }
        }
    }
}

/// Each pixel becomes the mean of those that pass it while the shutter is open.
fn smear(weather: &Weather, width: usize, plane: &mut [u8]) {
    let over = usize::from(weather.smear_px) + 1;
    if over == 1 {
        return;
    }
    for row in plane.chunks_exact_mut(3 * width) {
        let sharp = row.to_vec();
        for (k, byte) in row.iter_mut().enumerate() {
            let (column, channel) = (k / 3, k % 3);
            let passed = (0..over).map(|d| u32::from(sharp[3 * (column + d).min(width - 1) + channel]));
            *byte = (passed.sum::<u32>() / over as u32) as u8;
        }
    }
}

fn shade(pixel: &Pixel, world: &World) -> [f32; 3] {
    let Some(hit) = pixel.hit else { return SKY.map(|c| c * world.scene().weather.brightness()) };
    let paint = match hit.surface {
        Surface::Ground => soil(pixel.point),
        Surface::Object(id) => {
            let (object, place) = shown(id, pixel.point, world);
            let paint = painted(object, place);
            let shift = object.print.as_ref().and_then(|print| Some(print.shift(print::field(place)?)));
            shift.map_or(paint, |shift| printed(paint, shift))
        }
    };
    lit(paint, &hit, &world.scene().weather)
}

/// A printed coat can be no brighter than white and no darker than black.
fn printed(paint: [f32; 3], shift: [f32; 3]) -> [f32; 3] {
    core::array::from_fn(|c| (paint[c] + shift[c]).clamp(0.0, 255.0))
}

/// Paint as the camera sees it: in the sun's light, through the air.
fn lit(paint: [f32; 3], hit: &Hit, weather: &Weather) -> [f32; 3] {
    let light = AMBIENT + (1.0 - AMBIENT) * hit.normal.dot(SUN).max(0.0);
    let haze = hit.distance / (REACH * 2.5);
    if weather.is_clear() {
        return core::array::from_fn(|c| paint[c] * light * (1.0 - haze) + SKY[c] * haze);
    }
    let clearness = (1.0 - haze) * weather.clarity(hit.distance);
    core::array::from_fn(|c| (paint[c] * light * clearness + SKY[c] * (1.0 - clearness)) * weather.brightness())
}

/// The field of its object's print at a pixel, and the share of a shift and of the heat of that field that reaches the
/// cameras: none of an unprinted surface. Between black and white, where a print is not cut off, this is its whole
/// effect.
pub(crate) fn skin(pixel: &Pixel, world: &World) -> Option<Skin> {
    let hit = pixel.hit?;
    let Surface::Object(object) = hit.surface else { return None };
    let (of, place) = shown(object, pixel.point, world);
    let field = print::field(place).filter(|_| of.print.is_some())? as u16;
    let weather = &world.scene().weather;
    let [white, black] = [255.0, 0.0].map(|paint| lit([paint; 3], &hit, weather)[0]);
    let paint = painted(of, place).map(|channel| channel as u8);
    Some(Skin {
        object,
        field,
        paint,
        light: (white - black) / 255.0,
        heat: thermal::transmitted_share(hit.distance, weather),
    })
}

/// An object, and where on it a point lies.
fn shown(id: ObjectId, point: Vector, world: &World) -> (&Object, [f32; 3]) {
    let (object, place) = (&world.scene().objects[usize::from(id.0)], &world.placements()[usize::from(id.0)]);
    (object, on_object(object, place, point))
}

/// Coordinates of a point on an object: along its length, width and height, each in about −1..1.
pub(crate) fn on_object(object: &Object, place: &Placement, point: Vector) -> [f32; 3] {
    let (d, [cos, sin]) = (point - place.centre, place.facing);
    let [length, width, height] = object.size;
    [2.0 * (d.x * cos + d.y * sin) / length, 2.0 * (d.y * cos - d.x * sin) / width, 2.0 * d.z / height]
}

fn soil(point: Vector) -> [f32; 3] {
    let patch = smooth(11, point.x / 3.0, point.y / 3.0);
    let grain = lattice(12, (point.x * 5.0) as i64, (point.y * 5.0) as i64);
    let t = (0.5 + 0.4 * patch).clamp(0.0, 1.0);
    let tone = 1.0 + 0.12 * grain;
    [(88.0 + 44.0 * t) * tone, (104.0 - 8.0 * t) * tone, (58.0 + 16.0 * t) * tone]
}

fn painted(object: &Object, [along, across, up]: [f32; 3]) -> [f32; 3] {
    // A board is painted on its long side.
    let turned = object.disguise.paint.is_some() && object.size[1] > object.size[0];
    let (along, across) = if turned { (across, along) } else { (along, across) };
    let coat = object.colour.map(f32::from);
    let times = |factor: f32| coat.map(|c| c * factor);
    match object.paint() {
        Class::Vehicle if up < -0.35 && (along.abs() - 0.6).abs() < 0.2 => [20.0; 3],
        Class::Vehicle if up > 0.3 && up < 0.85 && along.abs() < 0.75 => [34.0, 42.0, 52.0],
        Class::Vehicle if along > 0.95 && up.abs() < 0.3 && across.abs() > 0.6 => [240.0, 236.0, 210.0],
        Class::Vehicle => coat,
        Class::Decoy if up > 0.3 && up < 0.85 && along.abs() < 0.75 => [70.0, 74.0, 80.0],
        Class::Decoy => times(0.9 + 0.15 * lattice(21, (along * 4.0) as i64, (up * 3.0) as i64)),
        Class::Person if up > 0.72 => [196.0, 154.0, 128.0],
        Class::Person if up < -0.1 => [38.0, 40.0, 58.0],
        Class::Person => coat,
        Class::Obstacle => {
            let grain = lattice(22, (along * 6.0) as i64, (across * 6.0) as i64 * 64 + (up * 6.0) as i64);
            times(1.0 + 0.2 * grain)
        }
    }
}
