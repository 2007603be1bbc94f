//! The telemetry part: DTLS sessions, with their listener or dialler.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Duration;

use wire::core::Input;
use wire::id::SessionId;

use crate::certificates::list::Revocations;
use crate::drive::{DriveError, Opened, Senders};
use crate::dtls::dial::{Dialler, dial};
use crate::dtls::listen::{Listener, listen};
use crate::dtls::session::{SessionCounters, SessionStats, Settings};
use crate::dtls::{DIAL_IDLE, LISTEN_IDLE, SessionEvent, SessionHandle};
use crate::loopback::LoopbackAddr;
use crate::pki::Credential;
use crate::sockets::kernel_drops;
use crate::spec::ServiceSpec;

/// An end that opens sessions.
enum End {
    Listener(Listener),
    Dialler(Dialler),
}

/// The open sessions, and the ends that open more.
pub(in crate::drive) struct Telemetry {
    ends: Vec<End>,
    sessions: BTreeMap<SessionId, SessionHandle>,
    counters: Arc<SessionCounters>,
}

impl Telemetry {
    pub(super) fn open(spec: &ServiceSpec, senders: &Senders) -> Result<Self, DriveError> {
        let handles = Arc::new(AtomicU32::new(0));
        let mut this = Self { ends: Vec::new(), sessions: BTreeMap::new(), counters: Arc::default() };
        let settings = |idle: Duration, credential: &Credential| -> Result<Settings, DriveError> {
            Ok(Settings {
                log: Some(senders.observations.clone()),
                sessions: handles.clone(),
                counters: this.counters.clone(),
                own: spec.own,
                ..Settings::new(spec.guard, idle, Revocations::from_credential(credential).opened("revocation list")?)
            })
        };
        if let Some(to) = &spec.listen {
            let settings = settings(LISTEN_IDLE, &to.credential)?;
            let listener = listen(to.at, to.credential.clone(), settings, senders.sessions.clone());
            this.ends.push(End::Listener(listener.opened("dtls listener")?));
        }
        if let Some(to) = &spec.dial {
            let settings = settings(DIAL_IDLE, &to.credential)?;
            let dialler = dial(to.remote, to.credential.clone(), to.expect, settings, senders.sessions.clone());
            this.ends.push(End::Dialler(dialler));
        }
        Ok(this)
    }

    /// Address at which sessions are accepted.
    pub(super) fn local(&self) -> Option<LoopbackAddr> {
        self.ends.iter().find_map(|end| match end {
            End::Listener(listener) => Some(listener.local()),
            End::Dialler(_) => None,
        })
    }

    /// Handles a session's event; returns the core's input.
    pub(in crate::drive) fn input_from(&mut self, event: SessionEvent) -> Input {
        match event {
            SessionEvent::Opened(handle) => {
                let (session, peer) = (handle.session, handle.peer);
                self.sessions.insert(session, handle);
                Input::Opened { session, peer }
            }
            SessionEvent::Record(session, bytes) => Input::Record { session, bytes },
            SessionEvent::Closed(session) => {
                self.close(session);
                Input::Closed { session }
            }
        }
    }

    pub(super) fn send(&self, session: SessionId, bytes: Vec<u8>) -> bool {
        self.sessions.get(&session).map(|handle| handle.send(bytes)).is_some()
    }

    /// Drops the sending end of a session, which ends it; its dialler opens the next.
    pub(super) fn close(&mut self, session: SessionId) {
        self.sessions.remove(&session);
    }

    /// Stops dialling, so that the closing account covers everything sent.
    pub(in crate::drive) async fn hang_up(&mut self) {
        for end in &mut self.ends {
            if let End::Dialler(dialler) = end {
                dialler.stop().await;
            }
        }
    }

    /// The counters, and the datagrams that the kernel dropped at the sockets; `None` without an end.
    pub(super) fn account(&self) -> Option<(SessionStats, u64)> {
        let drops = |end: &End| match end {
            End::Listener(listener) => kernel_drops(listener.local()).unwrap_or(0),
            End::Dialler(dialler) => dialler.kernel_drops(),
        };
        let dropped = self.ends.iter().map(drops).reduce(|a, b| a + b)?;
        Some((self.counters.read(), dropped))
    }
}
