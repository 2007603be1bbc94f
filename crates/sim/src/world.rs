//! The physical world: ground, objects and the rigid bodies in them, stepped by rapier.
//!
//! World frame: ENU, x east, y north, z up, metres; gravity along -z. One step is [`STEP`]. Standing objects are bare
//! colliders, moving ones kinematic bodies placed by their path's closed form; the only dynamic body is the plant's.
//! Everything a sensor sees comes from [`View::cast`], so all sensors agree on the places of objects. Leaves driving to
//! `plant` and appearance to `sensor`.

use std::collections::BTreeMap;
use std::sync::Arc;

use rapier3d::parry::utils::Array2;
use rapier3d::prelude::*;
use wire::id::ObjectId;
use wire::sensor::Class;
use wire::time::Span;

use crate::mover::{Mover, UnitBody};
use crate::scene::{Object, Scene};
use crate::terrain::Terrain;

/// Length of one physics step.
pub const STEP: Span = Span::ms(10);
/// Length of one physics step in seconds.
pub const DT: f32 = 0.01;
/// Acceleration of gravity, m/s².
pub(crate) const GRAVITY: f32 = 9.81;
/// Depth of objects in the ground, metres, so that no gap shows on a slope.
const SUNK: f32 = 0.05;
const GROUND_TAG: u128 = u128::MAX;

/// Surface that a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// The ground.
    Ground,
    /// A true object.
    Object(ObjectId),
}

/// End of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Surface that the ray met.
    pub surface: Surface,
    /// Ray parameter: metres when the direction is a unit vector.
    pub distance: f32,
    /// Outward unit normal, world frame.
    pub normal: Vector,
}

/// Position and facing of a true object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Centre of its box, world frame.
    pub centre: Vector,
    /// Unit vector it faces along, horizontal (cosine, sine of its heading).
    pub facing: [f32; 2],
}

impl Placement {
    fn turned(self) -> Self {
        Placement { facing: self.facing.map(|part| -part), ..self }
    }
}

/// The world of one sim.
pub struct World {
    pub(crate) physics: PhysicsWorld,
    scene: Arc<Scene>,
    terrain: Arc<Terrain>,
    placed: Vec<Placement>,
    movers: Vec<Mover>,
    steps: u64,
}

impl World {
    /// Builds the world of a scene that has passed [`Scene::check`].
    pub fn new(scene: Arc<Scene>) -> Self {
        let terrain = Arc::new(Terrain::new(&scene));
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::new(0.0, 0.0, -GRAVITY);
        physics.integration_parameters.dt = DT;
        physics.insert_collider(ground_collider(&terrain), None);
        let mut world = World { physics, scene, terrain, placed: Vec::new(), movers: Vec::new(), steps: 0 };
        world.insert_objects();
        world
    }

    fn insert_objects(&mut self) {
        let scene = Arc::clone(&self.scene);
        for (index, object) in scene.objects.iter().enumerate() {
            let placement = self.placement(object, 0.0);
            let collider = object_collider(object).user_data(index as u128);
            if object.moves() {
                let body = RigidBodyBuilder::kinematic_position_based().pose(pose_of(&placement));
                let (handle, _) = self.physics.insert(body, collider);
                self.movers.push(Mover::new(index, object, handle, STEP));
            } else {
                self.physics.insert_collider(collider.position(pose_of(&placement)), None);
            }
            self.placed.push(placement);
        }
    }

    /// Advances by one [`STEP`]: objects move to where their paths say, then physics follows.
    pub fn step(&mut self) {
        self.steps += 1;
        let scene = Arc::clone(&self.scene);
        let unit = UnitBody::from_physics(&self.physics);
        for k in 0..self.movers.len() {
            let Mover { object: index, body, .. } = self.movers[k];
            let object = &scene.objects[index];
            let Placement { centre, facing } = self.placed[index];
            self.movers[k].step(object, (centre, facing), unit.as_ref(), STEP);
            let placement = self.placement(object, seconds(self.movers[k].steps_along()));
            let placement = if self.movers[k].back { placement.turned() } else { placement };
            self.placed[index] = placement;
            self.physics.bodies[body].set_next_kinematic_position(pose_of(&placement));
        }
        self.physics.step();
    }

    /// Simulated seconds since the start.
    pub fn seconds(&self) -> f64 {
        seconds(self.steps)
    }

    /// Scene of the world.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Relief of the ground.
    pub fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    /// Placement of each object, by id.
    pub fn placements(&self) -> &[Placement] {
        &self.placed
    }

    /// The object nearest a place on the ground, with its horizontal distance in metres.
    pub fn nearest(&self, east: f32, north: f32) -> Option<(ObjectId, Class, f32)> {
        let distance = |p: &Placement| {
            let (dx, dy) = (p.centre.x - east, p.centre.y - north);
            (dx * dx + dy * dy).sqrt()
        };
        let all = self.placed.iter().enumerate().map(|(i, p)| (i, distance(p)));
        let (index, metres) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((ObjectId(index as u16), self.scene.objects[index].class, metres))
    }

    /// The objects that a collider touches, with the direction from it to each.
    pub(crate) fn touching(&self, collider: ColliderHandle) -> BTreeMap<ObjectId, Vector> {
        let pairs = self.physics.narrow_phase.contact_pairs_with(collider).filter(|p| p.has_any_active_contact());
        pairs
            .filter_map(|pair| {
                let first = pair.collider1 == collider;
                let other = if first { pair.collider2 } else { pair.collider1 };
                let tag = self.physics.colliders[other].user_data;
                // Rapier's normal leads from the first collider to the second.
                let normal = pair.manifolds().first()?.data.normal;
                (tag != GROUND_TAG).then_some((ObjectId(tag as u16), if first { normal } else { -normal }))
            })
            .collect()
    }

    /// Opens the world for ray casts that do not see `own_handle`, the body that carries the sensor.
    pub fn view(&self, own_handle: RigidBodyHandle) -> View<'_> {
        let filter = QueryFilter::default().exclude_rigid_body(own_handle);
        View { queries: self.physics.query_pipeline_with_filter(filter) }
    }

    fn placement(&self, object: &Object, seconds: f64) -> Placement {
        let ([east, north], heading) = object.place(seconds);
        let up = self.terrain.height(east, north) + object.size[2] / 2.0 - SUNK;
        let (sin, cos) = libm::sincosf(heading);
        Placement { centre: Vector::new(east, north, up), facing: [cos, sin] }
    }
}

impl Clone for World {
    /// A world that continues exactly as this one would. The pipelines hold scratch memory only and start empty.
    fn clone(&self) -> Self {
        let p = &self.physics;
        let physics = PhysicsWorld {
            gravity: p.gravity,
            integration_parameters: p.integration_parameters,
            physics_pipeline: PhysicsPipeline::new(),
            collision_pipeline: CollisionPipeline::new(),
            islands: p.islands.clone(),
            broad_phase: p.broad_phase.clone(),
            narrow_phase: p.narrow_phase.clone(),
            bodies: p.bodies.clone(),
            colliders: p.colliders.clone(),
            impulse_joints: p.impulse_joints.clone(),
            multibody_joints: p.multibody_joints.clone(),
            soft_bodies: p.soft_bodies.clone(),
            ccd_solver: p.ccd_solver.clone(),
        };
        World {
            physics,
            scene: Arc::clone(&self.scene),
            terrain: Arc::clone(&self.terrain),
            placed: self.placed.clone(),
            movers: self.movers.clone(),
            steps: self.steps,
        }
    }
}

/// The world at one instant, open for ray casts.
pub struct View<'a> {
    queries: QueryPipeline<'a>,
}

impl View<'_> {
    /// The first surface along a ray, up to ray parameter `reach`.
    pub fn cast(&self, origin: Vector, direction: Vector, reach: f32) -> Option<Hit> {
        let ray = Ray::new(origin, direction);
        let (handle, hit) = self.queries.cast_ray_and_get_normal(&ray, reach, true)?;
        let tag = self.queries.colliders[handle].user_data;
        let surface = if tag == GROUND_TAG { Surface::Ground } else { Surface::Object(ObjectId(tag as u16)) };
        Some(Hit { surface, distance: hit.time_of_impact, normal: hit.normal })
    }
}

/// Half a turn of the quaternion that lifts rapier's y-up height fields to z up.
const HALF_SQRT: f32 = core::f32::consts::FRAC_1_SQRT_2;

fn seconds(steps: u64) -> f64 {
    (steps * STEP.0) as f64 / 1e6
}

/// The relief as a collider. Rapier's height fields have height along y, rows along z and columns along x; turned by
/// a quarter about x, height is z up and rows run from north to south.
fn ground_collider(terrain: &Terrain) -> ColliderBuilder {
    let n = terrain.cells() + 1;
    let mut heights = Array2::repeat(n, n, 0.0);
    for row in 0..n {
        for column in 0..n {
            heights[(row, column)] = terrain.height_at(n - 1 - row, column);
        }
    }
    let quarter = Rotation::from_xyzw(HALF_SQRT, 0.0, 0.0, HALF_SQRT);
    ColliderBuilder::heightfield(heights, Vector::new(terrain.side(), 1.0, terrain.side()))
        .position(Pose::from_rotation(quarter))
        .friction(0.9)
        .user_data(GROUND_TAG)
}

fn object_collider(object: &Object) -> ColliderBuilder {
    let [length, width, height] = object.size.map(|s| s / 2.0);
    match object.class {
        Class::Person => {
            let radius = length.min(width);
            ColliderBuilder::capsule_z((height - radius).max(0.01), radius)
        }
        Class::Vehicle | Class::Decoy | Class::Obstacle => ColliderBuilder::cuboid(length, width, height),
    }
}

fn pose_of(placement: &Placement) -> Pose {
    Pose::from_parts(placement.centre, turn(placement.facing))
}

/// The rotation about z that turns east to `facing`, by half-angle identities and without trigonometry.
pub(crate) fn turn([cos, sin]: [f32; 2]) -> Rotation {
    let w = ((1.0 + cos).max(0.0) / 2.0).sqrt();
    let z = ((1.0 - cos).max(0.0) / 2.0).sqrt();
    Rotation::from_xyzw(0.0, 0.0, if sin < 0.0 { -z } else { z }, w).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use config::platform::Vehicle;

    use crate::fidelity::Fidelity;
    use crate::plant::{Plant, SetPoint};

    /// Distance to the north that a walker gets on a way through a unit that stands or drives off at this speed,
    /// metres, and the touches.
    fn walked(yields: bool, seconds: u64, speed: f32) -> (f32, usize) {
        let start = Scene::default().start;
        let [east, north] = [start.east + 1.0, start.north - 5.0];
        walked_along((vec![[east, north], [east, north + 25.0]], false), yields, seconds, speed)
    }

    /// The view from points along this path, closed or not, from its first point on.
    fn walked_along((path, closed): (Vec<[f32; 2]>, bool), yields: bool, seconds: u64, speed: f32) -> (f32, usize) {
        let mut scene = Scene::default();
        let mut walker = scene.objects.iter().find(|object| object.moves()).unwrap().clone();
        let north = path[0][1];
        (walker.path, walker.closed, walker.yields) = (path, closed, yields);
        scene.objects = vec![walker];
        let mut world = World::new(Arc::new(scene.clone()));
        let mut plant = Plant::new(&mut world, &scene.start, &Vehicle::GROUND, &Fidelity::SHIPPED);
        let mut touches = 0;
        for step in 1..=seconds * 1_000_000 / STEP.0 {
            let now = wire::time::Instant(step * STEP.0);
            plant.accept(now, SetPoint::course((speed, 0.0), now + wire::time::Span::ms(500)));
            plant.step(now, &mut world);
            touches += plant.touches(&world).len();
        }
        (world.placements()[0].centre.y - north, touches)
    }

    #[test]
    fn who_yields_stops_before_the_unit_and_turns_back() {
        // The walker has stood for ten seconds once the unit's springs have come to rest.
        let (stops, back) = (walked(true, 10, 0.0).0, walked(true, 13, 0.0).0);
        assert!((1.5..2.5).contains(&stops) && back < stops - 0.5, "{stops} {back}");
    }

    /// The path of the walker begins before the unit, and leads on past it.
    #[test]
    fn who_meets_the_unit_where_it_starts_goes_round_the_other_way() {
        let start = Scene::default().start;
        let [east, north] = [start.east, start.north - 2.5];
        let round = || (vec![[east, north], [east, north + 9.0], [east + 9.0, north + 9.0], [east + 9.0, north]], true);
        let (steps, _) = walked_along(round(), true, 9, 0.0);
        assert!(steps.abs() < 0.5, "{steps}");
        let (goes, touches) = walked_along(round(), true, 24, 0.0);
        assert!(goes > 2.0 && touches == 0, "{goes} {touches}");
    }

    #[test]
    fn nobody_walks_through_the_unit() {
        let (stops, touches) = walked(false, 10, 0.0);
        assert!((3.5..4.5).contains(&stops) && touches == 0, "{stops} {touches}");
        let (goes_on, touches) = walked(false, 20, 0.4);
        assert!(goes_on > 15.0 && touches == 0, "behind the unit, which has gone: {goes_on} {touches}");
    }
}
