//! The live launcher: every service its own process, real clock, real links, the adversary really in the middle.
//!
//! Services end when their pipe ends, so they cannot outlive the launcher; a janitor process removes a killed
//! launcher's shared memory and sockets. The launcher itself carries no message between services: it starts them, ends
//! them on purpose where the scenario says so, and reads the recording afterwards.

pub mod calm;
pub mod child;
mod core_waits;
pub mod detector;
mod disk;
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

/// Runs of this process so far.
static RUNS: AtomicU32 = AtomicU32::new(0);
/// Held by the run that is starting its processes.
static STARTING: Mutex<()> = Mutex::new(());
/// From the first process to the start of the run, microseconds: all links must stand by then.
const LEAD_US: u64 = 2_500_000;
/// Time limit for a service to report that it is ready.
const READY: Duration = Duration::from_secs(20);
/// From the end of a run to the end of the rights on its buses, microseconds.
const SPARE_US: u64 = 60_000_000;
/// From the start of a run with a window to the end of these rights: that of its certificates.
const WINDOW_US: u64 = 24 * 3_600_000_000;
/// Time limit at the end for messages under way.
const GRACE_US: u64 = 1_200_000;
/// By how much the host may oversleep before it, and not the platform, explains a latency, microseconds.
pub const OVERSLEPT_US: u64 = 100_000;
/// Time limit for a service to end itself.
const ENDING: Duration = Duration::from_secs(5);

/// Reason for a failed live run.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The host lacks something, or a service did not come up.
    #[error("{0}")]
    Environment(String),
    /// The user stopped it before it began.
    #[error("stopped")]
    Stopped,
}

impl From<String> for LiveError {
    fn from(why: String) -> Self {
        LiveError::Environment(why)
    }
}

/// Options of a run.
pub struct Options<'a> {
    /// Folder for recording and logs; made if it is not there. Without it they are deleted with the run's [`Logs`].
    pub keep: Option<PathBuf>,
    /// Location of the service programs.
    pub services: Services,
    /// The user's wish to stop.
    pub stop: &'a progress::Stop,
    /// Receiver of the console's display texts.
    pub show: &'a mut dyn FnMut(&str),
    /// True if the console has a window. Then the run lasts until that is closed, at least to the scenario's end: a person
    /// wants to look, and to act.
    pub window: bool,
    /// Permissions of that person, or of one without a window.
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
    /// The recording, on the run's time; behind it the notes of guards and launcher.
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
    /// By how much the host overslept at most, microseconds.
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
    /// Microseconds of the run.
    pub at: u64,
    /// Process.
    pub node: NodeId,
    /// The signal that ended it, if one did.
    pub signal: Option<u8>,
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { at, node, signal } = self;
        match signal.map(|number| Signal::try_from(i32::from(number))) {
            Some(Ok(Signal::SIGSYS)) => {
                write!(f, "{node} was ended at {} ms: a system call that its confinement does not allow", at / 1000)
            }
            Some(Ok(signal)) => write!(f, "{node} was ended by {signal} at {} ms", at / 1000),
            Some(Err(_)) | None => write!(f, "{node} ended by itself at {} ms", at / 1000),
        }
    }
}

/// The folder of a run that is over, with recording and input journals, to be read as long as this lives.
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
    let places = Places::new(options.keep, &run_id(run), own_address(run));
    leftovers::make_room();
    let marked = Marked::begin(places.remains()).map_err(|e| format!("cannot mark the run: {e}"))?;
    spec::make_folders(&places).map_err(|e| format!("cannot make {}: {e}", places.run_dir.display()))?;
    let run_folder = RunFolder::new(&places.run_dir);
    viewer_files::write_site(&run_folder, topology)
        .map_err(|e| format!("cannot write to {}: {e}", places.run_dir.display()))?;
    let credentials = spec::credentials(topology).map_err(|e| e.to_string())?;
    let wanted = options.confinement;
    let apart = options.hosts == scenario::Hosts::Namespaces;
    let hosts = (wanted != Confinement::None)
        .then(|| Hosts::start(&options.services, spec::roots(topology, &places), apart, options.shared_kib));
    if let Some(why) = hosts.as_ref().and_then(Hosts::refused).filter(|_| apart) {
        link::note!("hosts share the loopback interface: {why}");
    }
    let (lines_in, lines) = channel();
    let mut company = Company {
        janitor: None,
        children: Vec::new(),
        lines,
        stats: Vec::new(),
        stop: options.stop,
        show: options.show,
        window: options.window,
        wanted,
        acts: options.acts.into_iter().zip(1..).collect(),
        places: &places,
    };
    // Runs side by side start one after another, so that each has the host to itself during its lead.
    let turn = STARTING.lock().unwrap_or_else(PoisonError::into_inner);
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
    specs.enclaves = Some(write_enclaves(&run_folder, &specs.enclaves(until_us), &secret.authority())?);
    company.start_all(&options.services, topology, secret, marked.remains(), &mut specs, &lines_in)?;
    drop(turn);
    let mut again = |node: NodeId, boot: Boot| {
        let member = topology.members.iter().find(|m| m.node() == node).ok_or("no such member")?;
        let member = member.restarted(trace_us().saturating_sub(start_us));
        let mut spec = specs.member(&member)?;
        (spec.boot, spec.start_us) = (boot, 0);
        Child::start(&options.services, service(&member.role), node, &lines_in, &spec)
    };
    let stayed = company.stay(topology, start_us, &mut again)?;
    let levels = specs.levels;
    company.finish();
    let broker = secret.signing_secret(NodeId::BROKER);
    let anchors = topology.trust_anchors(Some((&broker, OVERSLEPT_US)));
    let (heads, stops) = (witness::heads(topology, &company.stats), stops(&stayed.events, start_us));
    let anchors = TrustAnchors { heads, stops, start_us, cut_short: stayed.cut_short(), ..anchors };
    let (log, verification, anchors) = gathered(topology, &run_folder, anchors, &stayed, &company.stats)?;
    drop(company);
    let logs = Logs { folder: places.run_dir, _marked: marked };
    let (lost, Stayed { lasted, overslept, waited, stopped, .. }) = (stayed.lost(), stayed);
    Ok(Aftermath { log, verification, anchors, lost, lasted, stopped, overslept, waited, levels, logs })
}

/// All records of a finished run, faults of them, and the trust anchors.
fn gathered(
    topology: &Topology,
    run: &RunFolder,
    mut anchors: TrustAnchors,
    stayed: &Stayed,
    stats: &[(NodeId, Value)],
) -> Result<(Vec<Logged>, Verification, TrustAnchors), LiveError> {
    let start_us = anchors.start_us;
    // A dead recorder wrote nothing more, nor did one with a full disk; then the input journals of the others are the second place where entries are.
    if !anchors.cut_short
        && let Some(hands) = topology.hands()
    {
        witness::lay_on(&hands, run)?;
    }
    let mut kept = match witness::recorded_entries(run) {
        Err(_) if anchors.cut_short => Vec::new(),
        kept => kept?,
    };
    let guards = witness::guards(topology, run);
    let mut log = match anchors.cut_short {
        true => witness::journals(topology, run, start_us),
        false => witness::on_the_runs_time(kept.clone(), start_us),
    };
    log.extend(witness::on_the_runs_time(guards.clone(), start_us));
    let mut told: Vec<(u64, Any)> = stayed.events.iter().map(|(at, note)| (*at, (*note).into())).collect();
    told.push((stayed.lasted, Note::Stalled { by: Span(stayed.overslept) }.into()));
    told.extend(witness::relayed(stats).into_iter().map(|event| (stayed.lasted, event.into())));
    let seen = witness::deliveries(topology, run, start_us, &log).into_iter();
    told.extend(seen.chain(witness::running(topology, run, start_us)).map(|(at, note)| (at, note.into())));
    // One chain, whose order has to be that of the times in it.
    told.sort_by_key(|(at, _)| *at);
    let end = told.last().map_or(stayed.lasted, |(at, _)| *at);
    let key = topology.witnesses.get(&NodeId::CAMPAIGN).map(|secret| Key::from_bytes(&secret.0));
    let notes = witness::notes(key, &told, end);
    witness::keep_notes(run, &notes)?;
    anchors.heads.extend(notes.last().and_then(|last| Head::from_last::<Any>(&last.bytes)).map(HeadAnchor::from));
    kept.extend(guards);
    kept.extend(notes.iter().cloned());
    log.extend(notes);
    let verification = LogVerifier::new(&anchors).verify(&kept);
    Ok((log, verification, anchors))
}

/// A few letters and digits that name this run among others on the host, of this process too. Short: it stands twice in
/// the path of every socket of the bus, and the kernel takes 107 bytes.
fn run_id(run: u32) -> String {
    format!("{:x}x{:x}x{run:x}", std::process::id(), trace_us() / 1_000 % (1 << 16))
}

/// The address of a run: apart from those of other runs on the host, of this process too.
fn own_address(run: u32) -> LoopbackAddr {
    LoopbackAddr::of_run(std::process::id().wrapping_mul(0x10_01).wrapping_add(run))
}

/// Times at which the launcher stopped processes, by its own record, on the recording's clock.
fn stops(events: &[(u64, Note)], start_us: u64) -> Vec<ProcessStop> {
    let mut stops: Vec<ProcessStop> = Vec::new();
    for (at, event) in events {
        let (Note::Suspended { node, how: Suspension::Hang, on: begins } | Note::Halted { node, on: begins }) = *event
        else {
            continue;
        };
        let open = stops.iter_mut().rev().find(|stop| stop.node == node && stop.until_us == u64::MAX);
        match (open, begins) {
            (None, true) => stops.push(ProcessStop { node, from_us: start_us + at, until_us: u64::MAX }),
            (Some(stop), false) => stop.until_us = start_us + at,
            (Some(_), true) | (None, false) => {}
        }
    }
    stops
}

/// Starts a node anew under a boot.
type Again<'a> = &'a mut dyn FnMut(NodeId, Boot) -> Result<Child, String>;

/// Events while the run was on.
struct Stayed {
    /// Process faults and their effects, in order.
    events: Vec<(u64, Note)>,
    /// By how much the host overslept at most.
    overslept: u64,
    /// The longest wait of a service for a core, microseconds.
    waited: Micros,
    /// Duration of the run, microseconds.
    lasted: u64,
    /// True if the user stopped it before its end.
    stopped: bool,
}

impl Stayed {
    fn ended(&self, node: NodeId) -> bool {
        self.events.iter().any(|(_, event)| matches!(event, Note::Ended { node: n, .. } if *n == node))
    }

    /// True if the recording lacks its end: the recorder was dead or its disk full at the end.
    fn cut_short(&self) -> bool {
        let disk = self.events.iter().rev().find_map(|(_, event)| {
            let Note::DiskFull { on, .. } = event else { return None };
            Some(*on)
        });
        self.ended(NodeId::RECORDER) || disk == Some(true)
    }

    fn lost(&self) -> Option<Lost> {
        self.events.iter().find_map(|(at, event)| {
            let Note::Ended { node, killed: false, signal } = event else { return None };
            Some(Lost { at: *at, node: *node, signal: *signal })
        })
    }
}

struct Company<'a> {
    janitor: Option<Child>,
    children: Vec<Child>,
    lines: Receiver<(NodeId, Line)>,
    stats: Vec<(NodeId, Value)>,
    stop: &'a progress::Stop,
    show: &'a mut dyn FnMut(&str),
    /// A window is open, or about to be.
    window: bool,
    wanted: Confinement,
    /// Future acts of a person, with the number of each.
    acts: VecDeque<((u64, Act), u64)>,
    places: &'a Places,
}

impl Company<'_> {
    /// Starts everybody in the order in which addresses become known.
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
        let remains = serde_json::to_string(remains).map_err(|e| e.to_string())?;
        janitor.write(format!("{remains}\n").as_bytes());
        self.janitor = Some(janitor);
        let member = |node: NodeId| topology.members.iter().find(|m| m.node() == node);
        // A rogue is there before anybody whose channels it makes.
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
        // But for a thief of sessions, which has to know where the broker is.
        let later = |node: NodeId| member(node).is_some_and(|m| m.role.joins_later());
        for node in first.into_iter().filter(|node| !later(*node)) {
            let child = if node == NodeId::BROKER {
                let spec = specs.broker(&secret.signing_secret(NodeId::BROKER))?;
                Child::start(services, "broker", node, lines, &spec)?
            } else {
                let Some(member) = member(node) else { continue };
                Child::start(services, service(&member.role), node, lines, &specs.member(member)?)?
            };
            self.take_in(child);
            self.await_ready(&[node], specs)?;
        }
        let rest: Vec<_> = topology.members.iter().filter(|m| !first.contains(&m.node()) || later(m.node())).collect();
        for member in &rest {
            let spec = specs.member(member)?;
            let child = Child::start(services, service(&member.role), member.node(), lines, &spec)?;
            self.take_in(child);
        }
        let rest: Vec<NodeId> = rest.iter().map(|m| m.node()).collect();
        self.await_ready(&rest, specs)
    }

    fn take_in(&mut self, child: Child) {
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
                return Err(format!("{} did not become ready within {} s", waiting[0], READY.as_secs()).into());
            }
            match self.lines.recv_timeout(Duration::from_millis(50)) {
                Ok((node, Line::Ready(line))) => {
                    let level = specs.ready(node, &line);
                    if self.wanted == Confinement::Full && !level.full() {
                        return Err(format!("--require-confinement: {node} reaches {level}").into());
                    }
                    waiting.retain(|n| *n != node);
                }
                Ok((node, Line::Refused(why))) => return Err(format!("{node} did not start: {why}").into()),
                Ok((node, Line::Ended)) => {
                    let signal = self.children.iter_mut().find(|child| child.node == node).and_then(Child::ended_by);
                    let by = signal.and_then(|number| Signal::try_from(i32::from(number)).ok());
                    let by = by.map_or_else(|| "ended by itself".to_owned(), |signal| format!("was ended by {signal}"));
                    return Err(format!("{node} {by} before it was ready").into());
                }
                Ok((_, Line::Closed(why))) => {
                    return Err(why.unwrap_or_else(|| "the window was closed before the run began".to_owned()).into());
                }
                Ok((_, Line::Stats(_) | Line::Text(_) | Line::Entry(_))) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err("every service ended".to_owned().into()),
            }
        }
        Ok(())
    }

    /// Stays until the end of the run, applying the scenario's process faults and calling the steps that wait; `again`
    /// restarts a node. Returns the applied faults, and the most by which the host overslept.
    fn stay(&mut self, topology: &Topology, start_us: u64, again: Again<'_>) -> Result<Stayed, LiveError> {
        let mut process_faults = ProcessFaults::new(topology);
        let mut watch = Watch::new(&topology.cues);
        let windowed = self.window;
        let (mut overslept, mut watched) = (0, 0);
        let mut core_waits = CoreWaits::default();
        let mut growth = topology.fills().then(|| Growth::of(self.places.recording()));
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
                self.tell_console(&Control::HostWait(Span(wait)));
            }
            if let Some(grown) = growth.as_mut().and_then(Growth::look) {
                process_faults.note(clock(), grown);
            }
            if stopped || now >= end && !self.window {
                let lasted = if windowed || stopped { now - start_us } else { topology.duration };
                // Whoever is still stopped has an account to close.
                for child in &mut self.children {
                    child.go_on();
                }
                let (events, waited) = (process_faults.events().to_vec(), core_waits.longest_us());
                return Ok(Stayed { events, overslept, waited, lasted, stopped });
            }
            if process_faults.next().is_some_and(|at| start_us + at <= now) {
                if let Some(node) = process_faults.carry_out(now.saturating_sub(start_us), &mut self.children, &clock) {
                    let boot = Boot(2);
                    self.take_in(again(node, boot)?);
                    process_faults.note(clock(), Note::Restarted { node, boot });
                }
                let told = process_faults.events().iter().skip(watched);
                let called = told.flat_map(|(at, note)| watch.take(*at, NodeId::CAMPAIGN, &(*note).into())).collect();
                watched = process_faults.events().len();
                self.call(topology, &mut process_faults, called, clock());
                continue;
            }
            self.act(now.saturating_sub(start_us));
            let end = if self.window { u64::MAX } else { end };
            let end = self.acts.front().map_or(end, |((at, _), _)| end.min(start_us + at));
            let next = process_faults.next().map_or(end, |at| (start_us + at).min(end));
            let nap = next.saturating_sub(now).clamp(1, 10_000);
            let heard = self.lines.recv_timeout(Duration::from_micros(nap));
            let slept = trace_us().saturating_sub(now);
            if now >= start_us && matches!(heard, Err(RecvTimeoutError::Timeout)) {
                overslept = overslept.max(slept.saturating_sub(nap));
            }
            match heard {
                Ok((_, Line::Text(text))) => (self.show)(&text),
                Ok((_, Line::Closed(Some(why)))) => return Err(LiveError::Environment(why)),
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
                Ok((node, Line::Ended)) if !process_faults.ended(node) => {
                    // With its process the window is gone too.
                    self.window &= node != NodeId::CONSOLE;
                    let signal = self.children.iter_mut().find(|child| child.node == node).and_then(Child::ended_by);
                    process_faults.note(clock(), Note::Ended { node, killed: false, signal });
                }
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err("every service ended".to_owned().into()),
            }
        }
    }

    /// Performs the person's acts due by `now` of the run.
    fn act(&mut self, now: u64) {
        while let Some(((_, act), serial)) = self.acts.pop_front_if(|((at, _), _)| *at <= now) {
            self.tell_console(&Control::Act(codec::encode(&Numbered { serial, act })));
        }
    }

    fn tell_console(&mut self, control: &Control) {
        self.children.iter_mut().filter(|child| child.node == NodeId::CONSOLE).for_each(|child| child.tell(control));
    }

    /// Calls steps: processes with steps are told, and process faults begin here.
    fn call(&mut self, topology: &Topology, process_faults: &mut ProcessFaults, steps: Vec<StepName>, now: u64) {
        let takes = |node: NodeId| topology.members.iter().any(|m| m.node() == node && m.role.takes_cues());
        for step in steps {
            self.children.iter_mut().filter(|c| takes(c.node)).for_each(|c| c.tell(&Control::Cue(step)));
            process_faults.call(now, step);
        }
    }

    /// Quiesces, lets messages under way arrive, and has every process write the closing account: the relays first, then
    /// the services that send to the gateway directly (they would dial again once the gateway is gone), then the gateway,
    /// so that no datagram is under way while its two ends count; the recorder last.
    fn finish(&mut self) {
        self.children.iter_mut().for_each(|c| c.tell(&Control::Quiesce));
        let until = trace_us() + GRACE_US;
        while trace_us() < until {
            self.hear(Duration::from_millis(20));
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
            group.iter_mut().for_each(|c| c.tell(&Control::Finish));
            let until = trace_us() + ENDING.as_micros() as u64;
            while trace_us() < until && !group.iter_mut().all(Child::ended) {
                self.hear(Duration::from_millis(10));
            }
        }
        self.hear(Duration::from_millis(10));
    }

    fn hear(&mut self, patience: Duration) {
        let mut next = self.lines.recv_timeout(patience).ok();
        while let Some((node, line)) = next {
            if let Line::Stats(stats) = line {
                self.stats.push((node, stats));
            }
            next = self.lines.try_recv().ok();
        }
    }
}

impl Drop for Company<'_> {
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
