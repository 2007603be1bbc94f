//! How long operators and teammates are admitted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{Located, Name, Seconds};

/// An identity is admitted for a time only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mandate {
    /// Who: an operator or a teammate.
    pub who: Located<Name>,
    /// Until when, on the clock of whoever judges it, from its start.
    pub until_s: Seconds,
}
