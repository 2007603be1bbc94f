//! Insiders: identities of their own that hold valid credentials and do what their role does not allow.
//!
//! `teammate` holds teammate B's certificate and signing key, `broker` the command broker's, `gateway` the gateway's. All keep every rule of the
//! protocol they speak; what they break is the meaning.

mod broker;
mod end;
mod flaw;
mod forgery;
mod gateway;
mod teammate;
#[cfg(test)]
mod tests;
mod voice;

pub use broker::InsiderBroker;
pub use gateway::InsiderGateway;
pub use teammate::InsiderTeammate;
