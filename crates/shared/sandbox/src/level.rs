//! The level of confinement that a process has reached.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Confinement of one process, layer by layer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Namespaces of its host: no network but the host's own, no shared memory of other hosts, no file outside of its row.
    pub namespaces: bool,
    /// Landlock: files, TCP ports, signals.
    pub landlock: bool,
    /// A filter that allows only the system calls of its row.
    pub calls: bool,
    /// Limits by number.
    pub limits: bool,
    /// Everything that is not held, each with its reason.
    #[serde(default)]
    pub why: Vec<String>,
}

impl Level {
    /// A process that gave up no right, and why.
    pub fn none(reason: impl Into<String>) -> Self {
        Self { why: vec![reason.into()], ..Self::default() }
    }

    /// True if every layer is complete.
    pub fn full(&self) -> bool {
        self.namespaces && self.landlock && self.calls && self.limits && self.why.is_empty()
    }

    /// `full`, `partial` or `none`.
    pub fn name(&self) -> &'static str {
        match (self.full(), self.namespaces || self.landlock || self.calls || self.limits) {
            (true, _) => "full",
            (false, true) => "partial",
            (false, false) => "none",
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        if self.why.is_empty() { Ok(()) } else { write!(f, " ({})", self.why.join("; ")) }
    }
}
