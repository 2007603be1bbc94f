//! Attacks on a MAVLink 2 link between two ends of other authors, and the classes that the published signing rules require.
//!
//! A pure core: bytes and a seed in, bytes out. `frame` reads and writes the framing, `signature` signs, `message` makes the payloads
//! of the attacks, `attack` turns a captured message into the attacker's. `expected` is the table that was stated before the first
//! run, `trial` runs an attack between a [`end::Sender`] and a [`end::Receiver`] in lock-step, `class` judges the counts,
//! `finding` knows the causes of findings.
//! `library` is the one receiver that needs no process: the parser of the public `mavlink` crate.
//!
//! Sockets belong to `link`, processes and the report to `lab`.

pub mod attack;
pub mod class;
pub mod end;
pub mod expected;
pub mod finding;
pub mod frame;
pub mod library;
pub mod message;
pub mod signature;
pub mod trial;
