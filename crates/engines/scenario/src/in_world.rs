//! A scenario's attack in a drawn world: it falls at a time that the world's seed draws, wherever the unit is by then.
//!
//! The world gives start, route, fence and objects (`world`); the scenario keeps its attacks, faults, policy, platform and classes. Its operator
//! keeps the orders that need no vehicle, as late after the first as the attack: in a drawn world none stands where the script would arm on it. A
//! scenario that is of an arming keeps its own times: its operator arms on the vehicle that is parked in sight of each start, and the route ends before it.

use core::fmt;

use evidence::mission::{Stage, Verb};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operator::Step;
use super::value::{List, Located, Real};
use super::world::Chance;
use super::{MAX_STATIONS, Point, Pose, Scenario, Scene, Station};

/// Range of the time by which everything that the scenario does comes later, seconds: a mission takes minutes.
const LATER_S: (f64, f64) = (0.0, 240.0);
/// Least length of a trial that has no such time, seconds: a mission.
const MISSION_S: f64 = 600.0;
/// Limits in a pass of a satellite, which has its region in sight for less than four minutes.
const IN_PASS_S: ((f64, f64), f64) = ((0.0, 90.0), 200.0);
/// Times that a route is driven before an attack finds the unit at its end; fewer where a scene has no room for a given number of way points.
const LAPS: usize = 3;
/// Way to the one way point of a scenario that keeps its time, metres: within the room that each start has, and more than ten metres before the
/// vehicle in sight of it.
const AHEAD_M: f64 = 1.0;
/// Number of the draws of that time; families have those below.
const ONSETS: u64 = 1000;

/// Part of a scenario in drawn worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Drawn {
    /// Its attack falls at any time of the mission, and its operator arms on no vehicle.
    #[default]
    AnyTime,
    /// Its attack is of an arming or of the start: operator and attack keep their times, and the vehicle that stands there stays in view.
    OwnTime,
    /// None: its own place scene is the attack.
    None,
}

impl Drawn {
    pub(crate) fn is_any_time(&self) -> bool {
        *self == Self::AnyTime
    }
}

/// Reason that a scenario has no meaning in a drawn world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Homebound {
    /// It has no world: it runs on the real stacks.
    OfStacks,
    /// Its teammates have their places in its own scene.
    Teammates,
    /// An object, the light or its own place scene is the attack.
    OwnScene,
    /// Its times lie in its own contacts.
    OwnContacts,
}

impl fmt::Display for Homebound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Homebound::OfStacks => "it runs on the real stacks, which have no world",
            Homebound::Teammates => "its teammates have their places in its own scene",
            Homebound::OwnScene => "an object, the light or a place of its own scene is its attack",
            Homebound::OwnContacts => "its times are those of its own contacts",
        })
    }
}

impl std::error::Error for Homebound {}

impl Scenario {
    /// The scenario in the world `scene`, at its own time or at one that `seed` draws. It goes on for its own length
    /// after that; without anything that has a time, for [`MISSION_S`] at least.
    ///
    /// # Errors
    /// The scenario has no meaning in a drawn world.
    pub fn in_world(&self, mut scene: Scene, seed: u64) -> Result<Scenario, Homebound> {
        if self.in_worlds == Drawn::OwnTime {
            scene.route = Located::nowhere(List::from_first([Located::nowhere(ahead_of(&scene.start))]));
        } else if !self.windows().is_empty() {
            let points = LAPS * scene.route.len();
            scene.route = Located::nowhere(List::from_first(scene.route.iter().cycle().take(points).cloned()));
        }
        self.placed(scene, seed, (LATER_S, MISSION_S))
    }

    /// The scenario in a pass of a satellite over the region `scene`, with these stations.
    ///
    /// # Errors
    /// The scenario has no meaning in a drawn world.
    pub fn in_pass(
        &self,
        scene: Scene,
        station: List<Station, MAX_STATIONS>,
        seed: u64,
    ) -> Result<Scenario, Homebound> {
        let mut scenario = self.placed(scene, seed, IN_PASS_S)?;
        scenario.conditions.station = station;
        Ok(scenario)
    }

    /// Places the scenario in a scene, with everything later by a time and a longer mission.
    fn placed(&self, scene: Scene, seed: u64, (later, mission_s): ((f64, f64), f64)) -> Result<Scenario, Homebound> {
        self.check_for_worlds()?;
        // Worlds of one seed differ by family, and so do these.
        let later_s = Chance::new(ONSETS, seed, scene.ground.seed.into()).uniform(later.0, later.1);
        let mut scenario = self.clone();
        (scenario.scene, scenario.scene_file) = (Some(scene), None);
        if self.in_worlds == Drawn::OwnTime {
            return Ok(scenario);
        }
        scenario.come_later(later_s, mission_s);
        Ok(scenario)
    }

    /// Moves all but the start by a given number of seconds, without the orders that need a vehicle.
    fn come_later(&mut self, later_s: f64, mission_s: f64) {
        let (from, to) = self.varies.phase_s();
        let own_s = self.duration_s.get();
        let lasts_s = if self.windows().is_empty() { own_s.max(mission_s) } else { own_s + later_s };
        self.duration_s = Located::nowhere(Real::nearest(lasts_s));
        self.varies.injection_phase_s =
            Located::nowhere(List::from_first([from + later_s, to + later_s].map(Real::nearest)));
        let needs_none = |step: &&Step| !matches!(*step.verb, Verb::Arm | Verb::Confirm | Verb::Disarm);
        let mut steps: Vec<Step> = self.operator.step.iter().filter(needs_none).cloned().collect();
        let begun = steps.iter().position(|step| *step.verb == Verb::Enable).map_or(0, |first| first + 1);
        for step in &mut steps[begun..] {
            step.at_s = Located::nowhere(Real::nearest(step.at_s.get() + later_s));
        }
        self.operator.step = List::from_first(steps);
        self.mission = self.mission.as_ref().map(|_| Located::nowhere(Stage::Enabled));
    }

    /// Checks that it has a meaning in a drawn world.
    ///
    /// # Errors
    /// The reason that it has none.
    pub fn check_for_worlds(&self) -> Result<(), Homebound> {
        if self.is_of_stacks() {
            return Err(Homebound::OfStacks);
        }
        if !self.unit.is_empty() {
            return Err(Homebound::Teammates);
        }
        if !self.conditions.station.is_empty() {
            return Err(Homebound::OwnContacts);
        }
        let scene = self.scene();
        let deceives = scene.object.iter().any(|object| {
            object.heated_s.is_some()
                || object.painted_as.is_some()
                || object.warm_as.is_some()
                || object.print.is_some()
        });
        let staged = self.in_worlds == Drawn::None
            || deceives
            || scene.perturbation.is_some()
            || scene.weather != super::Weather::default();
        if staged { Err(Homebound::OwnScene) } else { Ok(()) }
    }
}

/// The place [`AHEAD_M`] before a start.
fn ahead_of(start: &Pose) -> Point {
    let (sin, cos) = libm::sincos(start.heading_rad.get());
    let [east, north] = start.at_m.map(|along| along.get());
    [east + AHEAD_M * cos, north + AHEAD_M * sin].map(Real::nearest)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::world::{Body, Family, draw};
    use crate::{find, find_root, load};

    const BODY: Body = Body { width_m: 0.9, fence_m: 1.5 };

    fn shipped(name: &str) -> Scenario {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        load(&find(&root, name).unwrap()).unwrap()
    }

    #[test]
    fn attack_falls_at_a_time_of_the_worlds_seed() {
        let freeze = shipped("localisation_freeze");
        let in_world = |seed| freeze.in_world(draw(Family::Street, seed, &BODY).unwrap(), seed).unwrap();
        let [one, same, other] = [3, 3, 4].map(in_world);
        assert_eq!(one, same);
        let (from, to) = one.varies.phase_s();
        assert!((to - from - 1.0).abs() < 1e-9, "the scenario's own phase is kept");
        assert_ne!(from, other.varies.phase_s().0);
        let later_s = one.duration_s.get() - freeze.duration_s.get();
        assert!((from - freeze.varies.phase_s().0 - later_s).abs() < 0.01, "its own time after it is kept");
        assert_eq!(crate::check::scenario(&one, "localisation_freeze").len(), 0, "it could be written as a file");
        assert!(one.operator.step.iter().all(|step| *step.verb == Verb::Enable));
    }

    /// Without its revocation a good key would be an operator's, and the scenario another one.
    #[test]
    fn orders_without_a_vehicle_come_with_the_attack() {
        let rogue = shipped("rogue_station");
        let one = rogue.in_world(draw(Family::Street, 3, &BODY).unwrap(), 3).unwrap();
        let steps_of =
            |scenario: &Scenario, verb| scenario.operator.step.iter().find(|step| *step.verb == verb).cloned();
        let time = |scenario, verb| steps_of(scenario, verb).map(|step| step.at_s.get());
        let later_s = one.varies.phase_s().0 - rogue.varies.phase_s().0;
        assert_eq!(time(&one, Verb::Enable), time(&rogue, Verb::Enable));
        assert!((time(&one, Verb::Revoke).unwrap() - time(&rogue, Verb::Revoke).unwrap() - later_s).abs() < 0.01);
        assert_eq!(time(&one, Verb::Arm), None);
    }

    #[test]
    fn attack_on_an_arming_keeps_its_time_and_its_orders() {
        let splice = shipped("command_splice");
        let one = splice.in_world(draw(Family::Street, 3, &BODY).unwrap(), 3).unwrap();
        assert_eq!(one.scene.as_ref().map(|scene| scene.route.len()), Some(1));
        assert_eq!(Scenario { scene: splice.scene.clone(), scene_file: splice.scene_file.clone(), ..one }, splice);
    }

    #[test]
    fn scenario_with_its_attack_in_its_scene_stays_there() {
        let scene = draw(Family::Yard, 1, &BODY).unwrap();
        let refused = |name| shipped(name).in_world(scene.clone(), 1).unwrap_err();
        assert_eq!(refused("decoy_warm"), Homebound::OwnScene);
        assert_eq!(refused("teammate"), Homebound::Teammates);
        assert_eq!(refused("fence_start"), Homebound::OwnScene);
    }
}
