//! The `holdsafe` program: arguments, exit codes, one verb a file. `main` starts it, or one of the services of a live run.
//!
//! `runner` has the shared part of the verbs. The measurements of the authors are their own program, `lab`.

pub mod command;
