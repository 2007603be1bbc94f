//! Former verbs: each still works, as the verb that took it in.
//!
//! The arguments are rewritten before they are parsed, so that every option is defined once. On a terminal the new
//! spelling is printed once.

use std::ffi::OsString;
use std::io::IsTerminal;
use std::os::unix::process::CommandExt;
use std::process;

use clap::Command;
use runner::failure::{Exit, Failure};
use runner::start::asks_for_json;

/// A former verb, and the words that replace it now.
const RENAMED: [(&str, &[&str]); 13] = [
    ("live", &["run", "--live", "--watch"]),
    ("merge", &["campaign", "merge"]),
    ("curve", &["campaign", "curve"]),
    ("rare", &["estimate"]),
    ("sensors", &["watch", "--sensors"]),
    ("console", &["watch", "--window"]),
    ("explain", &["inspect", "explain"]),
    ("diff", &["inspect", "diff"]),
    ("verify", &["inspect", "verify"]),
    ("replay", &["inspect", "replay"]),
    ("cite", &["report", "--format", "cite"]),
    ("export", &["report", "--format", "mcap"]),
    ("reproduce", &["evaluate", "--reproduce"]),
];

/// Former verbs that the authors' program `lab` has now, and the words that replace them there.
const OF_LAB: [(&str, &[&str]); 3] = [("bench", &[]), ("dataset", &["dataset"]), ("catalogue", &["catalogue"])];

/// The command line with a former verb replaced by its new spelling.
///
/// # Errors
/// The exit code, for a verb of `lab` where that program is not there, and for a misspelt verb.
pub(super) fn current(command: &Command, mut arguments: Vec<OsString>) -> Result<Vec<OsString>, Exit> {
    let Some(index) = verb_at(command, &arguments, 1) else { return Ok(arguments) };
    let is = |verb: &str| arguments[index] == *verb;
    if let Some((old, new)) = OF_LAB.iter().find(|(old, _)| is(old)) {
        return Err(lab(old, new, arguments, index));
    }
    let (from, new) = match RENAMED.iter().find(|(old, _)| is(old)) {
        Some((old, new)) => (*old, new.to_vec()),
        None if is("campaign") && names_no_part(command, &arguments, index) => ("campaign", vec!["campaign", "run"]),
        None => {
            return match suggestion(command, &arguments[index].to_string_lossy()) {
                Some(message) => Err(Failure::new(Exit::Usage, message).tell(asks_for_json(&arguments))),
                None => Ok(arguments),
            };
        }
    };
    hint(&arguments, from, &format!("holdsafe {}", new.join(" ")));
    arguments.splice(index..=index, new.into_iter().map(OsString::from));
    Ok(arguments)
}

/// Message for an unknown verb that is similar to a known one. A former verb is answered with its present name.
fn suggestion(command: &Command, word: &str) -> Option<String> {
    let today = || command.get_subcommands().map(Command::get_name).chain(["help"]);
    // Options are no verbs: `--version`, which the parser adds itself, is similar to `verify`.
    if word.starts_with('-') || word.chars().count() < 2 || today().any(|verb| verb == word) {
        return None;
    }
    let near = scenario::closest(word, today().chain(RENAMED.iter().map(|(old, _)| *old)))?;
    let former = RENAMED.iter().find(|(old, _)| *old == near);
    let spelt = former.map_or_else(|| near.to_owned(), |(_, new)| new.join(" "));
    Some(format!("no verb `{word}`; did you mean `{spelt}`?"))
}

/// Place of the first word from `from` on that is neither an option of every command nor the value of one.
fn verb_at(command: &Command, arguments: &[OsString], from: usize) -> Option<usize> {
    let is_flag = |c: char| command.get_arguments().any(|arg| arg.get_short() == Some(c));
    let mut index = from;
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

/// True for the former grammar of `campaign`: a scenario or an option of a run follows, not the name of a part.
fn names_no_part(command: &Command, arguments: &[OsString], campaign: usize) -> bool {
    let Some(next) = verb_at(command, arguments, campaign + 1) else { return false };
    let parts = command.find_subcommand("campaign").into_iter().flat_map(Command::get_subcommands);
    let mut known = parts.map(Command::get_name).chain(["help", "--help", "-h"]);
    !known.any(|part| arguments[next] == *part)
}

/// Prints the new spelling on a terminal. The output for a program that reads stderr or an object is unchanged.
fn hint(arguments: &[OsString], old: &str, new: &str) {
    let quiet = arguments.iter().any(|word| word == "-q" || word == "--quiet");
    if std::io::stderr().is_terminal() && !quiet && !asks_for_json(arguments) {
        link::note!("`holdsafe {old}` is `{new}` now");
    }
}

/// Replaces this program by `lab` from the same folder.
fn lab(old: &str, new: &[&str], arguments: Vec<OsString>, at: usize) -> Exit {
    let spelt = ["lab"].iter().chain(new).copied().collect::<Vec<_>>().join(" ");
    hint(&arguments, old, &spelt);
    let json = asks_for_json(&arguments);
    let mut words = arguments;
    words.splice(at..=at, new.iter().map(OsString::from));
    let program = std::env::current_exe().map(|own_path| own_path.with_file_name("lab"));
    // `exec` returns only on failure.
    let error = program.map_or_else(|error| error, |lab| process::Command::new(lab).args(&words[1..]).exec());
    let message = format!(
        "`{old}` is `{spelt}` now, and that program is not beside this one ({error}); in a clone, \
         `cargo build --release --manifest-path measurements/Cargo.toml --target-dir target` builds it beside target/release/holdsafe"
    );
    Failure::new(Exit::Usage, message).tell(json)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::command::Cli;

    fn now(line: &str) -> String {
        let words = line.split(' ').map(OsString::from).collect();
        let words = current(&Cli::command(), words).unwrap();
        words.iter().map(|word| word.to_str().unwrap()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn old_verbs_become_new_ones() {
        for (old, new) in [
            ("holdsafe live loss --out x", "holdsafe run --live --watch loss --out x"),
            ("holdsafe --seed 7 -q merge a b", "holdsafe --seed 7 -q campaign merge a b"),
            ("holdsafe --root=x cite run", "holdsafe --root=x report --format cite run"),
            ("holdsafe campaign loss --trials 2", "holdsafe campaign run loss --trials 2"),
            ("holdsafe campaign --trials 2 loss", "holdsafe campaign run --trials 2 loss"),
        ] {
            assert_eq!(now(old), new);
        }
    }

    #[test]
    fn current_verbs_stay_as_typed() {
        for line in [
            "holdsafe",
            "holdsafe --json",
            "holdsafe --version",
            "holdsafe run live",
            "holdsafe --root live run replay",
            "holdsafe campaign --json run loss",
            "holdsafe campaign merge a --out b",
            "holdsafe campaign --help",
        ] {
            assert_eq!(now(line), line);
        }
    }

    #[test]
    fn misspelt_former_verb_is_answered_with_the_current() {
        let command = Cli::command();
        let answer = suggestion(&command, "explan").unwrap();
        assert!(answer.ends_with("did you mean `inspect explain`?"), "{answer}");
        for (word, verb) in [("rnu", "run"), ("urn", "run"), ("matirx", "matrix")] {
            assert_eq!(suggestion(&command, word), Some(format!("no verb `{word}`; did you mean `{verb}`?")));
        }
        for word in ["run", "help", "xqz", "u", "--version"] {
            assert_eq!(suggestion(&command, word), None);
        }
    }

    /// Else a former verb would be parsed as a current one.
    #[test]
    fn no_old_verb_is_a_current_one() {
        let command = Cli::command();
        let old = RENAMED.iter().chain(&OF_LAB).map(|(old, _)| *old);
        old.for_each(|old| assert!(command.find_subcommand(old).is_none(), "{old}"));
        RENAMED.iter().for_each(|(_, new)| assert!(command.find_subcommand(new[0]).is_some(), "{new:?}"));
    }
}
