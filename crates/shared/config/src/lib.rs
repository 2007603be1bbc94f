//! Setup of a core before its first message: identity and keys, the platform's numbers, the names of its sensors, the
//! contacts of its link.
//!
//! Nothing here crosses a link or a channel; messages and the checks that they pass are `wire`'s. Numbers are read and
//! checked in `scenario`, and handed to each core by `topology`.

pub mod contact;
pub mod platform;
pub mod setup;
pub mod suite;
