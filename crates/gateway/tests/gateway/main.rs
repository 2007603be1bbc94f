//! Behaviour of the gateway, seen from outside: bytes in, bytes and audit events out.

#![expect(clippy::unwrap_used, reason = "a bench that does not hold together is a failed test")]
#![expect(clippy::wildcard_enum_match_arm, reason = "tests pick out the events that they look at")]

mod bench;
mod boundary;
mod commands;
mod run;
mod stations;
mod supervision;
