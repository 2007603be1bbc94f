//! The files of a recording by their first bytes: ULog, MCAP, MAVLink telemetry, any of them packed as a whole by zstd, and the ones that are not
//! read, each with a remedy.

use std::borrow::Cow;

use super::{Format, LogError, MAX_LOG, bag, tlog, ulog};

/// Formats that are not read: name, first bytes, and the way out.
const OTHERS: [(&str, &[u8], &str); 5] = [
    (
        "an SQLite3 bag of rosbag2",
        b"SQLite format 3\0",
        "convert it: `ros2 bag convert -i BAG -o out.yaml`, where out.yaml is `output_bags: [{uri: converted, storage_id: mcap, all: true}]`, and \
         assess the folder `converted`",
    ),
    (
        "a bag of ROS 1",
        b"#ROSBAG V2.0",
        "convert it: `rosbags-convert --src IN.bag --dst converted --dst-storage mcap` (pip install rosbags), and assess the folder `converted`",
    ),
    ("packed by gzip", &[0x1f, 0x8b], "unpack it with `gunzip` and assess the file that is in it"),
    ("packed by xz", &[0xfd, b'7', b'z', b'X', b'Z'], "unpack it with `unxz` and assess the file that is in it"),
    ("a ZIP archive", b"PK\x03\x04", "unpack it with `unzip` and assess the files that are in it"),
];

/// First bytes of no format that is read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum FormatError {
    #[error("{name}, which is not read; {remedy}")]
    Other { name: &'static str, remedy: &'static str },
    #[error(
        "neither a ULog (`ULog`, 01 12 35) nor an MCAP file (89 `MCAP0`) nor a telemetry log of MAVLink (a time of eight bytes, then fe or fd) by its \
         first bytes, nor one of them packed by zstd"
    )]
    Unknown,
}

/// The inside of a file, and why it ends early, if it does.
type Inside<'a> = (Cow<'a, [u8]>, Option<String>);

/// One file, expanded, and its format.
pub(super) fn open(bytes: &[u8]) -> Result<(Inside<'_>, Format), LogError> {
    let (bytes, cut) = if bytes.starts_with(&bag::ZSTD) { expanded(bytes)? } else { (Cow::Borrowed(bytes), None) };
    if bytes.len() as u64 > MAX_LOG {
        return Err(LogError::Refused { at: MAX_LOG, why: format!("at most {MAX_LOG} bytes are read") });
    }
    let format = format(&bytes).map_err(|error| LogError::Refused { at: 0, why: error.to_string() })?;
    Ok(((bytes, cut), format))
}

/// The inside of a file that is one zstd stream.
fn expanded(bytes: &[u8]) -> Result<Inside<'_>, LogError> {
    let refused = |why: String| LogError::Refused { at: 0, why };
    let decoder = zstd::stream::read::Decoder::with_buffer(bytes)
        .map_err(|error| refused(format!("packed by zstd, and broken: {error}")))?;
    let (inside, ended) = bag::read(decoder, MAX_LOG + 1);
    let cut =
        ended.err().map(|error| format!("the zstd stream breaks off after {} bytes expanded: {error}", inside.len()));
    match (inside.is_empty(), cut) {
        (true, Some(cut)) => Err(refused(cut)),
        (_, cut) => Ok((Cow::Owned(inside), cut)),
    }
}

fn format(bytes: &[u8]) -> Result<Format, FormatError> {
    if bytes.starts_with(&ulog::MAGIC) {
        return Ok(Format::Ulog);
    }
    if bytes.starts_with(mcap::MAGIC) {
        return Ok(Format::Mcap);
    }
    if let Some(&(name, _, remedy)) = OTHERS.iter().find(|(_, first, _)| bytes.starts_with(first)) {
        return Err(FormatError::Other { name, remedy });
    }
    if tlog::begins(bytes) {
        return Ok(Format::Tlog);
    }
    Err(FormatError::Unknown)
}
