//! References in documents: relative links and quoted paths of every Markdown file point to a file that exists.
//!
//! Addresses on the web are not followed, and anchors inside a page are not checked.

use std::fs;
use std::path::{Path, PathBuf};

use crate::root;

/// Folders that hold no documents of ours: build output, recordings, seeds of the fuzzer.
const SKIPPED: [&str; 3] = ["target", "runs", "corpus"];

/// Folders of the root with files that documents quote. `tests/` is left out: crates have one too.
const ROOTS: [&str; 8] =
    ["crates/", "docs/", "measurements/", "platforms/", "policies/", "references/", "scenarios/", "tools/"];

/// Every Markdown file of the repository.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut waiting = vec![root()];
    while let Some(directory) = waiting.pop() {
        for entry in fs::read_dir(&directory).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            let hidden = name.starts_with('.') || SKIPPED.contains(&name.as_str());
            if path.is_dir() && !hidden {
                waiting.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The text without fenced blocks and inline code, in which `](` is no link.
fn prose(text: &str) -> String {
    let unfenced: Vec<&str> = text.split("```").step_by(2).collect();
    unfenced.concat().split('`').step_by(2).collect()
}

/// Files that links lead to, relative to the page. Anchors and titles are cut off.
fn targets(text: &str) -> Vec<String> {
    let prose = prose(text);
    let inside = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let inside = inside.filter(|target| !target.contains("://") && !target.starts_with("mailto:"));
    let file = |target: &str| target.split(['#', ' ']).next().unwrap_or_default().to_owned();
    inside.map(file).filter(|target| !target.is_empty()).collect()
}

/// Quoted paths below one of [`ROOTS`]. A test is quoted as `file::name`; patterns and elisions are not checked.
fn quoted_paths(text: &str) -> Vec<String> {
    let words = text.split('`').skip(1).step_by(2).flat_map(str::split_whitespace);
    let below = words.filter(|word| ROOTS.iter().any(|root| word.starts_with(root)) && !word.contains(['*', '…']));
    let file =
        |word: &str| word.split("::").next().unwrap_or_default().trim_end_matches([',', '.', ';', ':', ')']).to_owned();
    below.map(file).collect()
}

fn missing(page: &Path, text: &str) -> Vec<String> {
    let folder = page.parent().expect("a folder");
    let links = targets(text).into_iter().filter(|target| !folder.join(target).exists());
    // The changelog names files as they were.
    let quoted = if page.ends_with("CHANGELOG.md") { Vec::new() } else { quoted_paths(text) };
    let quoted = quoted.into_iter().filter(|path| !root().join(path).exists());
    links.chain(quoted).collect()
}

#[test]
fn links_in_markdown_point_to_files() {
    let pages = pages();
    assert!(pages.len() > 25, "{} Markdown files found", pages.len());
    for page in pages {
        let missing = missing(&page, &fs::read_to_string(&page).expect("a readable page"));
        assert!(missing.is_empty(), "{} refers to files that do not exist: {missing:?}", page.display());
    }
}

#[test]
fn a_broken_link_is_reported() {
    let page = root().join("README.md");
    let text =
        "[a](ARCHITECTURE.md#map) [b](gone.md) `[c](code.md)` https://x.org/docs/y `docs/gone.md` `crates/gone.rs::t`";
    assert_eq!(missing(&page, text), ["gone.md", "docs/gone.md", "crates/gone.rs"]);
}

/// A page that the index leaves out is found only by chance.
#[test]
fn the_index_lists_every_page() {
    let index = root().join("docs/README.md");
    let listed = targets(&fs::read_to_string(&index).expect("docs/README.md"));
    let listed: Vec<PathBuf> = listed.iter().map(|target| root().join("docs").join(target)).collect();
    for page in pages().into_iter().filter(|page| page.starts_with(root().join("docs")) && *page != index) {
        assert!(listed.contains(&page), "docs/README.md does not list {}", page.display());
    }
}
