//! The live launcher: every service its own process, real clock, real links, the adversary really in the middle.
//!
//! Services end when their pipe ends, so they cannot outlive the launcher; a janitor process removes a killed launcher's shared memory and
//! sockets. The launcher carries no message between services: it starts them, applies the process faults of the scenario, and reads the
//! recording afterwards.

pub mod calm;
pub mod child;
mod core_waits;
pub mod detector;
mod disk;
mod error;
mod guest;
pub mod hosts;
pub mod janitor;
pub mod journals;
pub mod leftovers;
mod process;
pub mod remains;
pub mod service;
mod spec;
pub mod trial;
pub mod viewer_files;
mod witness;

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use evidence::Micros;
use evidence::anchors::{HeadAnchor, ProcessStop, TrustAnchors};
use evidence::cue::Watch;
use evidence::log::Logged;
use ground_truth::{Any, Entry, Note, StepName, Suspension};
use link::clock::trace_us;
use link::loopback::LoopbackAddr;
use link::spec::Control;
use nix::sys::signal::Signal;
use parallel::progress;
use recording::RunFolder;
use recording::log::{LogVerifier, Verification};
use recording::write::write_enclaves;
use scenario::Confinement;
use serde_json::Value;
use topology::{RunSecret, Topology};
use wire::audit::Head;
use wire::codec;
use wire::id::{Boot, NodeId};
use wire::person::{Act, Numbered, Role};
use wire::policy::Requirement;
use wire::sign::Key;
use wire::time::Span;

use child::{Child, Line, Services};
use core_waits::CoreWaits;
use disk::Growth;
use hosts::{Hosts, Levels};
use leftovers::Marked;
use process::ProcessFaults;
use remains::Remains;
use spec::{Places, Specs, service};
pub(crate) use spec::{console, site};

pub use error::LiveError;

/// Number of runs of this process so far.
static RUNS: AtomicU32 = AtomicU32::new(0);
/// Lock of the run that is starting its processes.
static STARTING: Mutex<()> = Mutex::new(());
/// Time between the start of the first process and the start of the run, microseconds: all links must be up by then.
const LEAD_US: u64 = 2_500_000;
/// Time limit for a service to report that it is ready.
const READY: Duration = Duration::from_secs(20);
/// Time between the end of a run and the end of the rights on its buses, microseconds.
const SPARE_US: u64 = 60_000_000;
/// Time between the start of a run with a window and the end of these rights, microseconds: the lifetime of its certificates.
const WINDOW_US: u64 = 24 * 3_600_000_000;
/// Time at the end of a run for messages under way, microseconds.
const GRACE_US: u64 = 1_200_000;
/// Most that the host may oversleep, microseconds. Beyond it, the host and not the platform explains a latency.
pub const OVERSLEPT_US: u64 = 100_000;
/// Time limit for a service to end itself.
const ENDING: Duration = Duration::from_secs(5);

/// Options of a run.
pub struct Options<'a> {
    /// Folder for recording and logs, made if it is missing. Without it they are deleted with the run's [`Logs`].
    pub keep: Option<PathBuf>,
    /// Location of the service programs.
    pub services: Services,
    /// The user's request to stop.
    pub stop: &'a progress::Stop,
    /// Receiver of the console's display texts.
    pub show: &'a mut dyn FnMut(&str),
    /// True if the console has a window. The run then lasts until the window is closed, and at least to the scenario's end, so that a person
    /// can look and act.
    pub window: bool,
    /// Permissions of a person at the console.
    pub role: Role,
    /// Acts of a person at the console, each at its time of the run, microseconds, in order.
    pub acts: Vec<(u64, Act)>,
    /// Confinement of the services.
    pub confinement: Confinement,
    /// Networks of the hosts.
    pub hosts: scenario::Hosts,
    /// Shared memory of each host, KiB ([`sandbox::host::SHARED_KIB`], but in a test of its exhaustion).
    pub shared_kib: u64,
}

/// Records of a live run, before it is judged.
pub struct Aftermath {
    /// The recording, on the run's time; after it the notes of guards and launcher.
    pub log: Vec<Logged>,
    /// Verification of the recording, as it was kept.
    pub verification: Verification,
    /// Trust anchors held outside the recorder.
    pub anchors: TrustAnchors,
    /// The first process that ended by itself.
    pub lost: Option<Lost>,
    /// Duration of the run, microseconds.
    pub lasted: u64,
    /// True if the user stopped it before its end.
    pub stopped: bool,
    /// Most that the host overslept, microseconds.
    pub overslept: Micros,
    /// The longest wait of a service for a core, microseconds.
    pub waited: Micros,
    /// Levels of confinement that its services reached.
    pub levels: Levels,
    /// Folder of its recording and input journals.
    pub logs: Logs,
}

/// A process that ended by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lost {
    /// Time of its end, microseconds of the run.
    pub time_us: u64,
    /// Process.
    pub node: NodeId,
    /// The signal that ended it, if one did.
    pub signal: Option<u8>,
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { time_us, node, signal } = self;
        let ms = time_us / 1000;
        match signal.map(|number| Signal::try_from(i32::from(number))) {
            Some(Ok(Signal::SIGSYS)) => {
                write!(f, "{node} was ended at {ms} ms: a system call that its confinement does not allow")
            }
            Some(Ok(signal)) => write!(f, "{node} was ended by {signal} at {ms} ms"),
            Some(Err(_)) | None => write!(f, "{node} ended by itself at {ms} ms"),
        }
    }
}

/// The folder of a finished run, with recording and input journals. Unkept logs are removed with this.
#[derive(Debug)]
pub struct Logs {
    folder: PathBuf,
    _marked: Marked,
}

impl Logs {
    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Runs `topology` live.
pub fn run(
    topology: &Topology,
    secret: &RunSecret,
    guard: Requirement,
    options: Options<'_>,
) -> Result<Aftermath, LiveError> {
    let run = RUNS.fetch_add(1, Ordering::Relaxed);
    let places = Places::new(options.keep, &run_id(run), address_of_run(run));
    leftovers::make_room();
    let marked = Marked::begin(places.remains()).map_err(LiveError::Mark)?;
    spec::make_folders(&places).map_err(|error| LiveError::Folder { folder: places.run_dir.clone(), error })?;
    let run_folder = RunFolder::new(&places.run_dir);
    viewer_files::write_site(&run_folder, topology)
        .map_err(|error| LiveError::Site { folder: places.run_dir.clone(), error })?;
    let credentials = spec::credentials(topology)?;
    let confinement = options.confinement;
    let separate = options.hosts == scenario::Hosts::Namespaces;
    let hosts = (confinement != Confinement::None)
        .then(|| Hosts::start(&options.services, spec::roots(topology, &places), separate, options.shared_kib));
    if let Some(reason) = hosts.as_ref().and_then(Hosts::refused).filter(|_| separate) {
        link::note!("hosts share the loopback interface: {reason}");
    }
    let (lines_in, lines) = channel();
    let mut services = RunningServices {
        janitor: None,
        children: Vec::new(),
        lines,
        stats: Vec::new(),
        stop: options.stop,
        show: options.show,
        window: options.window,
        confinement,
        acts: options.acts.into_iter().zip(1..).collect(),
        places: &places,
    };
    // Parallel runs start one after another, so that each has the host to itself during its lead.
    let starting = STARTING.lock().unwrap_or_else(PoisonError::into_inner);
    let start_us = trace_us() + LEAD_US;
    let window = options.window;
    let mut specs = Specs {
        topology,
        places: &places,
        start_us,
        guard,
        credentials,
        hosts: hosts.as_ref(),
        secret,
        enclaves: None,
        levels: Levels::default(),
        addresses: Default::default(),
        window,
    };
    let until_us = start_us + if window { WINDOW_US } else { topology.duration + SPARE_US };
    let enclaves = write_enclaves(&run_folder, &specs.enclaves(until_us), &secret.authority());
    specs.enclaves = Some(enclaves.map_err(|error| LiveError::Enclaves(error.to_string()))?);
    services.start_all(&options.services, topology, secret, marked.remains(), &mut specs, &lines_in)?;
    drop(starting);
    let mut restart = |node: NodeId, boot: Boot| {
        let member = topology.members.iter().find(|m| m.node() == node).ok_or(LiveError::NoMember)?;
        let member = member.restarted(trace_us().saturating_sub(start_us));
        let mut spec = specs.member(&member)?;
        // Without a start time the restarted service begins at once.
        (spec.boot, spec.start_us) = (boot, 0);
        Ok(Child::start(&options.services, service(&member.role), node, &lines_in, &spec)?)
    };
    let course = services.supervise(topology, start_us, &mut restart)?;
    let levels = specs.levels;
    services.finish();
    let broker = secret.signing_secret(NodeId::BROKER);
    let anchors = topology.trust_anchors(Some((&broker, OVERSLEPT_US)));
    let (heads, stops) = (witness::heads(topology, &services.stats), stops(&course.events, start_us));
    let anchors = TrustAnchors { heads, stops, start_us, cut_short: course.cut_short(), ..anchors };
    let (log, verification, anchors) = collect_records(topology, &run_folder, anchors, &course, &services.stats)?;
    drop(services);
    let logs = Logs { folder: places.run_dir, _marked: marked };
    let (lost, Course { lasted, overslept, waited, stopped, .. }) = (course.lost(), course);
    Ok(Aftermath { log, verification, anchors, lost, lasted, stopped, overslept, waited, levels, logs })
}

/// All records of a finished run, their verification, and the trust anchors.
fn collect_records(
    topology: &Topology,
    run: &RunFolder,
    mut anchors: TrustAnchors,
    course: &Course,
    stats: &[(NodeId, Value)],
) -> Result<(Vec<Logged>, Verification, TrustAnchors), LiveError> {
    let start_us = anchors.start_us;
    // A recorder that died, or whose disk was full, lacks later entries. The input journals of the other services have them too.
    if !anchors.cut_short
        && let Some(insider) = topology.hands()
    {
        witness::rewrite_recording(&insider, run)?;
    }
    let mut recorded = match witness::recorded_entries(run) {
        Err(_) if anchors.cut_short => Vec::new(),
        entries => entries?,
    };
    let guards = witness::guards(topology, run);
    let mut log = match anchors.cut_short {
        true => witness::journals(topology, run, start_us),
        false => witness::to_run_time(recorded.clone(), start_us),
    };
    log.extend(witness::to_run_time(guards.clone(), start_us));
    let mut events: Vec<(u64, Any)> = course.events.iter().map(|(time_us, note)| (*time_us, (*note).into())).collect();
    events.push((course.lasted, Note::Stalled { by: Span(course.overslept) }.into()));
    events.extend(witness::relayed(stats).into_iter().map(|event| (course.lasted, event.into())));
    let seen = witness::deliveries(topology, run, start_us, &log).into_iter();
    events.extend(seen.chain(witness::running(topology, run, start_us)).map(|(time_us, note)| (time_us, note.into())));
    // The notes are one chain, whose entries must be in the order of their times.
    events.sort_by_key(|(time_us, _)| *time_us);
    let end = events.last().map_or(course.lasted, |(time_us, _)| *time_us);
    let key = topology.witnesses.get(&NodeId::CAMPAIGN).map(|secret| Key::from_bytes(&secret.0));
    let notes = witness::notes(key, &events, end);
    witness::write_notes(run, &notes)?;
    anchors.heads.extend(notes.last().and_then(|last| Head::from_last::<Any>(&last.bytes)).map(HeadAnchor::from));
    recorded.extend(guards);
    recorded.extend(notes.iter().cloned());
    log.extend(notes);
    let verification = LogVerifier::new(&anchors).verify(&recorded);
    Ok((log, verification, anchors))
}

/// Identifier of this run among all runs on the host, those of this process included. It is short, since the path of every socket of the bus
/// includes it twice, and the kernel limits a path to 107 bytes.
fn run_id(run: u32) -> String {
    format!("{:x}x{:x}x{run:x}", std::process::id(), trace_us() / 1_000 % (1 << 16))
}

/// The address of a run, which differs from the addresses of other runs on the host.
fn address_of_run(run: u32) -> LoopbackAddr {
    LoopbackAddr::of_run(std::process::id().wrapping_mul(0x10_01).wrapping_add(run))
}

/// Times at which the launcher stopped processes, from its own record, on the recording's clock.
fn stops(events: &[(u64, Note)], start_us: u64) -> Vec<ProcessStop> {
    let mut stops: Vec<ProcessStop> = Vec::new();
    for (time_us, event) in events {
        let (Note::Suspended { node, how: Suspension::Hang, on: begins } | Note::Halted { node, on: begins }) = *event
        else {
            continue;
        };
        let open = stops.iter_mut().rev().find(|stop| stop.node == node && stop.until_us == u64::MAX);
        match (open, begins) {
            (None, true) => stops.push(ProcessStop { node, from_us: start_us + time_us, until_us: u64::MAX }),
            (Some(stop), false) => stop.until_us = start_us + time_us,
            (Some(_), true) | (None, false) => {}
        }
    }
    stops
}

/// Restarts a node under a boot number.
type Restart<'a> = &'a mut dyn FnMut(NodeId, Boot) -> Result<Child, LiveError>;

/// Course of a run.
struct Course {
    /// Process faults and their effects, each with its time, microseconds of the run, in order.
    events: Vec<(u64, Note)>,
    /// Most that the host overslept, microseconds.
    overslept: u64,
    /// The longest wait of a service for a core, microseconds.
    waited: Micros,
    /// Duration of the run, microseconds.
    lasted: u64,
    /// True if the user stopped it before its end.
    stopped: bool,
}

impl Course {
    fn has_ended(&self, node: NodeId) -> bool {
        self.events.iter().any(|(_, event)| matches!(event, Note::Ended { node: n, .. } if *n == node))
    }

    /// True if the recording lacks its end: the recorder was dead or its disk full at the end.
    fn cut_short(&self) -> bool {
        let disk = self.events.iter().rev().find_map(|(_, event)| {
            let Note::DiskFull { on, .. } = event else { return None };
            Some(*on)
        });
        self.has_ended(NodeId::RECORDER) || disk == Some(true)
    }

    fn lost(&self) -> Option<Lost> {
        self.events.iter().find_map(|(time_us, event)| {
            let Note::Ended { node, killed: false, signal } = event else { return None };
            Some(Lost { time_us: *time_us, node: *node, signal: *signal })
        })
    }
}

/// The processes of a run.
struct RunningServices<'a> {
    janitor: Option<Child>,
    children: Vec<Child>,
    lines: Receiver<(NodeId, Line)>,
    stats: Vec<(NodeId, Value)>,
    stop: &'a progress::Stop,
    show: &'a mut dyn FnMut(&str),
    /// True if a window is open, or about to be.
    window: bool,
    /// The requested confinement.
    confinement: Confinement,
    /// Future acts of a person, with the number of each.
    acts: VecDeque<((u64, Act), u64)>,
    places: &'a Places,
}

impl RunningServices<'_> {
    /// Starts every process, in the order in which addresses become known.
    fn start_all(
        &mut self,
        services: &Services,
        topology: &Topology,
        secret: &RunSecret,
        remains: &Remains,
        specs: &mut Specs<'_>,
        lines: &std::sync::mpsc::Sender<(NodeId, Line)>,
    ) -> Result<(), LiveError> {
        let mut janitor = Child::spawn(services, "janitor", NodeId::CAMPAIGN, lines)?;
        let remains = serde_json::to_string(remains)?;
        janitor.write(format!("{remains}\n").as_bytes());
        self.janitor = Some(janitor);
        let member = |node: NodeId| topology.members.iter().find(|m| m.node() == node);
        // A rogue starts before the services whose channels it makes.
        let first = [
            NodeId::INSIDER_PERCEPTION,
            NodeId::IMPOSTOR,
            NodeId::RECORDER,
            topology.broker(),
            NodeId::GATEWAY,
            NodeId::INSIDER_B,
            NodeId::RELAY_TELEMETRY,
            NodeId::RELAY_COMMAND,
        ];
        // A thief of sessions starts later, since it has to know the broker's address.
        let later = |node: NodeId| member(node).is_some_and(|m| m.role.joins_later());
        for node in first.into_iter().filter(|node| !later(*node)) {
            let child = if node == NodeId::BROKER {
                let spec = specs.broker(&secret.signing_secret(NodeId::BROKER))?;
                Child::start(services, "broker", node, lines, &spec)?
            } else {
                let Some(member) = member(node) else { continue };
                Child::start(services, service(&member.role), node, lines, &specs.member(member)?)?
            };
            self.register(child);
            self.await_ready(&[node], specs)?;
        }
        let rest: Vec<_> = topology.members.iter().filter(|m| !first.contains(&m.node()) || later(m.node())).collect();
        for member in &rest {
            let spec = specs.member(member)?;
            let child = Child::start(services, service(&member.role), member.node(), lines, &spec)?;
            self.register(child);
        }
        let rest: Vec<NodeId> = rest.iter().map(|m| m.node()).collect();
        self.await_ready(&rest, specs)
    }

    /// Adds a process, which the janitor then ends if the launcher is killed.
    fn register(&mut self, child: Child) {
        if let Some(janitor) = &mut self.janitor {
            janitor.write(format!("{}\n", child.pid()).as_bytes());
        }
        self.children.push(child);
    }

    fn await_ready(&mut self, nodes: &[NodeId], specs: &mut Specs<'_>) -> Result<(), LiveError> {
        let mut waiting: Vec<NodeId> = nodes.to_vec();
        let until = trace_us() + READY.as_micros() as u64;
        while !waiting.is_empty() {
            if self.stop.is_requested() {
                return Err(LiveError::Stopped);
            }
            if trace_us() > until {
                return Err(LiveError::Late { node: waiting[0], seconds: READY.as_secs() });
            }
            match self.lines.recv_timeout(Duration::from_millis(50)) {
                Ok((node, Line::Ready(line))) => {
                    let level = specs.ready(node, &line);
                    if self.confinement == Confinement::Full && !level.full() {
                        return Err(LiveError::Level { node, level });
                    }
                    waiting.retain(|n| *n != node);
                }
                Ok((node, Line::Refused(reason))) => return Err(LiveError::Refused { node, reason }),
                Ok((node, Line::Ended)) => {
                    let child = self.children.iter_mut().find(|child| child.node == node);
                    let signal = child.and_then(Child::ending_signal);
                    let signal = signal.and_then(|number| Signal::try_from(i32::from(number)).ok());
                    return Err(LiveError::Ended { node, signal });
                }
                Ok((_, Line::Closed(Some(reason)))) => return Err(LiveError::Window(reason)),
                Ok((_, Line::Closed(None))) => return Err(LiveError::WindowClosed),
                Ok((_, Line::Stats(_) | Line::Text(_) | Line::Entry(_))) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(LiveError::AllEnded),
            }
        }
        Ok(())
    }

    /// Runs until the end: applies the scenario's process faults and calls the steps that wait; `restart` restarts a node.
    fn supervise(&mut self, topology: &Topology, start_us: u64, restart: Restart<'_>) -> Result<Course, LiveError> {
        let mut process_faults = ProcessFaults::new(topology);
        let mut watch = Watch::new(&topology.cues);
        let windowed = self.window;
        let (mut overslept, mut seen_events) = (0, 0);
        let mut core_waits = CoreWaits::default();
        let mut growth = topology.fills().then(|| Growth::new(self.places.recording()));
        let clock = || trace_us().saturating_sub(start_us);
        let end = start_us + topology.duration;
        loop {
            let now = trace_us();
            let stopped = self.stop.is_requested();
            if stopped && now < start_us {
                return Err(LiveError::Stopped);
            }
            if now >= start_us
                && let Some(wait) = core_waits.look(now, self.children.iter().map(Child::pid))
            {
                self.send_to_console(&Control::HostWait(Span(wait)));
            }
            if let Some(grown) = growth.as_mut().and_then(Growth::look) {
                process_faults.note(clock(), grown);
            }
            if stopped || now >= end && !self.window {
                let lasted = if windowed || stopped { now - start_us } else { topology.duration };
                // A process that is still stopped must write its closing statistics.
                for child in &mut self.children {
                    child.resume();
                }
                let (events, waited) = (process_faults.events().to_vec(), core_waits.longest_us());
                return Ok(Course { events, overslept, waited, lasted, stopped });
            }
            if process_faults.next_due().is_some_and(|due_us| start_us + due_us <= now) {
                if let Some(node) = process_faults.carry_out(now.saturating_sub(start_us), &mut self.children, &clock) {
                    let boot = Boot(2);
                    self.register(restart(node, boot)?);
                    process_faults.note(clock(), Note::Restarted { node, boot });
                }
                let new = process_faults.events().iter().skip(seen_events);
                let called =
                    new.flat_map(|(time_us, note)| watch.take(*time_us, NodeId::CAMPAIGN, &(*note).into())).collect();
                seen_events = process_faults.events().len();
                self.call(topology, &mut process_faults, called, clock());
                continue;
            }
            self.act(now.saturating_sub(start_us));
            let end = if self.window { u64::MAX } else { end };
            let end = self.acts.front().map_or(end, |((due_us, _), _)| end.min(start_us + due_us));
            let next = process_faults.next_due().map_or(end, |due_us| (start_us + due_us).min(end));
            let nap = next.saturating_sub(now).clamp(1, 10_000);
            let received = self.lines.recv_timeout(Duration::from_micros(nap));
            let slept = trace_us().saturating_sub(now);
            if now >= start_us && matches!(received, Err(RecvTimeoutError::Timeout)) {
                overslept = overslept.max(slept.saturating_sub(nap));
            }
            match received {
                Ok((_, Line::Text(text))) => (self.show)(&text),
                Ok((_, Line::Closed(Some(reason)))) => return Err(LiveError::Window(reason)),
                Ok((_, Line::Closed(None))) => self.window = false,
                Ok((_, Line::Entry(bytes))) => {
                    if let Ok(entry) = Entry::decode(&bytes) {
                        self.call(
                            topology,
                            &mut process_faults,
                            watch.take(clock(), entry.node, &entry.event),
                            clock(),
                        );
                    }
                }
                Ok((node, Line::Ended)) if !process_faults.has_ended(node) => {
                    // The window ends with the console's process.
                    self.window &= node != NodeId::CONSOLE;
                    let child = self.children.iter_mut().find(|child| child.node == node);
                    let signal = child.and_then(Child::ending_signal);
                    process_faults.note(clock(), Note::Ended { node, killed: false, signal });
                }
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(LiveError::AllEnded),
            }
        }
    }

    /// Performs the person's acts due by `now` of the run.
    fn act(&mut self, now: u64) {
        while let Some(((_, act), serial)) = self.acts.pop_front_if(|((due_us, _), _)| *due_us <= now) {
            self.send_to_console(&Control::Act(codec::encode(&Numbered { serial, act })));
        }
    }

    fn send_to_console(&mut self, control: &Control) {
        self.children.iter_mut().filter(|child| child.node == NodeId::CONSOLE).for_each(|child| child.send(control));
    }

    /// Calls steps: a process with steps gets a message, and process faults begin here.
    fn call(&mut self, topology: &Topology, process_faults: &mut ProcessFaults, steps: Vec<StepName>, now: u64) {
        let takes = |node: NodeId| topology.members.iter().any(|m| m.node() == node && m.role.takes_cues());
        for step in steps {
            self.children.iter_mut().filter(|c| takes(c.node)).for_each(|c| c.send(&Control::Cue(step)));
            process_faults.call(now, step);
        }
    }

    /// Quiesces the services, waits for messages under way, and ends every process, which then reports its closing statistics. The relays end
    /// first, then the services that send to the gateway directly, since they would dial again after the gateway's end; then the gateway, so
    /// that no datagram is under way while its two ends count; the recorder last.
    fn finish(&mut self) {
        self.children.iter_mut().for_each(|c| c.send(&Control::Quiesce));
        let until = trace_us() + GRACE_US;
        while trace_us() < until {
            self.collect_stats(Duration::from_millis(20));
        }
        let turn = |node: NodeId| match node {
            NodeId::RELAY_TELEMETRY | NodeId::RELAY_COMMAND => 0,
            NodeId::INSIDER_B | NodeId::UNIT_C => 1,
            NodeId::GATEWAY => 2,
            NodeId::RECORDER => 4,
            _ => 3,
        };
        let mut groups: [Vec<Child>; 5] = Default::default();
        self.children.drain(..).for_each(|child| groups[turn(child.node)].push(child));
        for group in &mut groups {
            group.iter_mut().for_each(|c| c.send(&Control::Finish));
            let until = trace_us() + ENDING.as_micros() as u64;
            while trace_us() < until && !group.iter_mut().all(Child::has_ended) {
                self.collect_stats(Duration::from_millis(10));
            }
        }
        self.collect_stats(Duration::from_millis(10));
    }

    /// Waits up to `patience` for a line, and collects the closing statistics among the lines that have arrived.
    fn collect_stats(&mut self, patience: Duration) {
        let mut next = self.lines.recv_timeout(patience).ok();
        while let Some((node, line)) = next {
            if let Line::Stats(stats) = line {
                self.stats.push((node, stats));
            }
            next = self.lines.try_recv().ok();
        }
    }
}

impl Drop for RunningServices<'_> {
    /// Ends processes that still run, then lets the janitor sweep.
    fn drop(&mut self) {
        self.children.iter_mut().for_each(Child::release);
        self.children.clear();
        if let Some(mut janitor) = self.janitor.take() {
            janitor.write(janitor::DONE.as_bytes());
            janitor.release();
            janitor.wait();
        }
    }
}
