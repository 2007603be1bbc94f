//! A channel of real shared memory between its publisher and a reader, with a stranger that has no right to it.
//!
//! The stranger subscribes to the channel and maps its memory, as any process of the same user and host can. A witness beside the reader
//! copies the bytes in the channel, so that an observation can be proved; judging it is left to the caller.

use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use nix::sched::{CloneFlags, unshare};
use tokio::sync::mpsc;
use wire::core::{Input, Topic};
use wire::sign::Secret;

use crate::bus::sweep::SHARED_MEMORY;
use crate::bus::{BusError, Domain, Protection};
use crate::clock::{pause, trace_us};

/// The channel: orders of the control room.
const CHANNEL: (&str, Topic) = ("control", Topic::Intents);
/// Messages that wait for each listener.
const ROOM: usize = 32;
/// Time between two polls for a message.
const EVERY: Duration = Duration::from_millis(1);
/// Polls for a message that has to arrive: ten seconds.
const REQUIRED_POLLS: u32 = 10_000;
/// Polls for a message that must not arrive: a time in which hundreds would.
const FORBIDDEN_POLLS: u32 = 100;

/// Behaviour of the stranger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stranger {
    /// It has no key of the channel.
    Keyless,
    /// It has the channel's key, and its rights have expired.
    Late,
}

/// Bytes of the messages at each place, in order.
#[derive(Clone, Debug, Default)]
pub struct Overheard {
    /// At the reader.
    pub read: Vec<Vec<u8>>,
    /// Bytes in the channel, as the witness copied them.
    pub carried: Vec<Vec<u8>>,
    /// At the stranger.
    pub heard: Vec<Vec<u8>>,
    /// Shared memory of the channel, by file, as the stranger maps it at the end.
    pub mapped: Vec<Vec<u8>>,
}

/// Sends `messages` over a channel that is encrypted under `key`, or has tags alone without a key, in a domain `prefix` with this `root`,
/// which the caller sweeps afterwards.
///
/// It runs on a thread with a separate file mask, since the shared-memory library changes the mask of its whole process while it creates a
/// socket: two at once leave it changed permanently, and files that others create at that time lack their rights. A machine
/// that refuses a thread a separate mask gets one exchange at a time.
///
/// # Errors
/// When the channel cannot be opened, or a message does not arrive within ten seconds.
pub fn overheard(
    (prefix, root): (&str, &Path),
    messages: &[Vec<u8>],
    key: Option<[u8; 32]>,
    manner: Stranger,
) -> Result<Overheard, BusError> {
    static ONE: Mutex<()> = Mutex::new(());
    let on_own_mask = || {
        let refused = unshare(CloneFlags::CLONE_FS).is_err();
        let _alone = refused.then(|| ONE.lock().unwrap_or_else(PoisonError::into_inner));
        exchange((prefix, root), messages, key, manner)
    };
    let failed = || BusError::Library { operation: "channel", reason: "its thread panicked".to_owned() };
    std::thread::scope(|scope| scope.spawn(on_own_mask).join().unwrap_or_else(|_| Err(failed())))
}

fn exchange(
    (prefix, root): (&str, &Path),
    messages: &[Vec<u8>],
    key: Option<[u8; 32]>,
    manner: Stranger,
) -> Result<Overheard, BusError> {
    let domain = Domain::new(root, prefix)?;
    let (scope, topic) = CHANNEL;
    let cipher = key.map(Secret);
    let authorised = domain.protected(Protection { cipher: cipher.clone(), time: None });
    let unauthorised = match manner {
        Stranger::Keyless => domain.clone(),
        Stranger::Late => domain.protected(Protection { cipher, time: Some((0, trace_us())) }),
    };
    let publisher = authorised.publisher(scope, topic)?;
    let [(to_reader, mut reader), (to_witness, mut witness), (to_stranger, mut stranger)] =
        std::array::from_fn(|_| mpsc::channel(ROOM));
    let _subscriptions = [
        authorised.subscribe(scope, topic, to_reader)?,
        domain.subscribe(scope, topic, to_witness)?,
        unauthorised.subscribe(scope, topic, to_stranger)?,
    ];
    let mut seen = Overheard::default();
    for message in messages {
        publisher.publish(message)?;
        seen.read.push(required_message(&mut reader)?);
        seen.carried.push(required_message(&mut witness)?);
        if manner == Stranger::Keyless {
            seen.heard.push(required_message(&mut stranger)?);
        }
    }
    while let Some(bytes) = next(&mut stranger, FORBIDDEN_POLLS) {
        seen.heard.push(bytes);
    }
    seen.mapped = memory(prefix);
    Ok(seen)
}

fn memory(prefix: &str) -> Vec<Vec<u8>> {
    let entries = std::fs::read_dir(SHARED_MEMORY).into_iter().flatten().filter_map(Result::ok);
    let in_domain = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix));
    in_domain.filter_map(|entry| std::fs::read(entry.path()).ok()).collect()
}

fn required_message(from: &mut mpsc::Receiver<Input>) -> Result<Vec<u8>, BusError> {
    next(from, REQUIRED_POLLS)
        .ok_or_else(|| BusError::Library { operation: "channel", reason: "a message did not come out".to_owned() })
}

fn next(from: &mut mpsc::Receiver<Input>, polls: u32) -> Option<Vec<u8>> {
    (0..polls).find_map(|_| match from.try_recv() {
        Ok(Input::Bus { bytes, .. }) => Some(bytes),
        Ok(_) | Err(_) => {
            pause(EVERY);
            None
        }
    })
}
