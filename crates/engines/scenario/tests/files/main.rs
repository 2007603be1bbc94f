//! Scenario and platform files as their readers meet them.

#![expect(clippy::unwrap_used, reason = "a test says what it expects and no more")]

mod platform;
mod scenarios;
mod steps;
