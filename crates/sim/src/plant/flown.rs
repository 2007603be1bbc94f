//! Test bench for bodies that move freely: one body under set-points in an empty scene.

use std::sync::Arc;

use config::platform::Body;
use wire::time::{Instant, Span};

use super::{BodyMotion, Plant, SafetyMargins, SetPoint, State};
use crate::fidelity::Fidelity;
use crate::scene::Scene;
use crate::wind::Wind;
use crate::world::World;

pub(super) struct Flown {
    pub(super) world: World,
    pub(super) plant: Plant,
    steps: u64,
}

impl Flown {
    pub(super) fn new(wind: Wind, body: Body) -> Self {
        let mut world = World::new(Arc::new(Scene { objects: Vec::new(), wind, ..Scene::default() }));
        let start = world.scene().start;
        let plant = Plant::from_body(&mut world, &start, &body, &Fidelity::SHIPPED, 1).unwrap();
        Flown { world, plant, steps: 0 }
    }

    /// Flies for a given number of seconds under this velocity, or without a lead; gives the states on the way.
    pub(super) fn fly(&mut self, seconds: f64, along: Option<[f32; 3]>, turn: f32) -> Vec<State> {
        (0..(seconds * 100.0).round() as u64)
            .map(|_| {
                self.steps += 1;
                let now = Instant(self.steps * 10_000);
                if let Some(along) = along {
                    let motion = BodyMotion::Velocity { along, turn };
                    assert!(self.plant.accept(now, SetPoint { motion, until: now + Span::ms(300) }));
                }
                self.plant.step(now, &mut self.world);
                self.plant.state(&self.world)
            })
            .collect()
    }

    pub(super) fn safety_margins(&self) -> SafetyMargins {
        self.plant.safety_margins(&self.world).unwrap()
    }
}
