//! One-shot authority to act: its bindings, its beginning, and the three ways in which it ends.
//!
//! An [`ActAuthority`] is a permission, not a record of one. It cannot be cloned, copied, defaulted, decoded or built
//! outside `transition`; [`ActAuthority::mint`] has one call site, the transition from Ready to PrepareToAct. It is
//! bound to one track, one command, one world and one moment of expiry, and it ends by being moved: into
//! [`ActAuthority::spend`], into [`ActAuthority::revoke`], or with the machine itself.
//!
//! When to mint, spend or revoke is decided in `transition`; this file only makes the wrong thing unsayable.
//!
//! Authority cannot be cloned:
//! ```compile_fail,E0599
//! fn twice(authority: autonomy::authority::ActAuthority) {
//!     let second = authority.clone();
//! }
//! ```
//! It cannot be forged:
//! ```compile_fail,E0451
//! use wire::{id::{TrackId, WorldId}, time::Instant};
//! let forged = autonomy::authority::ActAuthority {
//!     serial: 1, track: TrackId(1), command: unreachable!(), world: WorldId(0), until: Instant(0),
//!     waived: Default::default(),
//! };
//! ```
//! Its constructor cannot be called from outside the transitions:
//! ```compile_fail,E0624
//! let mint: fn(_, _, _, _, _) -> _ = autonomy::authority::ActAuthority::mint;
//! ```
//! It cannot be spent twice:
//! ```compile_fail,E0382
//! fn revoked_and_yet_held(held: autonomy::state::PrepareToAct, healthy: autonomy::health::Healthy) {
//!     let (ready, revoked) = held.give_up(healthy, wire::mode::Cause::Expired);
//!     let track = held.track();
//! }
//! ```
//! And it cannot be carried into another world without that world's [`Fork`], which only `Autonomy::fork` has:
//! ```compile_fail,E0451
//! use wire::id::WorldId;
//! let fork = autonomy::fork::Fork { world: WorldId(2) };
//! ```

use config::setup::Setup;
use wire::id::{CommandId, TrackId, WorldId};
use wire::mode::Cause;
use wire::policy::Waived;
use wire::time::{Instant, Span};

use crate::command::consent::Consented;
use crate::command::given::{Arm, Confirm, Given};
use crate::fork::Fork;
use crate::health::Healthy;

/// Permission for one act on one track.
#[derive(Debug)]
#[must_use = "authority that is dropped was never accounted for; spend or revoke it"]
pub struct ActAuthority {
    serial: u32,
    track: TrackId,
    command: CommandId,
    world: WorldId,
    until: Instant,
    waived: Waived,
}

/// Source of a unit's authority: the serial numbers, the world they belong to, and the admission of authority by the
/// policy in force. A machine has one.
#[derive(Debug)]
pub struct Mint {
    admitted: bool,
    world: WorldId,
    next: u32,
    lifetime: Span,
}

/// Authority ended unused.
#[derive(Debug, PartialEq, Eq)]
#[must_use = "a revocation has to reach the log"]
pub struct Revoked {
    /// Serial of the authority.
    pub authority: u32,
    /// Cause of the end.
    pub cause: Cause,
}

/// Authority was used: its bindings, for the act and for the log.
#[derive(Debug, PartialEq, Eq)]
#[must_use = "spent authority has to reach the plant and the log"]
pub struct Spent {
    /// Serial of the authority.
    pub authority: u32,
    /// World in which it was minted.
    pub world: WorldId,
    /// The track acted on.
    pub track: TrackId,
    /// Place at which the track is held to be, east, millimetres.
    pub x_mm: i32,
    /// Place at which the track is held to be, north, millimetres.
    pub y_mm: i32,
    /// The command that confirmed it.
    pub command: CommandId,
}

impl Mint {
    /// A mint for the world and under the policy of `setup`.
    pub fn new(setup: &Setup) -> Self {
        let lifetime = Span::ms(setup.bounds.authority_ms);
        Mint { admitted: setup.admits_authority(), world: setup.world, next: 1, lifetime }
    }

    /// True if the policy admits any authority.
    pub fn admits(&self) -> bool {
        self.admitted
    }

    /// Copy of the mint for a forked world.
    #[must_use]
    pub fn fork(&self, fork: &Fork) -> Mint {
        Mint { world: fork.world(), ..*self }
    }

    /// The mint that a row of the transition table assumes.
    pub(super) fn assumed(admitted: bool, world: WorldId, lifetime: Span) -> Self {
        Mint { admitted, world, next: 1, lifetime }
    }
}

impl ActAuthority {
    /// Everything authority rests on, as arguments: an operator's accepted Arm order, all guards holding, the ordered
    /// track fit for designation where the operator saw it, and a mint whose policy admits it. `None` for another track
    /// or without admission.
    pub(super) fn mint(
        mint: &mut Mint,
        now: Instant,
        arm: &Given<'_, Arm>,
        healthy: &Healthy,
        consented: &Consented<'_>,
    ) -> Option<ActAuthority> {
        let designated = consented.designated();
        if !mint.admitted || designated.track() != arm.track() {
            return None;
        }
        let serial = mint.next;
        // A mint at its last serial gives no more authority: no serial may be used twice within a boot.
        mint.next = mint.next.checked_add(1)?;
        Some(ActAuthority {
            serial,
            track: designated.track(),
            command: arm.id(),
            world: mint.world,
            until: now + mint.lifetime,
            waived: arm.order().waived().union(healthy.waived()),
        })
    }

    /// Serial number, unique within the unit's boot and world.
    pub fn serial(&self) -> u32 {
        self.serial
    }

    /// The one track it is for.
    pub fn track(&self) -> TrackId {
        self.track
    }

    /// The command that asked for it.
    pub fn command(&self) -> CommandId {
        self.command
    }

    /// The world it was minted in.
    pub fn world(&self) -> WorldId {
        self.world
    }

    /// Checks that were waived in the evidence it rests on.
    pub fn waived(&self) -> Waived {
        self.waived
    }

    /// Time for which it still lives; zero once it has expired.
    pub fn left(&self, now: Instant) -> Span {
        self.until.since(now)
    }

    /// Uses it up. The conditions of its minting must hold again, now.
    pub(super) fn spend(self, confirm: &Given<'_, Confirm>, _healthy: &Healthy, consented: &Consented<'_>) -> Spent {
        let (x_mm, y_mm) = consented.designated().place();
        Spent { authority: self.serial, world: self.world, track: self.track, x_mm, y_mm, command: confirm.id() }
    }

    /// Ends it unused.
    pub(super) fn revoke(self, cause: Cause) -> Revoked {
        Revoked { authority: self.serial, cause }
    }

    /// The authority of the same machine in a forked world, named after that world.
    pub(super) fn fork(&self, fork: &Fork) -> ActAuthority {
        ActAuthority { world: fork.world(), ..*self }
    }
}
