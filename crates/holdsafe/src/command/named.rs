//! Scenarios, platforms and verbs by the names that a person types, and answers that help with a name that is not there.
//!
//! `runner::plan` finds the files; it names everything that there is where it finds none.

use std::path::{Path, PathBuf};

use runner::failure::{Exit, Failure};
use runner::plan::Chosen;
use runner::{Context, plan};

/// The remedy where no name is near.
const LIST: &str = "`holdsafe scenario list` prints the shipped ones";

/// The file of a scenario given by name or by path.
///
/// # Errors
/// For a name that none has, and for a file that is no scenario by its ending.
pub(super) fn scenario(context: &Context, name: &str) -> Result<PathBuf, Failure> {
    let path = Path::new(name);
    let missing = |why: &str| Failure::new(Exit::Usage, format!("`{name}` {why}; {LIST}"));
    if path.extension().is_some_and(|ending| ending != "toml") && path.exists() {
        return Err(missing("is no scenario: a scenario's file ends in .toml"));
    }
    let root = if plan::is_path(name) { None } else { Some(context.root()?) };
    let Some(root) = root.filter(|root| scenario::find(root, name).is_none()) else {
        return plan::file_of(context, name);
    };
    if path.is_dir() {
        return Err(missing("is a folder"));
    }
    let files = shipped_scenarios(&root)?;
    let known: Vec<String> = files.iter().map(|file| plan::stem(file)).collect();
    let hint = match nearest(name, known.iter().map(String::as_str)) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => format!("{LIST}."),
    };
    let message = format!("no scenario `{name}`; {hint} A file is named by its path, ending in .toml");
    Err(Failure::new(Exit::Usage, message))
}

/// The files of all shipped scenarios: of the reference evaluation, rendered ones and those for showing.
pub(super) fn shipped_scenarios(root: &Path) -> Result<Vec<PathBuf>, Failure> {
    Ok([scenario::shipped(root)?, scenario::rendered(root)?, scenario::demo(root)?].concat())
}

/// The platform given by name or by path.
///
/// # Errors
/// For a name that none has; the nearest one is suggested beside all.
pub(super) fn platform(context: &Context, name: &str) -> Result<Chosen, Failure> {
    let known: Vec<String> = match plan::is_path(name) {
        true => Vec::new(),
        false => scenario::platform_files(&context.root()?)?.iter().map(|file| plan::stem(file)).collect(),
    };
    match nearest(name, known.iter().map(String::as_str)).filter(|meant| *meant != name) {
        None => plan::platform_of(context, name),
        Some(meant) => {
            let message = format!(
                "no platform `{name}`; did you mean `{meant}`? There are: {}. A file is named by its path, ending in .toml",
                known.join(", ")
            );
            Err(Failure::new(Exit::Usage, message))
        }
    }
}

/// The nearest of the known names: as the parser suggests one, or one letter or one exchange of neighbours away.
pub(super) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let known: Vec<&str> = known.into_iter().collect();
    let slip = |name: &&str| word.chars().count() > 1 && strsim::osa_distance(word, name) == 1;
    scenario::closest(word, known.iter().copied()).or_else(|| known.iter().copied().find(slip))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exchanged_letters_of_short_names_are_near() {
        let known = ["run", "tour", "matrix"];
        for (word, meant) in
            [("rnu", Some("run")), ("urn", Some("run")), ("matirx", Some("matrix")), ("xqz", None), ("u", None)]
        {
            assert_eq!(nearest(word, known), meant, "{word}");
        }
    }
}
