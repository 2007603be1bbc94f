//! The run directory: the inputs of a run (manifest), each trial as a line, the result as JSON.
//!
//! Recordings of single trials (MCAP, input journals) are put below it by the engines.

use std::collections::BTreeMap;
use std::fmt::{Arguments, Display};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use evidence::trial::Trial;
use guest::Program;
use link::{files, terminal};
use parallel::paint::{Stream, painted};
use parallel::progress::beside;
use perception::brought::Brought;
use perception::model::hex_digest;
use serde::Serialize;
use serde_json::Value;
use wire::bounds::Bounds;

use super::Context;
use super::failure::{Exit, Failure};
use super::plan::Planned;

/// Inputs of a run.
#[derive(Debug, Serialize)]
pub struct Manifest {
    schema_version: u32,
    version: &'static str,
    /// Digest of the program's sources.
    program: &'static str,
    build: &'static str,
    target: String,
    seed: u64,
    watermarks: Vec<String>,
    bounds: BTreeMap<String, Bounds>,
    /// The detector in place of the shipped one.
    #[serde(skip_serializing_if = "Option::is_none")]
    detector: Option<Brought>,
    /// The guest in place of the unit's mission and navigation.
    #[serde(skip_serializing_if = "Option::is_none")]
    guest: Option<Program>,
    /// [`inputs`] below the root.
    files: BTreeMap<String, String>,
}

impl Manifest {
    /// Inputs of a run of `planned` with the files below the root.
    pub fn new(context: &Context, planned: &[Planned]) -> Result<Self, Failure> {
        let mut watermarks: Vec<String> = planned.iter().filter_map(|p| p.setup.watermark()).collect();
        watermarks.dedup();
        let name = |p: &Planned| p.variation.scenario.name.as_str().to_owned();
        Ok(Self {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION"),
            program: context.program,
            build: if cfg!(debug_assertions) { "debug" } else { "release" },
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            seed: context.seed,
            watermarks,
            bounds: planned.iter().map(|p| (name(p), p.setup.bounds)).collect(),
            detector: planned.iter().find_map(|p| p.setup.detector.clone()),
            guest: planned.iter().find_map(|p| p.setup.guest.as_ref().map(|guest| Program::clone(&guest.program))),
            files: inputs(&context.root()?)?,
        })
    }
}

/// Folders of the files on which a result depends. A folder that a root lacks is left out: the built-in files have no models, which the
/// program's digest covers.
const INPUTS: [&str; 4] = ["scenarios", "platforms", "policies", "crates/perception/models"];

/// SHA-256 of each file below `root` on which a result depends, by its path.
pub fn inputs(root: &Path) -> Result<BTreeMap<String, String>, Failure> {
    let mut files = BTreeMap::new();
    INPUTS.iter().try_for_each(|directory| hash_directory(root, directory, &mut files))?;
    Ok(files)
}

fn hash_directory(root: &Path, directory: &str, files: &mut BTreeMap<String, String>) -> Result<(), Failure> {
    let Ok(entries) = fs::read_dir(root.join(directory)) else { return Ok(()) };
    for entry in entries {
        let entry = entry?;
        let path = entry.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // A link may lead anywhere, in a circle too.
        if entry.file_type()?.is_dir() {
            hash_directory(root, &format!("{directory}/{name}"), files)?;
        }
        if !path.is_file() {
            continue;
        }
        files.insert(format!("{directory}/{name}"), hex_digest(&fs::read(&path)?));
    }
    Ok(())
}

/// Makes the folder `named` by the user, or the first free `<label>-N` in the folder of runs.
pub fn directory(runs: &Path, named: Option<&Path>, label: &str) -> Result<PathBuf, Failure> {
    if let Some(dir) = named {
        fs::create_dir_all(dir)?;
        return Ok(dir.to_owned());
    }
    fs::create_dir_all(runs)?;
    for n in 1..10_000 {
        let dir = runs.join(format!("{label}-{n}"));
        match fs::create_dir(&dir) {
            Ok(()) => return Ok(dir),
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e.into()),
        }
    }
    Err(Failure::new(Exit::Environment, format!("{} is full; remove old runs or use --out DIR", runs.display())))
}

/// Checks that `folder`, for the recording of a trial, is empty or absent.
///
/// # Errors
///
/// When it has content, or is no folder.
pub fn check_unused(folder: &Path) -> Result<(), Failure> {
    match fs::read_dir(folder).map(|mut entries| entries.next().is_none()) {
        Ok(true) => Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Ok(false) => {
            let message =
                format!("{} holds a run already; name another --out or --seed, or remove it", folder.display());
            Err(Failure::new(Exit::Usage, message))
        }
        Err(e) => Err(Failure::new(Exit::Usage, format!("{}: {e}", folder.display()))),
    }
}

/// Name of the file with the inputs of a run.
pub const MANIFEST: &str = "manifest.json";
/// The longest manifest that is read.
const MAX_MANIFEST_BYTES: u64 = 4 << 20;

/// Writes the inputs of a run into its folder. A run with more scenarios continues in the folder of a run that is otherwise equal.
///
/// # Errors
/// When the folder has the inputs of another run, which would be replaced.
pub fn write_manifest(dir: &Path, manifest: &Manifest) -> Result<(), Failure> {
    let path = dir.join(MANIFEST);
    if path.exists() {
        let text = files::read(&path, MAX_MANIFEST_BYTES)?;
        let stored = serde_json::from_slice(&text).unwrap_or(Value::Null);
        if let Some(differs) = difference(&stored, &serde_json::to_value(manifest).map_err(Failure::internal)?) {
            let message = format!("{} has the results of another run{differs}; name another --out", dir.display());
            return Err(Failure::new(Exit::Usage, message));
        }
    }
    write_json(dir, MANIFEST, manifest)
}

/// The first field in which a new manifest does not continue the run of the stored one, in words.
fn difference(stored: &Value, new: &Value) -> Option<String> {
    let (Some(stored), Some(new)) = (stored.as_object(), new.as_object()) else { return Some(String::new()) };
    let field = new.keys().chain(stored.keys()).find(|key| !continues(stored.get(*key), new.get(*key), key))?;
    let short = |value: Option<&Value>| value.map(ToString::to_string).filter(|text| text.len() < 80);
    Some(match (short(stored.get(field)), short(new.get(field))) {
        (Some(stored), Some(new)) => format!(" ({field}: {stored}, this one has {new})"),
        _ => format!(" (another `{field}`)"),
    })
}

/// True if a field is equal in both manifests, or, where it has a value for each scenario, the new one includes all of the stored one.
fn continues(stored: Option<&Value>, new: Option<&Value>, field: &str) -> bool {
    match (field, stored, new) {
        ("bounds", Some(Value::Object(stored)), Some(Value::Object(new))) => {
            stored.iter().all(|(scenario, bounds)| new.get(scenario) == Some(bounds))
        }
        ("watermarks", Some(Value::Array(stored)), Some(Value::Array(new))) => {
            stored.iter().all(|mark| new.contains(mark))
        }
        _ => stored == new,
    }
}

/// A result as it is written: its kind, and the fields of the object.
#[derive(Serialize)]
struct Named<'a, T> {
    kind: &'static str,
    #[serde(flatten)]
    result: &'a T,
}

/// Writes a result as JSON into the run directory, with the name of its kind.
pub fn write_result(dir: &Path, name: &str, kind: &'static str, result: &impl Serialize) -> Result<(), Failure> {
    write_json(dir, name, &Named { kind, result })
}

/// Writes a value as JSON into the run directory.
pub fn write_json(dir: &Path, name: &str, value: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).map_err(Failure::internal)?;
    Ok(fs::write(dir.join(name), text + "\n")?)
}

/// Writes text into the run directory.
pub fn write_text(dir: &Path, name: &str, text: &str) -> Result<(), Failure> {
    Ok(fs::write(dir.join(name), text)?)
}

/// Writes a line for each trial into the run directory.
pub fn write_trials(dir: &Path, name: &str, trials: &[Trial]) -> Result<(), Failure> {
    let mut file = std::io::BufWriter::new(fs::File::create(dir.join(name))?);
    for trial in trials {
        let line = serde_json::to_string(trial).map_err(Failure::internal)?;
        writeln!(file, "{line}")?;
    }
    Ok(file.flush()?)
}

/// Writes a line to stdout, with the line of progress out of its way.
pub fn say(line: Arguments<'_>) {
    beside(|| terminal::say(line));
}

/// Writes a text of results to stdout, its classes in their colours where that takes them.
pub fn show(text: impl Display) {
    say(format_args!("{}", painted(&text.to_string(), Stream::Stdout)));
}

/// Writes a remark to stderr, its classes in their colours where that takes them, with the line of progress out of its way.
pub fn note(line: impl Display) {
    beside(|| terminal::note(format_args!("{}", painted(&line.to_string(), Stream::Stderr))));
}

/// Prints a result as one JSON object on stdout, with the name of its kind.
pub fn print_json(kind: &'static str, result: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string(&Named { kind, result }).map_err(Failure::internal)?;
    say(format_args!("{text}"));
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn only_more_scenarios_go_on_in_a_folder() {
        let manifest =
            |seed: u64, bounds: Value, marks: Value| json!({"seed": seed, "bounds": bounds, "watermarks": marks});
        let stored = manifest(1, json!({"loss": 500}), json!([]));
        assert_eq!(difference(&stored, &stored), None);
        assert_eq!(difference(&stored, &manifest(1, json!({"delay": 9, "loss": 500}), json!(["ABLATION"]))), None);
        for (new, differs) in [
            (manifest(2, json!({"loss": 500}), json!([])), " (seed: 1, this one has 2)"),
            (manifest(1, json!({"delay": 9}), json!([])), " (bounds: {\"loss\":500}, this one has {\"delay\":9})"),
            (
                manifest(1, json!({"delay": 9, "loss": 400}), json!([])),
                " (bounds: {\"loss\":500}, this one has {\"delay\":9,\"loss\":400})",
            ),
            (json!({"seed": 1, "bounds": {"loss": 500}}), " (another `watermarks`)"),
        ] {
            assert_eq!(difference(&stored, &new).as_deref(), Some(differs));
        }
        let marked = manifest(1, json!({"loss": 500}), json!(["ABLATION"]));
        assert!(difference(&marked, &stored).is_some() && difference(&Value::Null, &stored).is_some());
    }
}
