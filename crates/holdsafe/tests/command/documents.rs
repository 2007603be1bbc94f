//! Commands in documents: lines of `sh` blocks, and code spans that begin with a program's name. Trying them is left to the
//! tests of the program, `holdsafe` or `lab`.

use std::fs;
use std::path::{Path, PathBuf};

/// A run of a program, as a document writes it.
pub(crate) struct Documented {
    /// Page and text.
    pub(crate) place: String,
    /// Features of the build, where `cargo run` names some.
    pub(crate) features: Option<String>,
    /// Arguments behind the program's name.
    pub(crate) arguments: Vec<String>,
}

/// Every command of `program` in the documents below `root`; `built` commands are those that `cargo run --release` runs.
pub(crate) fn documented(root: &Path, program: &str, built: bool) -> Vec<Documented> {
    let mut found = Vec::new();
    for page in pages(root) {
        let text = fs::read_to_string(&page).unwrap();
        for line in lines(&text).into_iter().chain(spans(&text)) {
            let words = words(&line);
            let is_program = words.first().is_some_and(|word| word == program);
            let built = built && words.starts_with(&["cargo", "run", "--release"].map(str::to_owned));
            // The values of a shell loop are unknown here.
            if !is_program && !built || line.contains('$') {
                continue;
            }
            let arguments =
                if is_program { &words[1..] } else { words.split(|word| word == "--").nth(1).unwrap_or_default() };
            let features = words.iter().position(|word| word == "--features").filter(|_| built);
            found.push(Documented {
                place: format!("{}: {line}", page.display()),
                features: features.map(|index| words[index + 1].clone()),
                arguments: arguments.iter().filter_map(|word| example(word)).collect(),
            });
        }
    }
    found
}

/// Every Markdown file with commands.
fn pages(root: &Path) -> Vec<PathBuf> {
    let mut found =
        ["README.md", "ARTIFACT.md", "CONTRIBUTING.md", "ARCHITECTURE.md"].map(|name| root.join(name)).to_vec();
    for role in fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path()) {
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

/// The code spans of a text, without the code of its blocks. A span ends with its paragraph at the latest.
fn spans(text: &str) -> Vec<String> {
    let prose: String = text.split("```").step_by(2).collect();
    let paragraphs = prose.split("\n\n").flat_map(|paragraph| paragraph.split('`').skip(1).step_by(2));
    paragraphs.map(|span| span.replace('\n', " ")).collect()
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

/// An argument in place of the one written: a value of its kind for a placeholder, none for an ellipsis, which represents the
/// subject of the line above.
fn example(word: &str) -> Option<String> {
    match word {
        "…" => None,
        "N" => Some("1".to_owned()),
        "CHECK" => Some("boundary.freshness".to_owned()),
        "SHA256" => Some("0".repeat(64)),
        given => Some(given.to_owned()),
    }
}
