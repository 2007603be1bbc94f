//! Audit frames in the MCAP files that [`crate::recorder`] wrote.
//!
//! The files may be cut or hostile: sizes are bounded before allocation, and a cut file yields the frames before the
//! cut. The chains of the frames are left to `wire::audit`, the run's folder to the crate `recording`.

use std::io::Read;
use std::mem::size_of;
use std::path::{Path, PathBuf};

use mcap::sans_io::{LinearReaderOptions, MessageReadEvent, MessageReader};
use wire::id::NodeId;

use crate::files;
use crate::instrument::{Frame, MAX_FRAME};

/// The largest recording file that is read, bytes.
const MAX_FILE: u64 = 1 << 30;
/// The longest record of a file that is loaded, bytes: the library allocates any length that a file claims.
const MAX_RECORD: usize = 1 << 20;
/// Memory for the frames of one recording, bytes: a tiny compressed file can hold any number.
pub const MAX_MEMORY: usize = 1 << 30;

/// The MCAP files of a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum McapFramesError {
    /// The operating system refused to read a file.
    #[error("{}: {error}", file.display())]
    Io {
        /// The file or folder.
        file: PathBuf,
        /// Reason.
        error: std::io::Error,
    },
    /// It is not a recording, or damaged.
    #[error("{}: not a readable recording: {reason}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The library's message.
        reason: String,
    },
}

/// Every frame of the MCAP files in `directory`, file by file in the order of their numbers.
///
/// # Errors
/// When a file cannot be read at all. A cut file yields the frames before the cut.
pub fn frames_of_folder(directory: &Path) -> Result<Vec<Frame>, McapFramesError> {
    frames_within_lengths(directory, |_| None)
}

/// Every frame in the first bytes of each file, as many as `length` returns for its name; in the whole file where it returns none.
///
/// # Errors
/// As [`frames_of_folder`].
pub fn frames_within_lengths(
    directory: &Path,
    length: impl Fn(&str) -> Option<u64>,
) -> Result<Vec<Frame>, McapFramesError> {
    let io = |error| McapFramesError::Io { file: directory.to_owned(), error };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|e| e == "mcap") {
            files.push(path);
        }
    }
    // Files by their number, the shorter name first: the tenth comes after the second.
    files.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    let (mut frames, mut room) = (Vec::new(), MAX_MEMORY);
    for file in files {
        let most = file.file_name().and_then(|name| length(name.to_str()?));
        let bytes = read_file(&file, most)?;
        frames.extend(frames_of_bytes(&bytes, &mut room).map_err(|reason| McapFramesError::Damaged { file, reason })?);
    }
    Ok(frames)
}

/// The bytes of a file, up to its length.
fn read_file(file: &Path, length: Option<u64>) -> Result<Vec<u8>, McapFramesError> {
    let read = || match length.filter(|length| *length <= MAX_FILE) {
        None => files::read(file, MAX_FILE),
        Some(length) => {
            let mut bytes = Vec::new();
            files::open(file)?.take(length).read_to_end(&mut bytes).map(|_| bytes)
        }
    };
    read().map_err(|error| McapFramesError::Io { file: file.to_owned(), error })
}

/// The frames of one file, within `room` bytes of memory, from which their size is subtracted.
///
/// # Errors
///
/// When they need more.
pub fn frames_of_bytes(bytes: &[u8], room: &mut usize) -> Result<Vec<Frame>, String> {
    let options = LinearReaderOptions::default().with_skip_end_magic(true).with_record_length_limit(MAX_RECORD);
    let mut reader = MessageReader::new_with_options(options);
    let (mut frames, mut rest) = (Vec::new(), bytes);
    // A cut file ends in an error; the frames before it count.
    while let Some(Ok(event)) = reader.next_event() {
        let message = match event {
            MessageReadEvent::Message(message) => message,
            MessageReadEvent::ReadRequest(need) => {
                let (next, remaining) = rest.split_at(need.min(rest.len()));
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                rest = remaining;
                continue;
            }
        };
        let node = NodeId::from_name(message.channel.topic.trim_start_matches("/audit/"));
        let Some(node) = node.filter(|_| message.data.len() <= MAX_FRAME) else { continue };
        let size = size_of::<Frame>() + message.data.len();
        *room = room.checked_sub(size).ok_or("more entries than any run of ours writes")?;
        frames.push(Frame { trace_us: message.log_time / 1000, node, bytes: message.data.into_owned() });
    }
    Ok(frames)
}
