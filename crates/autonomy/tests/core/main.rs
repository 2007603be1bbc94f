//! The whole core, driven through its mouth: bytes in, bytes out, on a virtual clock.

#![expect(clippy::unwrap_used, clippy::wildcard_enum_match_arm, reason = "a test says what it expects and no more")]

mod bench;
mod commands;
mod modes;
mod teammates;
