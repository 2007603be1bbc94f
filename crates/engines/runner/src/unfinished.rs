//! The folder of a trial's recording in a command that resumes: under a temporary name until the recording is complete, then under the
//! trial's.
//!
//! Only a folder of a temporary name is ever removed, and only while it has no complete recording. A complete recording is evidence: where
//! another replaces it, it is moved aside, and a message names it. The content of a recording, and the endings of these folders, are left
//! to `recording`.

use std::fs;
use std::path::{Path, PathBuf};

use recording::RunFolder;
use recording::layout::aside::{EARLIER, LEFTOVER, SPOILT, UNFINISHED};

use super::failure::{Exit, Failure};
use super::{out, retry};

/// Folders with one of these endings beside one trial, at most.
const MOST_ASIDE: u32 = 1_000;

/// A recording that is being made.
pub(crate) struct Unfinished {
    folder: PathBuf,
    place: PathBuf,
}

impl Unfinished {
    /// Makes the folder of a recording for `place`. The unfinished folder of an interrupted start is removed.
    pub(crate) fn begin(place: PathBuf) -> Result<Self, Failure> {
        let folder = place.with_extension(UNFINISHED);
        if has_complete(&folder) {
            move_aside(&folder, &find_free(&place, EARLIER)?)?;
        } else if folder.exists() {
            let leftover = find_free(&place, LEFTOVER)?;
            fs::rename(&folder, &leftover)?;
            // Services of a killed run may still write there for a moment; no reader mistakes that for a recording.
            let _remains = fs::remove_dir_all(&leftover);
        }
        fs::create_dir_all(&folder)?;
        Ok(Self { folder, place })
    }

    /// The folder while the recording is incomplete.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Moves the recording to its place, and an earlier one there aside.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        if out::check_unused(&self.place).is_err() {
            move_aside(&self.place, &find_free(&self.place, EARLIER)?)?;
        }
        Ok(fs::rename(self.folder, self.place)?)
    }

    /// Moves the recording of a trial that the host spoilt aside.
    pub(crate) fn put_aside(self) -> Result<(), Failure> {
        Ok(fs::rename(self.folder, find_free(&self.place, SPOILT)?)?)
    }
}

/// True if the folder has a complete recording: its own, or one of an attempt that the host spoilt.
fn has_complete(folder: &Path) -> bool {
    let attempts = (1..=retry::MAX_RETRIES).map(|n| folder.join(format!("{}{n}", retry::SPOILT)));
    std::iter::once(folder.to_owned()).chain(attempts).any(|attempt| RunFolder::new(attempt).is_over())
}

/// Moves a complete recording aside, and reports it.
fn move_aside(folder: &Path, aside: &Path) -> Result<(), Failure> {
    out::note(format_args!(
        "{}: a complete recording of an earlier start, in whose place another comes, is now {}",
        folder.display(),
        aside.display()
    ));
    Ok(fs::rename(folder, aside)?)
}

/// The first free folder beside `place` with this ending.
fn find_free(place: &Path, ending: &str) -> Result<PathBuf, Failure> {
    let mut all = (1..=MOST_ASIDE).map(|n| place.with_extension(format!("{ending}-{n}")));
    all.find(|folder| !folder.exists()).ok_or_else(|| {
        let message = format!(
            "{}: {MOST_ASIDE} recordings lie aside; remove those whose name holds `.{ending}-`",
            place.display()
        );
        Failure::new(Exit::Environment, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording that is being made at `place`, with `content` in a file; with anchors if it is `complete`.
    fn made(place: &Path, content: &str, complete: bool) -> Unfinished {
        let made = Unfinished::begin(place.to_owned()).unwrap();
        fs::write(made.folder().join("events.jsonl"), content).unwrap();
        if complete {
            fs::write(RunFolder::new(made.folder()).anchors(), content).unwrap();
        }
        made
    }

    fn content(folder: &Path) -> Option<String> {
        fs::read_to_string(folder.join("events.jsonl")).ok()
    }

    #[test]
    fn remains_of_an_interruption_are_removed() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("live/loss/1");
        let _interrupted = made(&place, "half", false);
        made(&place, "whole", true).finish().unwrap();
        assert_eq!(content(&place).as_deref(), Some("whole"));
        assert_eq!(fs::read_dir(place.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn complete_recording_is_never_overwritten() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("1");
        for n in ["first", "second", "third"] {
            made(&place, n, true).finish().unwrap();
        }
        let _not_on_the_shelf = made(&place, "fourth", true);
        made(&place, "fifth", true).finish().unwrap();
        let aside = |n: u32| content(&place.with_extension(format!("earlier-{n}"))).unwrap();
        assert_eq!([1, 2, 3, 4].map(aside), ["first", "second", "fourth", "third"]);
        assert_eq!(content(&place).as_deref(), Some("fifth"));
    }

    #[test]
    fn recording_of_a_spoilt_trial_lies_aside() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("1");
        made(&place, "spoilt", true).put_aside().unwrap();
        made(&place, "judged", true).finish().unwrap();
        assert_eq!(content(&place.with_extension("spoilt-1")).as_deref(), Some("spoilt"));
        assert_eq!(content(&place).as_deref(), Some("judged"));
    }
}
