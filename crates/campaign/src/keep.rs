//! What a trial leaves in its run directory: the log as MCAP and as JSON lines.

use std::io::Write;
use std::path::Path;

use console::process::player::READING;
use link::instrument::Frame;
use link::recorder::Recording;
use serde_json::json;

use crate::cast::Cast;
use crate::custody::Held;
use crate::evidence::Logged;
use crate::live::{self, mouths::CoreReplay};
use crate::oracle::Witnessed;

/// Writes the log of a twin run as a recording, as a live run's recorder would.
pub fn recording(directory: &Path, log: &[Logged]) -> std::io::Result<()> {
    let mut recording = Recording::new(directory.join("recording"));
    for logged in log {
        let frame = Frame { trace_us: logged.at, node: logged.node, bytes: logged.bytes.clone() };
        recording.write(frame);
    }
    let whole = recording.finish().lost == 0;
    whole.then_some(()).ok_or_else(|| std::io::Error::other("the recording cannot be written"))
}

/// The file with public keys and heads.
pub const HELD: &str = "held.json";
/// The longest that is read.
const MAX_HELD_BYTES: u64 = 1 << 20;

/// Writes what is held of the recording outside the recorder: public keys and heads, no secret.
pub fn held(directory: &Path, held: &Held) -> std::io::Result<()> {
    std::fs::write(directory.join(HELD), serde_json::to_vec_pretty(held)?)
}

/// Reads it back.
pub fn read_held(directory: &Path) -> std::io::Result<Held> {
    held_in(std::fs::File::open(directory.join(HELD))?)
}

/// The same of the file's bytes; no more than a bounded number is read.
pub fn held_in(from: impl std::io::Read) -> std::io::Result<Held> {
    Ok(serde_json::from_reader(from.take(MAX_HELD_BYTES))?)
}

/// Writes what it takes to look at the console's mouth log again: no secret but the key of its feed, to which nobody answers
/// any more.
pub fn console(directory: &Path, cast: &Cast) -> std::io::Result<()> {
    let Some(console) = live::console(cast) else { return Ok(()) };
    std::fs::write(directory.join(READING), serde_json::to_vec(&console.to_read())?)
}

/// Writes what came of replaying the mouth logs.
pub fn replays(directory: &Path, replays: &[CoreReplay]) -> std::io::Result<()> {
    std::fs::write(directory.join("replay.json"), serde_json::to_vec_pretty(replays)?)
}

/// Writes the events, one JSON object a line, in (time, node, counter) order.
pub fn events(directory: &Path, entries: &[Witnessed]) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(directory.join("events.jsonl"))?);
    for w in entries {
        let line = json!({
            "t_us": w.at,
            "node": w.entry.node,
            "counter": w.entry.counter,
            "local_us": w.entry.at.0,
            "event": format!("{:?}", w.entry.event),
        });
        writeln!(out, "{line}")?;
    }
    out.flush()
}
