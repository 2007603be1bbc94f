//! Teammates, and insiders among them: holders of valid credentials who do what their role does not allow.
//!
//! An insider is an identity of its own beside the honest units; no service knows which one it is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::scene::Pose;
use super::value::{Located, Name};

/// A teammate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Unit {
    /// `unit-b`, `unit-c` or `unit-d`; `unit-a` is the platform under test.
    pub name: Located<Name>,
    /// What it is.
    pub role: Role,
    /// Where it starts.
    pub start: Pose,
}

/// What a teammate is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// It reports itself.
    Honest,
    /// It holds valid credentials and misuses them.
    Insider,
}
