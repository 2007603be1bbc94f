//! Specification of a service process, and the messages that stop it.
//!
//! The launcher writes a [`ServiceSpec`] as JSON, preceded by its length (u32, big-endian), to the child's standard
//! input and keeps the pipe open. Lines that follow are [`Control`]s; the end of the pipe ends the process at once.
//! Keys are sent only here. The content of `config` is left to the service.

use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;

use ground_truth::StepName;
use sandbox::Level;
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;
use wire::core::{Subject, Topic};
use wire::id::{Boot, NodeId, PeerId};
use wire::sign::Secret;
use wire::time::{Instant, Span};

use crate::bus::enclave::SignedEnclaves;
use crate::clock::HostClock;
use crate::files;
use crate::guard::GuardMode;
use crate::loopback::LoopbackAddr;
use crate::pki::Credential;

/// The largest specification, in bytes.
pub const MAX_SPEC: usize = 1 << 20;

/// The longest control line, in bytes: an act of a person, in hexadecimal.
const MAX_LINE: u64 = 512;

/// Exit status after the launcher's end of the pipe was closed.
pub const ORPHANED: i32 = 3;

/// Everything that one service process needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServiceSpec {
    /// Name of this process in records and logs.
    pub node: NodeId,
    /// Number of the node's start.
    pub boot: Boot,
    /// Seed of the core's generators.
    pub seed: u64,
    /// The host's clock.
    pub clock: HostClock,
    /// The run's directory (mode 0700): input journals, observations, the instrument socket.
    pub run_dir: PathBuf,
    /// Shared-memory domains this process takes part in.
    #[serde(default)]
    pub bus: Vec<BusSpec>,
    /// Rights on them; without them no right is checked, as in an attacker's process.
    #[serde(default)]
    pub enclaves: Option<SignedEnclaves>,
    /// Accepts DTLS sessions.
    #[serde(default)]
    pub listen: Option<DtlsListen>,
    /// Keeps a DTLS session up.
    #[serde(default)]
    pub dial: Option<DtlsDial>,
    /// Is a client of the command broker.
    #[serde(default)]
    pub mqtt: Option<MqttDial>,
    /// Is the command broker (in the broker crate), or a core in its place (with `mqtt::server`).
    #[serde(default)]
    pub broker: Option<BrokerListen>,
    /// Relays a path.
    #[serde(default)]
    pub relay: Option<RelaySpec>,
    /// The recorder's socket, for audit entries.
    #[serde(default)]
    pub instrument: Option<PathBuf>,
    /// The log of the delivery witness of its sessions and streams.
    #[serde(default)]
    pub witness: Option<WitnessSpec>,
    /// Is the recorder.
    #[serde(default)]
    pub recorder: Option<RecorderSpec>,
    /// Mode of the DTLS guard: drop unauthenticated records, or pass them.
    pub guard: GuardMode,
    /// The run's own address, with port 0, from which its processes send datagrams; datagrams from other addresses are an
    /// outsider's, and counted apart.
    #[serde(default = "any_port")]
    pub own: LoopbackAddr,
    /// Room for the input journal, in bytes; 0 for none.
    #[serde(rename = "mouth_bytes", default = "default_journal_bytes")]
    pub journal_bytes: u64,
    /// Confinement of the process; none for one that keeps all its rights.
    #[serde(default)]
    pub confinement: Option<Confinement>,
    /// The core's own configuration.
    #[serde(default)]
    pub config: serde_json::Value,
    /// Start of the run, raw monotonic microseconds: the start time of the core. Zero: at once.
    #[serde(default)]
    pub start_us: u64,
    /// The host's time at which the specification was read.
    #[serde(skip)]
    started: Instant,
    /// The level of confinement that this process has reached.
    #[serde(skip)]
    pub(crate) level: Level,
}

fn any_port() -> LoopbackAddr {
    LoopbackAddr::ANY_PORT
}

fn default_journal_bytes() -> u64 {
    1 << 30
}

/// Settings of a service's confinement that do not follow from its links.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confinement {
    /// Process that holds the namespaces of the service's host; none where the machine has none.
    #[serde(default)]
    pub host: Option<u32>,
    /// Models and libraries of others that it reads.
    #[serde(default)]
    pub models: Vec<PathBuf>,
    /// True if it opens a window.
    #[serde(default)]
    pub window: bool,
}

/// A shared-memory domain and the channels used in it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusSpec {
    /// The domain's root directory (absolute).
    pub root: PathBuf,
    /// The domain's file prefix, `hs_…`.
    pub prefix: String,
    /// Channels read.
    #[serde(default)]
    pub subscribe: Vec<ChannelSpec>,
    /// Channels written. A core's output on a topic goes to every channel of that topic.
    #[serde(default)]
    pub publish: Vec<ChannelSpec>,
    /// Room for publishers in the channels that this process is the first to open.
    #[serde(default = "one_publisher")]
    pub publishers: usize,
}

fn one_publisher() -> usize {
    1
}

/// One channel: a unit's or a domain's, and the topic.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelSpec {
    /// Unit or domain, such as `unit-a` or `control`.
    pub scope: String,
    /// Topic, by name.
    #[serde(with = "topic_name")]
    pub topic: Topic,
    /// Key that hides its messages from the host's other processes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cipher: Option<Secret>,
}

/// Accepting DTLS sessions.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DtlsListen {
    /// Address; port 0 lets the kernel choose, and the `ready` line reports it.
    pub at: LoopbackAddr,
    /// Own credential.
    pub credential: Credential,
}

/// Keeping one DTLS session open.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DtlsDial {
    /// Address of the listener, or of a relay before it.
    pub remote: LoopbackAddr,
    /// Expected peer.
    pub expect: PeerId,
    /// Own credential.
    pub credential: Credential,
}

/// Being a client of the command broker.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MqttDial {
    /// Address of the broker, or of a relay before it.
    pub remote: LoopbackAddr,
    /// Own name; the client identifier.
    pub own: PeerId,
    /// Expected peer.
    pub expect: PeerId,
    /// Own credential.
    pub credential: Credential,
    /// Subjects to receive, by topic name (`hs/cmd/unit-a`).
    #[serde(default, with = "subject_names")]
    pub subscribe: Vec<Subject>,
    /// True if the session is opened and closed by outputs of the core, and not at the start (adversaries).
    #[serde(default)]
    pub on_demand: bool,
}

/// Being the command broker.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrokerListen {
    /// Address.
    pub at: LoopbackAddr,
    /// Own credential.
    pub credential: Credential,
}

/// Relaying one path.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelaySpec {
    /// A datagram path.
    #[serde(default)]
    pub datagram: Option<RelayLeg>,
    /// A byte-stream path.
    #[serde(default)]
    pub stream: Option<RelayLeg>,
}

/// The two ends of a relayed path.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelayLeg {
    /// Address for clients.
    pub at: LoopbackAddr,
    /// Address of the server.
    pub upstream: LoopbackAddr,
}

/// Settings of the delivery witness of this process's sessions and streams ([`crate::witness`]).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WitnessSpec {
    /// Its name in the log.
    pub node: NodeId,
    /// The key that signs its chain.
    pub secret: Secret,
    /// True if this process dials the gateway, with no relay in between.
    #[serde(default)]
    pub direct: bool,
}

/// Being the recorder.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecorderSpec {
    /// Socket for services (short: a socket path has room for 107 bytes).
    pub socket: PathBuf,
    /// Directory of recordings; files are named `audit-<n>.mcap`.
    pub directory: PathBuf,
    /// True if the launcher gets the entries that a step of an attack may wait for ([`ground_truth::is_awaited`]).
    #[serde(default, rename = "tell")]
    pub reports_awaited: bool,
}

/// A specification could not be read.
#[derive(Debug, thiserror::Error)]
pub enum SpecError {
    /// Longer than [`MAX_SPEC`].
    #[error("specification of {0} bytes")]
    TooLong(usize),
    /// The pipe.
    #[error("reading the specification: {0}")]
    Io(#[from] io::Error),
    /// Not a specification.
    #[error("specification does not parse: {0}")]
    Json(#[from] serde_json::Error),
    /// The table of rights has no such service.
    #[error("no row for `{0}` in the table of rights")]
    NoRow(String),
    /// The process could not drop rights that it must not have.
    #[error(transparent)]
    Confinement(#[from] sandbox::Error),
}

/// A message of the launcher after the specification.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Control {
    /// The run is over; keep accounting for late arrivals.
    Quiesce,
    /// Write the closing account and exit.
    Finish,
    /// The event that a step waits for has occurred.
    Cue(StepName),
    /// Time for which the host kept a service waiting for a core, microseconds (the console only).
    HostWait(Span),
    /// An act of a person, encoded (the console only): for measurements without a window.
    Act(Vec<u8>),
}

impl Control {
    /// The line of the message.
    pub fn line(&self) -> String {
        match self {
            Control::Quiesce => "quiesce\n".to_owned(),
            Control::Finish => "finish\n".to_owned(),
            Control::Cue(step) => format!("cue {step}\n"),
            Control::HostWait(wait) => format!("host-wait {}\n", wait.0),
            Control::Act(bytes) => {
                let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
                format!("act {hex}\n")
            }
        }
    }

    /// Reads a line.
    pub fn parse(line: &str) -> Option<Control> {
        match line.trim_end().split_once(' ') {
            None if line.trim_end() == "quiesce" => Some(Control::Quiesce),
            None if line.trim_end() == "finish" => Some(Control::Finish),
            Some(("cue", step)) => StepName::new(step).map(Control::Cue),
            Some(("host-wait", us)) => us.parse().ok().map(|us| Control::HostWait(Span(us))),
            Some(("act", hex)) => bytes_of(hex).map(Control::Act),
            None | Some(_) => None,
        }
    }
}

/// Bytes in lower-case hexadecimal only, so that each message has exactly one line.
fn bytes_of(hex: &str) -> Option<Vec<u8>> {
    let digit = |digit: char| digit.to_digit(16).filter(|_| !digit.is_ascii_uppercase());
    let digits: Option<Vec<u32>> = hex.chars().map(digit).collect();
    let (pairs, []) = digits.as_deref()?.as_chunks::<2>() else { return None };
    Some(pairs.iter().map(|[high, low]| (high << 4 | low) as u8).collect())
}

impl ServiceSpec {
    /// A specification with no links, for the launcher to fill in.
    pub fn new(node: NodeId, boot: Boot, seed: u64, clock: HostClock, run_dir: PathBuf) -> Self {
        Self {
            node,
            boot,
            seed,
            clock,
            run_dir,
            bus: Vec::new(),
            enclaves: None,
            listen: None,
            dial: None,
            mqtt: None,
            broker: None,
            relay: None,
            instrument: None,
            witness: None,
            recorder: None,
            guard: GuardMode::Required,
            own: LoopbackAddr::ANY_PORT,
            journal_bytes: default_journal_bytes(),
            confinement: None,
            config: serde_json::Value::Null,
            start_us: 0,
            started: Instant(0),
            level: Level::default(),
        }
    }

    /// The core's own configuration as a value of the service's type.
    ///
    /// # Errors
    /// When it is not one.
    pub fn config<T: serde::de::DeserializeOwned>(&self) -> Result<T, SpecError> {
        Ok(T::deserialize(&self.config)?)
    }

    /// The start of the run, or the host's time at which the specification was read: the start time of a core, and of the journal's header.
    pub fn started(&self) -> Instant {
        self.started
    }

    /// The level of confinement that this process has reached.
    pub fn level(&self) -> &Level {
        &self.level
    }

    /// The file of this start's inputs.
    pub(crate) fn journal(&self) -> PathBuf {
        files::input_journal(&self.run_dir, self.node, self.boot)
    }

    /// The file of the log of this start's guard.
    pub(crate) fn guard_log(&self) -> PathBuf {
        files::guard_log(&self.run_dir, self.node, self.boot)
    }

    /// Writes the specification for [`ServiceSpec::read`].
    ///
    /// # Errors
    /// When it is too long or the pipe is closed.
    pub fn write(&self, mut to: impl Write) -> Result<(), SpecError> {
        let json = serde_json::to_vec(self)?;
        let length = u32::try_from(json.len()).ok().filter(|_| json.len() <= MAX_SPEC);
        let length = length.ok_or(SpecError::TooLong(json.len()))?;
        to.write_all(&length.to_be_bytes())?;
        to.write_all(&json)?;
        to.flush()?;
        Ok(())
    }

    /// Reads one specification and not a byte more.
    ///
    /// # Errors
    /// When the pipe ends early, the length is out of bounds, or the JSON is not exactly a specification.
    pub fn read(mut from: impl Read) -> Result<Self, SpecError> {
        let mut prefix = [0; 4];
        from.read_exact(&mut prefix)?;
        let length = u32::from_be_bytes(prefix) as usize;
        if length > MAX_SPEC {
            return Err(SpecError::TooLong(length));
        }
        let mut json = vec![0; length];
        from.read_exact(&mut json)?;
        let mut spec: ServiceSpec = serde_json::from_slice(&json)?;
        spec.started = if spec.start_us > 0 { spec.clock.at_trace(spec.start_us) } else { spec.clock.now() };
        Ok(spec)
    }

    /// Ties this process's life to its launcher's, installs the cryptographic provider and logging, and reads the
    /// specification from standard input.
    ///
    /// # Errors
    ///
    /// As [`ServiceSpec::read`].
    pub fn from_stdin() -> Result<Self, SpecError> {
        // Only a second means: it depends on the launcher's spawning thread. The end of the pipe decides (`watch`).
        nix::sys::prctl::set_pdeathsig(nix::sys::signal::Signal::SIGKILL).map_err(io::Error::from)?;
        crate::crypto::init();
        let filter = tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn,dtls=error".into());
        // Standard error may be a file on a full disk: a message that cannot be written is dropped without a panic.
        let logging = tracing_subscriber::fmt().log_internal_errors(false);
        let logging = logging.with_env_filter(filter).with_writer(io::stderr).try_init();
        if logging.is_err() {
            tracing::trace!("logging was set up already");
        }
        Self::read(io::stdin().lock())
    }
}

/// Watches standard input for controls on a separate thread. The end of the pipe ends the process at once.
///
/// # Errors
/// When the thread cannot be started.
pub fn watch() -> io::Result<mpsc::Receiver<Control>> {
    let (tx, rx) = mpsc::channel(8);
    std::thread::Builder::new().name("stdin".into()).spawn(move || {
        loop {
            let mut line = String::new();
            match io::stdin().lock().take(MAX_LINE).read_line(&mut line) {
                Ok(0) | Err(_) => std::process::exit(ORPHANED),
                Ok(_) => match Control::parse(&line) {
                    Some(control) => {
                        // After `finish` the launcher may close the pipe while the account is written.
                        let last = control == Control::Finish;
                        if tx.blocking_send(control).is_err() || last {
                            return;
                        }
                    }
                    None => tracing::warn!("a control line that means nothing"),
                },
            }
        }
    })?;
    Ok(rx)
}

/// Topics by name in JSON.
mod topic_name {
    use std::borrow::Cow;

    use serde::{Deserialize, Deserializer, Serializer, de::Error};
    use wire::core::Topic;

    pub(super) fn serialize<S: Serializer>(topic: &Topic, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(topic.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Topic, D::Error> {
        let name = <Cow<'de, str>>::deserialize(deserializer)?;
        Topic::ALL.into_iter().find(|t| t.name() == name).ok_or_else(|| D::Error::custom(format!("no topic `{name}`")))
    }
}

/// Subjects by topic name in JSON.
mod subject_names {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};
    use wire::core::Subject;

    pub(super) fn serialize<S: Serializer>(subjects: &[Subject], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(subjects.iter().map(|s| s.topic()))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Subject>, D::Error> {
        let names = <Vec<String>>::deserialize(deserializer)?;
        let parse =
            |name: &String| Subject::from_topic(name).ok_or_else(|| D::Error::custom(format!("no subject `{name}`")));
        names.iter().map(parse).collect()
    }
}
