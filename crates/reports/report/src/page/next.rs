//! Two commands that lead on from the finding.

use evidence::trial::Outcome;
use maud::{Markup, html};
use results::report::{ComparisonRow, SearchObject};
use results::summary::RunSummary;

use crate::Dossier;
use crate::reader::{FoundResult, Given};
use crate::tried::tried;

pub(super) fn section(dossier: &Dossier, told: &[&RunSummary]) -> Markup {
    html! { p class="next" { "Next: " @for command in commands(dossier, told) { code { (command) } " " } } }
}

fn commands(dossier: &Dossier, told: &[&RunSummary]) -> [String; 2] {
    let broken = dossier.recordings.iter().find(|of| of.invalid.is_some());
    // A run that nothing restricted explains nothing.
    let told_first = told.iter().find(|story| !story.why.is_empty()).or(told.first());
    let folder = told_first.and_then(|story| dossier.folders.get(&story.name));
    let other = told.first().and_then(|story| dossier.folders.get(&story.name)).or(folder);
    let again = dossier
        .results
        .files()
        .iter()
        .find_map(again)
        .unwrap_or_else(|| ["holdsafe tour".to_owned(), "holdsafe report --help".to_owned()]);
    match (broken, folder.zip(other)) {
        (Some(of), _) => [
            format!("holdsafe inspect verify {}", quoted(&of.name)),
            format!("holdsafe inspect explain {} --unverified", quoted(&of.name)),
        ],
        (None, Some((folder, other))) => [
            format!("holdsafe inspect explain {}", quoted(folder)),
            format!("holdsafe report {} --format mcap --out run.mcap", quoted(other)),
        ],
        (None, None) => again,
    }
}

/// Commands that run a part of a result again, with a recording.
fn again(given: &Given) -> Option<[String; 2]> {
    let run = |line: String| [format!("{line} --out runs/again"), "holdsafe report runs/again".to_owned()];
    if let FoundResult::Search(search) = &given.found {
        return Some(match search.findings.first() {
            Some(finding) => run(finding.reproduce.clone()),
            None => searched_on(search),
        });
    }
    if let FoundResult::Comparison(comparison) = &given.found {
        let asks = |row: &&ComparisonRow| row.harmful.hits > 0 || row.outcomes.contains_key(&Outcome::Undetected);
        let row = comparison.rows.iter().find(asks).or(comparison.rows.first())?;
        let cell = row.cell.as_ref().map(|cell| format!(" --cell {cell}")).unwrap_or_default();
        let bare = if row.conduct == "bare" { " --bare" } else { "" };
        let seed = comparison.seed;
        return Some(run(format!(
            "holdsafe run {}{cell} --trials 1 --seed {seed} --autonomy GUEST.TOML{bare}",
            row.scenario
        )));
    }
    let all = tried(given);
    let one = all.iter().find(|one| one.unexpected().next().is_some()).or(all.first())?;
    let cell = one.cell.map(|cell| format!(" --cell {cell}")).unwrap_or_default();
    let line = format!("holdsafe run {}{cell} --trials 1", one.scenario);
    Some(run(if one.reproduce.is_empty() { line } else { one.reproduce.clone() }))
}

/// A search without findings again, with ten times the sequences.
fn searched_on(search: &SearchObject) -> [String; 2] {
    let (scenario, space, budget) = (&search.scenario, &search.alphabet, search.hunt.trials.saturating_mul(10));
    let line = format!("holdsafe search {scenario} --attack-space {space} --budget {budget}");
    [line.clone(), format!("{line} --find UNSAFE,LATE")]
}

/// A path as a shell takes it.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+,:@=".contains(c);
    if !path.is_empty() && path.chars().all(plain) {
        path.to_owned()
    } else {
        format!("'{}'", path.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_of_a_command_is_one_word() {
        assert_eq!([quoted("runs/x/1"), quoted("it's me")], ["runs/x/1", "'it'\\''s me'"]);
    }
}
