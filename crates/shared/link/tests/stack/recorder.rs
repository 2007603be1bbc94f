//! The recorder as a process: controlled by a pipe, fed by a socket, with a readable recording at the end.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use ground_truth::{Any, Entry as AuditEntry, Note};
use link::bus::Domain;
use link::bus::sweep::sweep;
use link::clock::{HostClock, trace_us};
use link::input_journal::{Entry, Reader};
use link::instrument::{Frame, Instrument};
use link::mcap_frames;
use link::spec::{BusSpec, ChannelSpec, Control, ORPHANED, RecorderSpec, ServiceSpec};
use minicbor::Encode;
use rustix::process::{Resource, Rlimit};
use tokio::sync::mpsc;
use wire::audit::Journal;
use wire::core::{Input, Output, Topic};
use wire::event::Event;
use wire::id::{Boot, NodeId};
use wire::time::Instant;

/// A running recorder and its standard output.
struct Running {
    child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

fn start(directory: &Path) -> Running {
    launch(spec(directory, Boot(1)))
}

fn spec(directory: &Path, boot: Boot) -> ServiceSpec {
    let clock = HostClock { zero_us: 1_000, drift_ppm: 0 };
    let mut spec = ServiceSpec::new(NodeId::RECORDER, boot, 1, clock, directory.to_owned());
    spec.recorder = Some(RecorderSpec {
        socket: directory.join("audit"),
        directory: directory.join("record"),
        reports_awaited: false,
    });
    spec.config = serde_json::json!({
        "boot": boot,
        "secret": vec![7; 32],
        "channels": [{ "topic": Topic::Seals, "producer": NodeId::RECORDER, "key": vec![9; 32] }],
    });
    spec
}

/// Its standard error goes to a file beside its recording, which may be on a full disk as well.
fn launch(spec: ServiceSpec) -> Running {
    let errors = std::fs::File::create(spec.run_dir.join("said")).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_holdsafe-recorder"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(errors)
        .spawn()
        .unwrap();
    spec.write(child.stdin.as_mut().unwrap()).unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("ready {"));
    Running { child, lines }
}

fn frames(n: u64) -> Vec<Frame> {
    written(n, Event::Started)
}

fn written(n: u64, event: impl Encode<()> + Copy) -> Vec<Frame> {
    let mut journal = Journal::new(NodeId::SIM, Boot(1), None);
    let mut out = std::collections::VecDeque::new();
    (0..n).for_each(|time| journal.write(Instant(time), event, &mut out));
    let bytes = |output| if let Output::Audit { bytes } = output { bytes } else { panic!("{output:?}") };
    out.into_iter().map(|o| Frame { trace_us: trace_us(), node: NodeId::SIM, bytes: bytes(o) }).collect()
}

#[test]
fn service_entries_are_recorded_fed_and_accounted_for() {
    let directory = tempfile::tempdir().unwrap();
    let mut running = start(directory.path());
    let mut instrument = Instrument::start(directory.path().join("audit")).unwrap();
    let sent = frames(50);
    sent.iter().for_each(|frame| instrument.push(frame.clone()));
    let stats = instrument.finish();
    assert_eq!((stats.sent, stats.lost), (50, 0));
    let recorded = wait_for(directory.path(), 50);
    running.child.stdin.as_mut().unwrap().write_all(Control::Finish.line().as_bytes()).unwrap();
    let last = running.lines.map(Result::unwrap).find(|line| line.starts_with("stats ")).unwrap();
    assert!(running.child.wait().unwrap().success());
    let stats: serde_json::Value = serde_json::from_str(last.trim_start_matches("stats ")).unwrap();
    assert_eq!(stats["links"]["recording"]["lost"], 0);
    assert!(recorded >= 50);
    let file = std::fs::read(directory.path().join("record/audit-0.mcap")).unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&file).unwrap().map(Result::unwrap).collect();
    let from_sim: Vec<_> = messages.iter().filter(|m| m.channel.topic == "/audit/sim").collect();
    assert_eq!(from_sim.len(), 50);
    assert!(from_sim.iter().zip(&sent).all(|(message, frame)| *message.data == frame.bytes));
    let from_recorder = messages.iter().filter(|m| m.channel.topic == "/audit/recorder");
    assert!(from_recorder.clone().count() > 0 && from_recorder.clone().all(|m| AuditEntry::decode(&m.data).is_ok()));
}

/// Follows the recorder's input journal until it holds `n` fed entries.
fn wait_for(directory: &Path, n: usize) -> usize {
    loop {
        let file = std::fs::File::open(directory.join("inputs/recorder.cbor")).unwrap();
        let fed = Reader::new(BufReader::new(file)).map_or(0, |log| {
            log.filter(|entry| matches!(entry, Ok(Entry::Input { input: Input::Audit { .. }, .. }))).count()
        });
        if fed >= n {
            return fed;
        }
        std::thread::yield_now();
    }
}

/// Limits the files that the process writes from now on to this many bytes.
fn limit(child: &Child, bytes: Option<u64>) {
    let pid = rustix::process::Pid::from_raw(child.id() as i32);
    let maximum = rustix::process::getrlimit(Resource::Fsize).maximum;
    rustix::process::prlimit(pid, Resource::Fsize, Rlimit { current: bytes, maximum }).unwrap();
}

/// It lives while it may write no file, and loses no entry once it may again.
#[test]
fn recorder_without_writes_recovers_without_loss() {
    let directory = tempfile::tempdir().unwrap();
    let mut spec = spec(directory.path(), Boot(1));
    let recorder = spec.recorder.as_mut().unwrap();
    // It reports each step on receipt, whether or not it can write it.
    (recorder.reports_awaited, recorder.directory) = (true, directory.path().join("record"));
    let mut running = launch(spec);
    let mut instrument = Instrument::start(directory.path().join("audit")).unwrap();
    let step = Note::Step { step: ground_truth::StepName::new("cut").unwrap(), begun: true };
    let sent = written(60, step);
    let mut send = |range: std::ops::Range<usize>| {
        sent[range.clone()].iter().for_each(|frame| instrument.push(frame.clone()));
        let heard = running.lines.by_ref().map(Result::unwrap).filter(|line| line.starts_with("entry "));
        assert_eq!(heard.take(range.len()).count(), range.len());
    };
    let on_file = || -> usize {
        let until = trace_us() + 10_000_000;
        // On a full disk it creates files and removes them again: a listed file may be gone before it is read.
        let mut tries = std::iter::repeat_with(|| mcap_frames::frames_of_folder(&directory.path().join("record")));
        let frames = tries.find(|read| read.is_ok() || trace_us() > until).expect("there is always another try");
        frames.expect("a file that is there").iter().filter(|frame| frame.node == NodeId::SIM).count()
    };
    let lives = |child: &mut Child| assert!(child.try_wait().unwrap().is_none(), "the recorder has ended");
    // What is seen in the file may still have to be flushed whole. Of the first twenty that is so once one more is seen.
    for (range, all) in [(0..20, 20), (20..21, 21)] {
        send(range);
        while on_file() < all {
            lives(&mut running.child);
        }
    }
    limit(&running.child, Some(0));
    send(21..60);
    assert!((20..=21).contains(&on_file()), "the kernel refuses the rest");
    // Three times as long as its logs go unflushed: it wants to say that it cannot, where it can say nothing either.
    let until = trace_us() + 300_000;
    while trace_us() < until {
        lives(&mut running.child);
    }
    limit(&running.child, rustix::process::getrlimit(Resource::Fsize).current);
    while on_file() < 60 {
        lives(&mut running.child);
    }
    running.child.stdin.as_mut().unwrap().write_all(Control::Finish.line().as_bytes()).unwrap();
    let last = running.lines.map(Result::unwrap).find(|line| line.starts_with("stats ")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(last.trim_start_matches("stats ")).unwrap();
    assert_eq!(stats["links"]["recording"]["lost"], 0);
    assert!(running.child.wait().unwrap().success());
    let recorded = mcap_frames::frames_of_folder(&directory.path().join("record")).unwrap();
    let mut chains = wire::audit::Chains::default();
    assert!(recorded.iter().all(|frame| chains.follow::<Any>(&frame.bytes).is_ok()), "each once, in order");
    let last = recorded.iter().rev().find_map(|frame| {
        let Any::Service(Event::Sealed { entries, .. }) = AuditEntry::decode(&frame.bytes).unwrap().event else {
            return None;
        };
        Some(entries)
    });
    assert_eq!(last, Some(60));
}

#[test]
fn the_end_of_the_pipe_ends_the_process() {
    let directory = tempfile::tempdir().unwrap();
    let mut running = start(directory.path());
    drop(running.child.stdin.take());
    assert_eq!(running.child.wait().unwrap().code(), Some(ORPHANED));
}

/// It succeeds a killed recorder, whose log has every seal that was heard of it.
#[test]
fn successor_recorder_is_heard_by_the_same_services() {
    let directory = tempfile::tempdir().unwrap();
    let (root, prefix) = (directory.path().join("bus"), format!("hs_t{}_killed_", std::process::id()));
    let (tx, mut inbox) = mpsc::channel(64);
    let domain = Domain::new(&root, &prefix).unwrap();
    let reader = domain.subscribe("vehicle", Topic::Seals, tx).unwrap();
    for boot in 1..=3 {
        let mut spec = spec(directory.path(), Boot(boot));
        let publish = vec![ChannelSpec { scope: "vehicle".into(), topic: Topic::Seals, cipher: None }];
        spec.bus.push(BusSpec {
            root: root.clone(),
            prefix: prefix.clone(),
            subscribe: Vec::new(),
            publish,
            publishers: 1,
        });
        let mut running = launch(spec);
        let Some(Input::Bus { bytes: heard, .. }) = inbox.blocking_recv() else { panic!("the channel ended") };
        running.child.kill().unwrap();
        running.child.wait().unwrap();
        let log = if boot == 1 { "recorder.cbor".to_owned() } else { format!("recorder-{boot}.cbor") };
        let log = std::fs::File::open(directory.path().join("inputs").join(log)).unwrap();
        let done = |entry| matches!(entry, Ok(Entry::Output(Output::Bus { bytes, .. })) if bytes == heard);
        assert!(Reader::new(BufReader::new(log)).unwrap().any(done), "a killed process leaves no act without an entry");
        while inbox.try_recv().is_ok() {}
    }
    drop(reader);
    sweep(&prefix, &root).unwrap();
    assert_eq!(sweep(&prefix, &root).unwrap(), 0);
}
