//! Accepted orders by kind: a transition that needs a Resume order asks for a `Given<'_, Resume>`, and no other order
//! will do.
//!
//! The only way to a [`Given`] is [`Ordered::command`], which reads the kind that the operator signed.

use wire::command::CommandKind;
use wire::id::{CommandId, TrackId};
use wire::mode::{Because, Cause};
use wire::refusal::Refusal;
use wire::settings::Settings;

use super::Ordered;
use super::consent::Consented;
use crate::designation::Designated;

/// An accepted order of kind `K`.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a, K> {
    order: &'a Ordered,
    kind: K,
}

/// Stop and stay stopped.
#[derive(Clone, Copy, Debug)]
pub struct Hold(());

/// Give up authority.
#[derive(Clone, Copy, Debug)]
pub struct Disarm(());

/// Begin the mission.
#[derive(Clone, Copy, Debug)]
pub struct Enable(());

/// Go on after a stop.
#[derive(Clone, Copy, Debug)]
pub struct Resume(());

/// Take authority on this track.
#[derive(Clone, Copy, Debug)]
pub struct Arm(TrackId);

/// Use the authority on this track.
#[derive(Clone, Copy, Debug)]
pub struct Confirm(TrackId);

/// Set values for the mission.
#[derive(Clone, Copy, Debug)]
pub struct Configure(Settings);

/// An accepted order, sorted by kind.
#[derive(Clone, Copy, Debug)]
pub enum Command<'a> {
    /// See [`Hold`].
    Hold(Given<'a, Hold>),
    /// See [`Disarm`].
    Disarm(Given<'a, Disarm>),
    /// See [`Enable`].
    Enable(Given<'a, Enable>),
    /// See [`Resume`].
    Resume(Given<'a, Resume>),
    /// See [`Arm`].
    Arm(Given<'a, Arm>),
    /// See [`Confirm`].
    Confirm(Given<'a, Confirm>),
    /// See [`Configure`].
    Configure(Given<'a, Configure>),
}

impl Ordered {
    /// The order by its kind.
    pub fn command(&self) -> Command<'_> {
        match self.kind() {
            CommandKind::Hold => Command::Hold(Given { order: self, kind: Hold(()) }),
            CommandKind::Disarm => Command::Disarm(Given { order: self, kind: Disarm(()) }),
            CommandKind::Enable => Command::Enable(Given { order: self, kind: Enable(()) }),
            CommandKind::Resume => Command::Resume(Given { order: self, kind: Resume(()) }),
            CommandKind::Arm(track) => Command::Arm(Given { order: self, kind: Arm(track) }),
            CommandKind::Confirm(track) => Command::Confirm(Given { order: self, kind: Confirm(track) }),
            CommandKind::Configure(settings) => Command::Configure(Given { order: self, kind: Configure(settings) }),
        }
    }
}

impl<'a, K> Given<'a, K> {
    /// The order itself.
    pub fn order(&self) -> &'a Ordered {
        self.order
    }

    /// Id of the command, by which repetitions are recognised.
    pub fn id(&self) -> CommandId {
        self.order.id()
    }

    /// Cause and chain of a transition that follows from it.
    pub fn cause_chain(&self) -> (Cause, Because) {
        (Cause::Operator, Because::Command(self.id()))
    }
}

impl Given<'_, Arm> {
    /// The track to take authority on.
    pub fn track(&self) -> TrackId {
        self.kind.0
    }

    /// The designation, as the operator saw it.
    pub fn consented<'a>(&self, designated: &'a Designated) -> Result<Consented<'a>, Refusal> {
        self.order.consent.check_designation(designated)
    }
}

impl Given<'_, Confirm> {
    /// The track to act on.
    pub fn track(&self) -> TrackId {
        self.kind.0
    }

    /// The designation, as the operator saw it.
    pub fn consented<'a>(&self, designated: &'a Designated) -> Result<Consented<'a>, Refusal> {
        self.order.consent.check_designation(designated)
    }
}

impl Given<'_, Configure> {
    /// The values to set.
    pub fn settings(&self) -> Settings {
        self.kind.0
    }
}
