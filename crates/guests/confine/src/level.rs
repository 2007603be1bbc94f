//! The level of confinement that a machine gives.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Confinement of guests on a machine, part by part.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Level {
    /// Its own users, processes, mounts and names: a guest sees no other process, writes to no file of the machine, and leaves no process.
    pub namespaces: bool,
    /// No way to a network: its own loopback interface, or no sockets at all.
    pub network: bool,
    /// A filter of system calls that guests have no use for.
    pub seccomp: bool,
    /// Parts that the machine refused, each with the reason.
    pub why: Vec<String>,
}

impl Level {
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
