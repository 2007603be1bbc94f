//! P7.

pub(crate) mod age;
pub(crate) mod picture;
pub(crate) mod sessions;
