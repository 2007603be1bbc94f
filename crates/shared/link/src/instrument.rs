//! The instrument plane's link to the recorder: a Unix-domain stream, apart from the data plane.
//!
//! A service hands frames to a bounded queue and never waits. When the recorder is slow or absent, the queue fills and
//! frames are lost and counted, and the service continues. The response to an unsealed log is left to its core.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc as blocking;
use std::time::Duration;

use ground_truth::Any;
use minicbor::{Decode, Encode};
use serde::Serialize;
use tokio::io::AsyncReadExt;
use tokio::net::UnixListener;
use tokio::sync::mpsc;
use wire::audit::Head;
use wire::id::NodeId;

/// Frames that may wait in a service.
pub const QUEUE: usize = 8192;

/// The largest frame, in bytes.
pub const MAX_FRAME: usize = 64 * 1024;

/// Services that may be connected to a recorder at once.
pub const CONNECTIONS: usize = 64;

/// Pause between attempts to reach the recorder.
const PAUSE: Duration = Duration::from_millis(20);

/// Time limit for a closing service to hand over its queue.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// Head of a process's chain for its closing statistics: its boot, entries and the SHA-256 of the last, hexadecimal.
pub fn head(last: &[u8]) -> serde_json::Value {
    let account = |head: Head| {
        let hash: String = head.hash.iter().map(|byte| format!("{byte:02x}")).collect();
        serde_json::json!({ "boot": head.boot, "counter": head.counter, "hash": hash })
    };
    Head::from_last::<Any>(last).map_or(serde_json::Value::Null, account)
}

/// One audit entry on its way.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Frame {
    /// Raw monotonic microseconds at the core's output; for traces only.
    #[n(0)]
    pub trace_us: u64,
    /// The process whose core wrote it.
    #[n(1)]
    pub node: NodeId,
    /// Encoded `wire::audit::Entry`.
    #[cbor(n(2), with = "minicbor::bytes")]
    pub bytes: Vec<u8>,
}

impl Frame {
    /// Decodes the body of one frame.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(body: &[u8]) -> Result<Frame, minicbor::decode::Error> {
        minicbor::decode(body)
    }
}

/// Counts of a service's frames by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct InstrumentStats {
    /// Handed to the recorder's socket.
    pub sent: u64,
    /// Lost because the queue was full or the recorder did not come back before the end.
    pub lost: u64,
}

/// A service's end.
pub struct Instrument {
    queue: Option<blocking::SyncSender<Frame>>,
    ended: blocking::Receiver<()>,
    pushed: u64,
    sent: Arc<AtomicU64>,
}

impl Instrument {
    /// Starts a thread that connects to `socket` and keeps trying.
    ///
    /// # Errors
    /// When the thread cannot be started.
    pub fn start(socket: PathBuf) -> std::io::Result<Self> {
        let (queue, frames) = blocking::sync_channel(QUEUE);
        let (ended_tx, ended) = blocking::channel();
        let sent = Arc::new(AtomicU64::new(0));
        let count = sent.clone();
        std::thread::Builder::new().name("instrument".into()).spawn(move || {
            forward(&socket, &frames, &count);
            drop(ended_tx);
        })?;
        Ok(Self { queue: Some(queue), ended, pushed: 0, sent })
    }

    /// Queues a frame, or loses it.
    pub fn push(&mut self, frame: Frame) {
        self.pushed += 1;
        if let Some(queue) = &self.queue
            && queue.try_send(frame).is_err()
        {
            tracing::trace!("audit entry lost: the recorder does not keep up");
        }
    }

    /// Outcome of the frames so far; those under way count as lost.
    pub fn stats(&self) -> InstrumentStats {
        let sent = self.sent.load(Ordering::Relaxed);
        InstrumentStats { sent, lost: self.pushed.saturating_sub(sent) }
    }

    /// Hands over the queue within a time limit, and returns the outcome of the frames.
    pub fn finish(&mut self) -> InstrumentStats {
        self.queue = None;
        // Nothing is ever sent: the wait ends when the thread drops its end, or when the time is up.
        let _thread_ended = self.ended.recv_timeout(LAST_WORDS);
        self.stats()
    }
}

fn forward(socket: &Path, frames: &blocking::Receiver<Frame>, sent: &AtomicU64) {
    let mut stream: Option<UnixStream> = None;
    while let Ok(frame) = frames.recv() {
        let Ok(bytes) = encode(&frame) else { continue };
        loop {
            let outcome = match &mut stream {
                Some(open) => open.write_all(&bytes),
                None => UnixStream::connect(socket).and_then(|mut open| {
                    open.write_all(&bytes)?;
                    stream = Some(open);
                    Ok(())
                }),
            };
            if outcome.is_ok() {
                sent.fetch_add(1, Ordering::Relaxed);
                break;
            }
            // The next connection sends the whole frame again: the recorder drops one that a broken connection left incomplete.
            stream = None;
            crate::clock::pause(PAUSE);
        }
    }
}

fn encode(frame: &Frame) -> Result<Vec<u8>, std::io::Error> {
    let body = minicbor::to_vec(frame).map_err(std::io::Error::other)?;
    let length = u32::try_from(body.len()).map_err(std::io::Error::other)?;
    let mut bytes = length.to_be_bytes().to_vec();
    bytes.extend_from_slice(&body);
    Ok(bytes)
}

/// The recorder's end: accepts services and passes on their frames. Must be called inside a tokio runtime.
///
/// # Errors
/// When the socket cannot be bound; a stale one at the same path is removed first.
pub fn serve(socket: &Path, frames: mpsc::Sender<Frame>) -> std::io::Result<()> {
    match std::fs::remove_file(socket) {
        Ok(()) => {}
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    let listener = UnixListener::bind(socket)?;
    let slots = Arc::new(tokio::sync::Semaphore::new(CONNECTIONS));
    tokio::spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            let Ok(slot) = slots.clone().try_acquire_owned() else { continue };
            let frames = frames.clone();
            tokio::spawn(async move {
                if let Err(error) = receive(stream, &frames).await {
                    tracing::debug!(%error, "an instrument connection ended");
                }
                drop(slot);
            });
        }
    });
    Ok(())
}

async fn receive(mut stream: tokio::net::UnixStream, frames: &mpsc::Sender<Frame>) -> std::io::Result<()> {
    loop {
        let length = match stream.read_u32().await {
            Ok(length) => length as usize,
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(()),
            Err(error) => return Err(error),
        };
        if length > MAX_FRAME {
            return Err(std::io::Error::other("frame too long"));
        }
        let mut body = vec![0; length];
        stream.read_exact(&mut body).await?;
        let frame = Frame::decode(&body).map_err(std::io::Error::other)?;
        if frames.send(frame).await.is_err() {
            return Ok(());
        }
    }
}
