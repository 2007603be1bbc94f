//! Teammates, and insiders among them: holders of valid credentials who do more than their role allows.
//!
//! An insider is its own identity beside the honest units; no service knows which one it is.

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
    /// Its role.
    pub role: Role,
    /// Its start.
    pub start: Pose,
}

/// Role of a teammate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Reports its own state.
    Honest,
    /// It holds valid credentials and misuses them.
    Insider,
}
