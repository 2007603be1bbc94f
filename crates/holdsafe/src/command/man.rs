//! `holdsafe man [VERB…]`: the manual page of the program or of a verb, made from the command line itself; `man -l -` shows it.

use clap::Command;
use clap_mangen::Man;
use runner::failure::{Exit, Failure};
use runner::out;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The verb and its part, such as `campaign run`; the program where none is named.
    #[arg(value_name = "VERB")]
    verb: Vec<String>,
}

pub(super) fn run(mut command: Command, args: &Args) -> Result<Exit, Failure> {
    // Gives each verb its full name and the options of every command.
    command.build();
    let mut current = &command;
    for word in &args.verb {
        current = current.find_subcommand(word).ok_or_else(|| {
            let shown = current.get_subcommands().filter(|part| !part.is_hide_set() && part.get_name() != "help");
            let known: Vec<&str> = shown.map(Command::get_name).collect();
            let known_names = if known.is_empty() {
                "it has no parts".to_owned()
            } else {
                format!("there are: {}", known.join(", "))
            };
            Failure::new(Exit::Usage, format!("no page for `{word}` of `{}`; {known_names}", current.get_name()))
        })?;
    }
    let mut page = Vec::new();
    Man::new(current.clone()).render(&mut page)?;
    let page = String::from_utf8(page).map_err(Failure::internal)?;
    out::say(format_args!("{}", page.trim_end()));
    Ok(Exit::Fine)
}
