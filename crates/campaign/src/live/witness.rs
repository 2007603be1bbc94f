//! Reads what a live run left: the recording, or the mouth logs where there is none, the guards' logs, and the closing
//! statistics of the links.

use std::collections::VecDeque;
use std::io::BufReader;
use std::path::Path;

use adversary::insider::{InsiderRecorder, Kept};
use link::instrument::Frame;
use link::mouth;
use link::recorded;
use link::recorder::Recording;
use link::stream::{StreamLog, StreamSight};
use link::vet::Fault;
use serde_json::Value;
use wire::audit::Journal;
use wire::codec::Text;
use wire::core::{Output, Side};
use wire::event::{Account, Event, Interface};
use wire::id::{Boot, NodeId};
use wire::time::Instant;

use super::LiveError;
use crate::cast::{Cast, Member};
use crate::custody::HeldHead;
use crate::evidence::{Logged, guard_verdict};
use crate::sights::{Claims, Running};

/// The recording, in the order and under the times in which it was kept.
pub(super) fn recording(run_dir: &Path) -> Result<Vec<Logged>, LiveError> {
    let frames = recorded::frames(&run_dir.join("recording")).map_err(|e| LiveError::Environment(e.to_string()))?;
    let logged = |f: Frame| Logged { at: f.trace_us, node: f.node, bytes: f.bytes };
    Ok(frames.into_iter().map(logged).collect())
}

/// The same on the run's time; what was written before the start counts as written at the start.
pub(super) fn on_the_runs_time(kept: Vec<Logged>, start_us: u64) -> Vec<Logged> {
    kept.into_iter().map(|logged| Logged { at: logged.at.saturating_sub(start_us), ..logged }).collect()
}

/// Lets the hands that the recorder is in at the files of its recording.
pub(super) fn lay_on(hands: &InsiderRecorder, run_dir: &Path) -> Result<(), LiveError> {
    let folder = run_dir.join("recording");
    let unreadable = |e: recorded::RecordedError| LiveError::Environment(e.to_string());
    let frames = recorded::frames(&folder).map_err(unreadable)?;
    let kept = |Frame { trace_us: at, node, bytes }: Frame| Kept { at, node, bytes };
    let mut kept: Vec<Kept> = frames.into_iter().map(kept).collect();
    hands.lay_on(&mut kept);
    let unwritable = |e: std::io::Error| LiveError::Environment(format!("{}: {e}", folder.display()));
    std::fs::remove_dir_all(&folder).map_err(unwritable)?;
    let mut recording = Recording::new(folder.clone());
    for Kept { at: trace_us, node, bytes } in kept {
        recording.write(Frame { trace_us, node, bytes });
    }
    let again = || LiveError::Environment(format!("{} cannot be written again", folder.display()));
    (recording.finish().lost == 0).then_some(()).ok_or_else(again)
}

/// How far each service's chain went, by its own closing words; the recorder's are none against it.
pub(super) fn heads(stats: &[(NodeId, Value)]) -> Vec<HeldHead> {
    let of = |(node, stats): &(NodeId, Value)| {
        let head = &stats["links"]["head"];
        let boot = Boot(u32::try_from(head["boot"].as_u64()?).ok()?);
        Some(HeldHead {
            node: *node,
            boot,
            counter: head["counter"].as_u64()?,
            hash: head["hash"].as_str()?.to_owned(),
        })
    };
    stats.iter().filter(|(node, _)| *node != NodeId::RECORDER).filter_map(of).collect()
}

/// The same entries out of every member's mouth log, for a run whose recorder died; each counts as written when its core
/// was fed. The broker has no core and so no mouth: its entries are missing.
pub(super) fn mouths(cast: &Cast, run_dir: &Path, start_us: u64) -> Vec<Logged> {
    let mut log = Vec::new();
    for member in &cast.members {
        let node = member.node();
        passed(cast, member, run_dir, start_us, |at, entry| {
            if let mouth::Entry::Output(Output::Audit { bytes }) = entry {
                log.push(Logged { at, node, bytes });
            }
        });
    }
    log
}

/// What the mouths of the cores took in of what insiders say in `log` that they sent. The launcher's word, read from what
/// the process of each reader kept.
pub(super) fn sights(cast: &Cast, run_dir: &Path, start_us: u64, log: &[Logged]) -> Vec<(u64, Event)> {
    let mut claims = Claims::default();
    log.iter().for_each(|logged| claims.note(logged.node, &logged.bytes));
    let mut seen = Vec::new();
    for member in cast.members.iter().filter(|_| !claims.is_empty()) {
        passed(cast, member, run_dir, start_us, |at, entry| {
            if let mouth::Entry::Input { input, .. } = &entry {
                seen.extend(claims.sight(member.node(), input).map(|event| (at, event)));
            }
        });
    }
    seen
}

/// When the cores of processes that were to be kept from running were fed, by the mouth logs of those.
pub(super) fn running(cast: &Cast, run_dir: &Path, start_us: u64) -> Vec<(u64, Event)> {
    let watched = cast.watched();
    let mut running = Running::new(&watched);
    let mut seen = Vec::new();
    for member in cast.members.iter().filter(|m| watched.contains(&m.node())) {
        let node = member.node();
        passed(cast, member, run_dir, start_us, |at, entry| {
            if matches!(entry, mouth::Entry::Input { .. }) && running.told(node, at) {
                seen.push((at, Event::Ran { node }));
            }
        });
    }
    seen
}

/// Everything that passed the mouth of `member`, each with the time of the run at which its core was fed.
fn passed(cast: &Cast, member: &Member, run_dir: &Path, start_us: u64, mut each: impl FnMut(u64, mouth::Entry)) {
    let clock = super::spec::clock(cast, member.host);
    // One log for each start; the second is there when it was started again.
    for boot in ["", "-2"] {
        let file = std::fs::File::open(run_dir.join("mouth").join(format!("{}{boot}.cbor", member.node())));
        let Some(mouth) = file.ok().and_then(|file| mouth::Reader::new(BufReader::new(file)).ok()) else { continue };
        let mut now = mouth.header().started;
        // A cut at the end is what a killed writer leaves; a missing entry before it breaks the chain.
        for entry in mouth.map_while(Result::ok) {
            if let mouth::Entry::Input { now: fed, .. } = &entry {
                now = *fed;
            }
            each(clock.trace_at(now).saturating_sub(start_us), entry);
        }
    }
}

/// What the telemetry relay's sockets did not take, and what came to them that was not the client's: its core cannot know.
///
/// They are the launcher's word, read from the process's closing statistics, in a chain of the launcher's.
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

/// The guards' logs and accounts, as entries of the guards' own nodes.
pub(super) fn guards(cast: &Cast, run_dir: &Path, start_us: u64, stats: &[(NodeId, Value)]) -> Vec<Logged> {
    let mut log = Vec::new();
    let members = cast.members.iter().filter(|m| m.peer.is_some()).map(Member::node);
    let ends = members.map(|node| (node, node.guard())).chain(std::iter::once((cast.broker(), NodeId::BROKER.guard())));
    for (node, guard) in ends {
        let Some(guard) = guard else { continue };
        let mut journal = Journal::new(guard, Boot(1), None);
        let mut events = Vec::new();
        // One log for each start; the second is there when it was started again.
        let logs = ["", "-2"].map(|boot| run_dir.join("guard").join(format!("{node}{boot}.cbor")));
        for seen in logs.iter().flat_map(|path| recorded::observations(path).unwrap_or_default()) {
            let at = seen.trace_us.saturating_sub(start_us);
            if let Some(peer) = seen.peer {
                events.push((at, Event::Associated { association: seen.association, peer }));
                continue;
            }
            let event = Event::GuardSaw {
                association: seen.association,
                epoch: seen.epoch,
                sequence: seen.sequence,
                length: seen.length.min(u32::from(u16::MAX)) as u16,
                hash: u64::from_be_bytes(seen.digest),
                verdict: guard_verdict(seen.verdict),
            };
            events.push((at, event));
            if let Some(fault) = seen.fault {
                events.push((at, refused(node, fault)));
            }
        }
        for seen in recorded::streams(&StreamLog::path(run_dir, node)).unwrap_or_default() {
            let StreamSight { trace_us, sight, stream, offset, length, hash } = seen;
            let event = Event::StreamSaw { sight, stream, offset, length, hash };
            events.push((trace_us.saturating_sub(start_us), event));
        }
        // Each association logs for itself; only together do they have an order in time.
        events.sort_by_key(|(at, _)| *at);
        if let Some((_, stats)) = stats.iter().find(|(n, _)| *n == node) {
            let end = events.last().map_or(cast.duration, |(at, _)| cast.duration.max(*at));
            let direct = cast.links.iter().any(|l| l.client == node && l.server == NodeId::GATEWAY && !l.relayed);
            let accounts = accounts(stats, direct).into_iter();
            events.extend(accounts.map(|(account, n)| (end, Event::Count { account, n })));
        }
        for (at, event) in events {
            note(&mut journal, &mut log, guard, at, event);
        }
    }
    log
}

/// A link refused a handshake, or ended a session over its certificate.
fn refused(node: NodeId, fault: Fault) -> Event {
    let at = if node == NodeId::GATEWAY { Interface::Uplink } else { Interface::Downlink };
    let detail = Text::new(&format!("{}: expected {}", fault.name(), fault.expected()));
    Event::Refused { at, peer: None, reason: fault.reason(), detail }
}

/// Writes an event of `node`'s into its journal and the entry into the log.
pub(super) fn note(journal: &mut Journal, log: &mut Vec<Logged>, node: NodeId, at: u64, event: Event) {
    let mut out = VecDeque::new();
    journal.write(Instant(at), event, &mut out);
    log.extend(
        out.into_iter()
            .filter_map(|o| if let Output::Audit { bytes } = o { Some(Logged { at, node, bytes }) } else { None }),
    );
}

/// What the link counted, as accounts. What the secure layer consumed of application data without delivering it counts
/// as discarded; other records that the guard passed are the handshake's.
fn accounts(stats: &Value, direct: bool) -> Vec<(Account, u64)> {
    let dtls = &stats["links"]["dtls"];
    let get = |name: &str| dtls[name].as_u64().unwrap_or(0);
    let guard = |name: &str| dtls["guard"][name].as_u64().unwrap_or(0);
    let refused = ["unframed", "bad_hello", "plaintext_after", "plaintext_before", "too_early", "unsealed"]
        .map(guard)
        .iter()
        .sum();
    let (records, application, delivered) = (guard("records"), guard("application"), get("delivered"));
    let unguarded =
        ["overflowed", "abandoned", "strangers", "shed", "unproven", "proved", "asked"].map(get).iter().sum();
    let strangers = get("strangers") + get("shed") + get("unproven");
    vec![
        (Account::Datagrams, guard("datagrams")),
        (Account::Unguarded, unguarded),
        (Account::SentDirect, if direct { get("dialled") } else { 0 }),
        (Account::GuardIn, records + strangers + get("proved")),
        (Account::GuardRefused, refused + strangers),
        (Account::Delivered, delivered),
        (Account::Discarded, application.saturating_sub(delivered)),
        (Account::Handshake, (records + get("proved")).saturating_sub(refused).saturating_sub(application)),
        (Account::Outsiders, get("outsiders")),
        (Account::KernelDropped, stats["links"]["dtls_kernel_drops"].as_u64().unwrap_or(0)),
    ]
}
