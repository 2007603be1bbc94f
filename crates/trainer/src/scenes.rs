//! Random scenes: what the detector is trained and measured on. A seed gives one scene and one viewpoint.
//!
//! The spread is wider than any scenario's: paints, sizes, headings, relief, and objects that hide one another.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use sim::scene::{Disguise, Ground, Object, Scene, Start};
use wire::sensor::Class;

/// Nearest and farthest object, metres.
const RANGE: (f32, f32) = (4.0, 25.0);
/// Widest bearing of an object's middle, radians.
const BEARING: f32 = 0.72;

/// Scene and viewpoint of `seed`.
pub(crate) fn scene(seed: u64) -> (Scene, Start) {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
    let start =
        Start { east: draw.between(-12.0, 12.0), north: draw.between(-12.0, 12.0), heading: draw.between(-3.1, 3.1) };
    let mut objects: Vec<Object> = Vec::new();
    let wanted = 1 + draw.below(6);
    for _ in 0..3 * wanted {
        if objects.len() < wanted {
            let object = draw.object(&start);
            let apart =
                |other: &Object| distance(other.path[0], object.path[0]) > radius(other) + radius(&object) + 0.3;
            if objects.iter().all(apart) {
                objects.push(object);
            }
        }
    }
    let ground = Ground {
        seed: seed ^ 0x6f75,
        amplitude: draw.between(0.0, 0.5),
        wavelength: draw.between(16.0, 36.0),
        kelvin: draw.between(278.0, 296.0),
    };
    (Scene { start, objects, ground, ..Scene::default() }, start)
}

fn distance([ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    ((ax - bx) * (ax - bx) + (ay - by) * (ay - by)).sqrt()
}

fn radius(object: &Object) -> f32 {
    0.5 * object.size[0].max(object.size[1])
}

struct Draw(ChaCha8Rng);

impl Draw {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.0.next_u32() >> 8) as f32 / 16_777_216.0)
    }

    fn below(&mut self, n: usize) -> usize {
        self.0.next_u32() as usize % n
    }

    fn object(&mut self, start: &Start) -> Object {
        let class = Class::ALL[self.below(4)];
        let (size, kelvin) = match class {
            Class::Vehicle => (self.size([3.6, 1.6, 1.4], [4.8, 2.0, 1.9]), self.between(308.0, 330.0)),
            Class::Decoy => (self.size([3.6, 1.6, 1.4], [4.8, 2.0, 1.9]), self.between(280.0, 292.0)),
            Class::Person => (self.size([0.4, 0.4, 1.55], [0.6, 0.6, 1.95]), self.between(303.0, 308.0)),
            Class::Obstacle => (self.size([0.6, 0.6, 0.6], [2.4, 2.4, 1.8]), self.between(280.0, 290.0)),
        };
        let colour = match class {
            Class::Obstacle => {
                let grey = self.between(80.0, 150.0);
                [grey, grey * 0.92, grey * 0.8].map(|v| v as u8)
            }
            Class::Vehicle | Class::Decoy | Class::Person => core::array::from_fn(|_| self.between(25.0, 215.0) as u8),
        };
        let share = self.between(0.0, 1.0);
        let range = RANGE.0 + (RANGE.1 - RANGE.0) * share + radius_of(size);
        let (sin, cos) = libm::sincosf(start.heading + self.between(-BEARING, BEARING));
        Object {
            class,
            size,
            kelvin,
            colour,
            disguise: Disguise::default(),
            path: vec![[start.east + range * cos, start.north + range * sin]],
            heading: self.between(-3.1, 3.1),
            speed: 0.0,
            departs: 0.0,
            closed: false,
        }
    }

    fn size(&mut self, low: [f32; 3], high: [f32; 3]) -> [f32; 3] {
        core::array::from_fn(|axis| self.between(low[axis], high[axis]))
    }
}

fn radius_of(size: [f32; 3]) -> f32 {
    0.5 * size[0].max(size[1])
}
