//! `holdsafe report --format cite RUN`: a citation of a result, with the digests that identify it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use evidence::log::hex;
use link::files;
use perception::model::hex_digest;
use recording::Checked;
use runner::checked::Unverified;
use runner::failure::{Exit, Failure};
use runner::{Context, checked, out};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Authors and title, in the format read by citation services.
const CITATION: &str = include_str!("../../../../../CITATION.cff");
/// Largest manifest that is read.
const MAX_MANIFEST_BYTES: u64 = 4 << 20;
/// Largest result that is read.
const MAX_RESULT_BYTES: u64 = 256 << 20;
/// Results in a run's directory: tables and lines; recordings lie below and are named by them.
const RESULTS: [&str; 4] = ["json", "jsonl", "parquet", "csv"];
/// Folders from a trial's to its run's, both counted: seed, cell, scenario, mode, run.
const LEVELS: usize = 5;
/// Digits of a digest that tell one entry from another in a bibliography.
const SHORT: usize = 8;

/// Fields of a run's manifest that a citation needs.
#[derive(Deserialize)]
struct Manifest {
    version: String,
    program: String,
    build: String,
    target: String,
    seed: u64,
    watermarks: Vec<String>,
    bounds: BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Serialize)]
struct Cited {
    schema_version: u32,
    title: String,
    version: String,
    /// Digest of the program's sources.
    program: String,
    build: String,
    target: String,
    seed: u64,
    scenarios: Vec<String>,
    /// Place of its trials, of a result that ran in one place: twin, stack or live.
    #[serde(skip_serializing_if = "Option::is_none")]
    mode: Option<String>,
    /// Watermarks of an ablation, of each artefact.
    watermarks: Vec<String>,
    /// SHA-256 of each result, by its file.
    results: BTreeMap<String, String>,
    /// SHA-256 over those, and over the manifest.
    digest: String,
    bibtex: String,
}

/// Of the directory of a run with its manifest.json, or any below it.
pub(super) fn run(context: &Context, run: &Path, unverified: Unverified) -> Result<Exit, Failure> {
    let unusable = |reason: String| Failure::new(Exit::Usage, format!("{}: {reason}", run.display()));
    let directory = with_manifest(run);
    let manifest = directory.join("manifest.json");
    let text = files::read(&manifest, MAX_MANIFEST_BYTES)
        .map_err(|e| unusable(format!("manifest.json: {e}; name the directory of a run")))?;
    let read: Manifest = serde_json::from_slice(&text).map_err(|e| unusable(format!("manifest.json: {e}")))?;
    let results = results(&directory)?;
    if results.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, format!("{}: no result beside the manifest", directory.display())));
    }
    agree(&directory)?;
    let recorded = checked::open_runs(&directory)?;
    let recorded: Vec<&Checked> = recorded.iter().collect();
    checked::print_marks(context, &recorded);
    let cited = cited(read, mode(&directory), results, &hex_digest(&text), &recordings_sentence(&recorded));
    match context.json {
        true => checked::print_json("cite", &cited, &recorded)?,
        false => out::say(format_args!("{}", cited.bibtex)),
    }
    Ok(unverified.exit(&recorded, Exit::Fine))
}

/// Checks that the results of a command agree with themselves, and with the finished trials beside them.
fn agree(directory: &Path) -> Result<(), Failure> {
    for file in super::page::RESULTS.iter().map(|name| directory.join(name)).filter(|file| file.is_file()) {
        let bytes = files::read(&file, MAX_RESULT_BYTES)?;
        let mut results = report::reader::Results::default();
        // A result that no page takes is cited all the same.
        if results.read(&file.display().to_string(), &bytes).is_ok() {
            super::page::agrees(&file, &results)?;
        }
    }
    Ok(())
}

/// The directory with the manifest of `run`: itself, or the nearest around it.
fn with_manifest(run: &Path) -> PathBuf {
    let is_run = |dir: &&Path| dir.join("manifest.json").is_file();
    let whole = fs::canonicalize(run).unwrap_or_default();
    let enclosing = || whole.ancestors().take(LEVELS).find(is_run);
    if is_run(&run) { run.to_owned() } else { enclosing().unwrap_or(run).to_owned() }
}

/// Sentence about the recordings among the results.
fn recordings_sentence(recorded: &[&Checked]) -> String {
    let invalid = recorded.iter().filter(|checked| checked.invalid().is_some()).count();
    match (invalid, recorded.len()) {
        (_, 0) => String::new(),
        (0, n) => format!(", {n} recorded"),
        (invalid, n) => format!(", INVALID: {invalid} of {n} recordings"),
    }
}

/// Mode of the trials of a run, by its result.
fn mode(directory: &Path) -> Option<String> {
    #[derive(Deserialize)]
    struct Ran {
        mode: String,
    }
    let result = files::read(&directory.join("result.json"), MAX_RESULT_BYTES).ok()?;
    let ran: Ran = serde_json::from_slice(&result).ok()?;
    ran.mode.chars().all(|c| c.is_ascii_lowercase()).then_some(ran.mode)
}

/// The digest of each result in the directory itself.
fn results(directory: &Path) -> Result<BTreeMap<String, String>, Failure> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(directory)? {
        let path = entry?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let is_result = path.extension().is_some_and(|e| RESULTS.iter().any(|known| e == *known));
        if path.is_file() && is_result && name != "manifest.json" {
            let mut digest = Sha256::new();
            std::io::copy(&mut files::open(&path)?, &mut digest)?;
            found.insert(name, hex(&digest.finalize()));
        }
    }
    Ok(found)
}

fn cited(
    read: Manifest,
    mode: Option<String>,
    results: BTreeMap<String, String>,
    manifest: &str,
    recorded: &str,
) -> Cited {
    let mut wrapper = Sha256::new();
    wrapper.update(manifest);
    results.iter().for_each(|(name, digest)| wrapper.update(format!("\n{name} {digest}")));
    let digest = hex(&wrapper.finalize());
    let scenarios: Vec<String> = read.bounds.keys().cloned().collect();
    let title = of_citation("title");
    let text = match scenarios.as_slice() {
        [] => "no scenario".to_owned(),
        [one] => format!("scenario {one}"),
        [first, .., last] => format!("{} scenarios, {first} to {last}", scenarios.len()),
    };
    let marks: String = read.watermarks.iter().map(|mark| format!(", {mark}")).collect();
    let in_mode = mode.as_ref().map(|mode| format!(", {mode}")).unwrap_or_default();
    let Manifest { seed, build, target, program, .. } = &read;
    let (program, key) = (short(program), short(&digest));
    let note = format!(
        "seed {seed}, {text}{in_mode}, {build} build for {target}, program {program}, results {key}{recorded}{marks}"
    );
    let bibtex = bibtex(key, &title, &read.version, &note);
    Cited {
        schema_version: SCHEMA_VERSION,
        title,
        version: read.version,
        program: read.program,
        build: read.build,
        target: read.target,
        seed: read.seed,
        scenarios,
        mode,
        watermarks: read.watermarks,
        results,
        digest,
        bibtex,
    }
}

/// An entry for BibTeX. There is no year in it, since no file of a run records its date.
fn bibtex(key: &str, title: &str, version: &str, note: &str) -> String {
    let (author, title, note) = (of_citation("name"), escaped(title), escaped(note));
    let fields = [
        format!("author  = {{{{{author}}}}}"),
        format!("title   = {{{{{title}}}}}"),
        format!("version = {{{version}}}"),
        format!("note    = {{{note}}}"),
    ];
    format!("@misc{{holdsafe-{key},\n  {}\n}}", fields.join(",\n  "))
}

fn short(digest: &str) -> &str {
    digest.get(..SHORT).unwrap_or(digest)
}

/// Escapes the characters that BibTeX and LaTeX interpret; scenarios' names have underscores.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '_' | '%' | '&' | '#' | '$' | '{' | '}' => escaped.extend(['\\', c]),
            // Two backslashes are a line break, and braces keep the command from taking what follows.
            '\\' => escaped.push_str("\\textbackslash{}"),
            plain => escaped.push(plain),
        }
    }
    escaped
}

/// The value of a key of `CITATION.cff` that stands on one line.
fn of_citation(key: &str) -> String {
    let value =
        CITATION.lines().find_map(|line| line.trim_start_matches(['-', ' ']).strip_prefix(key)?.strip_prefix(": "));
    value.unwrap_or_default().trim_matches('"').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cite_results(results: &[(&str, &str)]) -> Cited {
        let manifest = r#"{"version":"0.1.0","program":"0123456789","build":"release","target":"x","seed":7,
                           "watermarks":["WAIVED: a_b"],"bounds":{"rgb_loss":{},"thermal_loss":{}}}"#;
        let results = results.iter().map(|(name, digest)| ((*name).to_owned(), (*digest).to_owned())).collect();
        cited(serde_json::from_str(manifest).expect("a manifest"), Some("twin".to_owned()), results, "m", "")
    }

    #[test]
    fn backslash_is_text_and_no_command() {
        assert_eq!(escaped("a\\b_c"), "a\\textbackslash{}b\\_c");
    }

    /// LaTeX takes the entry.
    #[test]
    fn citation_names_program_seed_and_results() {
        let cited = cite_results(&[("result.json", "aa")]);
        assert_eq!(cited.title, "holdsafe: does trust decay safely?");
        for part in [
            "{The holdsafe contributors}",
            "seed 7",
            "program 01234567,",
            "rgb\\_loss to thermal\\_loss, twin, ",
            "WAIVED: a\\_b",
        ] {
            assert!(cited.bibtex.contains(part), "{part}: {}", cited.bibtex);
        }
        assert_eq!(cited.bibtex.matches('{').count(), cited.bibtex.matches('}').count());
        assert_ne!(cited.digest, cite_results(&[("result.json", "ab")]).digest, "another result");
        assert_ne!(cited.digest, cite_results(&[("result.jsonl", "aa")]).digest, "under another name");
    }
}
