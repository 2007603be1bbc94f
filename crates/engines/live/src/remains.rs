//! Remains of a run outside its own folder, and their removal.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// Prefix of the folder of unkept logs.
pub const SCRATCH: &str = "holdsafe-run-";

/// The remains.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Remains {
    /// Prefix of every shared-memory name of the run.
    pub prefix: String,
    /// Shared-memory domains: (prefix, root).
    pub domains: Vec<(String, PathBuf)>,
    /// The run's folder for sockets.
    pub folder: PathBuf,
    /// The run's unkept logs: removed when the launcher was killed, since no reader is left.
    pub scratch: Option<PathBuf>,
}

impl Remains {
    /// Removes everything; to be called when no service is left.
    pub fn remove(&self) {
        for (prefix, root) in &self.domains {
            if let Err(error) = link::bus::sweep::sweep(prefix, root) {
                tracing::warn!(%error, prefix, "shared memory not swept");
            }
        }
        remove(&self.folder);
    }

    /// Removes everything and the unkept logs.
    pub fn remove_all(&self) {
        self.remove();
        self.scratch.iter().for_each(|scratch| remove(scratch));
    }
}

fn remove(folder: &Path) {
    if is_ours(folder)
        && folder.exists()
        && let Err(error) = std::fs::remove_dir_all(folder)
    {
        tracing::warn!(%error, "run folder not removed");
    }
}

/// True for a folder of a run only: a mark that another program wrote may name any folder.
fn is_ours(folder: &Path) -> bool {
    let name = folder.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    name.starts_with("holdsafe-") && folder.parent() == Some(&std::env::temp_dir())
}
