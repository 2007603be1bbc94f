//! Insiders: identities of their own that hold valid credentials and do what their role does not allow.
//!
//! `teammate` holds teammate B's certificate and signing key, `command` holds access to the command plane. Both keep
//! every rule of the protocol they speak; what they break is the meaning. `rogue` is a process on a host's shared memory
//! that speaks in another's name, with that one's keys or without.

mod command;
mod end;
mod flaw;
mod forged;
mod recorder;
mod rogue;
mod teammate;
#[cfg(test)]
mod tests;
mod voice;

pub use command::InsiderCommand;
pub use recorder::{InsiderRecorder, Kept};
pub use rogue::Rogue;
pub use teammate::InsiderTeammate;
