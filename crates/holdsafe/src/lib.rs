//! The `holdsafe` program: its arguments, its exit codes, one verb a file. `main` only starts it, or one of the services of a live run.
//!
//! Running, judging and telling are other crates' business: `topology`, `twin`, `live` and `stacks` run a trial, `oracle` judges it, `results` and
//! `explain` tell of it, `search` looks for attacks. The measurements of the authors are a program of their own, `lab`.

pub mod command;
