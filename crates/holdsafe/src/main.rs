//! The `holdsafe` command; what it does is in `holdsafe::command`. It can also start itself again as each service.

use std::ffi::OsStr;
use std::process::ExitCode;

fn main() -> ExitCode {
    // An argument need not be UTF-8: the command line says so of its own arguments.
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().as_deref() == Some(OsStr::new("service"))
        && let Some(name) = arguments.next()
    {
        let name = name.to_string_lossy();
        return live::service::main(&name).unwrap_or_else(|| {
            link::note!("holdsafe: no service `{name}`");
            ExitCode::from(2)
        });
    }
    ExitCode::from(holdsafe::command::main(std::env::args_os()).code())
}
