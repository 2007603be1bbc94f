//! Validity of operators and teammates: the time for which they are admitted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{Located, Name, Seconds};

/// An identity is admitted for a time only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mandate {
    /// The identity: an operator or a teammate.
    pub who: Located<Name>,
    /// End of the admission, on the clock of the service that judges it, from its start.
    pub until_s: Seconds,
}
