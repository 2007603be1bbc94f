//! The thermal camera: temperature at a pixel, its contrast fading with distance.
//!
//! A vehicle is hottest at its engine (the front), a person at head and trunk; ground and air share one temperature.

use wire::sensor::Class;

use crate::fault::Effect;
use crate::noise::Noise;
use crate::scene::Object;
use crate::sensor::camera::{Pixel, Sweep};
use crate::sensor::covered;
use crate::sensor::rgb::on_object;
use crate::terrain::smooth;
use crate::weather::Weather;
use crate::world::{Surface, World};
use ground_truth::print;

/// Temperature of the sky below the ground's, kelvin.
const SKY_BELOW: f32 = 30.0;
/// Distance at which half of the contrast is left, metres.
const HALF_CONTRAST: f32 = 120.0;
/// Half width of the noise, kelvin.
const NOISE: f32 = 0.4;

/// Writes the plane: u16 little-endian centikelvin.
pub(crate) fn expose(sweep: &Sweep, world: &World, noise: &mut Noise, effect: &Effect, plane: &mut [u8]) {
    let covered = covered(effect, sweep.width());
    let ambient = world.scene().ground.kelvin;
    noise.fill(plane);
    let gain = NOISE * effect.noise / 32_768.0;
    for (k, (pixel, out)) in sweep.pixels().iter().zip(plane.chunks_exact_mut(2)).enumerate() {
        let jitter = f32::from(i16::from_le_bytes([out[0], out[1]])) * gain;
        let kelvin = if k % sweep.width() < covered { ambient } else { temperature(pixel, world) };
        out.copy_from_slice(&centikelvin(kelvin + jitter).to_le_bytes());
    }
}

/// Kelvin as the planes carry it.
pub(crate) fn centikelvin(kelvin: f32) -> u16 {
    (kelvin * 100.0).clamp(0.0, 65_535.0) as u16
}

/// Share of a temperature contrast left after a given number of metres.
pub(crate) fn contrast(metres: f32) -> f32 {
    HALF_CONTRAST / (HALF_CONTRAST + metres)
}

fn temperature(pixel: &Pixel, world: &World) -> f32 {
    let ambient = world.scene().ground.kelvin;
    let Some(hit) = pixel.hit else { return ambient - SKY_BELOW };
    match hit.surface {
        Surface::Ground => ambient + 0.6 * smooth(31, pixel.point.x / 4.0, pixel.point.y / 4.0),
        Surface::Object(id) => {
            let object = &world.scene().objects[usize::from(id.0)];
            let place = &world.placements()[usize::from(id.0)];
            let position = on_object(object, place, pixel.point);
            let heated = object.print.as_ref().and_then(|print| print.warmth(print::field(position)));
            let above = heated.unwrap_or_else(|| (object.kelvin - ambient) * warmth(object, position));
            ambient
                + above * object.heat_share(world.seconds()) * transmitted_share(hit.distance, &world.scene().weather)
        }
    }
}

/// Share of a temperature above ambient that reaches the camera from a given number of metres.
pub(crate) fn transmitted_share(metres: f32, weather: &Weather) -> f32 {
    contrast(metres) * weather.warmth(metres)
}

/// Share of the object's temperature above ambient that shows at a point of its skin.
fn warmth(object: &Object, [along, _, up]: [f32; 3]) -> f32 {
    match object.warm_as() {
        Class::Vehicle if along > 0.3 => 1.0,
        Class::Vehicle if up < -0.35 => 0.8,
        Class::Vehicle => 0.6,
        Class::Person if up < -0.1 => 0.7,
        Class::Person | Class::Decoy | Class::Obstacle => 1.0,
    }
}
