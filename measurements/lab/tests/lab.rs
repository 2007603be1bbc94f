//! The measuring program from its authors' side.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

#[path = "lab/documented.rs"]
mod documented;
#[path = "../../../crates/holdsafe/tests/command/documents.rs"]
mod documents;
#[path = "lab/forms.rs"]
mod forms;
#[path = "lab/frames.rs"]
mod frames;
#[path = "../../../crates/holdsafe/tests/command/golden.rs"]
mod golden;
#[path = "lab/links.rs"]
mod links;
#[path = "lab/records.rs"]
mod records;
#[path = "lab/searches.rs"]
mod searches;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn lab(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lab"));
    let output = command.args(["--root", root().to_str().unwrap()]).args(arguments).output().unwrap();
    golden::hold(&output.stdout);
    output
}
