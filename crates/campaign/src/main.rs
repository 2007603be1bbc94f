//! The `holdsafe` command; what it does is in `campaign::command`. It can also start itself again as each service.

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args();
    if let (Some("service"), Some(name)) = (arguments.nth(1).as_deref(), arguments.next()) {
        return campaign::live::service::main(&name).unwrap_or_else(|| {
            eprintln!("holdsafe: no service `{name}`");
            ExitCode::from(2)
        });
    }
    ExitCode::from(campaign::command::main(std::env::args_os()).code())
}
