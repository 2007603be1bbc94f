//! The loop around a core: wait for the first of its deadline and its inputs, feed it, carry out its outputs.
//!
//! Links run on a worker thread and reach the loop through bounded queues, as does a person at a window ([`hands`]); the
//! core runs here and nowhere else. Every input and output is written to the input journal on its way. The meaning of a
//! message is left to the core.

mod ports;
mod sources;

use std::process::ExitCode;
use std::time::Duration;

use serde_json::json;
use tokio::sync::mpsc;
use wire::core::{Core, Input};
use wire::time::Instant;

use self::ports::Ports;
use self::sources::Sources;
use crate::clock::HostClock;
use crate::dtls::SessionEvent;
use crate::guard::observe::Observation;
use crate::instrument::Frame;
use crate::recorder::Recording;
use crate::spec::{Control, ServiceSpec, watch};

/// Longest time until logs are handed to the operating system: logs of observers in front of sessions, and logs after a failed write. The
/// entries of a core are handed over before its outputs are carried out.
pub const FLUSH_EVERY: Duration = Duration::from_millis(100);

/// Time for the last records to leave before the links are closed.
const LINGER: Duration = Duration::from_millis(50);

/// The specification is unusable, or a link could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// A link by name, and the reason.
    #[error("{link}: {reason}")]
    Link {
        /// Name of the link.
        link: &'static str,
        /// Reason of the failure.
        reason: String,
    },
}

/// Names the link that was opened, where it could not be.
trait Opened<T> {
    fn opened(self, link: &'static str) -> Result<T, DriveError>;
}

impl<T, E: std::fmt::Display> Opened<T> for Result<T, E> {
    fn opened(self, link: &'static str) -> Result<T, DriveError> {
        self.map_err(|error| DriveError::Link { link, reason: error.to_string() })
    }
}

/// Acts of a person that may wait: more than the largest number from one key press, the acknowledgement of every alarm on a display.
pub const ACTS: usize = 512;

/// The sending end of a person's acts, encoded.
#[derive(Clone, Debug)]
pub struct Hand(mpsc::Sender<Vec<u8>>);

impl Hand {
    /// Queues an act. False when too many wait or the loop has ended: the act is lost.
    #[must_use]
    pub fn give(&self, act: Vec<u8>) -> bool {
        self.0.try_send(act).is_ok()
    }
}

/// The receiving end of a person's acts, in the loop.
#[derive(Debug)]
pub struct Acts(mpsc::Receiver<Vec<u8>>);

/// A bounded queue for a person's acts into the loop.
#[must_use]
pub fn hands() -> (Hand, Acts) {
    let (hand, acts) = mpsc::channel(ACTS);
    (Hand(hand), Acts(acts))
}

/// An event that wakes the loop.
#[derive(Debug)]
enum Wake {
    /// Shared memory, the command plane or a relayed path.
    Input(Input),
    /// A DTLS session.
    Session(SessionEvent),
    /// A service's audit entry reached the recorder.
    Audit(Frame),
    /// A guard saw a record.
    Observed(Observation),
    /// A control line of the launcher.
    Control(Control),
    /// The core's deadline is reached.
    Deadline,
    /// Time to flush.
    Flush,
}

/// Answers the requests of a core to its guest, and takes as long as the guest does.
pub type Attendant = Box<dyn FnMut(&[u8]) -> Vec<u8> + Send>;

/// Drives `core` with the links of `spec` until the launcher sends `finish`. Prints `ready {json}` when the links are
/// open and `stats {json}` at the end. To be called from `main`, outside any tokio runtime.
pub fn run(spec: ServiceSpec, core: Box<dyn Core>) -> ExitCode {
    run_for(spec, core, hands().1)
}

/// [`run`] for a core with a guest, whose requests `attendant` answers.
pub fn run_attended(spec: ServiceSpec, core: Box<dyn Core>, attendant: Option<Attendant>) -> ExitCode {
    run_with(spec, core, hands().1, attendant)
}

/// [`run`] for a core with a person's acts, on any thread.
pub fn run_for(spec: ServiceSpec, core: Box<dyn Core>, acts: Acts) -> ExitCode {
    run_with(spec, core, acts, None)
}

fn run_with(spec: ServiceSpec, core: Box<dyn Core>, acts: Acts, attendant: Option<Attendant>) -> ExitCode {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    let outcome = runtime.opened("runtime").and_then(|runtime| {
        let outcome = runtime.block_on(drive(&spec, core, acts, attendant));
        runtime.shutdown_timeout(Duration::from_millis(200));
        outcome
    });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => refuse(spec.node.name(), &error.to_string()),
    }
}

async fn drive(
    spec: &ServiceSpec,
    core: Box<dyn Core>,
    acts: Acts,
    attendant: Option<Attendant>,
) -> Result<(), DriveError> {
    let (sources, senders) = sources::open(watch().opened("stdin")?, acts.0);
    let ports = Ports::open(spec, &senders, attendant)?;
    print_line("ready", &ports.ready(spec));
    let mut driver = Driver { clock: spec.clock, core, ports, latest: Instant(0), inputs: 0, late_us: 0 };
    driver.run(sources).await;
    tokio::time::sleep(LINGER).await;
    driver.ports.telemetry.hang_up().await;
    let stats = driver.ports.finish();
    print_line(
        "stats",
        &json!({ "node": spec.node, "inputs": driver.inputs, "late_max_us": driver.late_us, "links": stats }),
    );
    // Kept until here, so that no source looks ended while the loop runs.
    drop(senders);
    Ok(())
}

/// Ends a service that cannot start, with the reason to its launcher and on standard error.
pub fn refuse(service: &str, reason: &str) -> ExitCode {
    crate::note!("holdsafe-{service}: {reason}");
    print_line("refused", &json!(reason));
    ExitCode::from(2)
}

/// Prints one line for the launcher: a word and a JSON value.
pub fn print_line(word: &str, value: &serde_json::Value) {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    if writeln!(out, "{word} {value}").and_then(|()| out.flush()).is_err() {
        tracing::trace!("nobody reads standard output");
    }
}

struct Driver {
    clock: HostClock,
    core: Box<dyn Core>,
    ports: Ports,
    latest: Instant,
    inputs: u64,
    late_us: u64,
}

impl Driver {
    async fn run(&mut self, mut sources: Sources) {
        let mut flush = tokio::time::interval(FLUSH_EVERY);
        flush.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
        loop {
            let wake = tokio::select! {
                wake = sources.next() => wake,
                () = sleep_until(self.clock, self.core.deadline()) => Wake::Deadline,
                _ = flush.tick() => Wake::Flush,
            };
            if self.handle_wake(wake) {
                return;
            }
        }
    }

    /// Handles one wake; true when it was the last.
    fn handle_wake(&mut self, wake: Wake) -> bool {
        match wake {
            Wake::Input(input) => self.feed(&input),
            Wake::Session(event) => {
                let input = self.ports.telemetry.input_from(event);
                self.feed(&input);
            }
            Wake::Audit(frame) => self.ports.audit.receive(frame),
            Wake::Observed(observation) => self.ports.logs.observed(&observation),
            Wake::Control(Control::Quiesce) => self.feed(&Input::Quiesce),
            Wake::Control(Control::Cue(step)) => self.feed(&Input::Cue { step: step.cue() }),
            Wake::Control(Control::HostWait(wait)) => self.feed(&Input::HostWait { wait }),
            Wake::Control(Control::Act(bytes)) => self.feed(&Input::Act { bytes }),
            Wake::Control(Control::Finish) => {
                self.feed(&Input::Finish);
                return true;
            }
            Wake::Deadline => self.feed_timeout(),
            Wake::Flush => self.ports.logs.flush(),
        }
        self.feed_recorded();
        false
    }

    /// Feeds a timeout, if the deadline is reached.
    fn feed_timeout(&mut self) {
        let now = self.now();
        if let Some(deadline) = self.core.deadline()
            && deadline <= now
        {
            // A deadline in the distant past means "at once", not a stall.
            if deadline.0 > 0 && self.inputs > 0 {
                self.late_us = self.late_us.max(now.since(deadline).0);
            }
            self.feed(&Input::Timeout);
        }
    }

    /// Feeds newly written frames: the recorder's core gets no others.
    fn feed_recorded(&mut self) {
        while let Some(bytes) = self.ports.audit.recording().and_then(Recording::written) {
            self.feed(&Input::Audit { bytes });
        }
    }

    fn feed(&mut self, input: &Input) {
        let now = self.now();
        self.inputs += 1;

        self.ports.logs.input(now, input);
        self.core.handle(now, input);
        let outputs = std::iter::from_fn(|| self.core.output()).collect();
        self.ports.carry_out(outputs);
    }

    /// The host's time, never before the last reading.
    fn now(&mut self) -> Instant {
        self.latest = self.latest.max(self.clock.now());
        self.latest
    }
}

async fn sleep_until(clock: HostClock, deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => tokio::time::sleep(clock.time_to(deadline)).await,
        None => std::future::pending().await,
    }
}

/// The sending ends of every queue into the loop.
struct Senders {
    inputs: mpsc::Sender<Input>,
    relayed: mpsc::Sender<Input>,
    sessions: mpsc::Sender<SessionEvent>,
    frames: mpsc::Sender<Frame>,
    observations: crate::guard::observe::ObservationLog,
}
