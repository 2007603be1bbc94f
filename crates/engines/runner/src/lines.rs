//! A file of JSON lines that grows as a command goes on, and is whole after any end of it, `kill -9` too.
//!
//! A line is an object, written in one piece when it is complete, with a digest at its end (`chain`), so that a changed line is refused.
//! An incomplete last line is ignored, and cut off before another is written. The content of a line is left to its owner.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use link::files;
use parallel::progress::Stop;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::chain::{self, Chain, ChainError};
use super::failure::{Exit, Failure};

/// The longest line that is read.
const MAX_LINE_BYTES: u64 = 1 << 24;
/// Time between two looks at a request to stop.
const LOOK: Duration = Duration::from_millis(100);

/// Fault of a line, for which its file is refused.
#[derive(Debug, thiserror::Error)]
pub enum LineFault {
    /// It does not follow the line before it.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// It is no value of the expected type.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// It has no end within the limit.
    #[error("longer than {MAX_LINE_BYTES} bytes")]
    TooLong,
    /// The number of its result is too large.
    #[error("result {number} of {count}")]
    Number {
        /// Number of the result.
        number: u64,
        /// Number of results; numbers are below it.
        count: u64,
    },
    /// The owner of the file found a fault in its content.
    #[error("{0}")]
    Content(String),
}

/// A file of lines that is open to be written.
#[derive(Debug)]
pub struct Lines {
    path: PathBuf,
    file: File,
    /// Held while a line is written.
    end: Mutex<End>,
}

/// End of the lines of a file.
#[derive(Clone, Debug, Default)]
pub struct End {
    /// Offset of the next line.
    offset: u64,
    /// The digest of the last one.
    chain: Chain,
}

/// Place of a line in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinePlace {
    offset: u64,
    bytes: u32,
}

impl Lines {
    /// Opens or makes the file and gives each whole line to `take`, which returns the fault of one that does not fit.
    pub fn open<T: DeserializeOwned>(
        path: &Path,
        take: impl FnMut(LinePlace, T) -> Result<(), LineFault>,
    ) -> Result<Self, Failure> {
        let file = OpenOptions::new().create(true).read(true).append(true).open(path)?;
        let end = scan(path, &file, take)?;
        file.set_len(end.offset)?;
        Ok(Self { path: path.to_owned(), file, end: Mutex::new(end) })
    }

    /// Adds a line.
    ///
    /// # Errors
    /// When it cannot be written, or is no object with a field.
    pub fn put(&self, value: &impl Serialize) -> Result<LinePlace, Failure> {
        let object = serde_json::to_string(value).map_err(Failure::internal)?;
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        let (line, chain) = end.chain.seal(&object).ok_or_else(|| Failure::internal("an object expected in a line"))?;
        let line = line + "\n";
        let place = LinePlace { offset: end.offset, bytes: u32::try_from(line.len()).map_err(Failure::internal)? };
        if let Err(error) = (&self.file).write_all(line.as_bytes()) {
            // Half a line in the middle would be worse than none.
            self.file.set_len(place.offset)?;
            return Err(error.into());
        }
        *end = End { offset: place.offset + u64::from(place.bytes), chain };
        Ok(place)
    }

    /// Reads a line again.
    pub fn get<T: DeserializeOwned>(&self, place: LinePlace) -> Result<T, Failure> {
        let mut line = vec![0; place.bytes as usize];
        self.file.read_exact_at(&mut line, place.offset)?;
        let changed = |reason: &dyn std::fmt::Display| {
            let (path, offset) = (self.path.display(), place.offset);
            let message = format!("{path}, byte {offset}: {reason}; did another program write there?");
            Failure::new(Exit::Environment, message)
        };
        let (object, _) = chain::split(line.trim_ascii_end()).ok_or_else(|| changed(&"no digest at its end"))?;
        serde_json::from_slice(&object).map_err(|error| changed(&error))
    }
}

/// Locks `directory` for this process until the returned file is closed. Another process that has the lock is waited for, such as one that
/// an engine has lost and started again elsewhere. The kernel releases the lock however a process ends.
///
/// # Errors
/// When the user asks to stop while it waits.
pub fn lock(directory: &Path, stop: &Stop) -> Result<File, Failure> {
    let lock = File::create(directory.join("lock"))?;
    match lock.try_lock() {
        Ok(()) => return Ok(lock),
        Err(TryLockError::WouldBlock) => {}
        Err(TryLockError::Error(error)) => return Err(error.into()),
    }
    link::note!("{}: another process is at work there; waiting for its end", directory.display());
    // A call that waits for the lock returns at no request to stop, so a thread makes it.
    let (sender, locked) = mpsc::channel();
    std::thread::spawn(move || sender.send(lock.lock().map(|()| lock)));
    loop {
        match locked.recv_timeout(LOOK) {
            Ok(lock) => return Ok(lock?),
            Err(_) if stop.is_requested() => {
                let message = format!("stopped while another process is at work in {}", directory.display());
                return Err(Failure::new(Exit::Interrupted, message));
            }
            Err(_) => {}
        }
    }
}

/// Gives the object of each whole line of `path` to `take`, and returns the end of the last one.
///
/// # Errors
/// The first line that is not as it was written, or in which `take` finds a fault.
pub fn scan<T: DeserializeOwned>(
    path: &Path,
    file: impl Read,
    mut take: impl FnMut(LinePlace, T) -> Result<(), LineFault>,
) -> Result<End, Failure> {
    let (mut reader, mut line, mut end) = (BufReader::new(file), Vec::new(), End::default());
    for number in 1u64.. {
        line.clear();
        let bytes = reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
        let read = match line.last() {
            Some(b'\n') => {
                let place = LinePlace { offset: end.offset, bytes: bytes as u32 };
                end.chain.open(line.trim_ascii_end()).map_err(LineFault::from).and_then(|(object, chain)| {
                    end.chain = chain;
                    take(place, serde_json::from_slice(&object)?)
                })
            }
            Some(_) if bytes as u64 == MAX_LINE_BYTES => Err(LineFault::TooLong),
            Some(_) | None => break,
        };
        read.map_err(|fault| {
            let message = format!("{}:{number}: {fault}; remove the file, its results come again", path.display());
            Failure::new(Exit::Usage, message)
        })?;
        end.offset += bytes as u64;
    }
    Ok(end)
}

/// The lines with new digests, for tests of readers of a line that fits its digest. An object may have a digest or none; other lines stay as
/// they are.
pub fn reseal(text: &[u8]) -> Vec<u8> {
    let mut chain = Chain::default();
    let mut sealed = |line: &[u8]| {
        let body = line.trim_ascii_end();
        let object = chain::split(body).map_or_else(|| body.to_vec(), |(object, _)| object);
        let (line, next) = chain.seal(std::str::from_utf8(&object).ok()?)?;
        chain = next;
        Some((line + "\n").into_bytes())
    };
    text.split_inclusive(|byte| *byte == b'\n')
        .flat_map(|line| line.ends_with(b"\n").then(|| sealed(line)).flatten().unwrap_or_else(|| line.to_vec()))
        .collect()
}

/// Gives each whole line of the file at `path` to `take`; a missing file has none. `fits` returns the fault of a line.
///
/// # Errors
/// A line that does not fit, or the first error of `take`, which is no fault of the file.
pub fn each<T: DeserializeOwned>(
    path: &Path,
    fits: impl Fn(&T) -> Result<(), LineFault>,
    mut take: impl FnMut(T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let file = match files::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(e.into()),
    };
    let mut refused = None;
    let read = scan(path, file, |_, line: T| {
        fits(&line)?;
        take(line).map_err(|failure| {
            let fault = LineFault::Content(failure.to_string());
            refused = Some(failure);
            fault
        })
    });
    refused.map_or(read.map(|_| ()), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Line {
        n: u32,
    }

    fn read(path: &Path) -> Result<Vec<u32>, Failure> {
        let mut all = Vec::new();
        Lines::open(path, |_, Line { n }| {
            all.push(n);
            Ok(())
        })?;
        Ok(all)
    }

    /// A file of these lines in a folder.
    fn written(directory: &Path, lines: &[u32]) -> PathBuf {
        let path = directory.join("a.jsonl");
        let file = Lines::open(&path, |_, _: Line| Ok(())).expect("opened");
        for n in lines {
            file.put(&Line { n: *n }).expect("written");
        }
        path
    }

    #[test]
    fn truncated_line_is_cut_before_the_next() {
        let directory = tempfile::tempdir().expect("a folder");
        let path = written(directory.path(), &[1, 22, 33]);
        let text = std::fs::read_to_string(&path).expect("text");
        std::fs::write(&path, &text[..text.len() - 3]).expect("cut");
        let lines = Lines::open(&path, |_, _: Line| Ok(())).expect("opened");
        let place = lines.put(&Line { n: 44 }).expect("written");
        assert_eq!(lines.get::<Line>(place).expect("read again").n, 44);
        drop(lines);
        assert_eq!(read(&path).expect("opened"), [1, 22, 44]);
    }

    /// The wait ends when the other holder releases it, or the user asks to stop.
    #[test]
    fn folder_in_use_is_waited_for() {
        let (directory, stop) = (tempfile::tempdir().expect("a folder"), Stop::default());
        let first = lock(directory.path(), &stop).expect("free");
        std::thread::scope(|scope| {
            let second = scope.spawn(|| lock(directory.path(), &stop).map(|_| ()));
            drop(first);
            assert!(second.join().expect("no panic").is_ok());
        });
        let _held = lock(directory.path(), &stop).expect("free again");
        stop.ask();
        let failure = lock(directory.path(), &stop).expect_err("stopped");
        assert_eq!(failure.exit(), Exit::Interrupted);
        assert!(failure.to_string().contains("another process is at work in"), "{failure}");
    }

    #[test]
    fn changed_line_is_reported_with_remedy() {
        let directory = tempfile::tempdir().expect("a folder");
        let path = written(directory.path(), &[1, 2, 3]);
        let text = std::fs::read_to_string(&path).expect("text");
        std::fs::write(&path, text.replace("\"n\":2", "\"n\":4")).expect("changed");
        let message = read(&path).expect_err("refused").to_string();
        assert!(message.contains("a.jsonl:2: changed by hand") && message.contains("remove the file"), "{message}");
    }
}
