//! The services as they are, for runs in which one of them is hostile.

use std::process::ExitCode;

fn main() -> ExitCode {
    let name = std::env::args().nth(1).unwrap_or_default();
    live::service::main(&name).unwrap_or(ExitCode::from(2))
}
