//! Input of a report: result files, read within bounds, or refused with file, place and remedy.
//!
//! The reader of the files stops at [`MAX_FILE_BYTES`] + 1; longer ones are refused here.

use std::collections::BTreeMap;

use evidence::SCHEMA_VERSION;
use results::report::{
    Ablation, BenchLive, CampaignObject, Comparison, CurveObject, InWorlds, Matrix, Reference, RunObject, RunsObject,
    SearchObject, TwinCost,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

/// The longest result that is read. The matrix of 299 trials is below half a megabyte; a run carries its trials, at about 1 kB each.
pub const MAX_FILE_BYTES: usize = 64 << 20;

/// The most files that one dossier is made of.
pub const MAX_FILES: usize = 256;

/// Everything that was given, in the order in which it was.
#[derive(Clone, Debug, Default)]
pub struct Results {
    given: Vec<Given>,
    folders: BTreeMap<String, String>,
}

/// One file and its content.
#[derive(Clone, Debug)]
pub struct Given {
    /// Its name, as it was given.
    pub file: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// The result.
    pub found: FoundResult,
}

/// A result, by its kind.
#[derive(Clone, Debug, PartialEq)]
pub enum FoundResult {
    /// `matrix`.
    Matrix(Matrix),
    /// `run`, or `runs`: one for each scenario.
    Runs(Vec<RunObject>),
    /// `reference`.
    Reference(Reference),
    /// `campaign`.
    Campaign(CampaignObject),
    /// `search`.
    Search(SearchObject),
    /// `guests`.
    Comparison(Comparison),
    /// `bench-live`.
    BenchLive(Box<BenchLive>),
    /// `curve`.
    Curve(CurveObject),
    /// `ablation`.
    Ablation(Ablation),
    /// `bench-twin`.
    TwinCost(TwinCost),
    /// `worlds`.
    Worlds(InWorlds),
}

impl FoundResult {
    /// The name of its kind.
    pub fn kind(&self) -> &'static str {
        match self {
            FoundResult::Matrix(_) => "matrix",
            FoundResult::Runs(_) => "run",
            FoundResult::Reference(_) => "reference",
            FoundResult::Campaign(_) => "campaign",
            FoundResult::Search(_) => "search",
            FoundResult::Comparison(_) => "guests",
            FoundResult::BenchLive(_) => "bench-live",
            FoundResult::Curve(_) => "curve",
            FoundResult::Ablation(_) => "ablation",
            FoundResult::TwinCost(_) => "bench-twin",
            FoundResult::Worlds(_) => "worlds",
        }
    }

    /// The runs of a result that is runs; none of another.
    pub fn runs(&self) -> &[RunObject] {
        if let FoundResult::Runs(runs) = self { runs } else { &[] }
    }

    /// First contradiction in a result: a figure that does not follow from the others. Kinds without such figures have
    /// none. It is checked for results that others made.
    pub fn contradiction(&self) -> Option<String> {
        match self {
            FoundResult::Matrix(matrix) => matrix.contradiction(),
            FoundResult::Runs(runs) => runs.iter().find_map(RunObject::contradiction),
            FoundResult::Reference(reference) => reference.contradiction(),
            FoundResult::Campaign(campaign) => campaign.contradiction(),
            FoundResult::Search(_)
            | FoundResult::Comparison(_)
            | FoundResult::BenchLive(_)
            | FoundResult::Curve(_)
            | FoundResult::Ablation(_)
            | FoundResult::TwinCost(_)
            | FoundResult::Worlds(_) => None,
        }
    }
}

/// The kinds that are read.
const KINDS: &str =
    "matrix, run, runs, reference, campaign, search, guests, bench-live, curve, ablation, bench-twin, worlds";

/// A refused file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {why}")]
pub struct Refused {
    /// Its name, as it was given.
    pub file: String,
    /// The fault.
    #[source]
    pub why: Reason,
}

/// Fault of a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// A file longer than [`MAX_FILE_BYTES`].
    #[error("longer than {} MiB; give fewer trials a file, or the result without its trials", MAX_FILE_BYTES >> 20)]
    TooLong,
    /// More files than a dossier may have, [`MAX_FILES`].
    #[error("more than {MAX_FILES} files; make several dossiers")]
    TooMany,
    /// A duplicate of another file: its trials would count twice.
    #[error("the same result as {0}; give each once")]
    Twice(String),
    /// A file that is not JSON, or not the object that its kind promises.
    #[error("{0}; give the file that `holdsafe … --json` printed, whole and unchanged")]
    Unreadable(String),
    /// A file without a kind.
    #[error("no `kind`; print it again with this version of holdsafe (`--json`)")]
    NoKind,
    /// A file of a kind that is not read.
    #[error("kind `{0}` has no place in a dossier, which takes {KINDS}")]
    OtherKind(String),
    /// A file of another version of the form.
    #[error("schema_version {}, and {SCHEMA_VERSION} is read; print it again with this version of holdsafe", version_text(.0))]
    OtherVersion(Option<u32>),
}

fn version_text(version: &Option<u32>) -> String {
    version.map_or_else(|| "missing".to_owned(), |version| version.to_string())
}

#[derive(Deserialize)]
struct Head {
    kind: Option<String>,
    schema_version: Option<u32>,
}

impl Results {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// The refusal; earlier files stay.
    pub fn read(&mut self, file: &str, bytes: &[u8]) -> Result<(), Refused> {
        let refused = |why| Refused { file: file.to_owned(), why };
        if self.given.len() >= MAX_FILES {
            return Err(refused(Reason::TooMany));
        }
        let found = found(bytes).map_err(refused)?;
        // Compared as objects: the same result in another layout of its JSON is a duplicate too.
        if let Some(before) = self.given.iter().find(|given| given.found == found) {
            return Err(refused(Reason::Twice(before.file.clone())));
        }
        let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        self.given.push(Given { file: file.to_owned(), sha256, found });
        Ok(())
    }

    /// The files, in order.
    pub fn files(&self) -> &[Given] {
        &self.given
    }

    /// Names the folders below `scenarios/` that shipped scenarios lie in, each a scenario's name and its folder.
    pub fn lie_in(&mut self, folders: BTreeMap<String, String>) {
        self.folders = folders;
    }

    /// The folder of a shipped scenario.
    pub(crate) fn folder(&self, scenario: &str) -> Option<&str> {
        self.folders.get(scenario).map(String::as_str)
    }
}

/// `manifest.json` of a run: the inputs that its results depend on.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Manifest {
    /// SHA-256 of each file, hexadecimal, by its path below the repository's root.
    pub files: BTreeMap<String, String>,
    /// Watermarks of the ablations among its variations.
    #[serde(default)]
    pub watermarks: Vec<String>,
}

impl Manifest {
    /// Reads it.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, Refused> {
        let refused = |why| Refused { file: file.to_owned(), why };
        let manifest: Self = bounded(bytes).and_then(object).map_err(refused)?;
        let is_digest = |text: &str| text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit());
        match manifest.files.iter().find(|(_, digest)| !is_digest(digest)) {
            Some((path, _)) => Err(refused(Reason::Unreadable(format!("`{path}` has no SHA-256")))),
            None => Ok(manifest),
        }
    }
}

fn bounded(bytes: &[u8]) -> Result<&[u8], Reason> {
    if bytes.len() > MAX_FILE_BYTES { Err(Reason::TooLong) } else { Ok(bytes) }
}

fn found(bytes: &[u8]) -> Result<FoundResult, Reason> {
    let bytes = bounded(bytes)?;
    // The head first: of another version the version is reported, not the first field that does not fit.
    let head: Head = object(bytes)?;
    let kind = head.kind.ok_or(Reason::NoKind)?;
    if head.schema_version != Some(SCHEMA_VERSION) {
        return Err(Reason::OtherVersion(head.schema_version));
    }
    Ok(match kind.as_str() {
        "matrix" => FoundResult::Matrix(object(bytes)?),
        "run" => FoundResult::Runs(vec![object(bytes)?]),
        "runs" => FoundResult::Runs(object::<RunsObject>(bytes)?.runs),
        "reference" => FoundResult::Reference(object(bytes)?),
        "campaign" => FoundResult::Campaign(object(bytes)?),
        "search" => FoundResult::Search(object(bytes)?),
        "guests" => FoundResult::Comparison(object(bytes)?),
        "bench-live" => FoundResult::BenchLive(Box::new(object(bytes)?)),
        "curve" => FoundResult::Curve(object(bytes)?),
        "ablation" => FoundResult::Ablation(object(bytes)?),
        "bench-twin" => FoundResult::TwinCost(object(bytes)?),
        "worlds" => FoundResult::Worlds(object(bytes)?),
        _ => return Err(Reason::OtherKind(kind)),
    })
}

fn object<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Reason> {
    serde_json::from_slice(bytes).map_err(|e| Reason::Unreadable(e.to_string()))
}

/// A golden result of this kind, which has every field.
#[cfg(test)]
pub(crate) fn golden(kind: &str) -> serde_json::Value {
    let folders = ["results", "../holdsafe"];
    let file = |folder: &str| format!("{}/../{folder}/tests/golden/{kind}-v1.json", env!("CARGO_MANIFEST_DIR"));
    let found = folders.iter().find_map(|folder| std::fs::read(file(folder)).ok());
    serde_json::from_slice(&found.expect("a golden file")).expect("JSON")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use evidence::trial::Outcome;

    use super::*;

    fn refusal(text: &str) -> String {
        Results::default().read("x.json", text.as_bytes()).expect_err("a refusal").to_string()
    }

    #[test]
    fn a_result_is_read_by_its_kind() {
        let mut search = golden("search");
        search["later"] = 7.into();
        let text = search.to_string();
        let mut results = Results::default();
        results.read("x.json", text.as_bytes()).expect("a search");
        let [file] = results.files() else { panic!("one file") };
        let FoundResult::Search(search) = &file.found else { panic!("a search") };
        assert_eq!((search.hunt.trials, search.hunt.outcomes[&Outcome::HoldSafe]), (9, 1));
        assert_eq!((file.file.as_str(), file.sha256.len()), ("x.json", 64));
    }

    #[test]
    fn golden_file_of_every_kind_is_read() {
        let mut results = Results::default();
        for kind in KINDS.split(", ") {
            results.read(kind, golden(kind).to_string().as_bytes()).expect("a result");
        }
        let read: BTreeSet<&str> = results.files().iter().map(|file| file.found.kind()).collect();
        assert_eq!(read.len(), KINDS.split(", ").count() - 1, "`runs` is read as `run`");
    }

    #[test]
    fn unreadable_file_is_refused_with_place_and_remedy() {
        let cut = refusal(r#"{"kind":"matrix","schema_version":1,"#);
        assert!(
            cut.contains("x.json") && cut.contains("line 1 column") && cut.contains("whole and unchanged"),
            "{cut}"
        );
        assert!(refusal(r#"{"schema_version":1}"#).contains("no `kind`"));
        assert!(refusal(r#"{"kind":"doctor","schema_version":1}"#).contains("takes matrix"));
        assert!(refusal(r#"{"kind":"matrix","schema_version":2}"#).contains("schema_version 2"));
        assert!(refusal(r#"{"kind":"matrix"}"#).contains("schema_version missing"));
        let other = refusal(r#"{"kind":"matrix","schema_version":1,"seed":1,"build":"","rows":[{"id":7}]}"#);
        assert!(other.contains("invalid type") && other.contains("column"), "{other}");
    }

    #[test]
    fn lengths_numbers_and_depths_are_bounded() {
        assert!(refusal(&" ".repeat(MAX_FILE_BYTES + 1)).contains("longer than 64 MiB"));
        let deep = |key: &str, n: usize| {
            let (open, close) = ("[".repeat(n), "]".repeat(n));
            refusal(&format!(r#"{{"kind":"campaign","schema_version":1,"rows":[{{"{key}":{{"x":{open}{close}}}}}]}}"#))
        };
        assert!(deep("set", 1 << 20).contains("recursion limit"));
        assert!(deep("later", 1 << 20).contains("missing field"), "what is not read is passed over without recursion");
        let mut results = Results::default();
        let text = |seed| {
            format!(
                r#"{{"kind":"reference","schema_version":1,"seed":{seed},"rows":[],"live_latency_ms":[],"as_expected":true}}"#
            )
        };
        for seed in 0..MAX_FILES {
            results.read("x.json", text(seed).as_bytes()).expect("room");
        }
        assert_eq!(results.read("x.json", text(0).as_bytes()).expect_err("full").why, Reason::TooMany);
    }

    #[test]
    fn no_result_counts_twice_however_it_is_written() {
        let mut results = Results::default();
        let text =
            r#"{"kind":"reference","schema_version":1,"seed":1,"rows":[],"live_latency_ms":[],"as_expected":true}"#;
        results.read("a.json", text.as_bytes()).expect("room");
        let repeated = results.read("b.json", text.replace(',', ", ").as_bytes()).expect_err("the same again");
        assert!(repeated.to_string().contains("the same result as a.json"), "{repeated}");
    }
}
