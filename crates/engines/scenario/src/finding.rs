//! A mistake in a scenario, at its place in the file.

use std::ops::Range;

use wire::id::NodeId;

use super::{Located, Name};

/// A mistake in a scenario.
pub struct Finding {
    /// Its place.
    pub(super) bytes: Range<usize>,
    /// The message.
    pub(super) message: String,
    /// The remedy.
    pub(super) remedy: String,
}

/// A mistake at the place of a value.
pub(super) fn finding<T>(located: &Located<T>, message: impl Into<String>, remedy: impl Into<String>) -> Finding {
    Finding { bytes: located.bytes(), message: message.into(), remedy: remedy.into() }
}

/// A mistake where a name is no identity's.
pub(super) fn unknown(name: &Located<Name>) -> Option<Finding> {
    let remedy = "name one of the closed set, such as `operator-2`";
    NodeId::from_name(name.as_str()).is_none().then(|| finding(name, "no such identity", remedy))
}
