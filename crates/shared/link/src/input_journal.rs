//! Input journals: every input of a core and every output, in order.
//!
//! A journal is a magic, a header, then entries; each is a length (u32, big-endian) and that many bytes of CBOR. Feeding the
//! inputs to a fresh core must give the same outputs, byte for byte ([`replay`]). The writer may have been killed at any
//! byte; the reader reports a damage and its place, and allocates no more than [`MAX_ENTRY`]. A stored journal may lack most
//! of the sensor frames ([`thin`]).
//!
//! The journal is in `link` and not in `recording`, which owns the folder of a run: the processes of `link` write it
//! ([`crate::drive`]), and the console's player reads it, which depends on `wire` and `link` only.

use std::io::{self, Read, Write};

use minicbor::{Decode, Encode};
use wire::core::{Core, Input, Output, Topic};
use wire::event::wire_hash;
use wire::id::{Boot, NodeId};
use wire::time::Instant;

/// First bytes of every journal.
pub const MAGIC: [u8; 8] = *b"hsmouth1";

/// The largest encoded entry, in bytes: a rendered frame and its envelope.
pub const MAX_ENTRY: usize = 512 * 1024;

/// Owner of the journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Header {
    /// The node.
    #[n(0)]
    pub node: NodeId,
    /// Its boot.
    #[n(1)]
    pub boot: Boot,
    /// The host's time at the start of the core.
    #[n(2)]
    pub started: Instant,
}

/// One input or output of a core.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Entry {
    /// An input, fed to the core at `now`.
    #[n(0)]
    Input {
        /// The host's time.
        #[n(0)]
        now: Instant,
        /// The input.
        #[n(1)]
        input: Input,
    },
    /// An output of the core after the last input.
    #[n(1)]
    Output(#[n(0)] Output),
    /// A message on shared memory that [thinning](thin) removed.
    #[n(2)]
    LeftOut {
        /// The host's time of an input; none for an output.
        #[n(0)]
        now: Option<Instant>,
        /// Its channel.
        #[n(1)]
        topic: Topic,
        /// Its length in bytes.
        #[n(2)]
        length: u32,
        /// Its [`wire_hash`], by which insiders name their messages.
        #[n(3)]
        hash: u64,
    },
}

/// [`Entry`] by reference; same bytes.
#[derive(Encode)]
enum EntryRef<'a> {
    #[n(0)]
    Input {
        #[n(0)]
        now: Instant,
        #[n(1)]
        input: &'a Input,
    },
    #[n(1)]
    Output(#[n(0)] &'a Output),
}

/// A journal could not be read.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// Not an input journal.
    #[error("no input journal: the first bytes are wrong")]
    Magic,
    /// The file ends inside an entry (a killed writer leaves this).
    #[error("cut off inside the entry at byte {offset}")]
    Truncated {
        /// Offset of the entry.
        offset: u64,
    },
    /// A length beyond [`MAX_ENTRY`].
    #[error("entry at byte {offset} claims {length} bytes")]
    TooLong {
        /// Offset of the entry.
        offset: u64,
        /// Claimed length.
        length: u64,
    },
    /// Bytes that are not exactly one entry.
    #[error("entry at byte {offset} does not decode: {reason}")]
    Malformed {
        /// Offset of the entry.
        offset: u64,
        /// The decoder's error.
        reason: String,
    },
    /// The file.
    #[error("reading: {0}")]
    Io(#[from] io::Error),
}

/// Writer of a journal, up to a number of bytes; the excess is counted.
pub struct Writer<W: Write> {
    out: W,
    room: u64,
    entries: u64,
    dropped: u64,
}

impl<W: Write> Writer<W> {
    /// Starts a journal of at most `room` bytes of entries.
    ///
    /// # Errors
    /// As the writer below.
    pub fn new(mut out: W, header: Header, room: u64) -> io::Result<Self> {
        out.write_all(&MAGIC)?;
        let mut this = Self { out, room, entries: 0, dropped: 0 };
        this.append(&header)?;
        this.entries = 0;
        Ok(this)
    }

    /// Notes an input.
    ///
    /// # Errors
    /// As the writer below.
    pub fn input(&mut self, now: Instant, input: &Input) -> io::Result<()> {
        self.append(&EntryRef::Input { now, input })
    }

    /// Notes an output.
    ///
    /// # Errors
    /// As the writer below.
    pub fn output(&mut self, output: &Output) -> io::Result<()> {
        self.append(&EntryRef::Output(output))
    }

    /// Appends an entry of another journal.
    ///
    /// # Errors
    ///
    /// As the writer below.
    pub fn entry(&mut self, entry: &Entry) -> io::Result<()> {
        self.append(entry)
    }

    /// Hands everything to the writer below.
    ///
    /// # Errors
    /// As the writer below.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Entries written, and entries for which there was no room.
    pub fn counts(&self) -> (u64, u64) {
        (self.entries, self.dropped)
    }

    fn append<T: Encode<()>>(&mut self, entry: &T) -> io::Result<()> {
        let bytes = minicbor::to_vec(entry).map_err(io::Error::other)?;
        let length = u32::try_from(bytes.len()).map_err(io::Error::other)?;
        let cost = u64::from(length) + 4;
        // A journal cannot be replayed past an entry that was left out, so nothing is written after it.
        if self.dropped > 0 || cost > self.room || bytes.len() > MAX_ENTRY {
            self.dropped += 1;
            return Ok(());
        }
        self.room -= cost;
        self.entries += 1;
        self.out.write_all(&length.to_be_bytes())?;
        self.out.write_all(&bytes)
    }
}

/// Reader of a journal, entry by entry; ends after the first error.
pub struct Reader<R: Read> {
    source: R,
    /// Offset behind the last whole entry.
    offset: u64,
    header: Header,
    ended: bool,
}

impl<R: Read> Reader<R> {
    /// Reads magic and header.
    ///
    /// # Errors
    /// When they are wrong or cut.
    pub fn new(mut source: R) -> Result<Self, JournalError> {
        let mut magic = [0; MAGIC.len()];
        let filled = fill(&mut source, &mut magic)?;
        if magic[..filled] != MAGIC[..filled] {
            return Err(JournalError::Magic);
        }
        if filled < magic.len() {
            return Err(JournalError::Truncated { offset: 0 });
        }
        let mut offset = MAGIC.len() as u64;
        let header = record(&mut source, &mut offset)?.ok_or(JournalError::Truncated { offset })?;
        Ok(Self { source, offset, header, ended: false })
    }

    /// Continues a journal that may have grown; `source` is at `offset`, behind the last whole entry.
    pub fn resume(source: R, header: Header, offset: u64) -> Self {
        Self { source, offset, header, ended: false }
    }

    /// Owner of the journal.
    pub fn header(&self) -> Header {
        self.header
    }

    /// Offset behind the last whole entry.
    pub fn offset(&self) -> u64 {
        self.offset
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Entry, JournalError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let next = record(&mut self.source, &mut self.offset).transpose();
        self.ended = !matches!(next, Some(Ok(_)));
        next
    }
}

/// One length-prefixed record; `None` at a clean end.
fn record<T: for<'b> Decode<'b, ()>>(source: &mut impl Read, offset: &mut u64) -> Result<Option<T>, JournalError> {
    let mut prefix = [0; 4];
    match fill(source, &mut prefix)? {
        0 => return Ok(None),
        4 => {}
        _ => return Err(JournalError::Truncated { offset: *offset }),
    }
    let length = u32::from_be_bytes(prefix) as usize;
    if length > MAX_ENTRY {
        return Err(JournalError::TooLong { offset: *offset, length: length as u64 });
    }
    let mut bytes = vec![0; length];
    if fill(source, &mut bytes)? < length {
        return Err(JournalError::Truncated { offset: *offset });
    }
    let malformed = |reason: String| JournalError::Malformed { offset: *offset, reason };
    let mut decoder = minicbor::Decoder::new(&bytes);
    let value = decoder.decode().map_err(|e| malformed(e.to_string()))?;
    if decoder.position() != bytes.len() {
        return Err(malformed("bytes after the entry".to_owned()));
    }
    *offset += 4 + length as u64;
    Ok(Some(value))
}

fn fill(source: &mut impl Read, buf: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buf.len() {
        match source.read(&mut buf[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Extent of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Inputs fed.
    pub inputs: u64,
    /// Outputs compared and found equal.
    pub outputs: u64,
    /// Outputs of the last input that the journal lacks (its writer was killed).
    pub unlogged: u64,
}

/// The core's outputs differ from the journal.
#[derive(Debug, thiserror::Error)]
#[error("after input {input}, output {index} differs: expected {expected:?}, got {got:?}")]
pub struct Divergence {
    /// The last input that was fed, counted from 1.
    pub input: u64,
    /// Number of the output in the journal, from 0.
    pub index: u64,
    /// Output in the journal; `None` if the core gave an additional one.
    pub expected: Option<Output>,
    /// The core's output; `None` if it gave no further one.
    pub got: Option<Output>,
}

/// A replay did not reach the end of the journal.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The core and the journal differ.
    #[error(transparent)]
    Diverged(#[from] Box<Divergence>),
    /// The journal is damaged before its end; a cut in the last entry is not an error.
    #[error(transparent)]
    Unreadable(#[from] JournalError),
    /// The journal was thinned: removed entries can be neither fed nor compared.
    #[error("the log was thinned: of some of its `{}` messages it has the hash alone", topic.name())]
    Thinned {
        /// Topic of the removed messages.
        topic: Topic,
    },
}

/// Feeds a journal's inputs to a fresh core and compares the outputs.
///
/// # Errors
///
/// At the first output that differs, and when the journal is damaged anywhere but at its end.
pub fn replay<R: Read>(log: Reader<R>, core: &mut dyn Core) -> Result<Replayed, ReplayError> {
    let mut done = Replayed::default();
    for entry in log {
        match entry {
            Ok(Entry::Input { now, input }) => {
                if let Some(extra) = core.output() {
                    return Err(diverged(done, None, Some(extra)));
                }
                core.handle(now, &input);
                done.inputs += 1;
            }
            Ok(Entry::Output(expected)) => {
                let got = core.output();
                if got.as_ref() != Some(&expected) {
                    return Err(diverged(done, Some(expected), got));
                }
                done.outputs += 1;
            }
            Ok(Entry::LeftOut { topic, .. }) => return Err(ReplayError::Thinned { topic }),
            Err(JournalError::Truncated { .. }) => break,
            Err(error) => return Err(error.into()),
        }
    }
    while core.output().is_some() {
        done.unlogged += 1;
    }
    Ok(done)
}

/// Counts of copied and removed entries of a journal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Thinned {
    /// Entries copied whole.
    pub whole: u64,
    /// Messages of which the hash alone is left.
    pub left_out: u64,
}

/// Copies a journal without most sets of sensor frames, which are most of its bytes. Among the core's inputs each `every`-th set stays whole,
/// from the first on (none where `every` is zero). Sets among its outputs are removed, since the receiver's journal has them. A journal that
/// its writer's death cut off is copied up to the cut. The copy cannot be replayed.
///
/// # Errors
///
/// A journal that is damaged before its end, and errors of the writer below.
pub fn thin<R: Read, W: Write>(log: Reader<R>, out: W, every: u32) -> Result<Thinned, JournalError> {
    let mut writer = Writer::new(out, log.header(), u64::MAX)?;
    let (mut thinned, mut fed) = (Thinned::default(), 0);
    for entry in log {
        let entry = match entry {
            Ok(entry) => entry,
            Err(JournalError::Truncated { .. }) => break,
            Err(error) => return Err(error),
        };
        let left_out = match &entry {
            Entry::Input { now, input: Input::Bus { topic: Topic::Frames, bytes } } => {
                fed += 1;
                let stays = every > 0 && (fed - 1) % u64::from(every) == 0;
                (!stays).then(|| left_out(Some(*now), bytes))
            }
            Entry::Output(Output::Bus { topic: Topic::Frames, bytes }) => Some(left_out(None, bytes)),
            Entry::Input { .. } | Entry::Output(_) | Entry::LeftOut { .. } => None,
        };
        thinned.left_out += u64::from(left_out.is_some());
        thinned.whole += u64::from(left_out.is_none());
        writer.entry(&left_out.unwrap_or(entry))?;
    }
    writer.flush()?;
    Ok(thinned)
}

fn left_out(now: Option<Instant>, bytes: &[u8]) -> Entry {
    let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
    Entry::LeftOut { now, topic: Topic::Frames, length, hash: wire_hash(bytes) }
}

fn diverged(done: Replayed, expected: Option<Output>, got: Option<Output>) -> ReplayError {
    ReplayError::Diverged(Box::new(Divergence { input: done.inputs, index: done.outputs, expected, got }))
}
