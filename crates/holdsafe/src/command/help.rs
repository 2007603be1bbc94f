//! The top-level `--help`: the verbs grouped by their users, on one screen.

use clap::Command;

/// Groups of users and their verbs.
const GROUPS: [(&str, &[&str]); 4] = [
    ("To see what it does", &["tour", "run", "watch", "evaluate", "doctor"]),
    ("For researchers", &["campaign", "search", "estimate", "assess", "emit"]),
    ("For reviewers", &["matrix", "ablate", "inspect", "report"]),
    ("For authors of scenarios and guests", &["scenario", "guest"]),
];
/// Columns that a verb's name takes.
const NAME: usize = 10;

/// The command line with its verbs in groups in place of one list.
pub(super) fn grouped(command: Command) -> Command {
    let groups: String = GROUPS.iter().map(|(title, verbs)| group(&command, title, verbs)).collect();
    let template = format!(
        "{{about}}\n\n{{usage-heading}} {{usage}}\n{groups}\nOptions of every command:\n{{options}}{{after-help}}"
    );
    command.help_template(template)
}

fn group(command: &Command, title: &str, verbs: &[&str]) -> String {
    let description = |verb: &str| {
        command.find_subcommand(verb).and_then(|subcommand| subcommand.get_about()).map(ToString::to_string)
    };
    let line = |verb: &&str| format!("  {verb:NAME$}{}\n", description(verb).unwrap_or_default());
    format!("\n{title}:\n{}", verbs.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory;

    use super::*;
    use crate::command::Cli;

    /// Columns of text that help takes at most.
    const WIDTH: usize = 100;

    /// A verb that is missing in the groups is missing in the help; those that install a shell's help are in docs/install.md.
    #[test]
    fn every_verb_is_in_one_group() {
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, verbs)| verbs.iter().copied()).collect();
        let command = Cli::command();
        let verbs: BTreeSet<&str> =
            command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set()).map(Command::get_name).collect();
        assert_eq!(grouped.len(), verbs.len());
        assert_eq!(grouped.into_iter().collect::<BTreeSet<_>>(), verbs);
    }

    #[test]
    fn help_fits_on_one_screen() {
        let help = super::grouped(Cli::command()).render_help().to_string();
        assert!(help.lines().count() <= 45, "{help}");
        assert!(help.lines().all(|line| line.chars().count() <= WIDTH), "{help}");
    }

    #[test]
    fn help_of_every_verb_fits_its_width() {
        fn each(command: &mut Command) {
            for help in [command.render_help(), command.render_long_help()].map(|help| help.to_string()) {
                assert!(help.lines().all(|line| line.chars().count() <= WIDTH), "{help}");
            }
            command.get_subcommands_mut().for_each(each);
        }
        let mut command = Cli::command();
        command.build();
        each(&mut command);
    }
}
