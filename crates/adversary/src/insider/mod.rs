//! Insiders: identities of their own that hold valid credentials and do what their role does not allow.
//!
//! `teammate` holds teammate B's certificate and signing key, `command` holds access to the command plane, `operator`
//! somebody's signing key and a way to give orders with it. All keep every rule of the protocol they speak; what they
//! break is the meaning.

mod command;
mod end;
mod flaw;
mod operator;
mod teammate;
#[cfg(test)]
mod tests;
mod voice;

pub use command::InsiderCommand;
pub use operator::InsiderOperator;
pub use teammate::InsiderTeammate;
