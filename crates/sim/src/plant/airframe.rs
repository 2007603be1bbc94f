//! Parts that flying bodies have in common: a box in the world, the distance to the surface below, the energy of the
//! descent, and the envelope. Forces and motion are left to each kind.

use rapier3d::prelude::*;

use super::Flight;
use crate::scene::StartPose;
use crate::world::{World, turn};

/// Reach of the range finder, metres.
const REACH: f32 = 40.0;

/// Body of an aircraft: its handles in the world, and its numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Airframe {
    pub(super) handle: RigidBodyHandle,
    pub(super) shell: ColliderHandle,
    /// Height of the body, metres.
    height_m: f32,
    numbers: Numbers,
}

/// Numbers that multirotor and fixed wing have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers {
    /// Length, width and height of the body, metres.
    pub(super) body_m: [f32; 3],
    /// Height at which a run begins, metres above the ground.
    pub(super) cruise_m: f32,
    /// Power in flight, W.
    pub(super) power_w: f32,
    /// Speed of the descent, m/s.
    pub(super) descent_m_s: f32,
    /// Least height above the surface below while it is led, metres.
    pub(super) clearance_m: f32,
    /// Greatest height above the world's origin, metres.
    pub(super) ceiling_m: f32,
}

impl Airframe {
    /// Puts the body into `world` at its cruise height, with the mass that `weighed` gives it.
    pub(super) fn new(
        world: &mut World,
        start: &StartPose,
        numbers: Numbers,
        weighed: impl FnOnce(RigidBodyBuilder) -> RigidBodyBuilder,
    ) -> Self {
        let (sin, cos) = libm::sincosf(start.heading);
        let up = world.terrain().height(start.east, start.north) + numbers.cruise_m;
        let pose = Pose::from_parts(Vector::new(start.east, start.north, up), turn([cos, sin]));
        let body = RigidBodyBuilder::dynamic().pose(pose).can_sleep(false);
        let handle = world.physics.bodies.insert(weighed(body));
        let [length, width, height] = numbers.body_m.map(|edge| edge / 2.0);
        let shell = ColliderBuilder::cuboid(length, width, height).density(0.0).friction(0.7);
        let shell = world.physics.insert_collider(shell, Some(handle));
        Airframe { handle, shell, height_m: numbers.body_m[2], numbers }
    }

    pub(super) fn rigid<'a>(&self, world: &'a World) -> &'a RigidBody {
        &world.physics.bodies[self.handle]
    }

    /// Height above the surface below, metres; of the body's underside.
    pub(super) fn ground_clearance(&self, world: &World) -> f32 {
        let centre = self.rigid(world).translation();
        let hit = world.view(self.handle).cast(centre, -Vector::Z, REACH);
        hit.map_or(REACH, |hit| hit.distance) - self.height_m / 2.0
    }

    /// Energy that the way down takes, from `below` metres, and a tenth on top, joules.
    pub(super) fn reserve(&self, below: f32) -> f32 {
        1.1 * self.numbers.power_w * (below.max(0.0) / self.numbers.descent_m_s + 2.0)
    }

    /// Distance that is left to the envelope, metres. The floor follows from the surface below: see `clearance`.
    pub(super) fn margin(&self, world: &World, fence: f32) -> f32 {
        fence.min(self.numbers.ceiling_m - self.rigid(world).translation().z)
    }

    /// Distance to the surface below beyond the least, as a part of that. Unled, a body comes down to the ground,
    /// slowly.
    pub(super) fn clearance(&self, below: f32, led: bool) -> f32 {
        if led { (below - self.numbers.clearance_m) / self.numbers.clearance_m } else { 1.0 }
    }

    /// Motion in three dimensions, with this attitude and these rates about the body's axes.
    pub(super) fn flight(&self, world: &World, (attitude, rates): (Rotation, Vector), charge: f32) -> Flight {
        let body = self.rigid(world);
        Flight {
            attitude,
            rates,
            place: body.translation().to_array().map(f64::from),
            velocity: body.linvel().to_array().map(f64::from),
            placed: true,
            below: Some(self.ground_clearance(world)).filter(|below| *below < REACH - self.height_m),
            charge,
        }
    }
}
