//! Insiders: their own identities that hold valid credentials and act beyond their role.
//!
//! `teammate` holds teammate B's certificate and signing key, `broker` the command broker's, `gateway` the gateway's,
//! `operator` a stolen signing key and a way to give orders with it. They keep every rule of the protocol they speak;
//! they break only its meaning. `rogue` is a process on a host's shared memory that speaks in another's name, with that
//! one's keys or without; `thief` has a copy of another's certificate and takes that one's session at the broker.

mod broker;
mod end;
mod false_statement;
mod flaw;
mod forged;
mod forgery;
mod forwarding;
mod gateway;
mod operator;
mod recorder;
mod rogue;
mod tape;
mod teammate;
#[cfg(test)]
mod tests;
mod thief;
mod voice;

pub use broker::InsiderBroker;
pub use gateway::InsiderGateway;
pub use operator::InsiderOperator;
pub use recorder::{InsiderRecorder, RecordedEntry};
pub use rogue::Rogue;
pub use teammate::InsiderTeammate;
pub use thief::SessionThief;
