//! Rides at random: scenes of [`crate::draw`] in which some things move, and a unit that drives through them.
//!
//! Half of the vehicles and persons walk or drive a few metres, where that leads them neither into another object nor
//! before the unit. Rides share no randomness with the frames of their cell.

use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;
use sim::NoiseModel;
use sim::ride::Ride;
use sim::scene::{Object, Scene};
use wire::sensor::Class;

use crate::cells::{Cell, Range, Split};
use crate::draw::{self, distance, within};
use crate::example::ExampleError;

/// Frames of a ride, ten a second.
pub const FRAMES: usize = 50;
/// Set apart the scenes of rides from the scenes of frames, and the motion and the noise from the scene.
const SCENE: u64 = 0x7269_6465_7300;
const MOTION: u64 = 0x6d6f_7665;
const NOISE: u64 = 0x6e6f_6973;
/// Speed of the unit, m/s, and its curvature, 1/m.
const SPEED: Range = [0.4, 0.8];
const CURVATURE: Range = [-0.05, 0.05];
/// Ranges of moving objects: metres gone, and m/s of persons and of vehicles.
const GONE: Range = [2.0, 7.0];
const WALK: Range = [0.5, 1.5];
const DRIVE: Range = [0.5, 2.5];
/// Least distance of any moving object from the unit's course and from standing objects, metres.
const CLEAR: f32 = 2.5;

/// Ride `number` of a cell's split, with the scene that it leads through.
///
/// # Errors
/// The scene cannot be built.
pub fn ride(cell: &Cell, split: Split, number: u64, model: NoiseModel) -> Result<(Scene, Ride), ExampleError> {
    let (mut scene, _) = draw::scene(cell, split, number ^ SCENE)?;
    let mut rng = ChaCha8Rng::seed_from_u64(number ^ MOTION);
    rng.set_stream(split as u64);
    let (speed, curvature) = (within(&mut rng, SPEED), within(&mut rng, CURVATURE));
    for k in 0..scene.objects.len() {
        let moved = moving(&mut rng, &scene.objects[k]);
        scene.objects[k] = moved.filter(|moved| is_clear(moved, k, &scene)).unwrap_or_else(|| scene.objects[k].clone());
    }
    let ride = Ride::new(&scene, (speed, curvature), model, number ^ NOISE)?;
    Ok((scene, ride))
}

/// The object on its way, if it is one that moves.
fn moving(rng: &mut ChaCha8Rng, object: &Object) -> Option<Object> {
    let (chance, towards) = (within(rng, [0.0, 1.0]), within(rng, [-3.1, 3.1]));
    let (travelled, walk, drive) = (within(rng, GONE), within(rng, WALK), within(rng, DRIVE));
    let speed = match object.class {
        Class::Person => walk,
        Class::Vehicle => drive,
        Class::Decoy | Class::Obstacle => return None,
    };
    let (sin, cos) = libm::sincosf(towards);
    let [east, north] = object.path[0];
    let path = vec![[east, north], [east + travelled * cos, north + travelled * sin]];
    (chance < 0.5).then(|| Object { path, speed, ..object.clone() })
}

/// True if the way of object `index` is clear of the others and of the unit's.
fn is_clear(moved: &Object, index: usize, scene: &Scene) -> bool {
    let [from, to] = [moved.path[0], moved.path[1]];
    let point = |k: u8| core::array::from_fn(|axis| from[axis] + f32::from(k) / 10.0 * (to[axis] - from[axis]));
    let ahead = |k: u8| {
        let (sin, cos) = libm::sincosf(scene.start.heading);
        [scene.start.east + f32::from(k) * cos, scene.start.north + f32::from(k) * sin]
    };
    let rest = scene.objects.iter().enumerate().filter(|(k, _)| *k != index).flat_map(|(_, o)| o.path.iter().copied());
    let vec: Vec<[f32; 2]> = rest.chain((0..=4).map(ahead)).collect();
    (0..=10).map(point).all(|at: [f32; 2]| vec.iter().all(|other| distance(at, *other) > CLEAR))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells;

    #[test]
    fn rides_are_drivable_and_some_have_motion() {
        let clear = cells::named("clear").unwrap();
        let mut moving = 0;
        for number in 0..12 {
            let (scene, mut ride) = ride(clear, Split::HeldOut, number, NoiseModel::default()).unwrap();
            moving += scene.objects.iter().filter(|o| o.moves()).count();
            assert_eq!(ride.shoot().places.len(), scene.objects.len());
        }
        assert!(moving > 3, "{moving}");
    }
}
