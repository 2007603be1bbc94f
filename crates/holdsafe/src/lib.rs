//! The `holdsafe` program: arguments, exit codes, one verb a file. `main` starts it, or one of the services of a live run.
//!
//! `runner` has the shared part of the verbs, `lab` those of `bench`.

pub mod command;
