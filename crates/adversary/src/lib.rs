//! The adversary: relays that sit in a path without a key, and insiders who hold valid credentials and misuse them.
//!
//! Each role is a core with the same verbs as any service (`wire::core::Core`) and with no more powers than its place
//! gives it: a relay sees ciphertext, an insider holds its own credential. Its actions are a [`plan`], fixed before the
//! run; every act is journaled with the hash of the bytes concerned, as one half of a receipt (the other half is the
//! target's observation). It attacks only the twin: a core names a side or a session, never an address.
//!
//! The other services' internals and keys are unknown here. Judging the effect of an attack is left to the oracle.

pub mod insider;
mod opening;
mod outbox;
pub mod plan;
pub mod process;
pub mod relay;
mod role;
mod schedule;
#[cfg(test)]
mod testing;

pub use plan::{AdversaryConfig, PlanError};
pub use role::{Adversary, AdversaryError};
