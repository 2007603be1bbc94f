//! The console from outside: feed bytes in; bytes, requests and audit events out.

#![expect(clippy::unwrap_used, reason = "a bench that does not hold together is a failed test")]
#![expect(clippy::wildcard_enum_match_arm, reason = "tests pick out the events that they look at")]

mod acts;
mod bench;
mod display;
mod images;
#[cfg(feature = "gui")]
mod looks;
mod properties;
#[cfg(feature = "process")]
mod recordings;
#[cfg(feature = "gui")]
mod scenes;
mod script;
#[cfg(feature = "gui")]
mod sensors;
#[cfg(feature = "gui")]
mod snapshots;
#[cfg(feature = "gui")]
mod window;
mod world;
#[cfg(feature = "gui")]
mod yard;
