//! The console from outside: feed bytes in; bytes, requests and audit events out.

#![expect(clippy::unwrap_used, reason = "a bench that does not hold together is a failed test")]
#![expect(clippy::wildcard_enum_match_arm, reason = "tests pick out the events that they look at")]

mod acts;
mod alarm_lives;
mod alarms;
#[cfg_attr(not(feature = "process"), expect(dead_code, reason = "the tests of window and page use the rest of it"))]
mod bench;
#[cfg(feature = "process")]
mod browser;
mod display;
mod images;
#[cfg(feature = "process")]
mod page;
mod properties;
#[cfg(feature = "process")]
mod recordings;
#[cfg(feature = "process")]
#[expect(dead_code, reason = "the window's tests use the rest of it")]
#[path = "../../../../tests/window/scenes.rs"]
mod scenes;
mod script;
mod world;
#[cfg(feature = "process")]
#[path = "../../../../tests/window/yard.rs"]
mod yard;
