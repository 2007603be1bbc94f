//! The LiDAR: rays in the order that `wire::sensor::Lidar` states, and their noise.

use std::sync::Arc;

use rapier3d::prelude::Vector;
use wire::sensor;

use crate::fault::Effect;
use crate::noise::Noise;
use crate::plant::State;
use crate::sensor::covered;
use crate::weather::Weather;
use crate::world::View;

/// Greatest range, metres.
pub const REACH: f32 = 60.0;
/// Range of the cover of an occluded LiDAR, millimetres.
pub const COVER_MM: u16 = 150;
/// Half width of the noise, millimetres.
const NOISE_MM: f32 = 30.0;
/// Nearest and farthest drop that returns a pulse, metres. An assumption.
const DROP_M: (f32, f32) = (0.5, 6.0);

/// The beams' unit directions in the body frame, ring-major.
#[derive(Clone, Debug)]
pub struct Lidar {
    geometry: sensor::Lidar,
    directions: Arc<[Vector]>,
}

impl Lidar {
    /// Works the directions out once.
    pub fn new(geometry: sensor::Lidar) -> Self {
        let azimuths = usize::from(geometry.azimuths);
        let direction = |k: usize| {
            let elevation = (geometry.lowest_deg + geometry.ring_step_deg * (k / azimuths) as f32).to_radians();
            let azimuth = ((k % azimuths) as f32 * 360.0 / azimuths as f32).to_radians();
            let ((sin_e, cos_e), (sin_a, cos_a)) = (libm::sincosf(elevation), libm::sincosf(azimuth));
            Vector::new(cos_e * cos_a, cos_e * sin_a, sin_e)
        };
        let directions = (0..usize::from(geometry.rings) * azimuths).map(direction).collect();
        Lidar { geometry, directions }
    }

    /// Number of beams.
    pub fn beams(&self) -> usize {
        self.directions.len()
    }

    /// Writes the ranges: u16 little-endian millimetres, 0 = no return. An occlusion covers the first beams of a ring.
    pub(crate) fn scan(
        &self,
        (state, view): (&State, &View<'_>),
        noise: &mut Noise,
        effect: &Effect,
        weather: &Weather,
        plane: &mut [u8],
    ) {
        let azimuths = usize::from(self.geometry.azimuths);
        let covered = covered(effect, azimuths);
        let origin = state.to_world(Vector::new(0.0, 0.0, self.geometry.up_m));
        noise.fill(plane);
        for (k, (direction, out)) in self.directions.iter().zip(plane.chunks_exact_mut(2)).enumerate() {
            let jitter = f32::from(i16::from_le_bytes([out[0], out[1]])) / 32_768.0 * effect.noise;
            let range = if k % azimuths < covered {
                COVER_MM
            } else {
                let hit = view.cast(origin, state.rotation * *direction, REACH);
                let seen = hit.map(|h| h.distance).filter(|metres| weather.returns(*metres, REACH));
                let metres = drop(weather, noise).or(seen);
                metres.map_or(0, |m| (m * 1000.0 + jitter * NOISE_MM).clamp(1.0, 65_535.0) as u16)
            };
            out.copy_from_slice(&range.to_le_bytes());
        }
    }
}

/// Distance of the drop that a beam returns from, metres.
fn drop(weather: &Weather, noise: &mut Noise) -> Option<f32> {
    let chance = weather.drops();
    (chance > 0.0 && noise.chance(chance)).then(|| DROP_M.0 + (DROP_M.1 - DROP_M.0) * noise.uniform())
}
