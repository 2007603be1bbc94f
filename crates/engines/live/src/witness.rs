//! Reads the records of a live run: the recording, or the input journals where there is none, the guards' logs, and the closing statistics of
//! the links. It writes the launcher's own notes.

use std::collections::VecDeque;
use std::io::BufReader;

use adversary::insider::{InsiderRecorder, RecordedEntry};
use evidence::anchors::HeadAnchor;
use evidence::delivery::{Claims, Running};
use evidence::log::Logged;
use ground_truth::{Any, Entry, Note};
use link::input_journal;
use link::instrument::Frame;
use link::mcap_frames::frames_of_folder;
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
    let frames = frames_of_folder(&run.recording())?;
    let logged = |f: Frame| Logged { at: f.trace_us, node: f.node, bytes: f.bytes };
    Ok(frames.into_iter().map(logged).collect())
}

/// Entries of the recording on the run's time; an entry from before the start counts as written at the start.
pub(super) fn to_run_time(entries: Vec<Logged>, start_us: u64) -> Vec<Logged> {
    entries.into_iter().map(|logged| Logged { at: logged.at.saturating_sub(start_us), ..logged }).collect()
}

/// Lets the insider at the recorder alter the files of its recording.
pub(super) fn rewrite_recording(insider: &InsiderRecorder, run: &RunFolder) -> Result<(), LiveError> {
    let folder = run.recording();
    let frames = frames_of_folder(&folder)?;
    let entry = |Frame { trace_us, node, bytes }: Frame| RecordedEntry { at: trace_us, node, bytes };
    let mut entries: Vec<RecordedEntry> = frames.into_iter().map(entry).collect();
    insider.lay_on(&mut entries);
    let unwritable = |error: std::io::Error| LiveError::Unwritable { path: folder.clone(), error };
    std::fs::remove_dir_all(&folder).map_err(unwritable)?;
    let mut recording = Recording::new(folder.clone());
    for RecordedEntry { at: trace_us, node, bytes } in entries {
        recording.write(Frame { trace_us, node, bytes });
    }
    (recording.finish().lost == 0).then_some(()).ok_or(LiveError::NotRewritten { folder })
}

/// Heads of each service's chain, and of its guard's, by its own closing statement; the recorder's is no evidence
/// against it.
pub(super) fn heads(topology: &Topology, stats: &[(NodeId, Value)]) -> Vec<HeadAnchor> {
    let anchor = |node: NodeId, head: &Value| {
        let boot = Boot(u32::try_from(head["boot"].as_u64()?).ok()?);
        Some(HeadAnchor { node, boot, counter: head["counter"].as_u64()?, hash: head["hash"].as_str()?.to_owned() })
    };
    let both = |(node, stats): &(NodeId, Value)| {
        let guard = topology.ingress_of(*node).and_then(|guard| anchor(guard, &stats["links"]["witness"]));
        [anchor(*node, &stats["links"]["head"]), guard]
    };
    stats.iter().filter(|(node, _)| *node != NodeId::RECORDER).flat_map(both).flatten().collect()
}

/// Audit entries from every participant's input journal, for a run with a dead recorder; each counts as written when its core got the input.
/// The broker has no core and so no journal: its entries are missing.
pub(super) fn journals(topology: &Topology, run: &RunFolder, start_us: u64) -> Vec<Logged> {
    let mut log = Vec::new();
    for member in &topology.members {
        let node = member.node();
        each_entry(topology, member, run, start_us, |time_us, entry| {
            if let input_journal::Entry::Output(Output::Audit { bytes }) = entry {
                log.push(Logged { at: time_us, node, bytes });
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
        each_entry(topology, member, run, start_us, |time_us, entry| {
            if let input_journal::Entry::Input { input, .. } = &entry {
                seen.extend(claims.delivered(member.node(), input).map(|event| (time_us, event)));
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
        each_entry(topology, member, run, start_us, |time_us, entry| {
            if matches!(entry, input_journal::Entry::Input { .. }) && running.note_due(node, time_us) {
                seen.push((time_us, Note::Ran { node }));
            }
        });
    }
    seen
}

/// Every input and output of `member`'s core, each with the time of the run at which the core got the input.
fn each_entry(
    topology: &Topology,
    member: &Member,
    run: &RunFolder,
    start_us: u64,
    mut each: impl FnMut(u64, input_journal::Entry),
) {
    let clock = super::spec::clock(topology, member.host);
    // One log for each start; a restarted process has a second one.
    for boot in [Boot(1), Boot(2)] {
        let file = link::files::open(&run.input_journal(member.node(), boot));
        let Some(journal) = file.ok().and_then(|file| input_journal::Reader::new(BufReader::new(file)).ok()) else {
            continue;
        };
        let mut now = journal.header().started;
        // A killed writer leaves a cut at the end; a missing entry before it breaks the chain.
        for entry in journal.map_while(Result::ok) {
            if let input_journal::Entry::Input { now: input_time, .. } = &entry {
                now = *input_time;
            }
            each(clock.trace_at(now).saturating_sub(start_us), entry);
        }
    }
}

/// Datagrams that the telemetry relay's sockets refused, and datagrams of other senders than the client: both are unknown to its core.
///
/// The counts are the launcher's statements, read from the process's closing statistics, in a chain of the launcher's.
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
        // One log for each start; a restarted process has a second one.
        for boot in [Boot(1), Boot(2)] {
            let file = run.guard_log(node, boot);
            log.extend(
                link::witness::read_entries(&file).unwrap_or_default().into_iter().map(|bytes| logged(guard, bytes)),
            );
        }
    }
    log
}

/// An entry of its writer's own log, under the time at which it was written.
fn logged(node: NodeId, bytes: Vec<u8>) -> Logged {
    Logged { at: Entry::decode(&bytes).map_or(0, |entry| entry.at.0), node, bytes }
}

/// Writes the launcher's notes beside the guards' logs.
pub(super) fn write_notes(run: &RunFolder, notes: &[Logged]) -> Result<(), LiveError> {
    let file = run.guard_log(NodeId::CAMPAIGN, Boot(1));
    let written = link::witness::write_entries(&file, notes.iter().map(|note| note.bytes.as_slice()));
    written.map_err(|error| LiveError::Unwritable { path: file, error })
}

/// The launcher's notes, in order of time, as a chain that it signs at the end of the run.
pub(super) fn notes(key: Option<Key>, events: &[(u64, Any)], end: u64) -> Vec<Logged> {
    let (mut journal, mut log) = (Journal::new(NodeId::CAMPAIGN, Boot(1), key), Vec::new());
    let mut take = |time_us: u64, out: VecDeque<Output>| {
        for output in out {
            if let Output::Audit { bytes } = output {
                log.push(Logged { at: time_us, node: NodeId::CAMPAIGN, bytes });
            }
        }
    };
    for (time_us, event) in events {
        let mut out = VecDeque::new();
        journal.write(Instant(*time_us), *event, &mut out);
        take(*time_us, out);
    }
    let mut out = VecDeque::new();
    journal.sign(Instant(end), &mut out);
    take(end, out);
    log
}
