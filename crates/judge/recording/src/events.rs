//! `events.jsonl`: the evidence of a run as JSON lines, for judges of other people (`docs/reviewer/evidence.md`).
//!
//! This program reads two parts of it that the recording lacks: the bounds and the start of the run ([`RunFacts`]), and the
//! launcher's notes of its process faults. Both are for display; the log itself is left to [`crate::recorded_log`].

use std::io::{BufRead, BufReader, BufWriter, Read, Write};

use evidence::log::by_recorder;
use evidence::truth::MAX_MOMENTS;
use evidence::{Evidence, Micros, SCHEMA_VERSION, Witnessed};
use ground_truth::{Entry, Note, Suspension};
use link::files;
use serde::Deserialize;
use serde_json::json;
use wire::bounds::Bounds;
use wire::id::{Boot, NodeId};
use wire::time::{Instant, Span};

use crate::layout::RunFolder;

/// Bytes that are read at most for the launcher's notes.
const MAX_LOG_BYTES: u64 = 1 << 28;
/// Bytes that are read at most for the facts of the run.
const MAX_FACTS_BYTES: u64 = 1 << 20;
/// Marker of the launcher's lines.
const LAUNCHER: &str = r#""node":"campaign""#;

/// Writes the evidence of a run as JSON lines into its folder.
///
/// # Errors
/// When the file cannot be written.
pub fn write_events(run: &RunFolder, evidence: &Evidence) -> std::io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(run.events())?);
    write_lines(&mut out, evidence)?;
    out.flush()
}

/// Evidence for a judge, as JSON lines (`docs/reviewer/evidence.md`): first the facts of the whole run, then the events in
/// (time, node, counter) order. This program's conclusions are not in it.
///
/// # Errors
/// As the writer below.
pub fn write_lines(out: &mut impl Write, evidence: &Evidence) -> std::io::Result<()> {
    let flaws: Vec<String> = evidence.log_flaws.iter().map(ToString::to_string).collect();
    let head = json!({
        "schema_version": SCHEMA_VERSION,
        "bounds": evidence.bounds,
        "camera": evidence.camera,
        "duration_us": evidence.duration,
        "stall_limit_us": evidence.stall_limit,
        "planned": evidence.planned,
        "operators": evidence.operators,
        "script": evidence.script,
        "route": evidence.route,
        "contacts": evidence.contacts,
        "killed": evidence.killed,
        "broken_log": evidence.broken_log,
        "custody": flaws,
        "differences": evidence.differences,
    });
    writeln!(out, "{head}")?;
    for w in &evidence.entries {
        let Entry { node, boot, counter, at: local_us, event, previous: _ } = w.entry;
        let line = json!({
            "t_us": w.at, "node": node, "boot": boot, "counter": counter, "local_us": local_us, "event": event,
        });
        writeln!(out, "{line}")?;
    }
    Ok(())
}

/// Facts of a run in its JSON lines that its recording lacks.
#[derive(Clone, Debug)]
pub(crate) struct RunFacts {
    /// The bounds that were in force.
    pub(crate) bounds: Bounds,
    mark: Mark,
}

/// An entry that is in the recording too, with the time of the run at which it was seen there.
#[derive(Clone, Debug, Deserialize)]
struct Mark {
    t_us: Micros,
    node: String,
    boot: Boot,
    counter: u64,
}

impl RunFacts {
    /// Start of the run, by the recording's own time, microseconds.
    pub(crate) fn start(&self, entries: &[Witnessed]) -> Option<Micros> {
        let mark = &self.mark;
        let is_it = |w: &&Witnessed| {
            w.entry.node.name() == mark.node && w.entry.boot == mark.boot && w.entry.counter == mark.counter
        };
        entries.iter().find(is_it)?.at.checked_sub(mark.t_us)
    }
}

/// The facts of a run in the first of its JSON lines, up to a bounded number of bytes; `None` where they are missing.
pub(crate) fn read_facts(run: &RunFolder) -> Option<RunFacts> {
    let log = files::open(&run.events()).ok()?;
    let mut lines = BufReader::new(log.take(MAX_FACTS_BYTES)).lines().map_while(Result::ok);
    let head: serde_json::Value = serde_json::from_str(&lines.next()?).ok()?;
    let bounds = serde_json::from_value(head.get("bounds")?.clone()).ok()?;
    let mut marks = lines.filter_map(|line| serde_json::from_str::<Mark>(&line).ok());
    // Events before the run began have its beginning as their time (zero), so the offset to the recording's clock does not follow from them.
    let dates_the_start = |mark: &Mark| mark.t_us > 0 && NodeId::from_name(&mark.node).is_some_and(by_recorder);
    let mark = marks.find(dates_the_start)?;
    Some(RunFacts { bounds, mark })
}

/// The launcher's notes, as in the JSON lines.
#[derive(Deserialize)]
#[serde(tag = "is", rename_all = "snake_case")]
enum LauncherNote {
    Ended {
        node: String,
        killed: bool,
    },
    Restarted {
        node: String,
        boot: Boot,
    },
    Suspended {
        node: String,
        how: serde_json::Value,
        on: bool,
    },
    DiskFull {
        node: String,
        on: bool,
    },
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
struct Line {
    #[serde(flatten)]
    mark: Mark,
    local_us: u64,
    event: LauncherNote,
}

impl Line {
    fn parse(line: &str) -> Option<Witnessed> {
        let Line { mark: Mark { t_us, node, boot, counter }, local_us, event } = serde_json::from_str(line).ok()?;
        let event = match event {
            LauncherNote::Ended { node, killed } => {
                Note::Ended { node: NodeId::from_name(&node)?, killed, signal: None }
            }
            LauncherNote::Restarted { node, boot } => Note::Restarted { node: NodeId::from_name(&node)?, boot },
            LauncherNote::Suspended { node, how: kind, on } => {
                // No display shows the degree of a slowdown.
                let slow = Suspension::Slow { quota: 0, period: Span::ZERO };
                let suspension = if kind == "hang" { Suspension::Hang } else { slow };
                Note::Suspended { node: NodeId::from_name(&node)?, how: suspension, on }
            }
            LauncherNote::DiskFull { node, on } => Note::DiskFull { node: NodeId::from_name(&node)?, on },
            LauncherNote::Other => return None,
        };
        let node = NodeId::from_name(&node).filter(|node| *node == NodeId::CAMPAIGN)?;
        let entry = Entry { node, boot, counter, at: Instant(local_us), event: event.into(), previous: [0; 32] };
        Some(Witnessed { at: t_us, entry })
    }
}

/// The launcher's notes of a run, at times of the run: processes that it ended, restarted or stopped, and disks that it filled. No
/// recorder records them, so they are read from the JSON lines, up to a bounded number of bytes.
pub(crate) fn read_launcher_notes(run: &RunFolder) -> Vec<Witnessed> {
    let Ok(log) = files::open(&run.events()) else { return Vec::new() };
    let lines = BufReader::new(log.take(MAX_LOG_BYTES)).lines().map_while(Result::ok);
    // The search in the text only spares parsing the lines of other nodes: `parse` checks the node again.
    lines.filter(|line| line.contains(LAUNCHER)).filter_map(|line| Line::parse(&line)).take(MAX_MOMENTS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launcher_faults_are_read_from_its_lines_only() {
        let directory = tempfile::tempdir().expect("a folder");
        let run = RunFolder::new(directory.path());
        let line = |node: &str, event: &str| {
            format!(r#"{{"boot":1,"counter":2,"event":{event},"local_us":9,"node":"{node}","t_us":7}}"#)
        };
        let hangs = r#"{"how":"hang","is":"suspended","node":"gateway","on":true}"#;
        let slows = r#"{"how":{"slow":{"quota":50,"period":600}},"is":"suspended","node":"perception","on":true}"#;
        let lines = [
            r#"{"bounds":{}}"#.to_owned(),
            line("campaign", hangs),
            line("campaign", slows),
            line("campaign", r#"{"is":"ended","killed":true,"node":"sim"}"#),
            line("campaign", r#"{"is":"ran","node":"gateway"}"#),
            line("campaign", r#"{"is":"ended","killed":true,"node":"nobody"}"#),
            line("gateway", hangs),
            r#"{"node":"campaign","event""#.to_owned(),
        ];
        std::fs::write(run.events(), lines.join("\n")).expect("a file");
        let lasted: Vec<String> =
            evidence::truth::lasting(&read_launcher_notes(&run)).into_iter().map(|l| l.action).collect();
        assert_eq!(lasted, ["hang of gateway", "slowing of perception", "kill of sim"]);
        std::fs::remove_file(run.events()).expect("it is there");
        assert_eq!(read_launcher_notes(&run), []);
    }
}
