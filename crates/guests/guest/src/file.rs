//! The file of a guest: how the program is started, what it takes and gives, what its states mean, and its limits.
//!
//! A file is checked whole before anything starts: every path it names is read by the caller's reader and held to its pin. Reading from disk and
//! starting the process are left to the caller.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use ground_truth::BusAttack;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use strum::{IntoStaticStr, VariantArray};
use toml::Spanned;
use wire::guest::{Declared, MAX_NAME};

/// Most words of a command, variables of an environment, states or pinned files.
const MAX_ITEMS: usize = 64;
/// Longest word of a command or value of a variable, bytes.
const MAX_WORD: usize = 4096;
/// Version of the protocol between the core and a guest.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    JsonSchema,
    IntoStaticStr,
    VariantArray,
)]
pub enum Protocol {
    /// Positions, tracks and set-points by speed and curvature.
    #[default]
    #[serde(rename = "jsonl/1")]
    #[strum(serialize = "jsonl/1")]
    V1,
    /// Also the body, the start, heights, returns of LiDAR, velocities as set-points, and attacks on the guest's own bus.
    #[serde(rename = "jsonl/2")]
    #[strum(serialize = "jsonl/2")]
    V2,
}

impl Protocol {
    /// The name in files and requests.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Inputs that a guest may be given beside the mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// Position fixes and odometry.
    Navigation,
    /// Objects that perception tracks.
    Tracks,
    /// Places that other units claim.
    Teammates,
    /// Returns of LiDAR nearby, without a class. From `jsonl/2` on.
    Nearby,
}

/// Outputs that a guest may promise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// Set-points. Every guest gives these.
    Drive,
    /// The name of its state, one of `states`.
    State,
    /// The place that it drives by. Needed to judge how long it follows a false one.
    Place,
}

/// Limits of the process. Each has a default, and a range that the file cannot leave.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Limit from the start of the process to its first answer, ms of real time (1 to 60,000).
    pub start_ms: u64,
    /// Limit from a step to its answer, ms of real time (1 to 10,000).
    pub step_ms: u64,
    /// Address space, MiB (16 to 65,536).
    pub memory_mib: u64,
    /// Open files (8 to 1,024).
    pub files: u64,
    /// Processes and threads (1 to 256).
    pub processes: u64,
    /// CPU time, s (1 to 3,600).
    pub cpu_s: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { start_ms: 10_000, step_ms: 1_000, memory_mib: 4096, files: 64, processes: 16, cpu_s: 600 }
    }
}

/// The file as it is written.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Written {
    /// Name in reports, 1 to 40 characters of a-z, 0-9, `-` and `_`.
    #[schemars(with = "String")]
    name: Spanned<String>,
    /// The program and its arguments. A path with a `/` that is not absolute is taken from the file's own folder; `{dir}`
    /// in an argument means that folder.
    #[schemars(with = "Vec<String>")]
    command: Spanned<Vec<String>>,
    /// `jsonl/1` or `jsonl/2`.
    #[schemars(with = "Protocol")]
    protocol: Spanned<String>,
    /// True if one process serves several trials, each with a `start` of its own. From `jsonl/2` on.
    #[serde(default)]
    #[schemars(with = "bool")]
    reuse: Option<Spanned<bool>>,
    /// Attacks that the guest's adapter carries out on the guest's own bus when it is asked to. From `jsonl/2` on.
    #[serde(default)]
    #[schemars(with = "Vec<BusAttack>")]
    bus: Option<Spanned<Vec<BusAttack>>>,
    /// Inputs beside the mission.
    #[serde(default)]
    takes: Vec<Input>,
    /// Outputs.
    #[schemars(with = "Vec<Output>")]
    gives: Spanned<Vec<Output>>,
    /// The guest's names for its states, each with its meaning.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, String>")]
    states: BTreeMap<Spanned<String>, Declared>,
    /// The whole environment of the process.
    #[serde(default)]
    environment: BTreeMap<String, String>,
    /// SHA-256 of files, hexadecimal, by path from the file's folder.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, String>")]
    pins: BTreeMap<String, Spanned<String>>,
    /// Limits of the process.
    #[serde(default)]
    #[schemars(with = "Limits")]
    limits: Option<Spanned<Limits>>,
}

/// A guest's program, its file checked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// Name in reports.
    pub name: String,
    /// Program and arguments, paths resolved.
    pub command: Vec<String>,
    /// Folder of the file: the working directory of the process.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Version of the protocol.
    #[serde(default)]
    pub protocol: Protocol,
    /// True if one process serves several trials.
    #[serde(default)]
    pub reuse: bool,
    /// Attacks that the adapter carries out on the guest's bus, without repeats.
    #[serde(default)]
    pub bus: Vec<BusAttack>,
    /// Inputs in addition to the mission, without repeats.
    pub takes: Vec<Input>,
    /// Outputs, without repeats.
    pub gives: Vec<Output>,
    /// Meaning of each state.
    pub states: BTreeMap<String, Declared>,
    /// The whole environment of the process.
    pub environment: BTreeMap<String, String>,
    /// SHA-256 of the file, of every pinned file by its path from the folder, and of every file that the command names by its path, hexadecimal;
    /// the file itself has the empty path.
    pub digests: BTreeMap<String, String>,
    /// Limits of the process.
    pub limits: Limits,
}

/// A mistake in a guest's file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct FileError {
    /// Bytes of the file with the mistake; none for the whole file.
    pub at: Option<Range<usize>>,
    /// Expected and received value, in words.
    pub message: String,
    /// Remedy.
    pub remedy: &'static str,
}

impl Program {
    /// The program of a file's `text` in `folder`; `read` gives a pinned file's bytes.
    ///
    /// # Errors
    /// The first mistake, at its place.
    pub fn parse(
        text: &str,
        folder: &Path,
        read: impl Fn(&Path) -> Result<Vec<u8>, String>,
    ) -> Result<Program, FileError> {
        let written: Written = toml::from_str(text).map_err(|error| FileError {
            at: error.span(),
            message: error.message().trim().to_owned(),
            remedy: "`holdsafe guest schema` prints the fields of a guest file",
        })?;
        let mut digests = pinned(&written.pins, folder, &read)?;
        digests.insert(String::new(), digest(text.as_bytes()));
        let mut program = written.check(folder, digests)?;
        // The program and files among its arguments, so that results of another version are not taken for this one's.
        for path in program.command.iter().filter(|word| word.contains('/')) {
            // A word that is no readable file may be an argument of another kind, such as a URL.
            if let Ok(bytes) = read(Path::new(path)) {
                program.digests.insert(path.clone(), digest(&bytes));
            }
        }
        Ok(program)
    }

    /// True if the guest takes this input.
    pub fn takes(&self, input: Input) -> bool {
        self.takes.contains(&input)
    }

    /// True if the guest promises this output.
    pub fn gives(&self, output: Output) -> bool {
        self.gives.contains(&output)
    }
}

impl Written {
    fn check(self, folder: &Path, digests: BTreeMap<String, String>) -> Result<Program, FileError> {
        let Written { name, command, protocol, reuse, bus, takes, gives, states, environment, limits, .. } = self;
        named(&name)?;
        let version = Protocol::VARIANTS.iter().copied().find(|version| version.name() == protocol.get_ref());
        let Some(version) = version else {
            let message = format!("protocol jsonl/1 or jsonl/2 expected, got {}", protocol.get_ref());
            return Err(mistake(protocol.span(), message, "this version of holdsafe speaks no other"));
        };
        let newer = [reuse.as_ref().map(Spanned::span), bus.as_ref().map(Spanned::span)].into_iter().flatten().next();
        if let Some(bytes) = newer.filter(|_| version == Protocol::V1) {
            return Err(mistake(bytes, "`reuse` and `bus` need protocol jsonl/2", "set protocol = \"jsonl/2\""));
        }
        if version == Protocol::V1 && takes.contains(&Input::Nearby) {
            return Err(mistake(protocol.span(), "`nearby` needs protocol jsonl/2", "set protocol = \"jsonl/2\""));
        }
        if !gives.get_ref().contains(&Output::Drive) {
            let message = "`drive` is not among the outputs";
            return Err(mistake(gives.span(), message, "a guest that gives no set-points cannot be put to the test"));
        }
        let declares = gives.get_ref().contains(&Output::State);
        if declares == states.is_empty() {
            let message = if declares { "`state` is given and `states` is empty" } else { "`states` without `state`" };
            return Err(mistake(gives.span(), message, "give `state` and name each state in [states], or neither"));
        }
        for state in states.keys() {
            short(state)?;
        }
        few("environment", environment.len())?;
        few("states", states.len())?;
        if let Some((name, _)) = environment.iter().find(|(name, value)| !variable(name, value)) {
            let message = format!("environment variable {name:?} has a name or value that no process can take");
            return Err(mistake(0..0, message, "names of A-Z, a-z, 0-9 and _; values without NUL"));
        }
        let limits = limits.map_or_else(|| Ok(Limits::default()), |limits| check_limits(&limits))?;
        Ok(Program {
            name: name.into_inner(),
            command: resolved(&command, folder)?,
            folder: folder.to_owned(),
            protocol: version,
            reuse: reuse.is_some_and(Spanned::into_inner),
            bus: without_repeats(bus.map(Spanned::into_inner).unwrap_or_default()),
            takes: without_repeats(takes),
            gives: without_repeats(gives.into_inner()),
            states: states.into_iter().map(|(state, means)| (state.into_inner(), means)).collect(),
            environment,
            digests,
            limits,
        })
    }
}

fn mistake(bytes: Range<usize>, message: impl Into<String>, remedy: &'static str) -> FileError {
    FileError { at: (!bytes.is_empty()).then_some(bytes), message: message.into(), remedy }
}

fn named(name: &Spanned<String>) -> Result<(), FileError> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '_');
    let text = name.get_ref();
    if (1..=MAX_NAME).contains(&text.len()) && text.chars().all(plain) {
        return Ok(());
    }
    let message =
        format!("a name of 1 to {MAX_NAME} characters expected, got {:?}", text.chars().take(60).collect::<String>());
    Err(mistake(name.span(), message, "use a-z, 0-9, - and _"))
}

fn short(state: &Spanned<String>) -> Result<(), FileError> {
    let text = state.get_ref();
    if (1..=MAX_NAME).contains(&text.len()) && !text.chars().any(char::is_control) {
        return Ok(());
    }
    Err(mistake(state.span(), format!("a state of 1 to {MAX_NAME} bytes expected"), "shorten the state's name"))
}

fn few(name: &str, got: usize) -> Result<(), FileError> {
    if got <= MAX_ITEMS {
        return Ok(());
    }
    Err(mistake(0..0, format!("{name}: at most {MAX_ITEMS} entries expected, got {got}"), "take some out"))
}

fn variable(name: &str, value: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    (1..=MAX_NAME).contains(&name.len()) && name.chars().all(plain) && value.len() <= MAX_WORD && !value.contains('\0')
}

fn without_repeats<T: Ord>(mut items: Vec<T>) -> Vec<T> {
    items.sort();
    items.dedup();
    items
}

/// The command with its paths from the file's folder.
fn resolved(command: &Spanned<Vec<String>>, folder: &Path) -> Result<Vec<String>, FileError> {
    let words = command.get_ref();
    let bad = |word: &String| word.len() > MAX_WORD || word.contains('\0');
    if words.is_empty() || words.len() > MAX_ITEMS || words[0].is_empty() || words.iter().any(bad) {
        let message = format!("a program and at most {} arguments of {MAX_WORD} bytes expected", MAX_ITEMS - 1);
        return Err(mistake(command.span(), message, "command = [\"program\", \"argument\", ...]"));
    }
    let dir = folder.to_string_lossy();
    let mut resolved: Vec<String> = words.iter().map(|word| word.replace("{dir}", &dir)).collect();
    if resolved[0].contains('/') && !Path::new(&resolved[0]).is_absolute() {
        resolved[0] = folder.join(&resolved[0]).to_string_lossy().into_owned();
    }
    Ok(resolved)
}

fn check_limits(limits: &Spanned<Limits>) -> Result<Limits, FileError> {
    let Limits { start_ms, step_ms, memory_mib, files, processes, cpu_s } = *limits.get_ref();
    let ranges = [
        ("start_ms", start_ms, 1, 60_000),
        ("step_ms", step_ms, 1, 10_000),
        ("memory_mib", memory_mib, 16, 65_536),
        ("files", files, 8, 1024),
        ("processes", processes, 1, 256),
        ("cpu_s", cpu_s, 1, 3600),
    ];
    match ranges.into_iter().find(|(_, got, least, most)| !(least..=most).contains(&got)) {
        Some((field, got, least, most)) => {
            let message = format!("{field}: {least} to {most} expected, got {got}");
            Err(mistake(limits.span(), message, "choose a limit within the range, or leave the default"))
        }
        None => Ok(limits.get_ref().clone()),
    }
}

fn pinned(
    pins: &BTreeMap<String, Spanned<String>>,
    folder: &Path,
    read: impl Fn(&Path) -> Result<Vec<u8>, String>,
) -> Result<BTreeMap<String, String>, FileError> {
    few("pins", pins.len())?;
    let held = pins.iter().map(|(path, pin)| {
        let bytes = read(&folder.join(path)).map_err(|reason| {
            mistake(
                pin.span(),
                format!("{path}: {reason}"),
                "pin files that are there, by their path from this file's folder",
            )
        })?;
        let got = digest(&bytes);
        if got != pin.get_ref().to_ascii_lowercase() {
            let message = format!("{path}: SHA-256 {} expected, got {got}", pin.get_ref());
            return Err(mistake(
                pin.span(),
                message,
                "the file is not the one that was pinned: restore it, or pin this one",
            ));
        }
        Ok((path.clone(), got))
    });
    held.collect()
}

/// SHA-256, hexadecimal.
fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
name = "follower"
command = ["python3", "{dir}/follower.py"]
protocol = "jsonl/1"
takes = ["navigation"]
gives = ["drive", "state"]
[states]
DRIVING = "nominal"
"#;

    fn parse(text: &str) -> Result<Program, FileError> {
        Program::parse(text, Path::new("/guests/f"), |path| {
            if path.ends_with("model.bin") { Ok(b"weights".to_vec()) } else { Err("no such file".into()) }
        })
    }

    #[test]
    fn paths_are_taken_from_the_files_folder() {
        let program = parse(GOOD).unwrap();
        assert_eq!(program.command, ["python3", "/guests/f/follower.py"]);
        let beside = parse(&GOOD.replace("python3", "./run")).unwrap();
        assert_eq!(beside.command[0], "/guests/f/./run");
        assert!(program.takes(Input::Navigation) && !program.takes(Input::Tracks) && !program.gives(Output::Place));
    }

    #[test]
    fn each_mistake_is_named_at_its_place() {
        let cases = [
            ("\"jsonl/1\"", "\"jsonl/3\"", "protocol jsonl/1 or jsonl/2 expected, got jsonl/3"),
            ("\"jsonl/1\"", "\"jsonl/1\"\nreuse = true", "`reuse` and `bus` need protocol jsonl/2"),
            ("\"jsonl/1\"", "\"jsonl/1\"\nbus = [\"clock\"]", "`reuse` and `bus` need protocol jsonl/2"),
            ("\"jsonl/1\"", "\"jsonl/2\"\nbus = [\"gravity\"]", "unknown variant `gravity`"),
            ("[\"navigation\"]", "[\"nearby\"]", "`nearby` needs protocol jsonl/2"),
            ("\"follower\"", "\"Follower!\"", "a name of 1 to 40 characters expected"),
            ("[\"drive\", \"state\"]", "[\"state\"]", "`drive` is not among the outputs"),
            ("[\"drive\", \"state\"]", "[\"drive\"]", "`states` without `state`"),
            ("\"nominal\"", "\"fine\"", "unknown variant `fine`"),
            ("[\"python3\", \"{dir}/follower.py\"]", "[]", "a program and at most"),
            ("takes", "takse", "unknown field `takse`"),
            ("[states]", "[limits]\nstep_ms = 0\n[states]", "step_ms: 1 to 10000 expected, got 0"),
            ("[states]", "[pins]\n\"no.bin\" = \"00\"\n[states]", "no.bin: no such file"),
            ("[states]", "[pins]\n\"model.bin\" = \"00\"\n[states]", "model.bin: SHA-256 00 expected, got"),
        ];
        for (from, to, message) in cases {
            let text = GOOD.replace(from, to);
            let error = parse(&text).expect_err(message);
            assert!(error.message.contains(message), "{} / {message}", error.message);
            assert!(error.at.is_some_and(|place| place.end <= text.len()), "{message} has a place");
        }
    }

    #[test]
    fn pinned_files_are_held_by_their_digest() {
        let digest = digest(b"weights");
        let program =
            parse(&GOOD.replace("[states]", &format!("[pins]\n\"model.bin\" = \"{digest}\"\n[states]"))).unwrap();
        assert_eq!(program.digests.get("model.bin"), Some(&digest));
        assert_eq!(program.digests.len(), 2, "the file itself too");
    }
}
