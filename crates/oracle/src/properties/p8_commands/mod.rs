//! P8.

pub(crate) mod effect;
