//! Delivery witness of a byte stream: the bytes that arrive at an end, their time, and the stream's end, as the second
//! witness of a relay's statements.
//!
//! It is below TLS and sees only ciphertext, as anyone on the path does; names and places are in `ground_truth::Place`.
//! Bytes beyond the log's room are not logged, and so prove nothing. Judging is left to the oracle.

use std::io::{Error, Result};
use std::os::fd::OwnedFd;
use std::pin::Pin;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};

use ground_truth::{Sight, StreamPlace};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpStream, UnixStream};
use wire::event::wire_hash;

use crate::clock::trace_us;
use crate::witness::{StreamSight, WitnessLog};

/// Log in which a process notes the arrivals of its streams.
#[derive(Clone, Debug)]
pub struct StreamLog(Arc<Mutex<Option<Sink>>>);

/// Destination of sights.
#[derive(Debug)]
enum Sink {
    /// The log of the guard.
    Witness(WitnessLog),
    /// A listener in this process.
    Listener(SyncSender<StreamSight>),
}

impl Sink {
    /// True if there was room for it.
    fn take(&mut self, sight: &StreamSight) -> bool {
        match self {
            Sink::Witness(log) => {
                log.sighted(sight);
                true
            }
            // A listener that is gone needs no more; only a full queue loses a sight.
            Sink::Listener(to) => !matches!(to.try_send(*sight), Err(TrySendError::Full(_))),
        }
    }
}

impl StreamLog {
    /// A log that is discarded.
    pub fn none() -> Self {
        Self(Arc::default())
    }

    /// The log of the guard of this process, where it has one.
    pub fn from_witness(witness: Option<&WitnessLog>) -> Self {
        Self(Arc::new(Mutex::new(witness.cloned().map(Sink::Witness))))
    }

    /// A log for a listener in this process, without a file; it ends when more than `room` entries wait.
    pub fn to_listener(room: usize) -> (Self, Receiver<StreamSight>) {
        let (to, sights) = sync_channel(room);
        (Self(Arc::new(Mutex::new(Some(Sink::Listener(to))))), sights)
    }

    fn write(&self, sight: &StreamSight) {
        let mut log = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if log.as_mut().is_some_and(|sink| !sink.take(sight)) {
            tracing::warn!("stream log ended");
            *log = None;
        }
    }
}

/// State of one direction; outlives its stream, so that the layers above can add their errors.
#[derive(Clone, Debug)]
pub struct Witness {
    log: StreamLog,
    place: Arc<Mutex<StreamPlace>>,
}

impl Witness {
    fn new(log: StreamLog) -> Self {
        Self { log, place: Arc::default() }
    }

    fn arrived(&self, bytes: &[u8]) {
        let mut place = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        let offset = place.offset();
        place.pass(bytes);
        self.write(&place, Sight::Arrived, offset, bytes);
    }

    fn note(&self, sight: Sight) {
        self.saw(sight, &[]);
    }

    /// Notes a whole message that came out of the stream.
    pub fn delivered(&self, payload: &[u8]) {
        self.saw(Sight::Delivered, payload);
    }

    fn saw(&self, sight: Sight, bytes: &[u8]) {
        let place = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        self.write(&place, sight, place.offset(), bytes);
    }

    fn write(&self, place: &StreamPlace, sight: Sight, offset: u64, bytes: &[u8]) {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        let (stream, hash) = (place.name(), wire_hash(bytes));
        self.log.write(&StreamSight { trace_us: trace_us(), sight, stream, offset, length, hash });
    }

    /// Notes `error` when it comes from the secure layer: this end or the far end refused the bytes.
    pub fn failed(&self, error: &(dyn std::error::Error + 'static)) {
        let mut link = Some(error);
        while let Some(error) = link {
            let inner = error.downcast_ref::<Error>().and_then(Error::get_ref);
            if error.is::<rustls::Error>() || inner.is_some_and(|e| e.is::<rustls::Error>()) {
                return self.note(Sight::Refused);
            }
            link = error.source();
        }
    }
}

/// A stream with a delivery witness.
#[derive(Debug)]
pub struct Ingress<S> {
    inner: S,
    witness: Witness,
    over: bool,
}

impl<S> Ingress<S> {
    /// Watches arrivals over `inner`.
    pub fn new(inner: S, log: StreamLog) -> Self {
        Self { inner, witness: Witness::new(log), over: false }
    }

    /// The direction's witness.
    pub fn witness(&self) -> Witness {
        self.witness.clone()
    }

    fn closed(&mut self) {
        if !std::mem::replace(&mut self.over, true) {
            self.witness.note(Sight::Closed);
        }
    }
}

impl<S> Drop for Ingress<S> {
    fn drop(&mut self) {
        if !self.over {
            self.witness.note(Sight::HungUp);
        }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Ingress<S> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<Result<()>> {
        let (before, room) = (buf.filled().len(), buf.remaining());
        let outcome = ready!(Pin::new(&mut self.inner).poll_read(cx, buf));
        let bytes = &buf.filled()[before..];
        match &outcome {
            Ok(()) if !bytes.is_empty() => self.witness.arrived(bytes),
            Ok(()) if room == 0 => {}
            Ok(()) | Err(_) => self.closed(),
        }
        Poll::Ready(outcome)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Ingress<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<Result<usize>> {
        Pin::new(&mut self.inner).poll_write(cx, buf)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Result<()>> {
        Pin::new(&mut self.inner).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Result<()>> {
        Pin::new(&mut self.inner).poll_shutdown(cx)
    }
}

/// Puts a witness before `stream` for a library that accepts only a socket: the library gets one end of a socket pair
/// inside this process, and a task carries the bytes. Must be called inside a tokio runtime.
///
/// # Errors
///
/// When the pair cannot be made.
pub fn watched(stream: TcpStream, log: StreamLog) -> Result<(TcpStream, Witness)> {
    let (near, far) = std::os::unix::net::UnixStream::pair()?;
    near.set_nonblocking(true)?;
    far.set_nonblocking(true)?;
    let near = TcpStream::from_std(std::net::TcpStream::from(OwnedFd::from(near)))?;
    let ingress = Ingress::new(stream, log);
    let witness = ingress.witness();
    tokio::spawn(carry(ingress, UnixStream::from_std(far)?));
    Ok((near, witness))
}

/// Carries both directions until this process hangs up, or both have ended.
async fn carry(ingress: Ingress<TcpStream>, end: UnixStream) {
    let (mut from_network, mut to_network) = tokio::io::split(ingress);
    let (mut from_end, mut to_end) = end.into_split();
    // A failed direction counts as ended; the witness has noted which side ended it.
    let inward = async {
        let _ = tokio::io::copy(&mut from_network, &mut to_end).await;
        let _ = to_end.shutdown().await;
    };
    let outward = async {
        let _ = tokio::io::copy(&mut from_end, &mut to_network).await;
        let _ = to_network.shutdown().await;
    };
    tokio::pin!(outward);
    tokio::select! {
        () = &mut outward => {}
        () = inward => outward.await,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::AsyncReadExt;

    fn log() -> (Receiver<StreamSight>, StreamLog) {
        let (log, heard) = StreamLog::to_listener(64);
        (heard, log)
    }

    fn seen(heard: &Receiver<StreamSight>) -> Vec<(Sight, u64, u32)> {
        heard.try_iter().map(|s| (s.sight, s.offset, s.length)).collect()
    }

    #[tokio::test]
    async fn stream_witness_reports_arrivals_and_the_end() {
        for far_ends in [true, false] {
            let (heard, log) = log();
            let (mut far, near) = tokio::io::duplex(64);
            let mut ingress = Ingress::new(near, log);
            let mut buf = [0; 8];
            far.write_all(&[1; 5]).await.unwrap();
            assert_eq!(ingress.read(&mut buf).await.unwrap(), 5);
            far.write_all(&[2; 3]).await.unwrap();
            assert_eq!(ingress.read(&mut buf).await.unwrap(), 3);
            if far_ends {
                drop(far);
                assert_eq!(ingress.read(&mut buf).await.unwrap(), 0);
            }
            drop(ingress);
            let end = if far_ends { Sight::Closed } else { Sight::HungUp };
            assert_eq!(seen(&heard), [(Sight::Arrived, 0, 5), (Sight::Arrived, 5, 3), (end, 8, 0)]);
        }
    }

    #[tokio::test]
    async fn secure_layer_refusal_differs_from_connection_loss() {
        let (heard, log) = log();
        let witness = Witness::new(log);
        witness.failed(&Error::new(std::io::ErrorKind::InvalidData, rustls::Error::DecryptError));
        witness.failed(&Error::from(std::io::ErrorKind::ConnectionReset));
        assert_eq!(seen(&heard), [(Sight::Refused, 0, 0)]);
    }

    #[tokio::test]
    async fn watched_stream_carries_both_ways_until_either_ends() {
        let (heard, log) = log();
        let listener = tokio::net::TcpListener::bind(crate::loopback::LoopbackAddr::ANY_PORT.socket()).await.unwrap();
        let mut far = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let (mut near, _) = watched(listener.accept().await.unwrap().0, log).unwrap();
        let mut buf = [0; 8];
        far.write_all(&[1; 5]).await.unwrap();
        assert_eq!(near.read(&mut buf).await.unwrap(), 5);
        near.write_all(&[2; 3]).await.unwrap();
        assert_eq!(far.read(&mut buf).await.unwrap(), 3);
        drop(near);
        assert_eq!(far.read(&mut buf).await.unwrap(), 0, "hung up");
        drop(far);
        let mut sights = Vec::new();
        while sights.len() < 2 {
            sights.extend(seen(&heard));
            tokio::task::yield_now().await;
        }
        assert_eq!(sights, [(Sight::Arrived, 0, 5), (Sight::HungUp, 5, 0)]);
    }
}
