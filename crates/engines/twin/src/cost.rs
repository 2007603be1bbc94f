//! Cost of one trial: by stage, of its physics alone, along a known run, and forked from a known run. Reading a clock,
//! repeating trials and comparing figures are left to the caller.

use std::sync::Arc;

use config::platform::Body;
use evidence::trial::Trial;
use oracle::judged;
use scenario::{Scenario, Setup};
use sim::fidelity::Fidelity;
use sim::plant::{Plant, SetPoint};
use sim::scene::Scene;
use sim::world::{STEP, World};
use topology::{MemberRole, Topology};
use wire::id::{NodeId, WorldId};
use wire::time::Instant;

use super::Twin;
use super::part::Part;
use super::part::baseline::Baseline;
use super::part::make::AssemblyError;
use super::queue::Micros;
use super::stopwatch::{Stopwatch, WorkStage};
use super::trial::{Run, baseline, conclude, start, start_following};
use super::verified::SignatureCounts;

/// A trial that was watched.
pub struct Watched {
    /// Time of the trial by stage.
    pub stopwatch: Stopwatch,
    /// Number of signatures that a core made, asked about, and had to verify.
    pub signatures: SignatureCounts,
    /// Row of the trial in a table of results.
    pub trial: Trial,
}

/// Runs and judges one trial as `run` does, its time added up on `clock`.
pub fn watched(scenario: &Scenario, setup: &Setup, seed: u64, clock: fn() -> u64) -> Result<Watched, AssemblyError> {
    let mut stopwatch = Stopwatch::start(clock, WorkStage::Setup);
    let (topology, mut twin) = start(scenario, setup, seed, false)?;
    twin.watch(stopwatch.clone());
    let mut run = conclude(topology, twin, setup);
    if let Some(watched) = run.stopwatch.take() {
        stopwatch = watched;
    }
    let trial = judged::trial(seed, scenario.level(), &run.evidence, &run.verdict);
    let signatures = run.signatures;
    // Giving the memory back is part of the trial.
    drop(run);
    stopwatch.enter(WorkStage::Setup);
    Ok(Watched { stopwatch, signatures, trial })
}

/// A trial that is known, to be run again.
pub struct Known {
    seed: u64,
    baseline: Arc<Baseline>,
    topology: Topology,
    /// The trial a while before its end.
    twin: Twin,
}

impl Known {
    /// Runs the trial once as a baseline, and once up to `suffix` before its end.
    pub fn measure(scenario: &Scenario, setup: &Setup, seed: u64, suffix: Micros) -> Result<Known, AssemblyError> {
        let baseline = Arc::new(baseline(scenario, setup, seed)?);
        let (topology, mut twin) = start(scenario, setup, seed, false)?;
        twin.run_until(topology.duration.saturating_sub(suffix));
        Ok(Known { seed, baseline, topology, twin })
    }

    /// Runs and judges it with every core going along with the baseline: casting, the engine and the judge are left.
    pub fn run_with_baseline(&self, scenario: &Scenario, setup: &Setup) -> Result<Run, AssemblyError> {
        let (topology, twin) = start_following(scenario, setup, self.seed, &self.baseline)?;
        Ok(conclude(topology, twin, setup))
    }

    /// Forks it, runs the fork to its end and judges the whole.
    pub fn forked(&self, setup: &Setup) -> Run {
        conclude(self.topology.clone(), self.twin.fork(WorldId(1)), setup)
    }
}

/// The course of the unit under test in one trial: its scene, and the requests to its plant at each step.
pub struct Course {
    scene: Arc<Scene>,
    body: Body,
    asked: Vec<Option<SetPoint>>,
}

impl Course {
    /// Runs the trial once and notes its course; none if there is no unit under test.
    pub fn record(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Option<Course>, AssemblyError> {
        let (topology, mut twin) = start(scenario, setup, seed, false)?;
        let Some((scene, body)) = scene(&topology) else { return Ok(None) };
        let steps = topology.duration / STEP.0;
        let requested = (1..=steps).map(|step| {
            twin.run_until(step * STEP.0);
            set_point(&twin)
        });
        Ok(Some(Course { asked: requested.collect(), scene: Arc::new(scene), body }))
    }

    /// Length of the course, simulated seconds.
    pub fn seconds(&self) -> f64 {
        (self.asked.len() as u64 * STEP.0) as f64 / 1e6
    }

    /// World and vehicle at the start, for [`Bare::drive`].
    pub fn bare(&self) -> Bare<'_> {
        let mut world = World::new(Arc::clone(&self.scene));
        let plant = Plant::from_body(&mut world, &self.scene.start, &self.body, &Fidelity::SHIPPED, 1);
        let plant = plant.expect("invariant: the trial has made the same plant");
        Bare { course: self, world, plant }
    }
}

/// The physics engine (Rapier) with only the world and the vehicle.
pub struct Bare<'a> {
    course: &'a Course,
    world: World,
    plant: Plant,
}

impl Bare<'_> {
    /// Steps through the whole course.
    pub fn drive(&mut self) {
        for (k, asked) in (1..).zip(&self.course.asked) {
            let now = Instant(k * STEP.0);
            if let Some(requested) = asked {
                self.plant.accept(now, SetPoint { until: now + STEP, ..*requested });
            }
            self.plant.step(now, &mut self.world);
        }
    }

    /// Distance of the vehicle from the start, metres.
    pub fn way(&self) -> f32 {
        let place = self.plant.state(&self.world).position;
        let start = &self.course.scene.start;
        ((place.x - start.east).powi(2) + (place.y - start.north).powi(2)).sqrt()
    }
}

fn scene(topology: &Topology) -> Option<(Scene, Body)> {
    let sim = topology.members.iter().find(|m| m.node() == NodeId::SIM)?;
    if let MemberRole::Sim(config) = &sim.role { Some((config.scene.clone(), config.body)) } else { None }
}

fn set_point(twin: &Twin) -> Option<SetPoint> {
    let sim = twin.nodes().iter().find(|n| n.id == NodeId::SIM)?;
    if let Part::Sim(sim) = &sim.part { sim.truth().1.set_point() } else { None }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn nominal() -> (Scenario, Setup) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let scenario = scenario::load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        (scenario, setup)
    }

    #[test]
    fn watching_changes_nothing_and_no_time_is_lost() {
        let (scenario, setup) = nominal();
        let watched = watched(&scenario, &setup, 1, link::clock::trace_us).unwrap();
        let (topology, twin) = start(&scenario, &setup, 1, false).unwrap();
        let run = conclude(topology, twin, &setup);
        assert!(run.stopwatch.is_none());
        let single_trial = judged::trial(1, scenario.level(), &run.evidence, &run.verdict);
        assert_eq!((watched.trial.log_hash, watched.trial.outcome), (single_trial.log_hash, single_trial.outcome));
        for stage in WorkStage::ALL.into_iter().filter(|s| !matches!(s, WorkStage::Broker | WorkStage::Guest)) {
            assert!(watched.stopwatch.spent(stage) > 0, "{}", stage.name());
        }
    }

    #[test]
    fn twins_own_signatures_are_known_good() {
        let (scenario, setup) = nominal();
        let signatures = watched(&scenario, &setup, 1, || 0).unwrap().signatures;
        assert!(signatures.made > 100 && signatures.asked > 100 && signatures.verified == 0, "{signatures:?}");
    }

    #[test]
    fn known_run_repeats_to_the_same_log() {
        let (scenario, setup) = nominal();
        let known = Known::measure(&scenario, &setup, 1, 3_000_000).unwrap();
        let (topology, twin) = start(&scenario, &setup, 1, false).unwrap();
        let plain = conclude(topology, twin, &setup);
        assert_eq!(known.run_with_baseline(&scenario, &setup).unwrap().log, plain.log);
        let hash = |run: &Run| judged::trial(1, scenario.level(), &run.evidence, &run.verdict).log_hash;
        assert_eq!(hash(&known.forked(&setup)), hash(&plain));
    }

    #[test]
    fn bare_rapier_drives_the_course_of_the_twin() {
        let (scenario, setup) = nominal();
        let course = Course::record(&scenario, &setup, 1).unwrap().unwrap();
        let mut bare = course.bare();
        bare.drive();
        let (topology, mut twin) = start(&scenario, &setup, 1, false).unwrap();
        twin.run_until(topology.duration);
        let node = twin.nodes().iter().find(|n| n.id == NodeId::SIM).unwrap();
        let Part::Sim(sim) = &node.part else { panic!("the sim is no sim") };
        let (world, plant) = sim.truth();
        let vector = plant.state(world).position - bare.plant.state(&bare.world).position;
        assert!(bare.way() > 2.0 && vector.length() < 0.5, "{} m of way, {} m apart", bare.way(), vector.length());
    }
}
