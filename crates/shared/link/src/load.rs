//! Load on the real accept loop over loopback sockets: many sessions, and a flood of malformed datagrams beside valid ones.
//!
//! Both ends are in this process, so that every datagram is in one of its counters or in the kernel's. It measures and
//! returns figures; judging them is left to the caller.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use serde::Serialize;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval};
use wire::id::PeerId;

use crate::certificates::list::Revocations;
use crate::dtls::DtlsError;
use crate::dtls::dial::{Dialler, dial};
use crate::dtls::listen::{Listener, listen};
use crate::dtls::session::{SessionCounters, SessionEvent, SessionHandle, SessionStats, Settings};
use crate::guard::GuardMode;
use crate::loopback::LoopbackAddr;
use crate::pki::{Authority, Credential, PkiError, Role};
use crate::sockets;

/// Length of a valid record, in bytes: about that of a report.
const RECORD: usize = 300;

/// Time limit at the end for datagrams under way.
const GRACE: Duration = Duration::from_secs(2);

/// Time limit for all sessions together to open.
const OPENING: Duration = Duration::from_secs(60);

/// Datagrams of a flood that are sent between two readings of the clock.
const BURST: u32 = 30;

/// Parameters of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoadSettings {
    /// Valid sessions.
    pub sessions: usize,
    /// Records that each sends in a second.
    pub rate: u32,
    /// Datagrams a second that are no record, from one unknown peer.
    pub flood: u32,
    /// Duration.
    pub seconds: u64,
}

/// Result of a measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Its parameters.
    #[serde(rename = "asked")]
    pub settings: LoadSettings,
    /// Sessions that opened.
    pub opened: usize,
    /// Valid records that the sessions sent.
    pub sent: u64,
    /// Valid records that the listener delivered.
    pub delivered: u64,
    /// Datagrams of the flood that the kernel accepted.
    pub flooded: u64,
    /// Datagrams that the kernel dropped at the listener's socket.
    pub kernel_dropped: u64,
    /// Datagrams that the diallers and the flood sent, minus the ones that the listener counted or the kernel dropped. Any other value
    /// than zero is a defect.
    pub unaccounted: i64,
    /// The listener's counters.
    pub listener: SessionStats,
    /// Memory of this process before the load and at its peak, in KiB.
    pub resident_kib: [u64; 2],
}

/// Applies the load for its duration.
///
/// # Errors
/// When a socket or certificate cannot be made, or a session does not open in a minute.
pub fn run(load_settings: LoadSettings) -> Result<Measured, DtlsError> {
    crate::crypto::init();
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let measured = runtime.block_on(load(load_settings));
    runtime.shutdown_timeout(Duration::from_millis(200));
    measured
}

struct Ends {
    listener: Listener,
    listener_counters: Arc<SessionCounters>,
    dialler_counters: Arc<SessionCounters>,
    handles: Vec<SessionHandle>,
    diallers: Vec<Dialler>,
}

async fn load(settings: LoadSettings) -> Result<Measured, DtlsError> {
    let before = resident_kib();
    let mut ends = open(settings.sessions).await?;
    let until = Instant::now() + Duration::from_secs(settings.seconds);
    let flooding = tokio::spawn(flood(ends.listener.local(), settings.flood, until));
    let mut peak = before;
    let mut ticks = interval(Duration::from_secs(1) / settings.rate.max(1));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Burst);
    while Instant::now() < until {
        ticks.tick().await;
        for handle in &ends.handles {
            handle.send(vec![7; RECORD]);
        }
        peak = peak.max(resident_kib());
    }
    let flooded = flooding.await.unwrap_or(0);
    settle(&ends.listener_counters).await;
    peak = peak.max(resident_kib());
    let kernel_dropped = sockets::kernel_drops(ends.listener.local()).unwrap_or(0);
    for dialler in &mut ends.diallers {
        dialler.stop().await;
    }
    settle(&ends.listener_counters).await;
    let (listener, diallers) = (ends.listener_counters.read(), ends.dialler_counters.read());
    let counted = listener.guard.datagrams
        + listener.overflowed
        + listener.abandoned
        + listener.unknown_peers
        + listener.shed
        + listener.unproven
        + listener.proved;
    let dispatched = diallers.dialled + flooded;
    Ok(Measured {
        settings,
        opened: ends.handles.len(),
        sent: diallers.sent,
        delivered: listener.delivered,
        flooded,
        kernel_dropped,
        unaccounted: dispatched as i64 - counted as i64 - kernel_dropped as i64,
        listener,
        resident_kib: [before, peak],
    })
}

/// Waits until the listener's counters stay the same, or for [`GRACE`].
async fn settle(counters: &SessionCounters) {
    let end = Instant::now() + GRACE;
    let mut seen = counters.read();
    while Instant::now() < end {
        tokio::time::sleep(GRACE / 8).await;
        let now = counters.read();
        if now == seen {
            return;
        }
        seen = now;
    }
}

async fn open(sessions: usize) -> Result<Ends, DtlsError> {
    let authority = Authority::new()?;
    let gateway = authority.issue(PeerId::GATEWAY, Role::Listens)?;
    let unit = authority.issue(PeerId::UNIT_A, Role::Dials)?;
    let (listener_events, mut at_listener) = mpsc::channel(4096);
    let settings = settings(&gateway)?;
    let listener_counters = settings.counters.clone();
    let listener = listen(LoopbackAddr::ANY_PORT, gateway, settings, listener_events)?;
    tokio::spawn(async move {
        // A session at the listener ends when its handle is dropped.
        let mut handles = Vec::new();
        while let Some(event) = at_listener.recv().await {
            if let SessionEvent::Opened(handle) = event {
                handles.push(handle);
            }
        }
    });
    let settings = self::settings(&unit)?;
    let dialler_counters = settings.counters.clone();
    let (dialler_events, mut at_diallers) = mpsc::channel(4096);
    let diallers: Vec<Dialler> = (0..sessions)
        .map(|_| dial(listener.local(), unit.clone(), PeerId::GATEWAY, settings.clone(), dialler_events.clone()))
        .collect();
    let mut handles = Vec::new();
    let opening = async {
        while handles.len() < sessions {
            match at_diallers.recv().await {
                Some(SessionEvent::Opened(handle)) => handles.push(handle),
                Some(SessionEvent::Record(..) | SessionEvent::Closed(_)) => {}
                None => return,
            }
        }
    };
    tokio::time::timeout(OPENING, opening).await.map_err(|_| DtlsError::TooSlow)?;
    tokio::spawn(async move { while at_diallers.recv().await.is_some() {} });
    Ok(Ends { listener, listener_counters, dialler_counters, handles, diallers })
}

fn settings(credential: &Credential) -> Result<Settings, PkiError> {
    let revocations = Revocations::from_credential(credential)?;
    Ok(Settings::new(GuardMode::Required, Duration::from_secs(600), revocations))
}

/// Sends malformed datagrams at a steady rate until `until`; returns the number that the kernel accepted.
async fn flood(to: LoopbackAddr, rate: u32, until: Instant) -> u64 {
    let Ok(socket) = sockets::udp_to(LoopbackAddr::ANY_PORT, to) else { return 0 };
    let accepted = AtomicU64::new(0);
    if rate == 0 {
        return 0;
    }
    let mut ticks = interval(Duration::from_secs(1) * BURST / rate);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Burst);
    let mut n = 0u32;
    while Instant::now() < until {
        ticks.tick().await;
        for _ in 0..BURST {
            n = n.wrapping_add(1);
            if sockets::emit(&socket, None, &malformed(n)) {
                accepted.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
    accepted.load(Ordering::Relaxed)
}

/// A malformed datagram. In turn: no record, a record of a later epoch from an unknown peer, a truncated hello, a hello with wrong lengths.
fn malformed(n: u32) -> Vec<u8> {
    let noise = n.to_be_bytes();
    let mut bytes = match n % 4 {
        0 => vec![0x99, 1, 2],
        1 => vec![23, 254, 253, 0, 1, 0, 0, 0, 0, 0, 9, 0, 8],
        2 => vec![22, 254, 253, 0, 0, 0, 0, 0, 0, 0, 0, 0, 60, 1, 0, 0, 48],
        _ => vec![22, 254, 253, 0, 0, 0, 0, 0, 0, 0, 0, 0, 16, 1, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 4],
    };
    bytes.extend(noise);
    bytes.extend(noise);
    bytes
}

/// Resident memory of this process, by pages of 4 KiB in `/proc/self/statm`; zero where that is missing.
pub fn resident_kib() -> u64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    statm.split_whitespace().nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or(0) * 4
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flood reaches no session.
    #[test]
    fn every_datagram_is_accounted_for_under_flood() {
        let measured = run(LoadSettings { sessions: 20, rate: 20, flood: 2_000, seconds: 1 }).unwrap();
        assert_eq!(measured.opened, 20, "more at once than a calm listener admits");
        assert_eq!(measured.unaccounted, 0, "{measured:?}");
        assert!(measured.flooded > 0 && measured.listener.unknown_peers > 0);
        assert!(measured.sent > 0);
        assert!(measured.kernel_dropped > 0 || measured.delivered == measured.sent, "{measured:?}");
    }
}
