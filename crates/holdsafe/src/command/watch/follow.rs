//! An input journal that may still grow, read entry by entry as it does.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

use link::input_journal::{Entry, Header, JournalError, Reader};

/// An input journal and the position up to which it has been read.
pub(super) struct Follow {
    file: File,
    /// Its header, and the byte behind the last whole entry; none while the header is still to be written.
    read: Option<(Header, u64)>,
}

impl Follow {
    /// Opens a log at its beginning.
    ///
    /// # Errors
    /// When there is no file at `path`.
    pub(super) fn open(path: &Path) -> Result<Self, JournalError> {
        Ok(Self { file: link::files::open(path)?, read: None })
    }

    /// Hands over every entry that has come since the last look.
    ///
    /// # Errors
    /// When it is no input journal, or damaged.
    pub(super) fn news(&mut self, mut each: impl FnMut(Entry)) -> Result<(), JournalError> {
        self.file.seek(SeekFrom::Start(self.read.map_or(0, |(_, offset)| offset)))?;
        let source = BufReader::new(&self.file);
        let mut log = match self.read {
            Some((header, offset)) => Reader::resume(source, header, offset),
            None => match Reader::new(source) {
                Err(JournalError::Truncated { .. }) => return Ok(()),
                begun => begun?,
            },
        };
        for entry in log.by_ref() {
            match entry {
                Ok(entry) => each(entry),
                // The rest of the entry is still to be written.
                Err(JournalError::Truncated { .. }) => break,
                Err(error) => return Err(error),
            }
        }
        self.read = Some((log.header(), log.offset()));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use link::input_journal::Writer;
    use wire::core::{Input, Output};
    use wire::id::{Boot, NodeId};
    use wire::time::Instant;

    use super::*;

    /// A log is followed from its first byte on.
    #[test]
    fn log_is_followed_over_half_written_entries() {
        let header = Header { node: NodeId::CONSOLE, boot: Boot(1), started: Instant(0) };
        let mut whole = Vec::new();
        let mut log = Writer::new(&mut whole, header, 1 << 20).unwrap();
        for text in ["one", "two"] {
            log.output(&Output::Text { text: text.into(), picture: "{}".into() }).unwrap();
        }
        log.input(Instant(5), &Input::Finish).unwrap();
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let mut seen = Vec::new();
        let mut follow = Follow::open(file.path()).unwrap();
        let mut look = |seen: &mut Vec<String>| {
            let mut finished = false;
            follow
                .news(|entry| match entry {
                    Entry::Output(Output::Text { text, .. }) => seen.push(text),
                    Entry::Input { input, .. } => finished = matches!(input, Input::Finish),
                    Entry::Output(_) | Entry::LeftOut { .. } => {}
                })
                .unwrap();
            finished
        };
        for byte in &whole {
            assert!(!look(&mut seen));
            file.write_all(&[*byte]).unwrap();
        }
        assert!(look(&mut seen) && seen == ["one", "two"], "{seen:?}");
    }
}
