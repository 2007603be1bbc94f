//! Everything a trial needs beside its scenario: policy, bounds, whether sensors are rendered; and where the files lie.
//!
//! A waived check makes a run an ablation; the [`Setup`] reports it, and every report of the run has to repeat it.

use std::path::{Path, PathBuf};

use config::platform::{Body, Sensors};
use guest::{Conduct, Guest};
use parallel::progress::Stop;
use perception::brought::Brought;
use spacecraft::orbit::Orbit;
use wire::bounds::Bounds;
use wire::person::Role;
use wire::policy::Policy;

use super::file::read_text;
use super::platform::check::uplink_ms;
use super::read::load_platform;
use super::shipped::platform_files;
use super::{Name, Platform, Problem, Problems, Scenario};

/// Every fifth set of frames of a recorded live run stays whole, unless others are asked for: two a second, 1 GB an hour.
pub const FRAMES: u32 = 5;

/// Confinement of the services of a live run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Confinement {
    /// As far as the machine allows.
    #[default]
    Best,
    /// Complete, or no run.
    Full,
    /// None: to measure its cost, or to look at a service with a debugger.
    None,
}

/// Networks of the hosts of a live run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hosts {
    /// All on one loopback interface.
    #[default]
    Loopback,
    /// Each in a network namespace, on a wire with the adversary at its bridge.
    Namespaces,
}

/// Policy, bounds and rendering of a trial, and where its recordings go.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Name of the policy, its file's stem.
    pub policy_name: String,
    /// The policy in force.
    pub policy: Policy,
    /// The bounds in force: the platform's, tightened by the scenario.
    pub bounds: Bounds,
    /// Bounds that the services are made with in their place, in a measurement of the effects of a bound that is set wrong.
    pub misset: Option<Bounds>,
    /// The platform as its file states it.
    pub platform: Platform,
    /// True if sensors are rendered and the detector runs; else candidates are drawn from the noise model.
    pub rendered: bool,
    /// A detector in place of the shipped one, loaded.
    pub detector: Option<Brought>,
    /// A guest in place of the unit's mission and navigation.
    pub guest: Option<Guest>,
    /// Directory for the trial's recordings; `None` where none are kept.
    pub run_dir: Option<PathBuf>,
    /// Sets of sensor frames kept of a live run: every n-th set of sensor frames stays whole; 0 for none.
    pub frames: u32,
    /// Rights of the person at a live run's window; no window where absent.
    pub window: Option<Role>,
    /// Most repetitions of a live trial that a stall of the host alone makes INVALID.
    pub retries: u32,
    /// Confinement of a live run's services.
    pub confinement: Confinement,
    /// Networks of a live run's hosts.
    pub hosts: Hosts,
    /// Set when the user wants to stop; engines look at it between steps.
    pub stop: Stop,
}

impl Setup {
    /// For `scenario`, with the files below `root`; `policy` is a file that takes the place of the scenario's.
    ///
    /// # Errors
    /// A mistake in the platform or policy file, or a bound that the scenario loosens.
    pub fn load(root: &Path, scenario: &Scenario, policy: Option<&Path>, rendered: bool) -> Result<Self, Problems> {
        Self::load_on(root, scenario, &named(root, "platforms", &scenario.platform), policy, rendered)
    }

    /// Loads a setup with the file of the platform, wherever it lies.
    ///
    /// # Errors
    /// As [`Setup::load`].
    pub fn load_on(
        root: &Path,
        scenario: &Scenario,
        platform: &Path,
        policy: Option<&Path>,
        rendered: bool,
    ) -> Result<Self, Problems> {
        let platform = load_platform(platform)?;
        tighten(scenario, &platform)?;
        orbits(scenario, &platform)?;
        let path = policy.map_or_else(|| named(root, "policies", &scenario.policy), Path::to_path_buf);
        let policy_name = stem(&path);
        let policy = load_policy(&path, &policy_name)?;
        let bounds = scenario.bounds.applied_to(&platform.bounds).to_bounds();
        let stop = Stop::default();
        let (misset, detector, guest, run_dir, frames) = (None, None, None, None, FRAMES);
        let (window, retries, confinement, hosts) = (None, 0, Confinement::default(), Hosts::default());
        Ok(Self {
            policy_name,
            policy,
            bounds,
            misset,
            platform,
            rendered,
            detector,
            guest,
            run_dir,
            frames,
            window,
            retries,
            confinement,
            hosts,
            stop,
        })
    }

    /// The words that every artefact of an ablation or of a guest carries; `None` for the platform itself with every check, guard, rule and
    /// bound in place.
    pub fn watermark(&self) -> Option<String> {
        let guest = self.guest.as_ref().map(|guest| {
            let conduct = match guest.conduct {
                Conduct::Bare => "bare, without the platform's guards",
                Conduct::Guarded => "inside the platform's guards",
            };
            let repeatable = if guest.repeatable { "" } else { "; NOT DETERMINISTIC: the same trial gave two logs" };
            let confined =
                guest.unconfined.as_ref().map(|reason| format!("; NOT CONFINED: {reason}")).unwrap_or_default();
            format!("GUEST: `{}` drives, {conduct}{repeatable}{confined}", guest.program.name)
        });
        let marks: Vec<String> = [guest, self.ablation(), self.unmeasured()].into_iter().flatten().collect();
        (!marks.is_empty()).then(|| marks.join("; "))
    }

    /// The networks' figures are of the camera that they were trained with.
    fn unmeasured(&self) -> Option<String> {
        let camera = self.platform.seen_from().camera;
        let trained = Sensors::trained_like(&camera).camera;
        let moved = self.rendered && camera != trained;
        moved.then(|| {
            let (height, from) = (camera.up_m, trained.up_m);
            format!(
                "UNMEASURED: the camera is mounted at {height} m, the networks were trained and measured at {from} m"
            )
        })
    }

    fn ablation(&self) -> Option<String> {
        let waived = (!self.policy.is_full()).then(|| format!("ABLATION: policy `{}` waives checks", self.policy_name));
        waived.or_else(|| self.misset.map(|_| "ABLATION: a bound is set wrong on purpose".to_owned()))
    }
}

/// Refuses a scenario that loosens a bound of its platform, or tightens *Th* below the chain that has to fit into it.
fn tighten(scenario: &Scenario, platform: &Platform) -> Result<(), Problems> {
    let file = format!("{}.toml", scenario.name.as_str());
    let loosened = scenario.bounds.loosened(&platform.bounds);
    let problems = loosened.iter().map(|(bound, base)| {
        let message = format!("a bound of {} ms is looser than the platform's {base} ms", bound.get());
        Problem::with_file(&file, message, "a scenario may only tighten bounds: lower it or take it out")
    });
    let remedy = "a scenario may only tighten bounds: widen it or take it out";
    let least = platform.bounds.designation_bearings_mrad.get();
    let narrow = scenario.bounds.designation_bearings_mrad.as_ref().filter(|own_whole| own_whole.get() < least).map(
        |own_whole| {
            Problem::with_file(
                &file,
                format!("{} mrad is looser than the platform's {least} mrad", own_whole.get()),
                remedy,
            )
        },
    );
    Problems::none_or(problems.chain(narrow).collect())?;
    let in_force = scenario.bounds.applied_to(&platform.bounds);
    let (chain, most) = (uplink_ms(&in_force), in_force.to_hold_safe_ms.get());
    if chain <= most {
        return Ok(());
    }
    let message = format!(
        "after a lost uplink the lease lapses {chain} ms later (freshness, lease and control period), beyond Th = {most} ms"
    );
    let remedy = "shorten the lease, or give Th more time (docs/reference/bounds.md, The three bounds)";
    Err(Problem::with_file(&file, message, remedy).into())
}

/// Refuses ground stations for a platform in no orbit, and stations of which none sees it within the trial.
fn orbits(scenario: &Scenario, platform: &Platform) -> Result<(), Problems> {
    let stations = &scenario.conditions.station;
    if stations.is_empty() {
        return Ok(());
    }
    if let Body::Satellite(numbers) = platform.body() {
        let pass = numbers.pass();
        let until_s = pass.start_s + scenario.duration_s.get();
        let sees =
            |orbit: &Orbit| stations.iter().any(|station| !station.sees(orbit, pass.start_s, until_s).is_empty());
        if Orbit::new(&pass.elements).is_ok_and(|orbit| sees(&orbit)) {
            return Ok(());
        }
        let message = "no ground station sees the satellite within the trial";
        let remedy = "move a station, lower its `least_elevation_deg`, or make the trial longer";
        return Err(Problem::with_file(&format!("{}.toml", scenario.name.as_str()), message, remedy).into());
    }
    let message =
        format!("the scenario has ground stations, and the platform `{}` is in no orbit", platform.name.as_str());
    let remedy = "take `conditions.station` out, or set `platform = \"space\"`";
    Err(Problem::with_file(&format!("{}.toml", scenario.name.as_str()), message, remedy).into())
}

/// Reads a policy file.
///
/// # Errors
/// A mistake in it, in its place.
pub fn load_policy(path: &Path, name: &str) -> Result<Policy, Problems> {
    let file = path.display().to_string();
    parse_policy(&file, name, &read_text(path, &file)?)
}

/// Checks a policy's text by itself.
///
/// # Errors
/// A mistake in it, with `file` as its name.
pub fn parse_policy(file: &str, name: &str, text: &str) -> Result<Policy, Problems> {
    let policy: Policy = toml::from_str(text).map_err(|e| Problem::from_toml(file, text, &e))?;
    if policy.name != name {
        let message = format!("the policy is named `{}`, its file `{name}`", policy.name);
        return Err(Problem::with_file(file, message, "make name and file name the same").into());
    }
    Ok(policy)
}

/// Every shipped platform, by name.
///
/// # Errors
/// The folder cannot be read, or one of its files has a mistake.
pub fn platforms(root: &Path) -> Result<Vec<Platform>, Problems> {
    let folder = root.join("platforms");
    let unread = |e: std::io::Error| {
        Problem::with_file(&folder.display().to_string(), e.to_string(), "run from a holdsafe checkout")
    };
    let files = platform_files(root).map_err(|e| Problems::from(unread(e)))?;
    files.iter().map(|file| load_platform(file)).collect()
}

fn named(root: &Path, directory: &str, name: &Name) -> PathBuf {
    root.join(directory).join(format!("{name}.toml"))
}

fn stem(path: &Path) -> String {
    path.file_stem().and_then(|s| s.to_str()).unwrap_or_default().to_owned()
}
