//! Something that does not fit in a scenario, at its place in the file.

use std::ops::Range;

use super::Located;

/// Something that does not fit.
pub(super) struct Finding {
    /// Where.
    pub(super) bytes: Range<usize>,
    /// What.
    pub(super) message: String,
    /// What to do.
    pub(super) remedy: String,
}

/// That this does not fit at the place of a value.
pub(super) fn finding<T>(at: &Located<T>, message: impl Into<String>, remedy: impl Into<String>) -> Finding {
    Finding { bytes: at.bytes(), message: message.into(), remedy: remedy.into() }
}
