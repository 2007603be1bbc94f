//! Two commands that lead on from the finding.

use maud::{Markup, html};
use results::summary::RunSummary;

use crate::Dossier;
use crate::reader::FoundResult;
use crate::tried::tried;

pub(super) fn section(dossier: &Dossier, told: &[&RunSummary]) -> Markup {
    html! { p class="next" { "Next: " @for command in commands(dossier, told) { code { (command) } " " } } }
}

fn commands(dossier: &Dossier, told: &[&RunSummary]) -> [String; 2] {
    let broken = dossier.recordings.iter().find(|of| of.invalid.is_some());
    let folder = told.iter().find_map(|story| dossier.folders.get(&story.name));
    let found = dossier.results.files().iter().find_map(|given| match &given.found {
        FoundResult::Search(search) => search.findings.first().map(|finding| finding.reproduce.clone()),
        FoundResult::Comparison(comparison) => {
            let row = comparison.rows.iter().find(|row| row.harmful.hits > 0).or(comparison.rows.first())?;
            Some(format!("holdsafe run {} --autonomy {}.toml{}", row.scenario, row.guest, if row.conduct == "bare" { " --bare" } else { "" }))
        }
        _ => None,
    });
    let again = dossier.results.files().iter().flat_map(tried).map(|one| one.reproduce).find(|line| !line.is_empty());
    match (broken, folder, found.or(again)) {
        (Some(of), _, _) => [format!("holdsafe inspect verify {}", quoted(&of.name)), format!("holdsafe inspect explain {} --unverified", quoted(&of.name))],
        (None, Some(folder), _) => [
            format!("holdsafe inspect explain {}", quoted(folder)),
            format!("holdsafe report {} --format mcap --out run.mcap", quoted(folder)),
        ],
        (None, None, Some(line)) => [format!("{line} --out runs/again"), "holdsafe report runs/again".to_owned()],
        (None, None, None) => ["holdsafe tour".to_owned(), "holdsafe report --help".to_owned()],
    }
}

/// A path as a shell takes it.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+,:@=".contains(c);
    if !path.is_empty() && path.chars().all(plain) { path.to_owned() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_of_a_command_is_one_word() {
        assert_eq!([quoted("runs/x/1"), quoted("it's me")], ["runs/x/1", "'it'\\''s me'"]);
    }
}
