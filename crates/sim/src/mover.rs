//! Objects that move: each along its path at its speed, until the unit is in its way.
//!
//! An object stops where its next step would touch the unit, whether that drives or stands. One that yields stops
//! earlier. Who has stood for long turns back. A touch is then the unit's doing alone.

use rapier3d::prelude::*;

use crate::scene::Object;
use wire::time::Span;

/// Distance from its front to the unit's middle within which an object that yields stops, metres.
const STOPS_BEFORE: f32 = 3.0;
/// Room that is left to the unit's body, metres.
const ROOM: f32 = 0.15;
/// Time after which it turns back.
const WAITS: Span = Span::s(10);

/// An object that moves.
#[derive(Clone)]
pub(super) struct Mover {
    pub(super) object: usize,
    pub(super) body: RigidBodyHandle,
    /// Steps along the path, negative before the departure.
    gone: i64,
    /// True while the object goes back.
    pub(super) back: bool,
    /// Time for which it has stood before the unit.
    stood: Span,
    /// On a closed path: steps before the departure, and steps of one round.
    round: Option<[i64; 2]>,
}

impl Mover {
    /// Mover of the object with this index, in steps of length `step`.
    pub(super) fn new(index: usize, object: &Object, body: RigidBodyHandle, step: Span) -> Self {
        let steps = |seconds: f64| libm::round(seconds * 1e6 / step.0 as f64) as i64;
        let round = object.round().map(|round| round.map(steps));
        Mover { object: index, body, gone: 0, back: false, stood: Span(0), round }
    }

    /// Steps along its path so far.
    pub(super) fn steps_along(&self) -> u64 {
        self.gone.unsigned_abs()
    }

    /// Takes one step of length `passed` on the way from `centre`, or stands before the unit.
    pub(super) fn step(
        &mut self,
        object: &Object,
        (centre, facing): (Vector, [f32; 2]),
        unit: Option<&UnitBody>,
        passed: Span,
    ) {
        let is_blocked = unit.is_some_and(|unit| unit.stops(object, centre, facing));
        // A walker who follows a unit that rolls away by millimetres has stood all the same.
        self.stood = if is_blocked { self.stood + passed } else { Span(self.stood.0.saturating_sub(passed.0)) };
        if self.stood >= WAITS {
            (self.stood, self.back) = (Span(0), !self.back);
        } else if !is_blocked {
            self.gone += if self.back { -1 } else { 1 };
            // A closed path leads on behind its first point. Without that, one that meets the unit there could go
            // neither way.
            if let Some([departs, steps]) = self.round.filter(|[departs, _]| self.back && self.gone < *departs) {
                self.gone = departs + steps - 1;
            }
            self.gone = self.gone.max(0);
        }
        self.back &= self.gone > 0 || self.round.is_some();
    }
}

/// The unit's body, in whose way an object may come.
pub(super) struct UnitBody {
    at: Vector,
    rotation: Rotation,
    /// Half of its sides.
    half: Vector,
}

impl UnitBody {
    /// Body of the dynamic rigid body; none without a box.
    pub(super) fn from_physics(physics: &PhysicsWorld) -> Option<Self> {
        let body = physics.bodies.iter().map(|(_, body)| body).find(|body| body.is_dynamic())?;
        let shape = body.colliders().iter().find_map(|shape| physics.colliders.get(*shape)?.shape().as_cuboid())?;
        Some(UnitBody { at: body.translation(), rotation: *body.rotation(), half: shape.half_extents })
    }

    /// True if an object there stops for it.
    fn stops(&self, object: &Object, centre: Vector, facing: [f32; 2]) -> bool {
        let facing = Vector::new(facing[0], facing[1], 0.0);
        let ahead = (self.at - centre).dot(facing) > 0.0;
        let front = centre + facing * (object.size[0] / 2.0);
        let vector = self.at - front;
        let yields = object.yields && libm::hypotf(vector.x, vector.y) < STOPS_BEFORE;
        ahead && (yields || self.is_touched_from(front, object.size))
    }

    /// True if the front of a thing of this size is at the body.
    fn is_touched_from(&self, front: Vector, [_, width, height]: [f32; 3]) -> bool {
        let local = self.rotation.inverse() * (front - self.at);
        let reach = width / 2.0 + ROOM;
        let is_near = local.x.abs() < self.half.x + reach && local.y.abs() < self.half.y + reach;
        is_near && local.z.abs() < self.half.z + height / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    const STEP: Span = Span::ms(10);

    fn walker() -> Object {
        let scene = Scene::default();
        Object { yields: false, ..scene.objects.iter().find(|object| object.moves()).unwrap().clone() }
    }

    fn unit() -> UnitBody {
        let half = Vector::new(0.8, 0.45, 0.4);
        UnitBody { at: Vector::new(1.0, 0.0, 0.0), rotation: Rotation::IDENTITY, half }
    }

    const BEFORE_IT: (Vector, [f32; 2]) = (Vector::ZERO, [1.0, 0.0]);

    /// Every second the unit has rolled far enough for one step.
    #[test]
    fn walker_before_a_unit_that_rolls_away_turns_back() {
        let (object, unit) = (walker(), unit());
        let mut mover = Mover::new(0, &object, RigidBodyHandle::invalid(), STEP);
        let steps = (1..).find(|number| {
            mover.step(&object, BEFORE_IT, (number % 100 != 0).then_some(&unit), STEP);
            mover.back
        });
        assert!((1000..1200).contains(&steps.unwrap()), "{steps:?}");
    }

    /// A walker who turns at the start of a closed path goes on one step behind its first point, however long before
    /// the departure.
    #[test]
    fn walker_goes_on_from_where_it_starts() {
        let (object, unit) = (Object { closed: true, departs: 30.0, ..walker() }, unit());
        let mut mover = Mover::new(0, &object, RigidBodyHandle::invalid(), STEP);
        while !mover.back {
            mover.step(&object, BEFORE_IT, Some(&unit), STEP);
        }
        mover.step(&object, BEFORE_IT, None, STEP);
        let [departs, steps] = mover.round.unwrap();
        assert_eq!(mover.gone, departs + steps - 1);
    }
}
