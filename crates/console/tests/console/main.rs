//! The console from outside: feed bytes in; bytes, requests and audit events out.

#![expect(clippy::unwrap_used, reason = "a bench that does not hold together is a failed test")]
#![expect(clippy::wildcard_enum_match_arm, reason = "tests pick out the events that they look at")]

mod acts;
mod alarm_lives;
mod alarms;
mod bench;
mod display;
mod images;
mod properties;
#[cfg(feature = "process")]
mod recordings;
mod script;
mod world;
