//! A thermometer of the prose: openings of doc blocks, and pronouns in doc comments and documents, each with a ceiling.
//!
//! The ceilings are the values of the day and may only be lowered. Readability is left to the readers.

use std::fs;
use std::path::PathBuf;

use crate::{root, sources};

/// First words of a doc block that opens with a clause in place of a noun.
const OPENINGS: [&str; 7] = ["What", "Who", "Whether", "How", "When", "Where", "Why"];
/// Pronouns that stand where a noun would say more.
const PRONOUNS: [&str; 6] = ["what", "whoever", "whose", "nobody", "somebody", "nothing"];

/// Doc blocks that begin with one of [`OPENINGS`], in per cent; 0.0 on 2026-11-25.
const MOST_OPENINGS: f64 = 0.5;
/// [`PRONOUNS`] in 1,000 words of doc comments; 0.4 on 2026-11-25.
const MOST_IN_COMMENTS: f64 = 1.0;
/// [`PRONOUNS`] in 1,000 words of documents; 1.1 on 2026-11-25.
const MOST_IN_DOCUMENTS: f64 = 1.3;
/// Lines of the README: a front page, not a manual.
const LONGEST_README: usize = 120;

/// The text of each block of adjacent `//!` or `///` lines.
fn doc_blocks(source: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut last = None;
    for line in source.lines().map(str::trim_start) {
        let marker = ["//!", "///"].into_iter().find(|marker| line.starts_with(marker));
        if let Some(marker) = marker {
            let text = line.strip_prefix(marker).unwrap_or_default();
            match blocks.last_mut() {
                Some(block) if last == Some(marker) => *block = format!("{block}\n{text}"),
                _ => blocks.push(text.to_owned()),
            }
        }
        last = marker;
    }
    blocks
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '\'').filter(|word| word.starts_with(char::is_alphabetic))
}

/// Documents in Markdown: the root's and those below `docs/`.
fn documents() -> Vec<String> {
    let mut folders: Vec<PathBuf> = vec![root(), root().join("docs")];
    let below = fs::read_dir(root().join("docs")).expect("docs/").map(|entry| entry.expect("an entry").path());
    folders.extend(below.filter(|path| path.is_dir()));
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).expect("a folder"));
    let pages = files.map(|entry| entry.expect("an entry").path()).filter(|p| p.extension().is_some_and(|e| e == "md"));
    pages.map(|page| fs::read_to_string(page).expect("a readable page")).collect()
}

/// [`PRONOUNS`] in 1,000 words.
fn pronouns(texts: &[String]) -> f64 {
    let all: Vec<&str> = texts.iter().flat_map(|text| words(text)).collect();
    let pronoun = |word: &&&str| PRONOUNS.iter().any(|pronoun| word.eq_ignore_ascii_case(pronoun));
    1000.0 * all.iter().filter(pronoun).count() as f64 / all.len() as f64
}

#[test]
fn prose_stays_below_its_ceilings() {
    let sources = ["crates", "fuzz", "measurements", "tests"].into_iter().flat_map(sources);
    let blocks: Vec<String> = sources.flat_map(|(_, text)| doc_blocks(&text)).collect();
    let opens = |block: &&String| words(block).next().is_some_and(|word| OPENINGS.contains(&word));
    let openings = 100.0 * blocks.iter().filter(opens).count() as f64 / blocks.len() as f64;
    let (comments, documents) = (pronouns(&blocks), pronouns(&documents()));
    println!("{openings:.1} % of {} doc blocks open with a clause", blocks.len());
    println!("listed pronouns in 1,000 words: {comments:.1} of doc comments, {documents:.1} of documents");
    assert!(openings <= MOST_OPENINGS, "{openings:.1} % of doc blocks open with a clause: begin with a noun");
    assert!(
        comments <= MOST_IN_COMMENTS,
        "{comments:.1} listed pronouns in 1,000 words of doc comments: name the thing"
    );
    assert!(
        documents <= MOST_IN_DOCUMENTS,
        "{documents:.1} listed pronouns in 1,000 words of documents: name the thing"
    );
}

#[test]
fn the_readme_stays_a_front_page() {
    let lines = fs::read_to_string(root().join("README.md")).expect("README.md").lines().count();
    assert!(lines <= LONGEST_README, "README.md has {lines} lines: move detail to docs/");
}

#[test]
fn adjacent_doc_lines_are_one_block() {
    let source = "//! What it is.\n//! More.\n\n/// A length.\n//// no doc\nfn f() {}\n    /// Another.\n";
    assert_eq!(doc_blocks(source), [" What it is.\n More.", " A length.\n/ no doc", " Another."]);
}
