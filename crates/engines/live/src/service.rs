//! The services, so that one program can start itself again as each of them: same code, separate process.

use std::process::ExitCode;
use std::sync::Arc;

use perception::brought::Brought;
use perception::model::ModelRef;
use perception::process::detector::DETECTOR;
use perception::sight::Sight;

use super::child::Services;
use super::detector::ProcessError;

/// Runs the service called `name`; `None` for an unknown name.
pub fn main(name: &str) -> Option<ExitCode> {
    Some(match name {
        "sim" => sim::process::main(),
        "perception" => perception::process::main_with(|brought, runtime| {
            start_detector(brought, runtime).map_err(|error| error.to_string())
        }),
        "autonomy" => autonomy::process::main_with(super::guest::attend),
        "gateway" => gateway::process::main(),
        "console" => console::process::main(),
        "broker" => broker::process::main(),
        "adversary" => adversary::process::main(),
        "recorder" => link::process::main(),
        DETECTOR => perception::process::detector::main(),
        super::guest::ATTENDANT => super::guest::main(),
        "confine" => confine::inside::main(),
        "host" => sandbox::host::main(),
        "level" => sandbox::probe::main(),
        "janitor" => super::janitor::main(),
        _ => return None,
    })
}

/// Starts a custom detector in a process of this program.
fn start_detector(brought: &Brought, runtime: Option<&ModelRef>) -> Result<Arc<dyn Sight>, ProcessError> {
    let program = std::env::current_exe()?;
    super::detector::start(&Services::Own(program), brought, runtime)
}
