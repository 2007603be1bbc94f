//! The console's window, drawn without a screen. The console itself is tested in `crates/console/tests/`.

#![expect(clippy::unwrap_used, reason = "a bench that does not hold together is a failed test")]
#![expect(clippy::wildcard_enum_match_arm, reason = "tests pick out the events that they look at")]

#[expect(dead_code, reason = "the console's own tests use the rest of it")]
#[path = "../../crates/console/tests/console/bench.rs"]
mod bench;
mod glance;
mod layout;
mod looks;
mod names;
mod painted;
mod quiet;
mod reach;
mod scenes;
mod sensors;
mod snapshots;
mod window;
mod yard;
