//! The folder of one recorded run: names of its files and folders, in one place.
//!
//! | file or folder | content | written by |
//! |---|---|---|
//! | `recording/audit-<n>.mcap` | the log, as audit frames | the recorder's process, or [`crate::write`] for the twin |
//! | `inputs/<node>.cbor` | the input journal of a live core ([`link::input_journal`]) | each process |
//! | `guard/<node>.cbor` | the log of a guard, or of the launcher ([`link::witness`]) | each process, the launcher |
//! | `site.json`, `enclaves.json`, `enclaves.sig` | the plan of a live run, before it begins | [`crate::write`] |
//! | `events.jsonl` | the evidence as JSON lines | [`crate::events`] |
//! | `replay.json` | results of replaying the input journals | [`crate::replays`] |
//! | `verdict.json` | class, receipt and findings | [`crate::verdict`] |
//! | `held.json` | trust anchors and the digest of every other file, last of all | [`crate::anchors`] |
//!
//! `console::process::player` names the `console.json` and `truth.json` that it reads of a live run. The folders around a run's folder are
//! left to the command that made it.

use std::path::{Path, PathBuf};

use link::files;
use wire::id::{Boot, NodeId};

/// Endings of the folder of a run that is not in its trial's place: an unfinished run, a run that another one replaced, a run that the
/// host spoilt, and the rest of an interrupted start during its removal.
pub mod aside {
    /// Ending of the folder of a run that is being made.
    pub const UNFINISHED: &str = "unfinished";
    /// Ending of the folder of a run that another one replaced, with a number behind it.
    pub const EARLIER: &str = "earlier";
    /// Ending of the folder of a run that the host spoilt, with a number behind it.
    pub const SPOILT: &str = "spoilt";
    /// Ending of the folder of an interrupted start while it is removed, with a number behind it.
    pub const LEFTOVER: &str = "leftover";
}

/// The folder of one run, recorded or to be recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunFolder(PathBuf);

impl RunFolder {
    /// Name of the file of trust anchors.
    pub const ANCHORS: &str = "held.json";
    /// Name of the file of the verdict.
    pub const VERDICT: &str = "verdict.json";
    /// Name of the file of the evidence as JSON lines.
    pub const EVENTS: &str = "events.jsonl";
    /// Name of the file of the planned site.
    pub const SITE: &str = "site.json";
    /// Name of the folder of the log's MCAP files.
    pub const RECORDING: &str = "recording";
    /// Files beside a run's log; one of them is enough, since others may be removed.
    const COMPANIONS: [&str; 4] = [Self::ANCHORS, Self::EVENTS, Self::SITE, Self::VERDICT];

    /// The folder at this path, which may not exist yet.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self(path.into())
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// True if this is the folder of a run. A live one has its site and input journals before anything is recorded.
    pub fn is_run(&self) -> bool {
        let has_companion = || Self::COMPANIONS.iter().any(|file| self.0.join(file).is_file());
        (self.recording().is_dir() || self.has_input_journals()) && has_companion()
    }

    /// True if the name is a seed with an ending in [`aside`]: the run is not in its trial's place.
    pub fn is_aside(&self) -> bool {
        let is_seed = self.0.file_stem().is_some_and(|name| name.as_encoded_bytes().iter().all(u8::is_ascii_digit));
        let ending = self.0.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let endings = [aside::UNFINISHED, aside::EARLIER, aside::SPOILT, aside::LEFTOVER];
        is_seed && endings.iter().any(|aside| ending.starts_with(aside))
    }

    /// True if the run is over: its trust anchors are written last.
    pub fn is_over(&self) -> bool {
        self.anchors().exists()
    }

    /// The folder of the log's MCAP files.
    pub fn recording(&self) -> PathBuf {
        self.0.join(Self::RECORDING)
    }

    /// True if this is a live run's, whose cores leave input journals.
    pub fn has_input_journals(&self) -> bool {
        files::input_journals(&self.0).is_dir()
    }

    /// The input journal of `node`'s start `boot`.
    pub fn input_journal(&self, node: NodeId, boot: Boot) -> PathBuf {
        files::input_journal(&self.0, node, boot)
    }

    /// The folder of the logs that guards and launcher keep themselves.
    pub fn guard_logs(&self) -> PathBuf {
        self.0.join(files::GUARD_LOGS)
    }

    /// The log of the guard in the process of `node`, of its start `boot`; for the campaign node, the launcher's notes.
    pub fn guard_log(&self, node: NodeId, boot: Boot) -> PathBuf {
        files::guard_log(&self.0, node, boot)
    }

    /// The folders into which the processes of a live run write.
    pub fn written_by_processes(&self) -> [PathBuf; 3] {
        [self.recording(), files::input_journals(&self.0), self.guard_logs()]
    }

    /// The file of trust anchors.
    pub fn anchors(&self) -> PathBuf {
        self.0.join(Self::ANCHORS)
    }

    /// The file of the verdict.
    pub fn verdict(&self) -> PathBuf {
        self.0.join(Self::VERDICT)
    }

    /// The file of the evidence as JSON lines.
    pub fn events(&self) -> PathBuf {
        self.0.join(Self::EVENTS)
    }

    /// The file of the planned site.
    pub fn site(&self) -> PathBuf {
        self.0.join(Self::SITE)
    }

    /// The file of the results of replaying the input journals.
    pub fn replays(&self) -> PathBuf {
        self.0.join("replay.json")
    }

    /// The file of the rights on the buses.
    pub fn enclaves(&self) -> PathBuf {
        self.0.join("enclaves.json")
    }

    /// The file of the authority's signature over these rights.
    pub fn enclaves_signature(&self) -> PathBuf {
        self.0.join("enclaves.sig")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seed_with_an_ending_is_aside() {
        let is_aside = |name: &str| RunFolder::new(Path::new("live/loss").join(name)).is_aside();
        assert!(
            is_aside("7.unfinished") && is_aside("7.earlier-2") && is_aside("12.spoilt-1") && is_aside("7.leftover-1")
        );
        assert!(!is_aside("7") && !is_aside("cell.earlier") && !is_aside("7.other"));
    }
}
