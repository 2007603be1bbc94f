//! Published figures: each has a command or a file that it can be checked with, and both exist.
//!
//! Judging a figure right or wrong is left to the reader who runs the command.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::root;

/// The pages that publish measurements.
const PAGES: [&str; 17] = [
    "README.md",
    "docs/results.md",
    "docs/limits.md",
    "docs/reference/bounds.md",
    "docs/researcher/campaigns.md",
    "docs/reviewer/checks.md",
    "docs/operator/console.md",
    "docs/researcher/detector.md",
    "docs/researcher/evaluation.md",
    "docs/reviewer/evidence.md",
    "docs/developer/fuzzing.md",
    "docs/reference/interchange.md",
    "docs/researcher/mavlink.md",
    "docs/researcher/perception.md",
    "docs/researcher/rare.md",
    "docs/researcher/search.md",
    "docs/reviewer/tool-threats.md",
];

/// Programs of this repository that are not verbs of `holdsafe`.
const PROGRAMS: [&str; 4] = ["cargo", "trainer", "holdsafe", "lab"];

/// The verbs, from the sources of the command line: variants of one enum, one a line.
fn verbs() -> BTreeSet<String> {
    let text = fs::read_to_string(root().join("crates/holdsafe/src/command.rs")).expect("a source");
    let body = text.split("enum Verb {").nth(1).and_then(|rest| rest.split("\n}").next()).expect("the verbs");
    let variants = body.lines().map(str::trim).filter(|line| line.starts_with(|c: char| c.is_ascii_uppercase()));
    let named = |line: &str| line.chars().take_while(char::is_ascii_alphabetic).collect::<String>().to_lowercase();
    variants.map(named).collect()
}

/// The text between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Lines of code blocks.
fn blocks(text: &str) -> impl Iterator<Item = &str> {
    text.split("```").skip(1).step_by(2).flat_map(str::lines).skip(1)
}

/// True if it is a command of ours, or a path of this repository.
fn checks(phrase: &str, verbs: &BTreeSet<String>) -> bool {
    let first = phrase.split_whitespace().next().unwrap_or_default();
    let file = first.contains('/') && root().join(first.trim_end_matches('/')).exists();
    let test = first.contains("::") || first.len() > 24 && first.matches('_').count() >= 4;
    verbs.contains(first) || PROGRAMS.contains(&first) || file || test
}

/// Words before a share that make it a bound.
const BOUNDS: [&str; 12] =
    ["most", "least", "below", "above", "over", "under", "to", "beyond", "within", "be", "on", "from"];
/// Levels of confidence.
const LEVELS: [&str; 1] = ["99"];
/// Words behind a share that make it a condition of a link or a wheel.
const CONDITIONS: [&str; 6] = ["loss", "late", "lost", "jitter", "slip", "packet"];
/// The highest value of a pixel, in which strengths are given.
const FULL_PIXEL: &str = "255";

/// True for a share that is rather set than measured: of one digit, or a multiple of five.
fn is_round(share: &str) -> bool {
    let digits = share.trim_start_matches(['0', '.']);
    digits.len() == 1 || digits.parse::<u32>().is_ok_and(|share| share.is_multiple_of(5))
}

/// True if the text gives a count or a share of measured things: "7 of 20", "84 %". Bounds, levels, conditions, strengths, round shares, and
/// text in backticks are none.
pub(super) fn has_a_figure(text: &str) -> bool {
    let outside: String = text.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    let words: Vec<&str> = outside.split_whitespace().collect();
    let bare = |word: &str| word.trim_matches(|c: char| !c.is_ascii_alphanumeric()).replace(',', "");
    let number = |index: usize| {
        let word = bare(words.get(index).copied().unwrap_or_default());
        let digits = word.chars().all(|c| c.is_ascii_digit() || c == '.');
        (!word.is_empty() && digits).then_some(word)
    };
    let word = |index: usize| words.get(index).copied().unwrap_or_default();
    let before = |index: usize| index.checked_sub(1).map(word).unwrap_or_default();
    let is_share = |index: usize| {
        let first = word(index).trim_start_matches(['(', '*']).chars().next();
        let is_bound = BOUNDS.contains(&before(index)) || first.is_some_and(|c| !c.is_ascii_digit());
        let is_condition = CONDITIONS.iter().any(|name| word(index + 2).starts_with(name));
        let is_level = number(index).is_some_and(|share| LEVELS.contains(&share.as_str()) || is_round(&share));
        word(index + 1).starts_with('%') && !is_bound && !is_condition && !is_level
    };
    let is_count = |index: usize| {
        let behind = if word(index + 2) == "the" { index + 3 } else { index + 2 };
        word(index + 1) == "of" && number(behind).is_some_and(|all| all != FULL_PIXEL)
    };
    (0..words.len()).any(|index| number(index).is_some() && (is_share(index) || is_count(index)))
}

/// The sections of a page, each under its own heading; the text under a deeper heading is its own section.
pub(super) fn sections(text: &str) -> Vec<(String, String)> {
    let mut found = vec![(String::new(), String::new())];
    let mut in_block = false;
    for line in text.lines() {
        in_block ^= line.starts_with("```");
        if line.starts_with('#') && !in_block {
            found.push((line.to_owned(), String::new()));
        } else if let Some((_, body)) = found.last_mut() {
            body.push_str(line);
            body.push('\n');
        }
    }
    found
}

/// Each figure has a command or a file by which it can be checked.
#[test]
fn published_figures_can_be_checked() {
    let verbs = verbs();
    assert!(verbs.contains("run") && verbs.contains("inspect"), "{verbs:?}");
    for page in PAGES {
        let text = fs::read_to_string(root().join(page)).expect("a page");
        // A generated page names at its head the command that makes all of it.
        if text.contains("\nGenerated by `holdsafe ") {
            continue;
        }
        for (heading, body) in sections(&text).iter().filter(|(_, body)| has_a_figure(body)) {
            let named = quoted(body).chain(blocks(body)).any(|phrase| checks(phrase, &verbs));
            assert!(named, "{page}, `{heading}`: figures without a command or a file to check them with");
        }
    }
}

#[test]
fn each_row_of_published_figures_names_its_command() {
    let verbs = verbs();
    for page in ["README.md", "docs/results.md"] {
        let text = fs::read_to_string(root().join(page)).expect("a page");
        let mut rows = 0;
        for table in text.split("\n\n").filter(|table| table.starts_with("| quantity | figure |")) {
            let cells = |row: &str| row.split(" | ").map(str::to_owned).collect::<Vec<_>>();
            let head = table.lines().next().unwrap_or_default().trim_end_matches(" |");
            let column = cells(head).iter().position(|cell| cell == "command").expect("a column of commands");
            for row in table.lines().skip(2) {
                let row = cells(row.trim_end_matches(" |"));
                let command = row.get(column).map_or("", String::as_str);
                assert!(
                    quoted(command).any(|phrase| checks(phrase, &verbs)),
                    "{page}: no command that exists in {row:?}"
                );
                rows += 1;
            }
        }
        assert!(rows > 0, "{page}: the tables of figures are gone, or their heads are");
    }
}

/// A scenario that is named in a command and is not there was taken away, and its figure was not.
#[test]
fn scenarios_that_pages_name_are_there() {
    let is_scenario = |name: &str| scenario::find(&root(), name).is_some();
    for page in PAGES {
        let text = fs::read_to_string(root().join(page)).expect("a page");
        for phrase in quoted(&text).chain(blocks(&text)) {
            for file in phrase.split_whitespace().filter(|w| w.starts_with("scenarios/") && w.ends_with(".toml")) {
                let missing = !file.contains('*') && !Path::new(&root()).join(file).exists();
                assert!(!missing, "{page} names {file}, which is not there");
            }
            let words: Vec<&str> = phrase.split_whitespace().take_while(|w| *w != "#").collect();
            // The verb comes first, or right behind the program's name or cargo's `--`.
            let is_start = |at: &usize| *at == 0 || ["holdsafe", "--"].contains(&words[at - 1]);
            let runs = words.iter().position(|w| ["run", "curve", "live"].contains(w)).filter(is_start);
            let Some(name) = runs.and_then(|index| words.get(index + 1)) else { continue };
            let is_name = name.chars().all(|c| c.is_ascii_lowercase() || c == '_' || c.is_ascii_digit());
            let of_the_user = name.starts_with("my_");
            assert!(
                !is_name || of_the_user || is_scenario(name),
                "{page}: `{phrase}` names a scenario that is not there"
            );
        }
    }
}
