//! Scenes at random: a cell, a split and a number give one scene and one viewpoint.
//!
//! Objects stand at 4 to 25 m in the camera's field of view and may hide one another. No two cells or splits share a
//! stream of randomness, so the same number gives unrelated scenes in them.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use sim::scene::{Disguise, Ground, Object, Scene, StartPose};
use sim::weather::Weather;
use wire::sensor::Class;

use crate::cells::{self, Cell, CellsError, Range, Sizes, Split, Variant};

/// Nearest and farthest object, metres.
const RANGE: Range = [4.0, 25.0];
/// Widest bearing of an object's middle, radians.
const BEARING: f32 = 0.72;
/// Most objects.
const MOST: usize = 6;

/// Scene and viewpoint number `number` of a cell's split.
///
/// # Errors
/// `cells.toml` was edited into something else.
pub fn scene(cell: &Cell, split: Split, number: u64) -> Result<(Scene, StartPose), CellsError> {
    let variant = cells::variant(split)?;
    let place = cells::all()?.iter().position(|c| c.name == cell.name).unwrap_or_default() as u64;
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    rng.set_stream(place * Split::ALL.len() as u64 + split as u64);
    Ok(Draw { rng, variant }.scene(cell))
}

struct Draw<'a> {
    rng: ChaCha8Rng,
    variant: &'a Variant,
}

impl Draw<'_> {
    fn scene(mut self, cell: &Cell) -> (Scene, StartPose) {
        let start =
            StartPose { east: self.uniform([-12.0, 12.0]), north: self.uniform([-12.0, 12.0]), heading: self.turn() };
        let ground = Ground {
            seed: self.rng.next_u64(),
            amplitude: self.uniform(self.variant.amplitude_m),
            wavelength: self.uniform(self.variant.wavelength_m),
            kelvin: self.uniform(cell.ground_kelvin),
        };
        let weather = Weather {
            light: self.uniform(cell.light),
            visibility_m: cell.visibility_m.map(|range| self.uniform(range)),
            rain_mm_h: self.uniform(cell.rain_mm_h),
            smear_px: cell.smear_px[0]
                + self.uniform_below(usize::from(cell.smear_px[1] - cell.smear_px[0]) + 1) as u16,
        };
        let mut objects: Vec<Object> = Vec::new();
        let wanted = 1 + self.uniform_below(MOST);
        for _ in 0..3 * wanted {
            if objects.len() < wanted {
                let object = self.object(&start);
                let apart =
                    |other: &Object| distance(other.path[0], object.path[0]) > radius(other) + radius(&object) + 0.3;
                if objects.iter().all(apart) {
                    objects.push(object);
                }
            }
        }
        (Scene { start, objects, ground, weather, ..Scene::default() }, start)
    }

    fn object(&mut self, start: &StartPose) -> Object {
        let class = Class::ALL[self.uniform_below(4)];
        let (sizes, kelvin) = match class {
            Class::Vehicle => (self.variant.vehicle, [308.0, 330.0]),
            Class::Decoy => (self.variant.vehicle, [280.0, 292.0]),
            Class::Person => (self.variant.person, [303.0, 308.0]),
            Class::Obstacle => (self.variant.obstacle, [280.0, 290.0]),
        };
        let size = self.size(sizes);
        let range = self.uniform(RANGE) + 0.5 * size[0].max(size[1]);
        let (sin, cos) = libm::sincosf(start.heading + self.uniform([-BEARING, BEARING]));
        Object {
            class,
            size,
            kelvin: self.uniform(kelvin),
            heated: None,
            colour: self.paint(class),
            disguise: Disguise::default(),
            print: None,
            path: vec![[start.east + range * cos, start.north + range * sin]],
            heading: self.turn(),
            speed: 0.0,
            departs: 0.0,
            closed: false,
            yields: false,
        }
    }

    /// Obstacles are of a grey that is warmer than neutral; all else is of any paint.
    fn paint(&mut self, class: Class) -> [u8; 3] {
        let range = self.variant.paint;
        if class == Class::Obstacle {
            let grey = self.uniform([80.0, 150.0]);
            return [grey, grey * 0.92, grey * 0.8].map(|v| v as u8);
        }
        core::array::from_fn(|_| self.uniform(range) as u8)
    }

    fn size(&mut self, sizes: Sizes) -> [f32; 3] {
        core::array::from_fn(|axis| self.uniform([sizes.least[axis], sizes.most[axis]]))
    }

    fn uniform(&mut self, range: Range) -> f32 {
        within(&mut self.rng, range)
    }

    fn turn(&mut self) -> f32 {
        self.uniform([-3.1, 3.1])
    }

    fn uniform_below(&mut self, n: usize) -> usize {
        self.rng.next_u32() as usize % n
    }
}

/// Drawn evenly from a range.
pub(crate) fn within(rng: &mut ChaCha8Rng, [low, high]: Range) -> f32 {
    low + (high - low) * uniform(rng)
}

/// Drawn evenly from 0 to less than 1.
pub fn uniform(rng: &mut ChaCha8Rng) -> f32 {
    (rng.next_u32() >> 8) as f32 / 16_777_216.0
}

/// Between two places, metres.
pub(crate) fn distance([ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    ((ax - bx) * (ax - bx) + (ay - by) * (ay - by)).sqrt()
}

fn radius(object: &Object) -> f32 {
    0.5 * object.size[0].max(object.size[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_all_cells_are_buildable_and_distinct() {
        let mut seen: Vec<Scene> = Vec::new();
        for cell in cells::all().unwrap() {
            for split in Split::ALL {
                for number in 0..20 {
                    let (scene, _) = scene(cell, split, number).unwrap();
                    assert_eq!(scene.check(), Ok(()), "{} {} {number}", cell.name, split.name());
                    seen.push(scene);
                }
            }
        }
        for (k, scene) in seen.iter().enumerate() {
            assert!(!seen[..k].contains(scene));
        }
        let cell = cells::named("clear").unwrap();
        assert_eq!(scene(cell, Split::HeldOut, 7), scene(cell, Split::HeldOut, 7));
    }
}
