//! A scenario: one TOML file that says what world, what attack, what evidence, and what must come of it.
//!
//! Terms: a *cell* is one variation of a scenario with its own policy and its own expected classes; a *phase* is the
//! shift that a seed gives to the times of all attacks and faults. One array per kind (`[[delay]]`, `[[replay]]`, …):
//! tagged enums would lose the position of errors.
//!
//! These are plain data. Carrying them out belongs to the twin, the live launcher and the services; `read` takes a file
//! in, `check` says what must fit together, `problem` shows an error in its file.

mod alphabet;
mod attack;
mod broker;
mod cell;
mod check;
mod check_steps;
mod curve;
mod fault;
mod finding;
mod gateway;
mod hex;
mod insider;
mod labels;
mod operator;
mod peer;
mod perturbation;
mod platform;
mod print;
mod problem;
mod read;
mod rogue;
mod scene;
mod set;
mod setup;
mod shared;
pub mod stack;
mod step;
mod stream;
mod tamper;
mod template;
mod terms;
mod timed;
mod value;
mod varies;
mod weakness;

use evidence::mission::Stage;
use evidence::trial::{Knowledge, Outcome};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use alphabet::{Alphabet, Move, Number, Range};
pub use attack::{
    BurstLoss, Content, Corrupt, Damage, Delay, Direction, Duplicate, Inject, Jitter, Loss, Reorder, Reoriginate,
    Replay,
};
pub use broker::{
    AckForgery, BrokerDelay, BrokerDrop, BrokerDuplicate, BrokerForge, BrokerInvent, BrokerReorder, BrokerReplay,
    BrokerRetain, OrderForgery,
};
pub use cell::{Cell, Under, Variation};
pub use curve::Curve;
pub use fault::{Ending, Fault, FaultKind, Kill, Magnitude, Process, Sensor};
pub use gateway::{FeedDelay, FeedForge, FeedForgery, FeedReplay, FeedWithhold, IntentDrop};
pub use insider::{Flaw, Forwarding, Malformed, Role, Teammate, ThirdUnit, Unit};
pub use labels::{Labels, load_labels, parse_labels};
pub use operator::{DisplayedState, Operator, Step, Values};
pub use peer::{Falsehood, ModeConfusion, Motion, Product, SessionReplay};
pub use perturbation::Perturbation;
pub use platform::{Bound, BoundsTable, Length, Platform, Tightened};
pub use print::{Heat, Print};
pub use problem::{Problem, ProblemRow, Problems, closest};
pub use read::{MAX_FILE_BYTES, load, load_platform, parse, parse_platform, parse_scene};
pub use rogue::{Mandate, Order, OrderId, OrderTrack, Rogue, Takeover, Way};
pub use scene::{Ground, Object, Point, Pose, Scene, Weather};
pub use set::Settings;
pub use setup::{FRAMES, Setup, demo, find_root, load_policy, parse_policy, platforms, rendered, shipped};
pub use shared::{Alter, Channel, Every, Forge, Holder, Republish, Saying};
pub use step::{Timing, Trigger, When};
pub use stream::{Cut, HalfClose, Reset, Stall, StreamCorrupt, StreamDelay, Throttle};
pub use tamper::{Tamper, Tampered};
pub use template::{schema, template};
pub use terms::{Class, Evidence, Interface, Requirement, Stride};
pub use timed::Windowed;
pub use value::{
    Count, Extent, Label, List, Located, Millis, Name, Radians, Real, RelativePath, Seconds, Share, TechniqueId, Text,
    ThreatId, Whole,
};
pub use varies::{Conditions, Models, Varies};
pub use weakness::{Misset, Weakness, Weaknesses};

/// The version of the scenario format that this build reads.
pub const SCHEMA_VERSION: i64 = 1;

/// A whole scenario, each value within its range, everything that must fit together checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of this format, 1.
    pub schema_version: Whole<SCHEMA_VERSION, SCHEMA_VERSION>,
    /// Name, equal to the file's name without `.toml`.
    pub name: Located<Name>,
    /// One line for tables.
    pub title: Text<120>,
    /// What is done to whom, and what must then happen.
    pub description: Text<4000>,
    /// Rows of the threat catalogue.
    pub threats: Located<List<Located<ThreatId>, 16>>,
    /// Which of STRIDE.
    pub stride: List<Stride, 6>,
    /// ATT&CK and ATLAS techniques.
    #[serde(default)]
    pub techniques: List<TechniqueId, 24>,
    /// The boundary that is attacked.
    pub interface: Interface,
    /// Where the evidence comes from; n of different kinds is never added.
    pub evidence: Evidence,
    /// What the scenario puts to the test.
    pub requirement: Requirement,
    /// How much the adversary knows while the run is on; where nothing is said, what the kinds of attack need.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knowledge: Option<Located<Knowledge>>,
    /// How far the mission has to come before the attack for a trial to show anything; where nothing is said, as far as the
    /// operator's steps before the attack lead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mission: Option<Located<Stage>>,
    /// The outcome classes that are expected, committed before the run.
    pub expected: Located<List<Outcome, 9>>,
    /// Policy by name, a file of `policies/`.
    #[serde(default = "default_policy")]
    pub policy: Located<Name>,
    /// Platform by name, a file of `platforms/`.
    #[serde(default = "default_platform")]
    pub platform: Located<Name>,
    /// Length of a trial; of no account on the real stacks, which run until nothing more comes.
    pub duration_s: Located<Real<100, 3_600_000>>,
    /// Bounds of the platform that this scenario tightens.
    #[serde(default)]
    pub bounds: Tightened,
    /// What a seed varies.
    #[serde(default)]
    pub varies: Varies,
    /// A file with the scene, below the directory of the scenario; instead of `[scene]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_file: Option<Located<RelativePath>>,
    /// The world. After loading it is there, but for what runs on the real stacks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
    /// What the operator does.
    #[serde(default)]
    pub operator: Operator,
    /// Teammates beside the platform under test.
    #[serde(default)]
    pub unit: List<Unit, 3>,

    /// The telemetry link's own weather.
    #[serde(default)]
    pub conditions: Conditions,

    /// How far the models of sensors and plant are off.
    #[serde(default)]
    pub models: Models,

    /// Sensor faults.
    #[serde(default)]
    pub fault: List<Fault, 32>,
    /// Processes killed or hung.
    #[serde(default)]
    pub kill: List<Kill, 16>,

    /// Telemetry datagrams held back.
    #[serde(default)]
    pub delay: List<Delay, 16>,
    /// Telemetry datagrams held back by random times.
    #[serde(default)]
    pub jitter: List<Jitter, 16>,
    /// Telemetry datagrams lost, each by itself.
    #[serde(default)]
    pub loss: List<Loss, 16>,
    /// Telemetry datagrams lost in bursts.
    #[serde(default)]
    pub burst_loss: List<BurstLoss, 16>,
    /// Telemetry datagrams sent more than once.
    #[serde(default)]
    pub duplicate: List<Duplicate, 16>,
    /// Telemetry datagrams that overtake each other.
    #[serde(default)]
    pub reorder: List<Reorder, 16>,
    /// Captured telemetry datagrams sent again.
    #[serde(default)]
    pub replay: List<Replay, 16>,
    /// Telemetry datagrams changed on the way.
    #[serde(default)]
    pub corrupt: List<Corrupt, 16>,
    /// Telemetry sent on from the relay's own socket, without a credential.
    #[serde(default)]
    pub reoriginate: List<Reoriginate, 16>,
    /// Datagrams of the relay's own making.
    #[serde(default)]
    pub inject: List<Inject, 16>,

    /// Command-plane bytes held back.
    #[serde(default)]
    pub stream_delay: List<StreamDelay, 16>,
    /// Command-plane bytes kept until the end of the window.
    #[serde(default)]
    pub stall: List<Stall, 16>,
    /// Command-plane bytes let through at a rate.
    #[serde(default)]
    pub throttle: List<Throttle, 16>,
    /// One direction of a command-plane connection ended.
    #[serde(default)]
    pub half_close: List<HalfClose, 16>,
    /// Command-plane connections reset.
    #[serde(default)]
    pub reset: List<Reset, 16>,
    /// Command-plane connections cut and kept from coming back.
    #[serde(default)]
    pub cut: List<Cut, 16>,
    /// Command-plane bytes changed.
    #[serde(default)]
    pub stream_corrupt: List<StreamCorrupt, 16>,

    /// An admitted teammate forwards a third unit's telemetry.
    #[serde(default)]
    pub teammate: List<Teammate, 4>,
    /// An admitted teammate sends records that are authenticated and broken.
    #[serde(default)]
    pub malformed: List<Malformed, 16>,
    /// A rogue station gives orders under a key that is not its own.
    #[serde(default)]
    pub rogue: List<Rogue, 16>,
    /// A thief takes somebody's session at the broker.
    #[serde(default)]
    pub takeover: List<Takeover, 8>,
    /// Identities that are admitted for a time only.
    #[serde(default)]
    pub mandate: List<Mandate, 8>,

    /// On the real stacks: somebody with a certificate that is no good.
    #[serde(default)]
    pub impostor: List<stack::Impostor, 64>,
    /// On the real stacks: somebody who offers less than the pinned protocol.
    #[serde(default)]
    pub downgrade: List<stack::Downgrade, 64>,
    /// On the real stacks: somebody without a key in the path of an association.
    #[serde(default)]
    pub handle: List<stack::Handle, 64>,
    /// On the real stacks: strangers by the thousand.
    #[serde(default)]
    pub storm: List<stack::Storm, 64>,
    /// On the real stacks: somebody who only looks.
    #[serde(default)]
    pub observe: List<stack::Observe, 64>,
    /// Publications that a hostile broker does not pass on.
    #[serde(default)]
    pub broker_drop: List<BrokerDrop, 16>,
    /// Publications that it passes on later.
    #[serde(default)]
    pub broker_delay: List<BrokerDelay, 16>,
    /// Publications that it lets others overtake.
    #[serde(default)]
    pub broker_reorder: List<BrokerReorder, 16>,
    /// Publications that it delivers more than once.
    #[serde(default)]
    pub broker_duplicate: List<BrokerDuplicate, 16>,
    /// Captured publications that it delivers again.
    #[serde(default)]
    pub broker_replay: List<BrokerReplay, 16>,
    /// Publications that it delivers again to whoever connects.
    #[serde(default)]
    pub broker_retain: List<BrokerRetain, 16>,
    /// Orders of its own making.
    #[serde(default)]
    pub broker_invent: List<BrokerInvent, 16>,
    /// Acknowledgements of its own making.
    #[serde(default)]
    pub broker_forge: List<BrokerForge, 16>,
    /// A process on a host's shared memory makes messages in another's name.
    #[serde(default)]
    pub forge: List<Forge, 16>,
    /// A process on a host's shared memory publishes recorded messages again.
    #[serde(default)]
    pub republish: List<Republish, 16>,
    /// An insider in perception's place makes up where vehicles stand.
    #[serde(default)]
    pub alter: List<Alter, 4>,
    /// An admitted teammate sends what it said in an earlier session again.
    #[serde(default)]
    pub session_replay: List<SessionReplay, 1>,
    /// An admitted teammate claims a place or a motion that is not its own.
    #[serde(default)]
    pub falsehood: List<Falsehood, 16>,
    /// An admitted teammate's reports are no live product, or in another time base.
    #[serde(default)]
    pub mode_confusion: List<ModeConfusion, 16>,

    /// Reports that a gateway insider keeps from the display.
    #[serde(default)]
    pub feed_withhold: List<FeedWithhold, 16>,
    /// Reports that it passes on later.
    #[serde(default)]
    pub feed_delay: List<FeedDelay, 16>,
    /// Reports that it makes say something else.
    #[serde(default)]
    pub feed_forge: List<FeedForge, 16>,
    /// An old report that it says is new.
    #[serde(default)]
    pub feed_replay: List<FeedReplay, 16>,
    /// What the operator asks for, kept from the gateway.
    #[serde(default)]
    pub intent_drop: List<IntentDrop, 16>,

    /// The recorder's insider changes the recording before it is judged.
    #[serde(default)]
    pub tamper: List<Tamper, 16>,

    /// Variations, each with its own expected classes; without any the scenario is its only cell.
    #[serde(default)]
    pub cell: List<Located<Cell>, 64>,
    /// Expected classes under another policy than the scenario's own.
    #[serde(default)]
    pub under: List<Under, 16>,
    /// A value that `holdsafe campaign curve` takes through a range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<Curve>,
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

fn default_policy() -> Located<Name> {
    Located::nowhere(Name::constant("default"))
}

fn default_platform() -> Located<Name> {
    Located::nowhere(Name::constant("ground"))
}

#[cfg(test)]
mod step_tests;
#[cfg(test)]
mod tests;
