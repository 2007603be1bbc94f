//! What a trial leaves in its run directory: the log as MCAP and as JSON lines.

use std::io::Write;
use std::path::Path;

use link::instrument::Frame;
use link::recorder::Recording;
use serde_json::json;

use crate::evidence::Logged;
use crate::live::mouths::CoreReplay;
use crate::oracle::Witnessed;

/// Writes the log of a twin run as a recording, as a live run's recorder would.
pub fn recording(directory: &Path, log: &[Logged]) -> std::io::Result<()> {
    let mut recording = Recording::new(directory.join("recording"));
    for logged in log {
        let frame = Frame { trace_us: logged.at, node: logged.node, bytes: logged.bytes.clone() };
        if !recording.write(&frame) {
            return Err(std::io::Error::other("the recording cannot be written"));
        }
    }
    recording.finish();
    Ok(())
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
