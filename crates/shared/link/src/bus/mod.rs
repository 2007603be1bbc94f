//! Shared-memory channels (iceoryx2), one per scope and topic, inside one domain.
//!
//! A [`Domain`] is a root directory and a file prefix; the vehicle's and the control room's are different, and a process
//! opens only the domains of its specification. Payloads are bytes, copied out once; their authenticity is left to the core
//! (`wire::bus`). A channel has one publisher at a time, unless its creator left room for more; a slow reader loses
//! the oldest messages of each publisher and never blocks.

pub mod cipher;
pub mod enclave;
pub mod sweep;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher as Port;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{
    AllocationStrategy, FileName, LogLevel, SemanticString, SignalHandlingMode, ipc, set_log_level,
};
use iceoryx2::service::port_factory::{event, publish_subscribe};
use tokio::sync::mpsc;
use wire::core::{Input, Topic};
use wire::sign::Secret;

use self::cipher::Cipher;
use crate::clock::trace_us;

type Ipc = ipc::Service;
type Samples = publish_subscribe::PortFactory<Ipc, [u8], ()>;
type Wakes = event::PortFactory<Ipc>;

/// The longest scope name, in bytes.
pub const MAX_SCOPE: usize = 32;

/// Longest time for which a reader's thread sleeps before it checks whether it should end.
const NAP: Duration = Duration::from_millis(100);

/// Attempts, and the pause between them, to get past the remains of a killed process.
const ATTEMPTS: (u32, Duration) = (40, Duration::from_millis(50));

/// A channel could not be opened or used.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// Root and prefix too long for the path of a socket.
    #[error(
        "root and prefix take {length} bytes, at most {MAX_PLACE} fit a socket's path: point TMPDIR to a shorter one"
    )]
    Place {
        /// Bytes of both.
        length: usize,
    },
    /// A root, prefix or scope outside the allowed form.
    #[error("`{0}` is not a usable name for the bus")]
    Name(String),
    /// The message is longer than its topic allows.
    #[error("{length} bytes on topic {topic:?}")]
    TooLong {
        /// Topic.
        topic: Topic,
        /// Bytes.
        length: usize,
    },
    /// A message outside the time of the channel's rights.
    #[error("the rights on the channel are not valid yet, or no longer")]
    Time,
    /// The machine gives no random bytes for a confidential channel.
    #[error("no randomness from the host")]
    NoRandomness,
    /// The shared-memory library refused.
    #[error("{operation}: {reason}")]
    Library {
        /// The attempted operation.
        operation: &'static str,
        /// The library's error.
        reason: String,
    },
}

fn library(operation: &'static str) -> impl Fn(&dyn std::fmt::Debug) -> BusError {
    move |error| BusError::Library { operation, reason: format!("{error:?}") }
}

/// The longest root and prefix, in bytes: the library's listener is a socket at `root/prefix<port>.event`, the port has up
/// to 39 digits, and the kernel takes 107 bytes (`sockaddr_un`).
pub const MAX_PLACE: usize = 107 - 1 - 39 - 6;

/// One root and prefix: messages published here are invisible elsewhere.
#[derive(Clone, Debug)]
pub struct Domain {
    config: Config,
    publishers: usize,
    protection: Protection,
}

/// Protection of a channel beside the tags of its messages.
#[derive(Clone, Debug, Default)]
pub struct Protection {
    /// Key that hides its messages; none where they are readable by every process of the host.
    pub cipher: Option<Secret>,
    /// Times between which it carries messages, microseconds of the machine's monotonic clock; always without them.
    pub time: Option<(u64, u64)>,
}

impl Protection {
    fn carries(&self) -> bool {
        self.time.is_none_or(|(from, until)| (from..until).contains(&trace_us()))
    }

    fn cipher(&self, topic: Topic) -> Option<Cipher> {
        self.cipher.as_ref().map(|key| Cipher::new(key, topic))
    }
}

impl Domain {
    /// The domain below `root` with files that start with `prefix` (see [`sweep::checked_prefix`]).
    ///
    /// # Errors
    ///
    /// When either is not a usable name.
    pub fn new(root: &Path, prefix: &str) -> Result<Self, BusError> {
        set_log_level(LogLevel::Fatal);
        let name = |text: &str| BusError::Name(text.escape_default().take(64).collect());
        let prefix = sweep::checked_prefix(prefix).ok_or_else(|| name(prefix))?;
        let root_text = root.to_str().filter(|r| r.starts_with('/')).ok_or_else(|| name("root"))?;
        if root_text.len() + prefix.len() > MAX_PLACE {
            return Err(BusError::Place { length: root_text.len() + prefix.len() });
        }
        let mut config = Config::default();
        config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|_| name(prefix))?;
        let root = iceoryx2::prelude::Path::new(root_text.as_bytes()).map_err(|_| name(root_text))?;
        config.global.set_root_path(&root);
        Ok(Self { config, publishers: 1, protection: Protection::default() })
    }

    /// This domain with another number of publishers: channels first created through it have room for that many at once. An existing
    /// channel is opened as it is.
    #[must_use]
    pub fn with_publishers(self, publishers: usize) -> Self {
        Self { publishers, ..self }
    }

    /// This domain with a protection for the channels opened through it.
    #[must_use]
    pub fn protected(&self, protection: Protection) -> Self {
        Self { protection, ..self.clone() }
    }

    /// Opens the writing end of a channel, which stays on its thread.
    ///
    /// # Errors
    /// When the channel has a living publisher already or the library refuses.
    pub fn publisher(&self, scope: &str, topic: Topic) -> Result<Publisher, BusError> {
        let channel = self.open(scope, topic)?;
        let port = persist(&channel.node, || {
            let builder = channel.samples.publisher_builder();
            builder
                .initial_max_slice_len(topic.max_len() + cipher::OVERHEAD)
                // A segment that grows would be made after `reserve`, and could find a full memory in the middle of a run.
                .allocation_strategy(AllocationStrategy::Static)
                .create()
                .map_err(|e| library("publisher")(&e))
        })?;
        let bell =
            persist(&channel.node, || channel.wakes.notifier_builder().create().map_err(|e| library("notifier")(&e)))?;
        // Last, when every file of this end is there.
        self.reserve()?;
        let cipher = self.protection.cipher(topic);
        Ok(Publisher { topic, port, bell, cipher, protection: self.protection.clone(), _channel: channel })
    }

    /// Opens the reading end of a channel: a thread that sleeps until it is notified and moves messages to `to`.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn subscribe(&self, scope: &str, topic: Topic, to: mpsc::Sender<Input>) -> Result<Subscription, BusError> {
        let stop = Arc::new(AtomicBool::new(false));
        let received = Arc::new(AtomicU64::new(0));
        let (opened_tx, opened) = std::sync::mpsc::channel();
        let (domain, scope, stopping, count) = (self.clone(), scope.to_owned(), stop.clone(), received.clone());
        let thread = std::thread::Builder::new()
            .name(format!("bus-{}", topic.name()))
            .spawn(move || {
                // Opened on the thread that reads: the ends of the library stay on their thread.
                let ends = Ends::open(&domain, &scope, topic);
                let failed = match ends {
                    Ok(ends) => {
                        if opened_tx.send(Ok(())).is_ok() {
                            ends.forward(&to, &stopping, &count);
                        }
                        None
                    }
                    Err(error) => Some(error),
                };
                if let Some(error) = failed
                    && opened_tx.send(Err(error)).is_err()
                {
                    tracing::trace!("nobody waits for a subscription");
                }
            })
            .map_err(|e| library("thread")(&e))?;
        opened.recv().map_err(|e| library("subscription thread")(&e))??;
        Ok(Subscription { stop, received, thread: Some(thread) })
    }

    fn reserve(&self) -> Result<(), BusError> {
        sweep::reserve(self.config.global.prefix.as_bytes()).map_err(|e| library("room in shared memory")(&e))
    }

    fn open(&self, scope: &str, topic: Topic) -> Result<Channel, BusError> {
        let sound = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
        if scope.is_empty() || scope.len() > MAX_SCOPE || !scope.bytes().all(sound) {
            return Err(BusError::Name(scope.escape_default().take(64).collect()));
        }
        let node = NodeBuilder::new()
            .config(&self.config)
            // The library would otherwise install handlers of SIGINT and SIGTERM for the whole process.
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Ipc>()
            .map_err(|e| library("node")(&e))?;
        // The library creates its management segment with rights for every user.
        sweep::restrict(self.config.global.prefix.as_bytes()).map_err(|e| library("shared memory")(&e))?;
        let text = format!("{scope}/{}", topic.name());
        let name = text.as_str().try_into().map_err(|_| BusError::Name(text.clone()))?;
        let depth = depth(topic);
        let samples = persist(&node, || {
            node.service_builder(&name)
                .publish_subscribe::<[u8]>()
                .max_publishers(self.publishers)
                .max_subscribers(depth.subscribers)
                .max_nodes(16)
                .subscriber_max_buffer_size(depth.buffer)
                // A reader copies each message out before it takes the next.
                .subscriber_max_borrowed_samples(1)
                .history_size(0)
                // A full buffer drops its oldest message: a reader that stopped must not stop its publisher.
                .enable_safe_overflow(true)
                .open_or_create()
                .map_err(|e| library("channel")(&e))
        })?;
        let wakes = persist(&node, || {
            node.service_builder(&name)
                .event()
                .max_notifiers(2)
                .max_listeners(depth.subscribers)
                .max_nodes(16)
                .open_or_create()
                .map_err(|e| library("bell")(&e))
        })?;
        Ok(Channel { samples, wakes, node })
    }
}

/// Repeats an attempt for a while: the remains of a killed process are in the way until a survivor cleans them up.
fn persist<T>(node: &Node<Ipc>, mut attempt: impl FnMut() -> Result<T, BusError>) -> Result<T, BusError> {
    let mut last = attempt();
    for _ in 1..ATTEMPTS.0 {
        if last.is_ok() {
            break;
        }
        crate::clock::pause(ATTEMPTS.1);
        node.try_cleanup_dead_nodes();
        last = attempt();
    }
    last
}

/// Bounds of a topic: messages buffered for a slow reader, and number of readers.
struct Depth {
    buffer: usize,
    subscribers: usize,
}

/// Number of messages of a topic that are buffered for a slow reader; the oldest is dropped first.
pub fn buffer_depth(topic: Topic) -> usize {
    depth(topic).buffer
}

fn depth(topic: Topic) -> Depth {
    match topic {
        Topic::Frames => Depth { buffer: 4, subscribers: 2 },
        Topic::Candidates
        | Topic::Navigation
        | Topic::Tracks
        | Topic::Drive
        | Topic::Act
        | Topic::Feed
        | Topic::Intents
        | Topic::Seals => Depth { buffer: 32, subscribers: 8 },
    }
}

struct Channel {
    samples: Samples,
    wakes: Wakes,
    node: Node<Ipc>,
}

/// The writing end of a channel.
pub struct Publisher {
    topic: Topic,
    port: Port<Ipc, [u8], ()>,
    bell: Notifier<Ipc>,
    cipher: Option<Cipher>,
    protection: Protection,
    _channel: Channel,
}

impl Publisher {
    /// The channel's topic.
    pub fn topic(&self) -> Topic {
        self.topic
    }

    /// Copies a message into shared memory and notifies its readers, without waiting for them.
    ///
    /// # Errors
    /// When it is too long or the library refuses.
    pub fn publish(&self, bytes: &[u8]) -> Result<(), BusError> {
        if bytes.len() > self.topic.max_len() {
            return Err(BusError::TooLong { topic: self.topic, length: bytes.len() });
        }
        if !self.protection.carries() {
            return Err(BusError::Time);
        }
        let encrypted = self.cipher.as_ref().map(|cipher| cipher.encrypt(bytes));
        let encrypted = encrypted.map(|encrypted| encrypted.ok_or(BusError::NoRandomness)).transpose()?;
        let bytes = encrypted.as_deref().unwrap_or(bytes);
        let sample = self.port.loan_slice_uninit(bytes.len()).map_err(|e| library("loan")(&e))?;
        sample.write_from_slice(bytes).send().map_err(|e| library("send")(&e))?;
        self.bell.notify().map_err(|e| library("ring")(&e))?;
        Ok(())
    }
}

/// The reading end of a channel; dropping it ends its thread.
pub struct Subscription {
    stop: Arc<AtomicBool>,
    received: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Subscription {
    /// Messages moved so far.
    pub fn received(&self) -> u64 {
        self.received.load(Ordering::Relaxed)
    }
}

impl Drop for Subscription {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::warn!("a bus thread panicked");
        }
    }
}

/// Resources of a reader's thread.
struct Ends {
    topic: Topic,
    port: Subscriber<Ipc, [u8], ()>,
    bell: Listener<Ipc>,
    cipher: Option<Cipher>,
    protection: Protection,
    _channel: Channel,
}

impl Ends {
    fn open(domain: &Domain, scope: &str, topic: Topic) -> Result<Self, BusError> {
        let channel = domain.open(scope, topic)?;
        let bell =
            persist(&channel.node, || channel.wakes.listener_builder().create().map_err(|e| library("listener")(&e)))?;
        let port = persist(&channel.node, || {
            channel.samples.subscriber_builder().create().map_err(|e| library("subscriber")(&e))
        })?;
        domain.reserve()?;
        let (cipher, protection) = (domain.protection.cipher(topic), domain.protection.clone());
        Ok(Self { topic, port, bell, cipher, protection, _channel: channel })
    }

    fn forward(&self, to: &mpsc::Sender<Input>, stop: &AtomicBool, received: &AtomicU64) {
        while !stop.load(Ordering::Relaxed) && !to.is_closed() {
            loop {
                match self.port.receive() {
                    Ok(Some(sample)) => {
                        let bytes = sample.payload().to_vec();
                        if !self.protection.carries() {
                            continue;
                        }
                        // Bytes that are no message of the channel are passed on unchanged, for the core to refuse and log.
                        let message = self.cipher.as_ref().and_then(|cipher| cipher.decrypt(&bytes));
                        let bytes = message.unwrap_or(bytes);
                        received.fetch_add(1, Ordering::Relaxed);
                        if to.blocking_send(Input::Bus { topic: self.topic, bytes }).is_err() {
                            return;
                        }
                    }
                    Ok(None) => break,
                    Err(error) => {
                        tracing::debug!(?error, "bus message not received");
                        break;
                    }
                }
            }
            if let Err(error) = self.bell.timed_wait(|_| {}, NAP) {
                tracing::debug!(?error, "bus bell failed");
                crate::clock::pause(Duration::from_millis(10));
            }
        }
    }
}
