//! `holdsafe completions SHELL`: a script that completes verbs and options on the tab key, made from the command line itself.

use clap_complete::Shell;
use clap_complete::generate;
use runner::failure::{Exit, Failure};
use runner::out;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The shell that reads the script.
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

pub(super) fn run(mut command: clap::Command, args: &Args) -> Result<Exit, Failure> {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    generate(args.shell, &mut command, name, &mut script);
    let script = String::from_utf8(script).map_err(Failure::internal)?;
    out::say(format_args!("{}", script.trim_end()));
    Ok(Exit::Fine)
}
