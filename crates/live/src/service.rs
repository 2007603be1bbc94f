//! The services, so that one program can start itself again as each of them: same code, separate process.

use std::process::ExitCode;

/// Runs the service called `name`; `None` for an unknown name.
pub fn main(name: &str) -> Option<ExitCode> {
    Some(match name {
        "sim" => sim::process::main(),
        "perception" => perception::process::main(),
        "autonomy" => autonomy::process::main_with(super::guest::attend),
        "gateway" => gateway::process::main(),
        "console" => console::process::main(),
        "broker" => broker::process::main(),
        "adversary" => adversary::process::main(),
        "recorder" => link::process::main(),
        "try-detector" => perception::process::try_detector::main(),
        "confine" => confine::inside::main(),
        "host" => sandbox::host::main(),
        "level" => sandbox::probe::main(),
        "janitor" => super::janitor::main(),
        _ => return None,
    })
}
