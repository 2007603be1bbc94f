//! Confinement of a process by itself: it keeps the rights that a table gives its service, and gives up all others permanently.
//!
//! The table is `services.toml`; [`enter()`] carries out one row of it, in layers that hold one another up. [`host`] makes the namespaces of a
//! modelled host, with a network, shared memory and temporary files of its own; `view` leaves a process no files but those of its row;
//! `ruleset` (Landlock) says the same again for machines without namespaces, and refuses signals and tracing; `calls` (seccomp) leaves the
//! system calls that services make; `limits` bounds memory, files and descriptors. Does not know a message, a run or a guest.

pub mod calls;
mod enter;
mod error;
pub mod host;
mod level;
pub mod limits;
pub mod namespaces;
pub mod numbering;
pub mod probe;
mod ruleset;
pub mod table;
mod view;
pub mod wire;

pub use enter::{Error, Rights, enter};
pub use error::StepError;
pub use level::Level;
