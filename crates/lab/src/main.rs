//! The `lab` program, which can also start itself again as each service of a live run. Its verbs are in `lab::command`.

use std::process::ExitCode;

fn main() -> ExitCode {
    runner::start::program("lab", lab::command::main)
}
