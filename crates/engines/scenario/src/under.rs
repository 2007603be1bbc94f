//! Expected classes under another policy, or on another platform.

use evidence::trial::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{List, Located, Name};

/// Expected classes under another policy or on another platform than the scenario's own, or both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Under {
    /// The policy; the scenario's own where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub policy: Option<Located<Name>>,
    /// The platform; the scenario's own where absent. Classes without a policy hold for every cell that names none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub platform: Option<Located<Name>>,
    /// Classes that are expected there; none where the scenario has no meaning on the platform.
    pub expected: Located<List<Outcome, 9>>,
}
