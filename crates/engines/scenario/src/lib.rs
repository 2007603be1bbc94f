//! A scenario: one TOML file with the world, the attack, the kind of evidence, and the expected outcomes.
//!
//! Terms: a *cell* is one variation of a scenario with its own policy and its own expected classes; a *phase* is the
//! shift that a seed gives to the times of all attacks and faults. One array per kind (`[[delay]]`, `[[replay]]`, …):
//! tagged enums would lose the position of errors. Each kind of attack is a file of `attack`.
//!
//! These are plain data. Carrying them out belongs to the twin, the live launcher and the services; `read` takes a file in,
//! `check` holds its parts against each other, `problem` shows an error in its file.

mod accepted;
mod attack;
mod attack_space;
mod cell;
mod check;
mod check_steps;
mod curve;
mod extend;
mod fault;
mod file;
mod finding;
mod footprint;
mod hex;
mod in_world;
mod labels;
mod mandate;
mod operator;
mod perturbation;
mod platform;
mod print;
mod problem;
mod read;
mod scene;
mod set;
mod setup;
mod shared;
mod shipped;
pub mod stack;
mod step;
mod tamper;
mod template;
mod terms;
mod timed;
mod under;
mod unit;
mod value;
mod varies;
mod weakness;
pub mod world;

use evidence::mission::Stage;
use evidence::trial::{Knowledge, Outcome};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use accepted::Accepted;
pub use adversary::plan::{Direction, Form};
pub use attack::forge::Saying;
pub use attack::inject::Content;
pub use attack::rogue::Way;
pub use attack::teammate::ThirdUnit;
pub use attack::{Act, Attack, Deceit, Injection};
pub use attack_space::{AttackSpace, Move, Number, Range};
pub use cell::{Cell, Variation};
pub use curve::Curve;
pub use fault::{Ending, Fault, Kill, Magnitude, Process};
pub use file::MAX_FILE_BYTES;
pub use in_world::{Drawn, Homebound};
pub use labels::{Labels, load_labels, parse_labels};
pub use mandate::Mandate;
pub use operator::{Operator, Step, Values};
pub use perturbation::Perturbation;
pub use platform::{
    AloftTable, Angle, Bound, BoundsTable, CameraTable, FixedWingTable, GuardsTable, Length, LidarTable,
    MultirotorTable, Platform, SafeAction, SafeTable, SatelliteTable, Small, Tightened, VehicleTable, platform_schema,
    platform_template,
};
pub use print::{Heat, Print};
pub use problem::{Problem, ProblemRow, Problems, closest};
pub use read::{load, load_platform, load_with, parse, parse_platform, parse_scene};
pub use scene::{Ground, Object, Point, Pose, Scene, Weather, Wind};
pub use set::{Settings, SettingsError};
pub use setup::{Confinement, FRAMES, Hosts, Setup, load_policy, parse_policy, platforms};
pub use shared::{Every, Holder, on_control};
pub use shipped::{demo, find, find_root, honest, platform_files, rendered, shipped};
pub use step::{Timing, Trigger, When};
pub use tamper::Tamper;
pub use template::{schema, template};
pub use terms::{Evidence, Interface, Requirement, Stride};
pub use timed::Windowed;
pub use under::Under;
pub use unit::{Role, Unit};
pub use value::{
    Count, Extent, Label, List, Located, Millis, Name, Radians, Real, RelativePath, Seconds, Share, TechniqueId, Text,
    ThreatId, Whole,
};
pub use varies::{Conditions, MAX_STATIONS, Models, Station, Varies};
pub use weakness::{Misset, Weakness, Weaknesses};

/// The version of the scenario format that this build reads.
pub const SCHEMA_VERSION: i64 = 1;

attack::with_attacks! {
    /// A whole scenario, each value within its range, everything that must fit together checked.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    pub struct Scenario {
        /// Version of this format, 1.
        pub schema_version: Whole<SCHEMA_VERSION, SCHEMA_VERSION>,
        /// Name, equal to the file's name without `.toml`.
        pub name: Located<Name>,
        /// Another scenario, by name, from which keys are taken that are left out here: all but those that state the subject of a
        /// scenario, from `title` to `expected`, and its cells. It is a file of the same folder or a shipped one. After loading
        /// this key is gone, and the keys that it gave are there.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub extends: Option<Located<Name>>,
        /// One line for tables.
        pub title: Text<120>,
        /// The attack, its target, and the reaction that must follow.
        pub description: Text<4000>,
        /// Rows of the threat catalogue.
        pub threats: Located<List<Located<ThreatId>, 16>>,
        /// Categories of STRIDE.
        pub stride: List<Stride, 6>,
        /// ATT&CK and ATLAS techniques.
        #[serde(default)]
        pub techniques: List<TechniqueId, 24>,
        /// The boundary that is attacked.
        pub interface: Interface,
        /// Source of the evidence; n of different kinds is never added.
        pub evidence: Evidence,
        /// The requirement that is under test.
        pub requirement: Requirement,
        /// Knowledge of the adversary while the run is on; by default, the level that the kinds of attack need.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub knowledge: Option<Located<Knowledge>>,
        /// Stage that the mission has to reach before the attack for a trial to show anything; by default, the one to which the
        /// operator's steps before the attack lead.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub mission: Option<Located<Stage>>,
        /// Part that it takes in drawn worlds (`--world`).
        #[serde(default, skip_serializing_if = "Drawn::is_any_time")]
        pub in_worlds: Drawn,
        /// The outcome classes that are expected, committed before the run.
        pub expected: Located<List<Outcome, 9>>,
        /// Other classes that are accepted below a stated rate.
        #[serde(default)]
        pub accepted: List<Accepted, 4>,
        /// For an honest fault: the shipped attacks that look like it, by name (`holdsafe evaluate --worlds N --twins`).
        #[serde(default, skip_serializing_if = "is_empty")]
        pub twin_of: List<Located<Name>, 8>,
        /// Policy by name, a file of `policies/`.
        #[serde(default = "default_policy")]
        pub policy: Located<Name>,
        /// Platform by name, a file of `platforms/`.
        #[serde(default = "default_platform")]
        pub platform: Located<Name>,
        /// Length of a trial; of no account on the real stacks, which run until no more messages come.
        pub duration_s: Located<Real<100, 7_200_000>>,
        /// Bounds of the platform that this scenario tightens.
        #[serde(default)]
        pub bounds: Tightened,
        /// Quantities that a seed varies.
        #[serde(default)]
        pub varies: Varies,
        /// A file with the scene, below the directory of the scenario; instead of `[scene]`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub scene_file: Option<Located<RelativePath>>,
        /// The world. After loading it is there, but for scenarios on the real stacks.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub scene: Option<Scene>,
        /// The operator's script.
        #[serde(default)]
        pub operator: Operator,
        /// Teammates beside the platform under test.
        #[serde(default)]
        pub unit: List<Unit, 3>,

        /// The telemetry link's own weather.
        #[serde(default)]
        pub conditions: Conditions,

    /// Motion of the air; it moves bodies that fly.
    #[serde(default)]
    pub wind: Wind,
        /// Errors of the models of sensors and plant.
        #[serde(default)]
        pub models: Models,

        /// Sensor faults.
        #[serde(default)]
        pub fault: List<Fault, 32>,
        /// Processes killed or hung.
        #[serde(default)]
        pub kill: List<Kill, 16>,

        /// Identities that are admitted for a time only.
        #[serde(default)]
        pub mandate: List<Mandate, 8>,

        /// On the real stacks: an impostor with a certificate that is no good.
        #[serde(default)]
        pub impostor: List<stack::Impostor, 64>,
        /// On the real stacks: an adversary that offers less than the pinned protocol.
        #[serde(default)]
        pub downgrade: List<stack::Downgrade, 64>,
        /// On the real stacks: an adversary without a key in the path of an association.
        #[serde(default)]
        pub handle: List<stack::Handle, 64>,
        /// On the real stacks: unknown peers by the thousand.
        #[serde(default)]
        pub storm: List<stack::Storm, 64>,
        /// On the real stacks: a passive observer.
        #[serde(default)]
        pub observe: List<stack::Observe, 64>,

        /// The recorder's insider changes the recording before it is judged.
        #[serde(default)]
        pub tamper: List<Tamper, 16>,

        /// Variations, each with its own expected classes; without any the scenario is its only cell.
        #[serde(default)]
        pub cell: List<Located<Cell>, 64>,
        /// Expected classes under another policy or on another platform than the scenario's own.
        #[serde(default)]
        pub under: List<Under, 16>,
        /// A value that `holdsafe campaign curve` takes through a range.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub curve: Option<Curve>,
    }
}

impl Scenario {
    /// The scene; `read` refuses a scenario without one, but for those on the real stacks, which have no platform.
    pub fn scene(&self) -> &Scene {
        self.scene.as_ref().expect("invariant: a loaded scenario has its scene")
    }

    /// Everything with a time on the trial's clock.
    pub fn windows(&self) -> Vec<&dyn Windowed> {
        check::windows(self)
    }
}

fn is_empty<T, const N: usize>(list: &List<T, N>) -> bool {
    list.is_empty()
}

fn default_policy() -> Located<Name> {
    Located::nowhere(Name::constant("default"))
}

fn default_platform() -> Located<Name> {
    Located::nowhere(Name::constant("ground"))
}
