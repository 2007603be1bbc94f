//! P1.

pub(crate) mod guards;
