//! Misspelt verbs: a word that is no verb is answered with the nearest verb, or the nearest part of one.
//!
//! The command line is looked at before it is parsed; options and values are left to the parser.

use std::ffi::OsString;

use clap::Command;

/// The answer to a command line whose verb is none, where a verb or a part of one is near.
pub(super) fn suggestion(command: &Command, arguments: &[OsString]) -> Option<String> {
    let word = arguments.get(verb_index(command, arguments)?)?.to_string_lossy();
    // `--version`, which the parser adds by itself, is near to `verify`.
    if word.starts_with('-') || word.chars().count() < 2 {
        return None;
    }
    let verbs = || command.get_subcommands();
    if verbs().any(|verb| verb.get_name() == word) || word == "help" {
        return None;
    }
    let parts = verbs().flat_map(|verb| verb.get_subcommands().map(move |part| (verb.get_name(), part.get_name())));
    let parts: Vec<(&str, &str)> = parts.collect();
    let known = verbs().map(Command::get_name).chain(["help"]).chain(parts.iter().map(|(_, part)| *part));
    let near = scenario::closest(&word, known)?;
    let whole = parts.iter().find(|(_, part)| *part == near).filter(|_| verbs().all(|verb| verb.get_name() != near));
    let spelt = whole.map_or_else(|| near.to_owned(), |(verb, part)| format!("{verb} {part}"));
    Some(format!("no verb `{word}`; did you mean `{spelt}`?"))
}

/// Index of the first word that is neither an option of every command nor the value of one.
fn verb_index(command: &Command, arguments: &[OsString]) -> Option<usize> {
    let is_flag = |c: char| command.get_arguments().any(|arg| arg.get_short() == Some(c));
    let mut index = 1;
    while let Some(word) = arguments.get(index) {
        let word = word.to_string_lossy();
        let (name, value) = word.split_once('=').map_or((&*word, None), |(name, value)| (name, Some(value)));
        let mut options = command.get_arguments().filter(|arg| arg.get_long().is_some());
        let option = options.find(|arg| name.strip_prefix("--") == arg.get_long());
        let flags = word.strip_prefix('-').is_some_and(|flags| !flags.is_empty() && flags.chars().all(is_flag));
        index += match option {
            Some(option) if value.is_none() && option.get_action().takes_values() => 2,
            Some(_) => 1,
            None if flags => 1,
            None => return Some(index),
        };
    }
    None
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::command::Cli;

    fn answer(line: &str) -> Option<String> {
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        suggestion(&Cli::command(), &words)
    }

    #[test]
    fn misspelt_verb_is_answered_with_the_nearest() {
        for (line, verb) in [
            ("holdsafe rnu", "run"),
            ("holdsafe --seed 7 -q urn loss", "run"),
            ("holdsafe --root=x explain run", "inspect explain"),
            ("holdsafe --root live explan", "inspect explain"),
        ] {
            let answer = answer(line).unwrap_or_default();
            assert!(answer.ends_with(&format!("did you mean `{verb}`?")), "{line}: {answer}");
        }
    }

    #[test]
    fn verb_option_and_strange_word_go_to_parser() {
        for line in
            ["holdsafe", "holdsafe run live", "holdsafe help", "holdsafe xqz", "holdsafe u", "holdsafe --version"]
        {
            assert_eq!(answer(line), None, "{line}");
        }
    }
}
