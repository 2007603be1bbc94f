//! Telemetry: the unit's report of itself, ten times a second, signed at its origin.
//!
//! A report is made from the same values that the guards were judged by. Wrapping it for the session is left to
//! `intake`; belief in it, to the gateway.

use wire::codec;
use wire::id::{CommandId, Nonce, Sequence};
use wire::measured::Measured;
use wire::mode::{Cause, Guards, Mode};
use wire::policy::Waived;
use wire::refusal::Reason;
use wire::report::{Report, ReportedAuthority, ReportedContact, ReportedTrack};
use wire::sensor::ProductMode;
use wire::settings::Settings;
use wire::sign::Purpose;
use wire::time::{Echo, Instant, Span};
use wire::track::Track;

use crate::bearings::Bearings;
use crate::command::CommandGate;
use crate::crops::Crops;
use crate::identity::Identity;
use crate::localisation::Localisation;
use crate::mission::Mission;
use crate::picture::Picture;
use crate::transition::state::Machine;

/// Age of a pose that never was: a day.
const NEVER: Span = Span::s(86_400);

/// The unit's own account of its mode.
#[derive(Clone, Copy, Debug, Default)]
pub struct StatusRecord {
    /// Cause of the last transition.
    pub cause: Cause,
    /// The last order that was accepted and, if it was refused, why.
    pub last_command: Option<(CommandId, Option<Reason>)>,
    /// Checks that the newest grant passed by waiver.
    pub lease_waived: Waived,
    /// Number of times that the unit's session at the broker was lost.
    pub sessions_lost: u32,
    /// Values that an operator has set.
    pub settings: Option<Settings>,
}

/// Contents of a report.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// Identity of the reporting unit.
    pub identity: &'a Identity,
    /// State machine, with the authority that it holds.
    pub machine: &'a Machine,
    /// Guards that fail now.
    pub failing: Guards,
    /// Measurements by which they are judged.
    pub measured: Measured,
    /// Cause and last command.
    pub status: &'a StatusRecord,
    /// Pose and speed.
    pub localisation: &'a Localisation,
    /// The newest accepted tracks.
    pub picture: &'a Picture,
    /// Lines of sight to them.
    pub bearings: &'a Bearings,
    /// Mission, for its progress.
    pub mission: &'a Mission,
    /// The command nonce.
    pub commands: &'a CommandGate,
    /// The display's challenge, with its first sight.
    pub watched: Option<Echo>,
    /// Contact by the plan.
    pub contact: Option<ReportedContact>,
    /// Newest crops of a track.
    pub crops: &'a Crops,
}

impl Sources<'_> {
    /// The signed report with this sequence.
    pub fn signed(&self, now: Instant, sequence: Sequence) -> Vec<u8> {
        self.identity.key.sign(Purpose::Report, &codec::encode(&self.report(now, sequence)))
    }

    fn report(&self, now: Instant, sequence: Sequence) -> Report {
        let (pose, pose_age) = self.localisation.reported(now).unwrap_or((wire::sensor::Pose::default(), NEVER));
        let authority = self.machine.authority();
        Report {
            origin: self.identity.node,
            boot: self.identity.boot,
            sequence,
            stamp: now.stamp(),
            product: ProductMode::Live,
            mode: self.mode(),
            cause: self.status.cause,
            failing: self.failing,
            pose,
            speed_mm_s: self.localisation.speed() as i32,
            pose_age,
            authority: authority.map(|held| ReportedAuthority { track: held.track(), left: held.left(now) }),
            command_nonce: self.commands.current().map_or(Nonce::NONE, |(nonce, _)| nonce),
            last_command: self.status.last_command,
            progress: self.mission.progress(),
            tracks: self.picture.tracks().iter().map(|track| self.reported(track, now)).collect(),
            watched: self.watched,
            sessions_lost: self.status.sessions_lost,
            measured: self.measured,
            settings: self.status.settings,
            motion: self.localisation.flight(),
            contact: self.contact,
            pictured: self.crops.pictured(now),
        }
    }

    fn mode(&self) -> Mode {
        self.machine.mode()
    }

    fn reported(&self, track: &Track, now: Instant) -> ReportedTrack {
        ReportedTrack {
            id: track.id,
            class: track.class,
            x_mm: track.x_mm,
            y_mm: track.y_mm,
            confidence: track.confidence,
            supported: track.supported,
            age: now.since(track.updated),
            contradicted: track.vetoed,
            bearings_mrad: self.bearings.apart_mrad(track.id).min(u32::from(u16::MAX)) as u16,
            across_px: track.across_px,
        }
    }
}
