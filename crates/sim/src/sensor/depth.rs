//! The depth camera: distance along the optical axis, with noise that grows with its square as in stereo.

use crate::fault::Effect;
use crate::noise::Noise;
use crate::sensor::camera::Sweep;
use crate::sensor::covered;
use crate::weather::Weather;

/// Greatest depth that gives a return, metres.
pub const REACH: f32 = 60.0;
/// Depth of the cover of an occluded lens, millimetres.
pub const COVER_MM: u16 = 150;
/// Half width of the noise at 1 m, millimetres; the stereo term is this times the square of the metres, over 10.
const NOISE_MM: f32 = 5.0;

/// Writes the plane: u16 little-endian millimetres, 0 = no return.
pub(crate) fn expose(sweep: &Sweep, noise: &mut Noise, effect: &Effect, weather: &Weather, plane: &mut [u8]) {
    let covered = covered(effect, sweep.width());
    noise.fill(plane);
    for (k, (pixel, out)) in sweep.pixels().iter().zip(plane.chunks_exact_mut(2)).enumerate() {
        let jitter = f32::from(i16::from_le_bytes([out[0], out[1]])) / 32_768.0;
        let millimetres = if k % sweep.width() < covered {
            COVER_MM
        } else {
            let seen = pixel.hit.filter(|hit| weather.returns(hit.distance, REACH));
            seen.map_or(0, |hit| reading(hit.distance, jitter * effect.noise))
        };
        out.copy_from_slice(&millimetres.to_le_bytes());
    }
}

fn reading(metres: f32, jitter: f32) -> u16 {
    if metres > REACH {
        return 0;
    }
    let error = jitter * NOISE_MM * (1.0 + metres * metres / 10.0);
    (metres * 1000.0 + error).clamp(1.0, 65_535.0) as u16
}
