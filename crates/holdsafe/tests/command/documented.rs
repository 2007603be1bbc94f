//! Commands in documents: the program has each of them, and the cheap ones of the README run to their end.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::root;

/// A run that is written to a document, of which `cargo run` is the one way to build the program.
struct Documented {
    place: String,
    features: Option<String>,
    arguments: Vec<String>,
}

/// Every Markdown file with commands.
fn pages() -> Vec<PathBuf> {
    let mut found = ["README.md", "ARTIFACT.md", "CONTRIBUTING.md"].map(|name| root().join(name)).to_vec();
    for role in fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path()) {
        let below =
            if role.is_dir() { fs::read_dir(&role).unwrap().map(|e| e.unwrap().path()).collect() } else { vec![role] };
        found.extend(below.into_iter().filter(|path| path.extension().is_some_and(|e| e == "md")));
    }
    found.sort();
    found
}

/// The lines of a text's `sh` blocks, continued ones joined.
fn lines(text: &str) -> Vec<String> {
    let blocks = text.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    blocks.flat_map(|block| block.replace("\\\n", " ").lines().map(str::to_owned).collect::<Vec<_>>()).collect()
}

/// A line's words as a shell takes them, up to a comment, a pipe or a redirection.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (i, part) in line.split('\'').enumerate() {
        if i % 2 == 1 {
            words.push(part.to_owned());
            continue;
        }
        for word in part.split_whitespace() {
            if ["#", "|", ">", "&&", ";"].contains(&word) {
                return words;
            }
            words.push(word.to_owned());
        }
    }
    words
}

fn documented() -> Vec<Documented> {
    let mut found = Vec::new();
    for page in pages() {
        for line in lines(&fs::read_to_string(&page).unwrap()) {
            let words = words(&line);
            let own = words.first().is_some_and(|word| word == "holdsafe");
            let built = words.starts_with(&["cargo", "run", "--release"].map(str::to_owned));
            // The values of a shell loop are unknown here.
            if !own && !built || line.contains('$') {
                continue;
            }
            let arguments = if own { &words[1..] } else { words.split(|word| word == "--").nth(1).unwrap_or_default() };
            let features = words.iter().position(|word| word == "--features").filter(|_| built);
            found.push(Documented {
                place: format!("{}: {line}", page.display()),
                features: features.map(|at| words[at + 1].clone()),
                arguments: arguments.to_vec(),
            });
        }
    }
    found
}

/// `--help` behind a command makes the parser check its verbs, options and values without running it.
#[test]
fn documented_commands_are_understood() {
    let all = documented();
    assert!(all.len() > 40, "{} commands found", all.len());
    let manifest = fs::read_to_string(root().join("crates/holdsafe/Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    for Documented { place, features, arguments } in &all {
        for feature in features.iter().flat_map(|named| named.split(',')) {
            assert!(manifest["features"].get(feature).is_some(), "{place}: no feature {feature}");
        }
        // An ellipsis stands for the subject of the line above.
        let shown = arguments.iter().filter(|word| *word != "…");
        let output = Command::new(env!("CARGO_BIN_EXE_holdsafe")).args(shown).arg("--help").output().unwrap();
        assert!(output.status.success(), "{place}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn cheap_commands_of_the_readme_succeed() {
    let cheap = |run: &&Documented| {
        let begins = run.arguments.iter().take(2).map(String::as_str).collect::<Vec<_>>();
        run.place.contains("README.md")
            && matches!(begins[..], ["explain" | "doctor", ..] | ["scenario", "new"] | ["inspect", "explain"])
    };
    let all = documented();
    let cheap: Vec<&Documented> = all.iter().filter(cheap).collect();
    assert!(cheap.len() >= 2, "{} found", cheap.len());
    let root = root().canonicalize().unwrap();
    for run in cheap {
        let here = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.arg("--root").arg(&root).args(&run.arguments).current_dir(here.path()).stdin(Stdio::null());
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}: {}", run.place, String::from_utf8_lossy(&output.stderr));
    }
}
