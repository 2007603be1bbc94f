//! The display's model: a pure fold of accepted messages and the console's own clock.
//!
//! [`Model::shown`] gives [`Shown`], the only input of views, operator and oracle; no other way leads from the model to
//! a screen. Judging messages is left to `intake`, following commands to `life`, raising alarms to `alarms`, judging
//! acts to `hand`, deciding to `operator`.

use std::collections::{BTreeMap, VecDeque};

use config::suite::Suite;
use sha2::{Digest, Sha256};
use wire::bounds::Bounds;
use wire::command::ReportHash;
use wire::id::{Boot, NodeId, PeerId, RecordId, UnitId};
use wire::person::{Alarm, Order, Role, Shelf};
use wire::policy::{Policy, Waived};
use wire::refusal::{Reason, Refusal};
use wire::report::{Report, ReportedTrack};
use wire::sensor::{Pose, ProductMode};
use wire::time::{Age, Instant, PeerStamp, Span};
use wire::trust::{Accepted, Bearer, SignedReport};

use crate::age::{AgeLimits, Aged};
use crate::alarm::ShownGroup;
use crate::alarms::Alarms;
use crate::hand::Hand;
use crate::history::{History, Incident};
use crate::host::HostWait;
use crate::images::Gallery;
use crate::life::{Commands, Giver};
use crate::shown::{LostTrack, Marks, Origin, Shown, ShownLink, ShownRefusals, ShownUnit, State};
use crate::skew::Skew;
use crate::sound::Sound;
use crate::trace::{Sample, Trace};

/// Lost tracks of one unit that are kept; six times as many as it reports at once.
pub const MAX_LOST: usize = 48;

/// The identity of a display: operator and role.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Station {
    /// Time at which the console started.
    pub started: Instant,
    /// The node that issues the commands.
    pub operator: NodeId,
    /// Permissions of the person here.
    pub role: Role,
    /// Marks of the picture as a whole.
    pub marks: Marks,
    /// The platform's bounds.
    pub bounds: Bounds,
    /// Identities that the operator can have revoked, and whether that was requested.
    pub revocable: Vec<(NodeId, bool)>,
    /// Units that take part, and are silent until something of theirs is accepted.
    pub awaited: Vec<UnitId>,
}

/// A unit as last reported.
#[derive(Clone, Debug)]
struct Heard {
    report: RecordId,
    hash: ReportHash,
    stamp: PeerStamp,
    via: PeerId,
    bearer: Bearer,
    waived: Waived,
    since: Instant,
    state: Aged<State>,
    pose: Aged<Pose>,
    product: ProductMode,
    tracks: Vec<Aged<ReportedTrack>>,
    lost: Lost,
    /// Skew of its clock in this boot.
    skew: Skew,
    /// Its reports over time, in every boot.
    trace: Trace,
}

/// Tracks that a unit no longer reports, oldest first, at most [`MAX_LOST`].
#[derive(Clone, Debug, Default)]
struct Lost {
    kept: VecDeque<(Boot, Aged<ReportedTrack>, Instant)>,
    more: u32,
}

impl Lost {
    fn push(&mut self, boot: Boot, track: Aged<ReportedTrack>, since: Instant) {
        if self.kept.len() >= MAX_LOST {
            self.kept.pop_front();
            self.more = self.more.saturating_add(1);
        }
        self.kept.push_back((boot, track, since));
    }
}

/// A session at the gateway, by its last word.
#[derive(Clone, Copy, Debug)]
struct Link {
    open: bool,
    since: Instant,
    /// Time at which a report that it brought was accepted last.
    heard: Option<Instant>,
}

/// The display's state, from which every picture is drawn.
#[derive(Clone, Debug)]
pub struct Model {
    station: Station,
    limits: AgeLimits,
    units: Vec<(UnitId, Option<Heard>)>,
    /// Images of the tracks, in the order of `units`.
    galleries: Vec<Gallery>,
    links: BTreeMap<PeerId, Link>,
    /// The last answer of the gateway.
    fed: Option<Aged<()>>,
    /// Refusals by reason, by peer, and whether the console itself refused.
    refusals: BTreeMap<(Reason, Option<PeerId>, bool), Refusals>,
    losses: BTreeMap<PeerId, Losses>,
    commands: Commands,
    alarms: Alarms,
    history: History,
    hand: Hand,
    host_wait: HostWait,
}

/// Refusals of one kind.
#[derive(Clone, Copy, Debug)]
struct Refusals {
    /// Number of refusals in all boots of the gateway.
    all: u64,
    /// Number that the gateway stated last, in its present boot.
    counted: u64,
    last: Instant,
}

/// Sessions that one peer has lost.
#[derive(Clone, Copy, Debug, Default)]
struct Losses {
    /// Boot of the peer, where it is known.
    boot: Option<Boot>,
    /// Number that the peer stated last, in that boot.
    counted: u32,
    /// Number of losses in all boots.
    total: u32,
}

impl Model {
    /// A model of `units` before any message.
    pub fn new(units: &[UnitId], station: Station, policy: &Policy) -> Self {
        Self {
            limits: AgeLimits::new(&station.bounds, policy),
            station,
            units: units.iter().map(|unit| (*unit, None)).collect(),
            galleries: vec![Gallery::default(); units.len()],
            links: BTreeMap::new(),
            fed: None,
            refusals: BTreeMap::new(),
            losses: BTreeMap::new(),
            commands: Commands::default(),
            alarms: Alarms::default(),
            history: History::default(),
            hand: Hand::default(),
            host_wait: HostWait::default(),
        }
    }

    /// The limits that labels follow from.
    pub fn limits(&self) -> &AgeLimits {
        &self.limits
    }

    /// The unit that is displayed first; the one under test where there is none.
    pub fn first(&self) -> UnitId {
        self.units.first().map_or(UnitId::A, |(unit, _)| *unit)
    }

    /// An accepted report. One that is not newer than the one shown, by sequence or by stamp, changes no value: so
    /// neither a replay nor a stamp that runs backwards can make a shown value look younger. False in that case. `seen`
    /// holds the send time of the challenge that the unit repeats, and the time at which the unit says it saw it.
    pub fn report(
        &mut self,
        accepted: &Accepted<SignedReport<'_>>,
        via: PeerId,
        waived: Waived,
        seen: Option<(Instant, PeerStamp)>,
    ) -> bool {
        let (report, evidence) = (&accepted.message().report, accepted.evidence());
        let unit = report.origin.unit();
        let mut known = self.units.iter_mut().zip(&mut self.galleries);
        let Some(((unit, slot), gallery)) = known.find(|((u, _), _)| Some(*u) == unit) else { return false };
        let peer = unit.peer();
        // Accepted reports may overtake each other within the replay window: an older one must not replace the display.
        if slot.as_ref().is_some_and(|heard| !newer(report, heard)) {
            return false;
        }
        let (arrived, age) = (evidence.received, evidence.age);
        let mode = |heard: &Heard| heard.state.label_at(arrived, &self.limits).get().0.mode;
        let same = slot.as_ref().filter(|heard| mode(heard) == report.mode);
        let since = same.map_or(arrived, |heard| heard.since);
        if same.is_none() && slot.is_some() {
            self.history.note(
                arrived,
                Incident::Mode(*unit, report.mode, report.cause, Suite::from_motion(report.motion.as_ref())),
            );
        }
        gallery.vouched(report, arrived, age);
        let older = |delay: Span| age.map(|age| age.plus(delay));
        let mut skew = match &mut *slot {
            // A restarted unit has a clock with another zero: stamps of two boots give no rate.
            Some(heard) if heard.report.boot == report.boot => core::mem::take(&mut heard.skew),
            _ => Skew::default(),
        };
        skew.heard(report.stamp, arrived, seen);
        let mut trace = slot.as_mut().map(|heard| core::mem::take(&mut heard.trace)).unwrap_or_default();
        trace.push(Sample::new(arrived, age.map(Age::upper), report));
        let lost = lost_by(report, slot.take(), arrived);
        *slot = Some(Heard {
            report: report.id(),
            hash: Sha256::digest(accepted.message().bytes).into(),
            stamp: report.stamp,
            via,
            bearer: accepted.message().bearer(via),
            waived: waived.union(evidence.waived),
            since,
            state: Aged::new(state_of(report), arrived, age),
            pose: Aged::new(report.pose, arrived, older(report.pose_age)),
            product: report.product,
            tracks: report.tracks.iter().map(|track| Aged::new(*track, arrived, older(track.age))).collect(),
            lost,
            skew,
            trace,
        });
        self.commands.reported(arrived, *unit, report);
        let link = self.links.entry(via).or_insert(Link { open: true, since: arrived, heard: None });
        link.heard = Some(arrived);
        self.sessions_lost(peer, Some(report.boot), report.sessions_lost);
        true
    }

    /// A crop in the session of `unit`.
    ///
    /// # Errors
    /// It is none, or the unit is not displayed here.
    pub fn crop(&mut self, unit: UnitId, bytes: &[u8]) -> Result<(), Refusal> {
        let mut known = self.units.iter().zip(&mut self.galleries);
        let (_, gallery) = known.find(|((owner, _), _)| *owner == unit).ok_or(Refusal::NoUnit { got: unit })?;
        gallery.take(bytes)
    }

    /// Count of session losses at the broker that `peer` reports since its `boot`th start, where that is known. A shown
    /// loss stays shown.
    pub fn sessions_lost(&mut self, peer: PeerId, boot: Option<Boot>, counted: u32) {
        let known = self.losses.entry(peer).or_default();
        // A peer that has started again counts from nothing.
        let repeated = known.boot != boot || counted < known.counted;
        let more = if repeated { counted } else { counted - known.counted };
        *known = Losses { boot, counted, total: known.total.saturating_add(more) };
    }

    /// The gateway sent a message: the shown state of its sessions is as old as that.
    pub fn fed(&mut self, now: Instant) {
        self.fed = Some(Aged::new((), now, Some(Age::on_one_host(now, now))));
    }

    /// The host kept a service waiting for a core.
    pub fn host_waited(&mut self, now: Instant, wait: Span) {
        self.host_wait.note(now, wait);
    }

    /// A session at the gateway opened or ended.
    pub fn session(&mut self, now: Instant, peer: PeerId, open: bool) {
        let heard = self.links.get(&peer).and_then(|link| link.heard);
        self.links.insert(peer, Link { open, since: now, heard });
    }

    /// The gateway refused something; the count of its refusals for this reason and from this peer by then. One that
    /// counts lower than before has started again.
    pub fn refused_there(&mut self, now: Instant, reason: Reason, peer: Option<PeerId>, counted: u64) {
        let known = self.refusals.entry((reason, peer, false)).or_insert(Refusals { all: 0, counted: 0, last: now });
        let more = if counted < known.counted { counted } else { counted - known.counted };
        *known = Refusals { all: known.all.saturating_add(more), counted, last: now };
    }

    /// The console itself refused something.
    pub fn refused_here(&mut self, now: Instant, reason: Reason) {
        let known = self.refusals.entry((reason, None, true)).or_insert(Refusals { all: 0, counted: 0, last: now });
        (known.all, known.last) = (known.all.saturating_add(1), now);
    }

    /// An alarm, or a track that ended, was taken note of; tracks that it was about are gone from then on.
    pub fn acknowledge(&mut self, now: Instant, alarm: &Alarm, since: Instant) {
        let mut gone = self.alarms.tracks(alarm);
        if let Alarm::TrackLost(unit, boot, id) = alarm {
            gone.push((*unit, *boot, *id));
        }
        for (unit, heard) in &mut self.units {
            let kept = heard.iter_mut().map(|heard| &mut heard.lost.kept);
            kept.for_each(|kept| kept.retain(|(boot, track, _)| !gone.contains(&(*unit, *boot, track.id()))));
        }
        if let Some(group) = self.alarms.acknowledge(alarm, since) {
            self.history.note(now, Incident::Acknowledged(group.cause, group.suite));
        }
    }

    /// An alarm was put aside.
    pub fn shelve(&mut self, now: Instant, group: &ShownGroup, shelf: Shelf) {
        if self.alarms.shelve(now, &group.cause, group.since, shelf) {
            self.history.note(now, Incident::Shelved(group.cause, group.suite, shelf));
        }
    }

    /// The sound of the alarms raised so far was silenced.
    pub fn silence(&mut self, now: Instant) {
        self.alarms.silence(now);
        self.history.note(now, Incident::Silenced);
    }

    /// An order was given.
    pub fn ordered(&mut self, now: Instant, order: Order, giver: Giver) {
        self.history.note(now, Incident::Ordered(order, giver));
    }

    /// The revocation of `node` was requested: an order on the first request.
    pub fn revoked(&mut self, now: Instant, node: NodeId, giver: Giver) {
        let first = self.station.revocable.iter_mut().find(|(owner, requested)| *owner == node && !*requested);
        if let Some((_, requested)) = first {
            *requested = true;
            self.ordered(now, Order::Revoke(node), giver);
        }
    }

    /// Raises the alarms of the picture, and adds them to it.
    pub fn watch(&mut self, shown: &mut Shown) {
        self.alarms.fold(shown, &mut self.history);
        self.alarms.show(shown);
        (shown.past, shown.past_more) = self.history.shown();
    }

    /// The person's hand.
    pub fn hand(&mut self) -> &mut Hand {
        &mut self.hand
    }

    /// The commands of this console.
    pub fn commands(&self) -> &Commands {
        &self.commands
    }

    /// The commands of this console, to move them along.
    pub fn commands_mut(&mut self) -> &mut Commands {
        &mut self.commands
    }

    /// Time at which the picture changes next by time alone.
    pub fn changes(&self, now: Instant) -> Option<Instant> {
        let heard = self.units.iter().filter_map(|(_, heard)| heard.as_ref());
        let labels = heard.flat_map(|heard| {
            let tracks = heard.tracks.iter().filter_map(|track| track.changes(now, &self.limits));
            tracks.chain(heard.state.changes(now, &self.limits)).chain(heard.pose.changes(now, &self.limits))
        });
        let links = self.fed.iter().filter_map(|fed| fed.changes(now, &self.limits));
        let prepared = self.hand.prepared().map(|prepared| prepared.until);
        let alarms = self.alarms.changes(now);
        labels.chain(links).chain(self.commands.changes()).chain(prepared).chain(alarms).min()
    }

    /// The picture to draw at `now`.
    pub fn shown(&self, now: Instant) -> Shown {
        let unit = |((unit, heard), gallery): (&(UnitId, Option<Heard>), &Gallery)| {
            heard.as_ref().map(|heard| self.shown_unit(now, *unit, heard, gallery))
        };
        let refusals = self.refusals.iter();
        let (past, past_more) = self.history.shown();
        let mut shown = Shown {
            at: now,
            started: self.station.started,
            operator: self.station.operator,
            role: self.station.role,
            marks: Marks { host_wait: self.host_wait.longest_wait(now), ..self.station.marks.clone() },
            bounds: self.station.bounds,
            limits: self.limits,
            units: self.units.iter().zip(&self.galleries).filter_map(unit).collect(),
            silent: self
                .units
                .iter()
                .filter(|(unit, heard)| heard.is_none() && self.station.awaited.contains(unit))
                .map(|(unit, _)| *unit)
                .collect(),
            links: self.links.iter().filter_map(|(peer, link)| self.shown_link(now, *peer, link)).collect(),
            refusals: refusals
                .map(|((reason, peer, local), refusals)| ShownRefusals {
                    reason: *reason,
                    peer: *peer,
                    here: *local,
                    n: refusals.all,
                    last: refusals.last,
                })
                .collect(),
            losses: self.losses.iter().map(|(peer, n)| (*peer, n.total)).filter(|(_, n)| *n > 0).collect(),
            commands: self.commands.shown(),
            revocable: self.station.revocable.clone(),
            alarms: Vec::new(),
            alarms_more: 0,
            alarms_in_hour: 0,
            alarm_flood: false,
            sound: Sound::default(),
            past,
            past_more,
            prepared: self.hand.prepared(),
            answers: self.hand.answers(),
        };
        self.alarms.show(&mut shown);
        shown
    }

    fn shown_link(&self, now: Instant, peer: PeerId, link: &Link) -> Option<ShownLink> {
        // As old as the gateway's last message: a gateway that falls silent must not leave its links shown as open.
        let open = self.fed.as_ref()?.with_value(link.open).label_at(now, &self.limits);
        Some(ShownLink { peer, open, since: link.since, heard: link.heard.map(|heard| now.since(heard)) })
    }

    fn shown_unit(&self, now: Instant, unit: UnitId, heard: &Heard, gallery: &Gallery) -> ShownUnit {
        ShownUnit {
            unit,
            report: heard.report,
            hash: heard.hash,
            via: heard.via,
            waived: heard.waived,
            origin: origin(heard),
            since: heard.since,
            state: heard.state.label_at(now, &self.limits),
            pose: heard.pose.label_at(now, &self.limits),
            tracks: heard.tracks.iter().map(|track| track.label_at(now, &self.limits)).collect(),
            images: gallery.shown(now, &self.limits),
            lost: heard
                .lost
                .kept
                .iter()
                .map(|(boot, track, since)| LostTrack { boot: *boot, track: track.lost_at(now), since: *since })
                .collect(),
            lost_more: heard.lost.more,
            clock: heard.skew.rate(),
            trace: heard.trace.clone(),
        }
    }
}

/// The tracks that are lost once `report` follows the earlier ones. A track that is reported again is no longer lost; a
/// restarted unit has none of its old ones.
fn lost_by(report: &Report, before: Option<Heard>, now: Instant) -> Lost {
    let Some(Heard { report: of, tracks, mut lost, .. }) = before else { return Lost::default() };
    let reported = |boot: Boot, track: &Aged<ReportedTrack>| {
        boot == report.boot && report.tracks.iter().any(|now| now.id == track.id())
    };
    lost.kept.retain(|(boot, track, _)| !reported(*boot, track));
    for track in tracks.into_iter().filter(|track| !reported(of.boot, track)) {
        lost.push(of.boot, track, now);
    }
    lost
}

fn origin(heard: &Heard) -> Origin {
    if !heard.waived.is_empty() {
        return Origin::Unverified;
    }
    if heard.product != ProductMode::Live {
        return Origin::NotLive(heard.product);
    }
    match heard.bearer {
        Bearer::Origin => Origin::Direct,
        Bearer::Other(via) => Origin::Relayed(via),
    }
}

/// True if `report` is newer than the shown one: a later boot, or within one boot a higher sequence *and* a later
/// stamp.
fn newer(report: &Report, heard: &Heard) -> bool {
    let later = (report.boot, report.sequence) > (heard.report.boot, heard.report.sequence);
    later && (report.boot > heard.report.boot || report.stamp.minus(heard.stamp) > 0)
}

fn state_of(report: &Report) -> State {
    State {
        mode: report.mode,
        cause: report.cause,
        failing: report.failing,
        measured: report.measured,
        settings: report.settings,
        authority: report.authority,
        speed_mm_s: report.speed_mm_s,
        nonce: report.command_nonce,
        progress: report.progress,
        motion: report.motion,
        contact: report.contact,
    }
}
