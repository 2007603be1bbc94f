//! The `holdsafe` program, which can also start itself again as each service. Its verbs are in `holdsafe::command`.

use std::process::ExitCode;

fn main() -> ExitCode {
    runner::start::program("holdsafe", holdsafe::command::main)
}
