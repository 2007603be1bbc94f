//! Reads the records of a live run: the recording, or the input journals where there is none, the guards' logs, and the
//! closing statistics of the links; and keeps the launcher's own notes.

use std::collections::VecDeque;
use std::io::BufReader;

use adversary::insider::{InsiderRecorder, RecordedEntry};
use evidence::anchors::HeadAnchor;
use evidence::delivery::{Claims, Running};
use evidence::log::Logged;
use ground_truth::{Any, Entry, Note};
use link::input_journal;
use link::instrument::Frame;
use link::mcap_frames::{McapFramesError, frames_of_folder};
use link::recorder::Recording;
use recording::RunFolder;
use serde_json::Value;
use topology::{Member, Topology};
use wire::audit::Journal;
use wire::core::{Output, Side};
use wire::event::{Account, Event};
use wire::id::{Boot, NodeId};
use wire::sign::Key;
use wire::time::Instant;

use super::LiveError;

/// The recording, in the order and under the times in which it was kept.
pub(super) fn recorded_entries(run: &RunFolder) -> Result<Vec<Logged>, LiveError> {
    let frames = frames_of_folder(&run.recording()).map_err(|e| LiveError::Environment(e.to_string()))?;
    let logged = |f: Frame| Logged { at: f.trace_us, node: f.node, bytes: f.bytes };
    Ok(frames.into_iter().map(logged).collect())
}

/// The same on the run's time; entries from before the start count as written at the start.
pub(super) fn on_the_runs_time(kept: Vec<Logged>, start_us: u64) -> Vec<Logged> {
    kept.into_iter().map(|logged| Logged { at: logged.at.saturating_sub(start_us), ..logged }).collect()
}

/// Lets the hands that the recorder is in at the files of its recording.
pub(super) fn lay_on(hands: &InsiderRecorder, run: &RunFolder) -> Result<(), LiveError> {
    let folder = run.recording();
    let unreadable = |e: McapFramesError| LiveError::Environment(e.to_string());
    let frames = frames_of_folder(&folder).map_err(unreadable)?;
    let kept = |Frame { trace_us: at, node, bytes }: Frame| RecordedEntry { at, node, bytes };
    let mut kept: Vec<RecordedEntry> = frames.into_iter().map(kept).collect();
    hands.lay_on(&mut kept);
    let unwritable = |e: std::io::Error| LiveError::Environment(format!("{}: {e}", folder.display()));
    std::fs::remove_dir_all(&folder).map_err(unwritable)?;
    let mut recording = Recording::new(folder.clone());
    for RecordedEntry { at: trace_us, node, bytes } in kept {
        recording.write(Frame { trace_us, node, bytes });
    }
    let again = || LiveError::Environment(format!("{} cannot be written again", folder.display()));
    (recording.finish().lost == 0).then_some(()).ok_or_else(again)
}

/// Heads of each service's chain, and of its guard's, by its own closing statement; the recorder's is no evidence
/// against it.
pub(super) fn heads(topology: &Topology, stats: &[(NodeId, Value)]) -> Vec<HeadAnchor> {
    let of = |node: NodeId, head: &Value| {
        let boot = Boot(u32::try_from(head["boot"].as_u64()?).ok()?);
        Some(HeadAnchor { node, boot, counter: head["counter"].as_u64()?, hash: head["hash"].as_str()?.to_owned() })
    };
    let both = |(node, stats): &(NodeId, Value)| {
        let guard = topology.ingress_of(*node).and_then(|guard| of(guard, &stats["links"]["witness"]));
        [of(*node, &stats["links"]["head"]), guard]
    };
    stats.iter().filter(|(node, _)| *node != NodeId::RECORDER).flat_map(both).flatten().collect()
}

/// The same entries out of every participant's input journal, for a run with a dead recorder; each counts as written
/// when its core was fed. The broker has no core and so no journal: its entries are missing.
pub(super) fn journals(topology: &Topology, run: &RunFolder, start_us: u64) -> Vec<Logged> {
    let mut log = Vec::new();
    for member in &topology.members {
        let node = member.node();
        each_entry(topology, member, run, start_us, |at, entry| {
            if let input_journal::Entry::Output(Output::Audit { bytes }) = entry {
                log.push(Logged { at, node, bytes });
            }
        });
    }
    log
}

/// Inputs of the cores among the messages that insiders in `log` claim to have sent. These are the launcher's statements,
/// read from each reader's own records.
pub(super) fn deliveries(topology: &Topology, run: &RunFolder, start_us: u64, log: &[Logged]) -> Vec<(u64, Note)> {
    let mut claims = Claims::default();
    log.iter().for_each(|logged| claims.note(logged.node, &logged.bytes));
    let mut seen = Vec::new();
    for member in topology.members.iter().filter(|_| !claims.is_empty()) {
        each_entry(topology, member, run, start_us, |at, entry| {
            if let input_journal::Entry::Input { input, .. } = &entry {
                seen.extend(claims.delivered(member.node(), input).map(|event| (at, event)));
            }
        });
    }
    seen
}

/// Input times of cores in processes that were to be stopped, by their journals.
pub(super) fn running(topology: &Topology, run: &RunFolder, start_us: u64) -> Vec<(u64, Note)> {
    let watched = topology.watched();
    let mut running = Running::new(&watched);
    let mut seen = Vec::new();
    for member in topology.members.iter().filter(|m| watched.contains(&m.node())) {
        let node = member.node();
        each_entry(topology, member, run, start_us, |at, entry| {
            if matches!(entry, input_journal::Entry::Input { .. }) && running.note_due(node, at) {
                seen.push((at, Note::Ran { node }));
            }
        });
    }
    seen
}

/// Every input and output of `member`'s core, each with the time of the run at which its core was fed.
fn each_entry(
    topology: &Topology,
    member: &Member,
    run: &RunFolder,
    start_us: u64,
    mut each: impl FnMut(u64, input_journal::Entry),
) {
    let clock = super::spec::clock(topology, member.host);
    // One log for each start; the second is there when it was started again.
    for boot in [Boot(1), Boot(2)] {
        let file = link::files::open(&run.input_journal(member.node(), boot));
        let Some(journal) = file.ok().and_then(|file| input_journal::Reader::new(BufReader::new(file)).ok()) else {
            continue;
        };
        let mut now = journal.header().started;
        // A cut at the end is what a killed writer leaves; a missing entry before it breaks the chain.
        for entry in journal.map_while(Result::ok) {
            if let input_journal::Entry::Input { now: fed, .. } = &entry {
                now = *fed;
            }
            each(clock.trace_at(now).saturating_sub(start_us), entry);
        }
    }
}

/// Datagrams that the telemetry relay's sockets refused, and those that were not the client's: unknown to its core.
///
/// They are the launcher's statements, read from the process's closing statistics, in a chain of the launcher's.
pub(super) fn relayed(stats: &[(NodeId, Value)]) -> Vec<Event> {
    let relay = stats.iter().find(|(node, _)| *node == NodeId::RELAY_TELEMETRY);
    let Some((_, stats)) = relay else { return Vec::new() };
    let sockets = &stats["links"]["relay_datagram"];
    let unsent = |side: Side| (Account::RelayUnsent(side), sockets["unsent"][side as usize].as_u64());
    [unsent(Side::Client), unsent(Side::Server), (Account::Outsiders, sockets["outsiders"].as_u64())]
        .into_iter()
        .filter_map(|(account, n)| Some(Event::Count { account, n: n? }))
        .collect()
}

/// The guards' logs, each life in the order in which it was written, under the recording's own time.
pub(super) fn guards(topology: &Topology, run: &RunFolder) -> Vec<Logged> {
    let mut log = Vec::new();
    let broker = Some(topology.broker()).filter(|broker| topology.members.iter().all(|m| m.node() != *broker));
    for node in topology.members.iter().map(Member::node).chain(broker) {
        let Some(guard) = topology.ingress_of(node) else { continue };
        // One log for each start; the second is there when it was started again.
        for boot in [Boot(1), Boot(2)] {
            let file = run.guard_log(node, boot);
            log.extend(
                link::witness::read_entries(&file).unwrap_or_default().into_iter().map(|bytes| kept(guard, bytes)),
            );
        }
    }
    log
}

/// An entry that its writer kept by itself: it was handed over when it was written.
fn kept(node: NodeId, bytes: Vec<u8>) -> Logged {
    Logged { at: Entry::decode(&bytes).map_or(0, |entry| entry.at.0), node, bytes }
}

/// Keeps the launcher's notes beside the guards' logs.
pub(super) fn keep_notes(run: &RunFolder, notes: &[Logged]) -> Result<(), LiveError> {
    let file = run.guard_log(NodeId::CAMPAIGN, Boot(1));
    let written = link::witness::write_entries(&file, notes.iter().map(|note| note.bytes.as_slice()));
    written.map_err(|e| LiveError::Environment(format!("{}: {e}", file.display())))
}

/// The launcher's notes, in order of time, as a chain that it signs at the end of the run.
pub(super) fn notes(key: Option<Key>, told: &[(u64, Any)], end: u64) -> Vec<Logged> {
    let (mut journal, mut log) = (Journal::new(NodeId::CAMPAIGN, Boot(1), key), Vec::new());
    let mut take = |at: u64, out: VecDeque<Output>| {
        for output in out {
            if let Output::Audit { bytes } = output {
                log.push(Logged { at, node: NodeId::CAMPAIGN, bytes });
            }
        }
    };
    for (at, event) in told {
        let mut out = VecDeque::new();
        journal.write(Instant(*at), *event, &mut out);
        take(*at, out);
    }
    let mut out = VecDeque::new();
    journal.sign(Instant(end), &mut out);
    take(end, out);
    log
}
