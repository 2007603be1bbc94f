//! Messages between processes: specifications, controls, lines, audit frames; and the files of a run.

use std::mem::size_of;

use evidence::anchors::{HeadAnchor, TrustAnchors};
use evidence::log::Logged;
use ground_truth::{Any, Entry};
use link::input_journal::{self, JournalError};
use link::instrument::Frame;
use link::loopback::LoopbackAddr;
use link::mcap_frames::frames_of_bytes;
use link::spec::{Control, MAX_SPEC, ServiceSpec, SpecError};
use link::witness::entries_of;
use live::child::Line;
use recording::anchors::parse_anchors;
use recording::log::{LogVerifier, Verification};
use wire::audit::Head;

/// Memory for the frames of one recording here.
const ROOM: usize = 1 << 20;

/// A specification that is taken is read to its end and no further, and says the same once written.
pub fn spec(bytes: &[u8]) -> bool {
    let mut from = bytes;
    match ServiceSpec::read(&mut from) {
        Ok(spec) => {
            let length = bytes.len() - from.len();
            assert_eq!(bytes[..4], (length as u32 - 4).to_be_bytes(), "read beyond its end");
            let written = written(spec);
            let repeated = ServiceSpec::read(written.as_slice()).expect("a written specification is one");
            assert_eq!(self::written(repeated), written);
            return true;
        }
        Err(SpecError::TooLong(got)) => assert!(got > MAX_SPEC),
        Err(error @ (SpecError::NoRow(_) | SpecError::Confinement(_))) => panic!("reading confines nothing: {error}"),
        Err(error @ (SpecError::Io(_) | SpecError::Json(_))) => assert!(!error.to_string().is_empty()),
    }
    false
}

/// A core's own configuration is not this parser's, and a float in it need not come back to the last digit.
fn written(mut spec: ServiceSpec) -> Vec<u8> {
    spec.config = serde_json::Value::Null;
    let mut bytes = Vec::new();
    spec.write(&mut bytes).expect("what was read is short enough");
    bytes
}

/// A line of a launcher or a service means one thing; an address that is taken is this machine's.
pub fn lines(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let mut parsed = false;
    for line in text.lines() {
        if let Some(control) = Control::parse(line) {
            parsed = true;
            assert_eq!(control.line().trim_end(), line.trim_end());
            assert_eq!(Control::parse(&control.line()), Some(control));
        }
        if let Some(line_read) = Line::parse(line) {
            let word = match line_read {
                Line::Ready(_) => "ready ",
                Line::Stats(_) => "stats ",
                Line::Text(_) => "text ",
                Line::Refused(_) => "refused ",
                Line::Closed(_) => "closed ",
                Line::Entry(_) => "entry ",
                Line::Ended => panic!("a line that ends a service"),
            };
            assert!(line.starts_with(word), "not what the service said");
        }
        if let Ok(address) = line.parse::<LoopbackAddr>() {
            assert!(address.socket().ip().is_loopback() && address.to_string().parse() == Ok(address));
        }
    }
    parsed
}

/// A frame of the instrument plane that is taken holds no more than came, and is the same once written.
pub fn frame(bytes: &[u8]) -> bool {
    let Ok(frame) = Frame::decode(bytes) else { return false };
    assert!(frame.bytes.len() < bytes.len(), "more bytes than came");
    let written = minicbor::to_vec(&frame).expect("a frame can be written");
    assert_eq!(Frame::decode(&written).expect("a written frame is one"), frame);
    true
}

/// An input journal gives its writer's entries, up to the first error, which has its place.
pub fn journal(bytes: &[u8]) -> bool {
    let reader = match input_journal::Reader::new(bytes) {
        Ok(reader) => reader,
        Err(error) => {
            placed(&error, bytes.len());
            return false;
        }
    };
    let (header, mut entries) = (reader.header(), reader);
    let (mut written, mut read) = (Vec::new(), Vec::new());
    let mut writer = input_journal::Writer::new(&mut written, header, u64::MAX).expect("memory takes it");
    for entry in entries.by_ref() {
        match entry {
            Ok(entry) => {
                writer.entry(&entry).expect("memory takes it");
                read.push(entry);
            }
            Err(error) => placed(&error, bytes.len()),
        }
    }
    assert!(entries.next().is_none(), "something behind its end");
    assert_eq!(writer.counts(), (read.len() as u64, 0));
    let repeated = input_journal::Reader::new(written.as_slice()).expect("a written log is one");
    assert_eq!(repeated.header(), header);
    assert_eq!(repeated.map(|entry| entry.expect("a written entry is one")).collect::<Vec<_>>(), read);
    let repeated = input_journal::Reader::new(written.as_slice()).expect("a written log is one");
    let thinned = input_journal::thin(repeated, std::io::sink(), 2).expect("a written log is whole");
    assert_eq!(thinned.whole + thinned.left_out, read.len() as u64);
    !read.is_empty()
}

fn placed(error: &JournalError, length: usize) {
    match error {
        JournalError::Magic => {}
        JournalError::Truncated { offset }
        | JournalError::TooLong { offset, .. }
        | JournalError::Malformed { offset, .. } => {
            assert!(*offset <= length as u64, "{error}: behind its end");
        }
        JournalError::Io(error) => panic!("memory does not fail: {error}"),
    }
}

/// A guard's log gives whole entries, which are the same once written.
pub fn deliveries(bytes: &[u8]) -> bool {
    let found = entries_of(bytes);
    let mut written = Vec::new();
    for entry in &found {
        written.extend_from_slice(&(entry.len() as u32).to_be_bytes());
        written.extend(entry);
    }
    assert!(bytes.starts_with(&written), "other entries than came");
    assert_eq!(entries_of(written.as_slice()), found);
    found.iter().any(|entry| Entry::decode(entry).is_ok())
}

/// Trust anchors of a recording (length, then JSON) and the recording: reading stays within the memory bound, and
/// without a flaw all anchored entries are there.
pub fn recording(bytes: &[u8]) -> bool {
    let Some((length, rest)) = bytes.split_first_chunk() else { return false };
    let (anchors, recording) = rest.split_at((u32::from_be_bytes(*length) as usize).min(rest.len()));
    let anchors = parse_anchors(anchors).unwrap_or_default();
    let written = serde_json::to_vec(&anchors).expect("what was parsed can be written");
    assert_eq!(parse_anchors(written.as_slice()).expect("what was written can be parsed"), anchors);
    let mut room = ROOM;
    match frames_of_bytes(recording, &mut room) {
        Ok(frames) => {
            let taken: usize = frames.iter().map(|frame| frame.bytes.len() + size_of::<Frame>()).sum();
            assert_eq!(taken + room, ROOM, "frames that were not counted");
            flawless(&anchors, &frames)
        }
        Err(why) => {
            assert!(!why.is_empty());
            false
        }
    }
}

fn flawless(anchors: &TrustAnchors, frames: &[Frame]) -> bool {
    let logged = |frame: &Frame| Logged { at: frame.trace_us, node: frame.node, bytes: frame.bytes.clone() };
    let log: Vec<Logged> = frames.iter().map(logged).collect();
    let Verification { events, flaws, .. } = LogVerifier::new(anchors).verify(&log);
    assert_eq!(events, frames.len());
    if flaws.is_empty() {
        let whole: Vec<HeadAnchor> =
            frames.iter().filter_map(|frame| Head::from_last::<Any>(&frame.bytes)).map(HeadAnchor::from).collect();
        // A recording that was cut short lacks what came last, and reports it.
        let missing = anchors.heads.iter().filter(|_| !anchors.cut_short).find(|head| !whole.contains(head));
        assert_eq!(missing, None, "held, not there, and no flaw");
        let unread = frames.iter().filter(|frame| Entry::decode(&frame.bytes).is_err());
        assert_eq!(unread.count(), 0, "no entry, and no flaw");
    }
    flaws.is_empty()
}
