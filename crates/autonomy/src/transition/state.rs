//! The states of the machine, as types that carry the proofs that they may exist.
//!
//! | state | carries |
//! |---|---|
//! | [`Idle`] | none: any unit may stand still |
//! | [`Ready`] | [`Healthy`]: all required guards held when they were last judged |
//! | [`PrepareToAct`] | [`Healthy`] and [`ActAuthority`] |
//! | [`Degraded`] | the loss, the start of blindness, the start of full recovery |
//! | [`HoldSafe`] | none: any unit may stop |
//!
//! Fields can be set by `transition` alone, so no state exists that a transition did not make.
//!
//! ```compile_fail,E0451
//! let ready = autonomy::state::Ready { healthy: unreachable!() };
//! ```

use wire::id::TrackId;
use wire::mode::Mode;
use wire::time::Instant;

use super::authority::ActAuthority;
use crate::fork::Fork;
use crate::health::Healthy;

/// Standing, not yet enabled.
#[derive(Debug)]
pub struct Idle {
    pub(super) started: Started,
}

/// Proof that this is a machine's first state; made once for each machine.
#[derive(Debug)]
pub(super) struct Started;

/// Driving the mission under supervision.
#[derive(Debug)]
pub struct Ready {
    pub(super) healthy: Healthy,
}

/// Holding one-shot authority on one track.
#[derive(Debug)]
pub struct PrepareToAct {
    pub(super) healthy: Healthy,
    pub(super) authority: ActAuthority,
}

/// A subsystem is lost: no authority, reduced speed.
#[derive(Debug)]
pub struct Degraded {
    /// Start of the time for which driving has lacked its basis; absent while it has it.
    pub(super) blind: Option<Instant>,
    /// Since when every guard has held; absent while one fails.
    pub(super) whole: Option<Instant>,
}

/// Standing still until an operator consents.
#[derive(Debug)]
pub struct HoldSafe {
    pub(super) stopped: Stopped,
}

/// Proof that trust was lost or an operator asked for a stop.
#[derive(Debug)]
pub(super) struct Stopped;

/// The state machine: exactly one state.
#[derive(Debug)]
pub enum Machine {
    /// See [`Idle`].
    Idle(Idle),
    /// See [`Ready`].
    Ready(Ready),
    /// See [`PrepareToAct`].
    PrepareToAct(PrepareToAct),
    /// See [`Degraded`].
    Degraded(Degraded),
    /// See [`HoldSafe`].
    HoldSafe(HoldSafe),
}

impl PrepareToAct {
    /// The designated track.
    pub fn track(&self) -> TrackId {
        self.authority.track()
    }

    /// The authority held, to look at.
    pub fn authority(&self) -> &ActAuthority {
        &self.authority
    }
}

impl Machine {
    /// The machine at its start.
    pub fn start() -> Machine {
        Machine::Idle(Idle { started: Started })
    }

    /// Mode of the present state.
    pub fn mode(&self) -> Mode {
        match self {
            Machine::Idle(_) => Mode::Idle,
            Machine::Ready(_) => Mode::Ready,
            Machine::PrepareToAct(_) => Mode::PrepareToAct,
            Machine::Degraded(_) => Mode::Degraded,
            Machine::HoldSafe(_) => Mode::HoldSafe,
        }
    }

    /// The authority it holds, to look at.
    pub fn authority(&self) -> Option<&ActAuthority> {
        match self {
            Machine::PrepareToAct(held) => Some(held.authority()),
            Machine::Idle(_) | Machine::Ready(_) | Machine::Degraded(_) | Machine::HoldSafe(_) => None,
        }
    }

    /// Copy of the machine for a forked world.
    #[must_use]
    pub fn fork(&self, fork: &Fork) -> Machine {
        match self {
            Machine::Idle(Idle { started: Started }) => Machine::start(),
            Machine::Ready(ready) => Machine::Ready(Ready { healthy: ready.healthy.fork(fork) }),
            Machine::PrepareToAct(held) => Machine::PrepareToAct(PrepareToAct {
                healthy: held.healthy.fork(fork),
                authority: held.authority.fork(fork),
            }),
            Machine::Degraded(Degraded { blind, whole }) => {
                Machine::Degraded(Degraded { blind: *blind, whole: *whole })
            }
            Machine::HoldSafe(HoldSafe { stopped: Stopped }) => Machine::HoldSafe(HoldSafe { stopped: Stopped }),
        }
    }
}
