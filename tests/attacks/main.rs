//! Every shipped scenario in the twin, named after its attack, against the classes it committed to beforehand.
//!
//! A few seeds each: rates with bounds are `holdsafe run`'s business.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod broker;
mod commands;
mod compounds;
mod controls;
mod decoys;
mod escapes;
mod evidence;
mod floods;
mod handshake;
mod host;
mod link;
mod missions;
mod models;
mod orders;
mod peers;
mod processes;
mod sensing;
mod stored;
mod timebase;
mod timing;
mod views;

const SEEDS: std::ops::Range<u64> = 1..4;
