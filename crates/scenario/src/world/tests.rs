//! Draws of every family: fair, long, repeatable, and readable as scene files.

use super::fair::{metres, still};
use super::*;
use crate::footprint::{At, Footprint};
use crate::parse_scene;

/// The ground platform's.
const BODY: Body = Body { width_m: 0.9, fence_m: 1.5 };
const DEVELOPED: [Family; 7] =
    [Family::Street, Family::Aisles, Family::Perimeter, Family::Crossing, Family::Trees, Family::Yard, Family::Site];

fn drawn(family: Family, seed: u64) -> Scene {
    draw(family, seed, &BODY).expect("a fair world")
}

/// Way points behind the start.
fn legs(scene: &Scene) -> Vec<(At, At)> {
    let start = metres(&scene.start.at_m);
    let places: Vec<At> = std::iter::once(start).chain(scene.route.iter().map(|point| metres(point))).collect();
    places.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

/// True if a body that goes straight would touch the thing.
fn on_the_way((from, to): (At, At), thing: &Footprint) -> bool {
    let (steps, distance) = (200, thing.distances());
    (0..=steps).any(|step| {
        let share = f64::from(step) / f64::from(steps);
        distance([0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))) < BODY.width_m / 2.0
    })
}

#[test]
fn a_seed_draws_one_world() {
    for family in Family::ALL {
        assert_eq!(drawn(family, 7), drawn(family, 7));
        assert_ne!(drawn(family, 7), drawn(family, 8), "{}", family.name());
        assert_eq!(Family::from_name(family.name()), Some(family));
    }
}

#[test]
fn a_printed_world_is_a_scene_file() {
    for (family, seed) in Family::ALL.into_iter().flat_map(|family| (1..=20).map(move |seed| (family, seed))) {
        let scene = drawn(family, seed);
        let read = parse_scene(family.name(), &print(&scene)).unwrap_or_else(|why| panic!("{}", why.render(false)));
        assert_eq!(read, scene, "{} of seed {seed}", family.name());
    }
}

#[test]
fn still_things_leave_start_and_way_points_free() {
    for (family, seed) in Family::ALL.into_iter().flat_map(|family| (1..=20).map(move |seed| (family, seed))) {
        let scene = drawn(family, seed);
        let places = legs(&scene).into_iter().flat_map(|(from, to)| [from, to]);
        for (place, thing) in places.flat_map(|place| still(&scene).map(move |thing| (place, thing))) {
            assert!(thing.distance(place) > 1.5, "{} of seed {seed}: {thing:?} at {place:?}", family.name());
        }
        let parked = scene.object.first().map(|object| (object.class, metres(&object.path_m[0])));
        let start = metres(&scene.start.at_m);
        let near = parked.is_some_and(|(_, at)| libm::hypot(at[0] - start[0], at[1] - start[1]) <= 15.0);
        assert!(near && still(&scene).count() <= MOST_STILL, "{} of seed {seed}", family.name());
    }
}

/// Places along the closed path of something that moves, and half of its width.
fn walked(object: &crate::scene::Object) -> (Vec<At>, f64) {
    let points: Vec<At> = object.path_m.iter().map(metres).collect();
    let legs = points.iter().zip(points.iter().cycle().skip(1));
    let along = |(from, to): (&At, &At)| {
        let (from, to) = (*from, *to);
        (0..400).map(move |step| [0, 1].map(|axis| from[axis] + f64::from(step) / 400.0 * (to[axis] - from[axis])))
    };
    (legs.flat_map(along).collect(), object.size_m[1].get() / 2.0)
}

/// A centimetre is lost where files round.
#[test]
fn nobody_walks_through_a_still_thing() {
    let mut actors = 0;
    for (family, seed) in Family::ALL.into_iter().flat_map(|family| (1..=20).map(move |seed| (family, seed))) {
        let scene = drawn(family, seed);
        for actor in scene.object.iter().filter(|object| object.speed_m_s.get() > 0.0) {
            let (places, half) = walked(actor);
            let through = still(&scene).find(|thing| places.iter().any(|at| thing.distance(*at) < half - 0.02));
            assert!(through.is_none(), "{} of seed {seed}: {actor:?} through {through:?}", family.name());
            actors += 1;
        }
    }
    assert!(actors > 200, "{actors}");
}

#[test]
fn fewer_than_a_fifth_of_draws_are_unfair() {
    for family in DEVELOPED {
        // Cells of a site are a hundred times as many.
        let worlds = if family == Family::Site { 10 } else { 200 };
        let unfair = |seed: u64| {
            let mut draws = (0..MOST_DRAWS).map(|number| attempt(family, seed, number));
            draws.position(|scene| fair::holds(&scene, &BODY)).expect("a fair draw")
        };
        let refused: usize = (1..=worlds).map(unfair).sum();
        let share = refused as f64 / (worlds as f64 + refused as f64);
        assert!(share < 0.2, "{}: {share}", family.name());
    }
}

#[test]
fn routes_are_long_with_things_in_the_way() {
    const WORLDS: usize = 20;
    for family in DEVELOPED {
        let mut obstructed = 0;
        let longest = if family == Family::Site { 1500.0 } else { 800.0 };
        for seed in 1..=WORLDS as u64 {
            let scene = drawn(family, seed);
            let length: f64 = legs(&scene).iter().map(|(a, b)| libm::hypot(b[0] - a[0], b[1] - a[1])).sum();
            assert!((200.0..=longest).contains(&length), "{} of seed {seed}: {length} m", family.name());
            obstructed +=
                usize::from(legs(&scene).iter().any(|leg| still(&scene).any(|thing| on_the_way(*leg, &thing))));
        }
        assert!(2 * obstructed > WORLDS, "{}: {obstructed}", family.name());
    }
}

#[test]
fn a_body_wider_than_its_gates_has_no_world() {
    let wide = Body { width_m: 3.6, ..BODY };
    let refused = draw(Family::Perimeter, 1, &wide).map(drop);
    assert_eq!(refused, Err(Unfair { family: Family::Perimeter, seed: 1, draws: MOST_DRAWS, body: wide }));
}
