//! The errors of an MCAP file: a record that is not taken, and messages that are not read.

use std::io;

use super::MAX_EXPANDED;
use super::frame::HEAD;
use super::tables::MAX_SCHEMAS;
use crate::log::MAX_TOPICS;
use crate::log::cdr::DefinitionError;

/// A record is not taken.
#[derive(Debug, thiserror::Error)]
pub(super) enum RecordError {
    #[error("a record's header has {HEAD} bytes, {left} are left")]
    Header { left: usize },
    #[error("no record is of the kind {kind:#04x}")]
    Kind { kind: u8 },
    #[error("a record of {length} bytes, {left} are left")]
    Short { length: u64, left: usize },
    #[error("a message outside of the chunks")]
    OutsideChunks,
    #[error("a chunk under the kind {kind:#04x}")]
    ChunkUnderKind { kind: u8 },
    #[error("its records are more than {MAX_EXPANDED} bytes once expanded")]
    Expanded,
    #[error("a chunk's header has 40 bytes or more, got {got}")]
    ChunkHeader { got: usize },
    #[error("the name of a chunk's compression is no text")]
    CompressionName,
    #[error("a chunk is packed by `{}`, expected zstd, lz4 or nothing", got.escape_debug())]
    Compression { got: String },
    #[error("a chunk's {compression} data are broken: {error}")]
    Packed { compression: String, error: io::Error },
    #[error("a chunk says {stated} bytes of data and has {got}")]
    ChunkData { stated: u64, got: usize },
    #[error("a chunk says {stated} bytes of records and has {got}")]
    ChunkRecords { stated: u64, got: usize },
    #[error("a chunk's CRC is {stated:08x}, that of its bytes {got:08x}")]
    ChunkCrc { stated: u32, got: u32 },
    #[error("more than {MAX_SCHEMAS} schemas")]
    ManySchemas,
    #[error("more than {MAX_TOPICS} topics")]
    ManyTopics,
    #[error(transparent)]
    Content(#[from] mcap::McapError),
}

/// The messages of a channel are not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(in crate::log) enum Unreadable {
    #[error("its messages are in `{}`, expected `json` or `cdr`", got.escape_debug())]
    Encoding { got: String },
    #[error("the definition of its messages is in `{}`, expected `ros2msg`", got.escape_debug())]
    DefinitionEncoding { got: String },
    #[error("its channel names no definition")]
    NoDefinition,
    #[error(transparent)]
    Definition(#[from] DefinitionError),
}
