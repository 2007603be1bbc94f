//! The display's model: a pure fold of accepted messages and the console's own clock.
//!
//! [`Model::shown`] gives [`Shown`], which is what views draw, what the operator sees and what the oracle is told; no
//! other way leads from the model to a screen. Judging messages is left to `intake`, following commands to `life`,
//! deciding to `operator`.

use std::collections::BTreeMap;

use wire::bounds::Bounds;
use wire::command::IntentHash;
use wire::event::Freshness;
use wire::id::{Boot, Nonce, PeerId, RecordId, UnitId};
use wire::mode::{Cause, Guards, Mode};
use wire::policy::{Policy, Waived};
use wire::refusal::Reason;
use wire::report::{Report, ReportedAuthority, ReportedTrack};
use wire::sensor::Pose;
use wire::time::{Instant, PeerStamp, Span};
use wire::trust::{Accepted, SignedReport};

use crate::age::{Aged, Labelled, Limits};
use crate::life::{Commands, ShownCommand};

/// What a unit says of its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    /// Mode of its machine.
    pub mode: Mode,
    /// Cause of the last transition.
    pub cause: Cause,
    /// Guards that failed.
    pub failing: Guards,
    /// Authority, while it was held.
    pub authority: Option<ReportedAuthority>,
    /// Forward speed, mm/s.
    pub speed_mm_s: i32,
    /// What an intent has to repeat.
    pub nonce: Nonce,
    /// Share of the route driven, permille.
    pub progress: u16,
}

/// A unit as drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShownUnit {
    /// Which.
    pub unit: UnitId,
    /// The report behind it.
    pub report: RecordId,
    /// Whose session brought that.
    pub via: PeerId,
    /// Checks that were waived on its way.
    pub waived: Waived,
    /// When the shown mode was first shown.
    pub since: Instant,
    /// State.
    pub state: Labelled<State>,
    /// Place; older than the state by the age of its localisation.
    pub pose: Labelled<Pose>,
    /// Tracks; each older than the state by its own age.
    pub tracks: Vec<Labelled<ReportedTrack>>,
}

impl ShownUnit {
    /// How many tracks carry one of these labels.
    pub fn tracks_labelled(&self, labels: &[Freshness]) -> u8 {
        self.tracks.iter().filter(|t| labels.contains(&t.freshness())).count() as u8
    }
}

/// Everything that is drawn at one instant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// When, on the console's clock.
    pub at: Instant,
    /// Units that have been heard, in the configured order.
    pub units: Vec<ShownUnit>,
    /// Units that have not.
    pub silent: Vec<UnitId>,
    /// Sessions at the gateway.
    pub links: Vec<(PeerId, bool)>,
    /// Refusals by reason, as fed (the feed is bounded; exact numbers are in the accounts).
    pub refusals: Vec<(Reason, u64)>,
    /// Whose sessions at the broker were cut or taken, and how often: an alarm.
    pub losses: Vec<(PeerId, u32)>,
    /// Commands of this console, oldest first.
    pub commands: Vec<ShownCommand>,
}

impl Shown {
    /// The unit, if it has been heard.
    pub fn unit(&self, unit: UnitId) -> Option<&ShownUnit> {
        self.units.iter().find(|shown| shown.unit == unit)
    }

    /// The command, if it is still kept.
    pub fn command(&self, intent: &IntentHash) -> Option<&ShownCommand> {
        self.commands.iter().find(|shown| shown.intent == *intent)
    }
}

/// A unit as last reported.
#[derive(Clone, Debug)]
struct Heard {
    report: RecordId,
    stamp: PeerStamp,
    via: PeerId,
    waived: Waived,
    since: Instant,
    state: Aged<State>,
    pose: Aged<Pose>,
    tracks: Vec<Aged<ReportedTrack>>,
}

/// The model.
#[derive(Clone, Debug)]
pub struct Model {
    limits: Limits,
    units: Vec<(UnitId, Option<Heard>)>,
    links: BTreeMap<PeerId, bool>,
    refusals: BTreeMap<Reason, u64>,
    losses: BTreeMap<PeerId, Losses>,
    commands: Commands,
}

/// Sessions that one peer has lost.
#[derive(Clone, Copy, Debug, Default)]
struct Losses {
    /// Its boot, where that is known.
    boot: Option<Boot>,
    /// As it counted them last, in that boot.
    counted: u32,
    /// In all.
    total: u32,
}

impl Model {
    /// A model that has heard nothing of `units`.
    pub fn new(units: &[UnitId], bounds: &Bounds, policy: &Policy) -> Self {
        Self {
            limits: Limits::new(bounds, policy),
            units: units.iter().map(|unit| (*unit, None)).collect(),
            links: BTreeMap::new(),
            refusals: BTreeMap::new(),
            losses: BTreeMap::new(),
            commands: Commands::default(),
        }
    }

    /// The limits that labels follow from.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// An accepted report. One that is not newer than the one shown, by sequence or by stamp, changes nothing: so
    /// neither a replay nor a stamp that runs backwards can make a shown value look younger. False in that case.
    pub fn report(&mut self, accepted: &Accepted<SignedReport<'_>>, via: PeerId, waived: Waived) -> bool {
        let (report, evidence) = (&accepted.message().report, accepted.evidence());
        let unit = report.origin.unit();
        let Some((unit, slot)) = self.units.iter_mut().find(|(u, _)| Some(*u) == unit) else { return false };
        let peer = unit.peer();
        if slot.as_ref().is_some_and(|heard| !newer(report, heard)) {
            return false;
        }
        let (arrived, age) = (evidence.received, evidence.age);
        let mode = |heard: &Heard| heard.state.at(arrived, &self.limits).get().0.mode;
        let since = slot.as_ref().filter(|heard| mode(heard) == report.mode).map_or(arrived, |heard| heard.since);
        let older = |by: Span| age.map(|age| age.after(by));
        *slot = Some(Heard {
            report: report.id(),
            stamp: report.stamp,
            via,
            waived: waived.union(evidence.waived),
            since,
            state: Aged::new(state_of(report), arrived, age),
            pose: Aged::new(report.pose, arrived, older(report.pose_age)),
            tracks: report.tracks.iter().map(|track| Aged::new(*track, arrived, older(track.age))).collect(),
        });
        self.sessions_lost(peer, Some(report.boot), report.sessions_lost);
        true
    }

    /// So often, says `peer`, its session at the broker was lost since it started for the `boot`th time, where that is known.
    /// What was shown once stays shown.
    pub fn sessions_lost(&mut self, peer: PeerId, boot: Option<Boot>, counted: u32) {
        let known = self.losses.entry(peer).or_default();
        // A peer that has started again counts from nothing.
        let again = known.boot != boot || counted < known.counted;
        let more = if again { counted } else { counted - known.counted };
        *known = Losses { boot, counted, total: known.total.saturating_add(more) };
    }

    /// A session at the gateway opened or ended.
    pub fn session(&mut self, peer: PeerId, open: bool) {
        self.links.insert(peer, open);
    }

    /// Something was refused.
    pub fn refused(&mut self, reason: Reason) {
        *self.refusals.entry(reason).or_default() += 1;
    }

    /// The commands of this console.
    pub fn commands(&self) -> &Commands {
        &self.commands
    }

    /// The commands of this console, to move them along.
    pub fn commands_mut(&mut self) -> &mut Commands {
        &mut self.commands
    }

    /// When the picture changes next by time alone.
    pub fn changes(&self, now: Instant) -> Option<Instant> {
        let heard = self.units.iter().filter_map(|(_, heard)| heard.as_ref());
        let labels = heard.flat_map(|heard| {
            let tracks = heard.tracks.iter().filter_map(|track| track.changes(now, &self.limits));
            tracks.chain(heard.state.changes(now, &self.limits)).chain(heard.pose.changes(now, &self.limits))
        });
        labels.chain(self.commands.changes()).min()
    }

    /// What is to be drawn at `now`.
    pub fn shown(&self, now: Instant) -> Shown {
        let unit =
            |(unit, heard): &(UnitId, Option<Heard>)| heard.as_ref().map(|heard| self.shown_unit(now, *unit, heard));
        Shown {
            at: now,
            units: self.units.iter().filter_map(unit).collect(),
            silent: self.units.iter().filter(|(_, heard)| heard.is_none()).map(|(unit, _)| *unit).collect(),
            links: self.links.iter().map(|(peer, open)| (*peer, *open)).collect(),
            refusals: self.refusals.iter().map(|(reason, n)| (*reason, *n)).collect(),
            losses: self.losses.iter().map(|(peer, n)| (*peer, n.total)).filter(|(_, n)| *n > 0).collect(),
            commands: self.commands.shown(),
        }
    }

    fn shown_unit(&self, now: Instant, unit: UnitId, heard: &Heard) -> ShownUnit {
        ShownUnit {
            unit,
            report: heard.report,
            via: heard.via,
            waived: heard.waived,
            since: heard.since,
            state: heard.state.at(now, &self.limits),
            pose: heard.pose.at(now, &self.limits),
            tracks: heard.tracks.iter().map(|track| track.at(now, &self.limits)).collect(),
        }
    }
}

/// Whether `report` is newer than what is shown: a later boot, or within one boot a higher sequence *and* a later stamp.
fn newer(report: &Report, heard: &Heard) -> bool {
    let later = (report.boot, report.sequence) > (heard.report.boot, heard.report.sequence);
    later && (report.boot > heard.report.boot || report.stamp.minus(heard.stamp) > 0)
}

fn state_of(report: &Report) -> State {
    State {
        mode: report.mode,
        cause: report.cause,
        failing: report.failing,
        authority: report.authority,
        speed_mm_s: report.speed_mm_s,
        nonce: report.command_nonce,
        progress: report.progress,
    }
}
