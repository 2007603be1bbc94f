//! The level of confinement that a machine gives, found by trying.

use std::fmt;
use std::path::PathBuf;

use guest::Failure;
use serde::{Deserialize, Serialize};

use crate::launch::Helper;

/// How far guests are confined on a machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Level {
    /// Users, processes, mounts and names of its own: a guest sees no other process, writes to no file of the machine, and leaves no process.
    pub namespaces: bool,
    /// No way to a network: a loopback interface of its own, or no sockets at all.
    pub network: bool,
    /// A filter of system calls that guests have no use for.
    pub seccomp: bool,
    /// Everything that was refused, each with its reason.
    pub why: Vec<String>,
}

impl Level {
    /// The level that guests of a launcher with this helper reach on this machine; see [`crate::launcher`].
    ///
    /// # Errors
    /// The helper could not be started.
    pub fn of(helper: PathBuf, leading: Vec<String>) -> Result<Level, Failure> {
        Helper { program: helper, leading }.level()
    }

    /// True if no part was refused.
    pub fn full(&self) -> bool {
        self.namespaces && self.network && self.seccomp && self.why.is_empty()
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.full() { f.write_str("full") } else { write!(f, "partial: {}", self.why.join("; ")) }
    }
}
