//! Files that a trial leaves in its run directory: the log as MCAP and as JSON lines, and the trust anchors of all of
//! it.

pub mod verdict;
pub mod whole;

use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::Path;

use console::moment::{Happened, MAX_MOMENTS};
use console::process::player::{READING, TRUTH};
use console::site::Site;
use evidence::log::{Logged, by_recorder, hex};
use evidence::verification::Held;
use evidence::{Evidence, Micros, SCHEMA_VERSION, Witnessed, truth};
use ground_truth::{Entry, Note, Suspension};
use link::bus::enclave::{Enclaves, SignedEnclaves};
use link::files;
use link::input_journal;
use link::instrument::Frame;
use link::recorder::Recording;
use serde::Deserialize;
use serde_json::json;
use sha2::{Digest, Sha256};
use topology::Topology;
use wire::bounds::Bounds;
use wire::id::{Boot, NodeId};
use wire::sign::Key;
use wire::time::{Instant, Span};

use crate::journals::CoreReplay;

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

/// The file with the log as JSON lines.
const EVENTS: &str = "events.jsonl";
/// The most that is read of it.
const MAX_LOG_BYTES: u64 = 1 << 28;
/// Marker of the launcher's lines.
const LAUNCHER: &str = r#""node":"campaign""#;
/// Bound of the part that is read.
const MAX_TOLD_BYTES: u64 = 1 << 20;

/// The file with public keys and heads.
pub const HELD: &str = "held.json";
/// The longest that is read.
const MAX_HELD_BYTES: u64 = 1 << 20;

/// Writes the trust anchors of the recording, which are held outside the recorder: public keys and heads, no secret; and the
/// digest of every file that is in `directory` by now, so that this comes last. Returns the digest of the written file, which
/// authenticates the whole run.
pub fn held(directory: &Path, held: &Held) -> std::io::Result<String> {
    let held = Held { files: Some(whole::survey(directory)?), ..held.clone() };
    let bytes = serde_json::to_vec_pretty(&held)?;
    files::create(&directory.join(HELD))?.write_all(&bytes)?;
    Ok(hex(&Sha256::digest(&bytes)))
}

/// Reads it back, with its digest.
pub fn read_held(directory: &Path) -> std::io::Result<(Held, String)> {
    let bytes = files::read(&directory.join(HELD), MAX_HELD_BYTES)?;
    Ok((held_in(bytes.as_slice())?, hex(&Sha256::digest(&bytes))))
}

/// The same of the file's bytes; no more than a bounded number is read.
pub fn held_in(from: impl std::io::Read) -> std::io::Result<Held> {
    Ok(serde_json::from_reader(from.take(MAX_HELD_BYTES))?)
}

/// The file with the site as it was planned, there from the beginning: no secret, and for spectators of a running run.
const SITE: &str = "site.json";
/// Rights on the buses, and the authority's signature over them.
const ENCLAVES: &str = "enclaves.json";
const ENCLAVES_SIGNATURE: &str = "enclaves.sig";
/// The longest that is read.
const MAX_SITE_BYTES: u64 = 1 << 20;

/// Writes the site.
pub fn site(directory: &Path, topology: &Topology) -> std::io::Result<()> {
    // What another run left there stays.
    std::fs::File::create_new(directory.join(SITE))?.write_all(&serde_json::to_vec(&crate::site(topology))?)
}

/// Signs the rights on the buses of a run, and writes document and signature.
pub(super) fn enclaves(directory: &Path, of: &Enclaves, authority: &Key) -> Result<SignedEnclaves, String> {
    let signed = of.sign(authority).map_err(|why| why.to_string())?;
    let write = |name: &str, bytes: &[u8]| std::fs::File::create_new(directory.join(name))?.write_all(bytes);
    let written =
        write(ENCLAVES, signed.document.as_bytes()).and_then(|()| write(ENCLAVES_SIGNATURE, &signed.signature));
    written.map_err(|why| format!("cannot write to {}: {why}", directory.display()))?;
    Ok(signed)
}

/// Reads it back.
pub fn read_site(directory: &Path) -> std::io::Result<Site> {
    Ok(serde_json::from_reader(files::open(&directory.join(SITE))?.take(MAX_SITE_BYTES))?)
}

/// Writes the file needed to replay the console's input journal: no secret but the key of its feed, which is void by then.
/// Beside it the true events.
pub fn console(directory: &Path, topology: &Topology, entries: &[Witnessed]) -> std::io::Result<()> {
    let Some(console) = crate::console(topology) else { return Ok(()) };
    std::fs::write(directory.join(READING), serde_json::to_vec(&console.to_read())?)?;
    let done = truth::of(entries).into_iter().take(MAX_MOMENTS);
    let done: Vec<Happened> = done.map(|one| Happened { at_us: one.at_us, what: one.what }).collect();
    std::fs::write(directory.join(TRUTH), serde_json::to_vec(&done)?)
}

/// Writes the results of replaying the input journals.
pub fn replays(directory: &Path, replays: &[CoreReplay]) -> std::io::Result<()> {
    std::fs::write(directory.join("replay.json"), serde_json::to_vec_pretty(replays)?)
}

/// Removes from the input journals below `directory` all sets of frames but each `every`-th ([`input_journal::thin`]), for each core that `replays`
/// found to be a function of its inputs in its first life: they are no longer needed to the byte, and they are nearly all of a recording. A
/// journal with any other result stays as it is.
pub fn thinned(directory: &Path, replays: &[CoreReplay], every: u32) -> std::io::Result<()> {
    let identical = replays.iter().filter(|r| r.difference.is_none());
    let with_frames = identical.filter(|r| matches!(r.node, NodeId::SIM | NodeId::PERCEPTION));
    for log in with_frames.map(|r| directory.join("mouth").join(format!("{}.cbor", r.node))) {
        let beside = log.with_extension("new");
        thin(&log, &beside, every).and_then(|()| std::fs::rename(&beside, &log)).inspect_err(|_| {
            // It is of no use to anybody, and what failed is told.
            let _ = std::fs::remove_file(&beside);
        })?;
    }
    Ok(())
}

fn thin(log: &Path, beside: &Path, every: u32) -> std::io::Result<()> {
    let source = input_journal::Reader::new(BufReader::new(files::open(log)?)).map_err(std::io::Error::other)?;
    let copy = BufWriter::new(files::create(beside)?);
    input_journal::thin(source, copy, every).map(|_| ()).map_err(std::io::Error::other)
}

/// Writes the log as JSON lines, for other programs.
pub fn events(directory: &Path, evidence: &Evidence) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(directory.join(EVENTS))?);
    lines(&mut out, evidence)?;
    out.flush()
}

/// Facts of a run in the log's JSON lines that its recording lacks.
#[derive(Clone, Debug)]
pub struct Told {
    /// The bounds that were in force.
    pub bounds: Bounds,
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

impl Told {
    /// Start of the run, by the recording's own time.
    pub fn start(&self, entries: &[Witnessed]) -> Option<Micros> {
        let mark = &self.mark;
        let is_it = |w: &&Witnessed| {
            w.entry.node.name() == mark.node && w.entry.boot == mark.boot && w.entry.counter == mark.counter
        };
        entries.iter().find(is_it)?.at.checked_sub(mark.t_us)
    }
}

/// Process faults by the launcher, as in the log's JSON lines.
#[derive(Deserialize)]
#[serde(tag = "is", rename_all = "snake_case")]
enum Launched {
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
    event: Launched,
}

impl Line {
    fn read(line: &str) -> Option<Witnessed> {
        let Line { mark: Mark { t_us, node, boot, counter }, local_us, event } = serde_json::from_str(line).ok()?;
        let of = |name: &str| NodeId::from_name(name);
        let event = match event {
            Launched::Ended { node, killed } => Note::Ended { node: of(&node)?, killed, signal: None },
            Launched::Restarted { node, boot } => Note::Restarted { node: of(&node)?, boot },
            Launched::Suspended { node, how, on } => {
                // How slow does not matter to who looks on.
                let slow = Suspension::Slow { quota: 0, period: Span::ZERO };
                let how = if how == "hang" { Suspension::Hang } else { slow };
                Note::Suspended { node: of(&node)?, how, on }
            }
            Launched::DiskFull { node, on } => Note::DiskFull { node: of(&node)?, on },
            Launched::Other => return None,
        };
        let node = of(&node).filter(|node| *node == NodeId::CAMPAIGN)?;
        let entry = Entry { node, boot, counter, at: Instant(local_us), event: event.into(), previous: [0; 32] };
        Some(Witnessed { at: t_us, entry })
    }
}

/// The launcher's notes of the run in `directory`, at times of the run: processes it ended, restarted or stopped, and filled disks. They
/// go by way of no recorder, so they are read from the log's JSON lines, up to a bounded number of bytes.
pub fn launched(directory: &Path) -> Vec<Witnessed> {
    let Ok(log) = files::open(&directory.join(EVENTS)) else { return Vec::new() };
    let lines = std::io::BufReader::new(log.take(MAX_LOG_BYTES)).lines().map_while(Result::ok);
    // Lines of others are told apart before they are taken for anything.
    lines.filter(|line| line.contains(LAUNCHER)).filter_map(|line| Line::read(&line)).take(MAX_MOMENTS).collect()
}

/// Reads the first lines of the log's JSON lines, no more than a bounded number of bytes.
pub fn told(directory: &Path) -> Option<Told> {
    let log = files::open(&directory.join(EVENTS)).ok()?;
    let mut lines = std::io::BufReader::new(log.take(MAX_TOLD_BYTES)).lines().map_while(Result::ok);
    let head: serde_json::Value = serde_json::from_str(&lines.next()?).ok()?;
    let bounds = serde_json::from_value(head.get("bounds")?.clone()).ok()?;
    let mut marks = lines.filter_map(|line| serde_json::from_str::<Mark>(&line).ok());
    // What was seen before the run began is dated to its beginning, and tells nothing of when that was.
    let is_kept = |mark: &Mark| mark.t_us > 0 && NodeId::from_name(&mark.node).is_some_and(by_recorder);
    let mark = marks.find(is_kept)?;
    Some(Told { bounds, mark })
}

/// Evidence for a judge, as JSON lines (`docs/reviewer/evidence.md`): first the facts of the whole run, then the events in
/// (time, node, counter) order. This program's conclusions are not in it.
pub fn lines(out: &mut impl Write, evidence: &Evidence) -> std::io::Result<()> {
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
        let Entry { node, boot, counter, at, event, previous: _ } = w.entry;
        let line = json!({
            "t_us": w.at, "node": node, "boot": boot, "counter": counter, "local_us": at, "event": event,
        });
        writeln!(out, "{line}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launcher_faults_are_read_from_its_lines_only() {
        let directory = std::env::temp_dir().join(format!("holdsafe-launched-{}", std::process::id()));
        std::fs::create_dir_all(&directory).expect("a folder");
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
        std::fs::write(directory.join(EVENTS), lines.join("\n")).expect("a file");
        let told: Vec<String> = truth::lasted(&launched(&directory)).into_iter().map(|l| l.what).collect();
        assert_eq!(told, ["hang of gateway", "slowing of perception", "kill of sim"]);
        std::fs::remove_dir_all(&directory).expect("it is there");
        assert_eq!(launched(&directory), []);
    }
}
