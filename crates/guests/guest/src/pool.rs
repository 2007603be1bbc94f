//! Processes that serve several trials: a guest whose file says `reuse` is started once, and again only after a failure.
//!
//! Start and discovery are most of the time of a trial with a program of a middleware. A guest that promises `reuse` forgets the
//! trial before with each `start`; whether it does is measured by the probe of the plan, as for any guest.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::file::Program;
use crate::{Failure, GuestChannel, Launcher, Patience};

/// Most idle processes that are kept; more end with their trial.
const MAX_IDLE: usize = 64;

type Idle = Arc<Mutex<Vec<(BTreeMap<String, String>, Box<dyn GuestChannel>)>>>;

/// A launcher that hands out idle processes first.
pub struct Pool {
    launcher: Arc<dyn Launcher>,
    idle: Idle,
}

impl Pool {
    /// A pool of processes that `launcher` starts.
    pub fn new(launcher: Arc<dyn Launcher>) -> Self {
        Self { launcher, idle: Idle::default() }
    }

    /// An idle process of this very program.
    fn take(&self, program: &Program) -> Option<Box<dyn GuestChannel>> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let at = idle.iter().position(|(digests, _)| *digests == program.digests)?;
        Some(idle.swap_remove(at).1)
    }
}

impl Launcher for Pool {
    fn launch(&self, program: &Program) -> Result<Box<dyn GuestChannel>, Failure> {
        if !program.reuse {
            return self.launcher.launch(program);
        }
        let taken = self.take(program);
        let is_reused = taken.is_some();
        let channel = taken.map_or_else(|| self.launcher.launch(program), Ok)?;
        let digests = program.digests.clone();
        Ok(Box::new(Pooled { channel: Some(channel), digests, is_reused, idle: Arc::clone(&self.idle) }))
    }
}

/// A process that goes back to the pool when its trial has ended without a failure.
struct Pooled {
    /// None after a failure, with which the process has ended.
    channel: Option<Box<dyn GuestChannel>>,
    digests: BTreeMap<String, String>,
    is_reused: bool,
    idle: Idle,
}

impl GuestChannel for Pooled {
    fn exchange(&mut self, line: &str, patience: Patience) -> Result<String, Failure> {
        let ended = || Failure::new(wire::guest::Fault::Ended, "the process has failed before");
        let answer = self.channel.as_mut().ok_or_else(ended)?.exchange(line, patience);
        if answer.is_err() {
            self.channel = None;
        }
        answer
    }

    fn is_reused(&self) -> bool {
        self.is_reused
    }

    fn end(&mut self) {
        self.channel = None;
    }
}

impl Drop for Pooled {
    fn drop(&mut self) {
        let Some(channel) = self.channel.take() else { return };
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        if idle.len() < MAX_IDLE {
            idle.push((std::mem::take(&mut self.digests), channel));
        }
    }
}
