//! Autonomy: the core that decides on the unit's actions, and drives it.
//!
//! It takes sensor products and seals over shared memory, leases and teammates' reports over one secure session, and
//! operators' orders over the command plane; it gives leased set-points, the abstract act, telemetry, acknowledgements
//! and its own audit log. It does no I/O and reads no clock.
//!
//! Where to read:
//!
//! | question | module |
//! |---|---|
//! | order of the modes, and the proof for each | [`transition`] |
//! | authority | [`authority`] |
//! | failure of a guard | [`health`], and the module that answers for it: [`picture`], [`localisation`], [`geofence`], [`lease`], [`seals`], [`consistency`], [`designation`], [`bearings`] |
//! | requirements of an order | [`command`] |
//! | records of the session | [`intake`] |
//! | the unit's way | [`mission`], [`grid`], [`navigation`]; in the air [`flight`] |
//! | things around it, and the speed before them | [`things`], [`extent`], [`shell`] |
//! | its own reports | [`telemetry`] |
//! | a guest in place of mission and navigation | [`pilot`] |
//!
//! The core itself is in three parts: its making (here), the meaning of an input (`inputs`), periodic work
//! (`cycle`).

pub mod bearings;
pub mod command;
pub mod config;
pub mod consistency;
pub mod crops;
mod cycle;
pub mod designation;
pub mod extent;
mod fitness;
pub mod flight;
pub mod fork;
pub mod geofence;
pub mod grid;
pub mod health;
pub mod identity;
mod inputs;
pub mod intake;
pub mod lease;
pub mod localisation;
pub mod look;
pub mod mission;
pub mod navigation;
pub mod picture;
pub mod pilot;
#[cfg(feature = "process")]
pub mod process;
pub mod seals;
pub mod settings;
pub mod shell;
mod stored;
pub mod telemetry;
pub mod things;
pub mod transition;
pub mod turn;

use std::collections::VecDeque;
use std::sync::Arc;

use ::config::platform::Limits;
use ::config::setup::Setup;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::account::Accounts;
use wire::audit::Journal;
use wire::bounds::Bounds;
use wire::bus::Sender;
use wire::codec::Text;
use wire::core::{Core, Input, Output, Topic};
use wire::event::Event;
use wire::id::{Nonce, Sequence};
use wire::mode::Mode;
use wire::policy::Waived;
use wire::time::{Instant, Span};
use wire::trust::{BusGate, RevocationList, Windows};

pub use config::{AutonomyConfig, ConfigError, GuestConfig, MapBox};
pub use transition::{authority, state};

use authority::Mint;
use bearings::Bearings;
use command::CommandGate;
use command::schedule::Schedule;
use consistency::Teammates;
use crops::Crops;
use extent::Extent;
use fork::Fork;
use geofence::{Geofence, Point};
use grid::{Clearance, Grid};
use health::{Findings, Health};
use identity::Identity;
use intake::Session;
use lease::Lease;
use localisation::Localisation;
use look::Look;
use mission::Mission;
use picture::Picture;
use pilot::Pilot;
use seals::Seals;
use state::Machine;
use telemetry::StatusRecord;
use things::{Thing, Things};
use turn::Turn;

/// Room that a narrow way leaves beside the body: that of the shell, and as much again for the way that a curve is cut.
const NARROW_MM: f64 = 500.0;

/// The core of one unit.
pub struct Autonomy {
    identity: Arc<Identity>,
    random: ChaCha8Rng,
    machine: Machine,
    mint: Mint,
    schedule: Schedule,
    commands: CommandGate,
    revoked: RevocationList,
    health: Health,
    status: StatusRecord,
    /// The platform's bounds under an operator's settings.
    bounds: Bounds,
    view: View,
    driving: Driving,
    links: Links,
    logged: Logged,
    out: VecDeque<Output>,
    next_control: Instant,
    next_telemetry: Instant,
    quiet: bool,
}

/// The unit's view of its place and of what is around it.
#[derive(Clone)]
struct View {
    picture: Picture,
    crops: Crops,
    bearings: Bearings,
    localisation: Localisation,
    fence: Arc<Geofence>,
    things: Things,
}

/// The way of the unit, and the one that decides on it: mission, look or guest.
#[derive(Clone)]
struct Driving {
    /// Curvature that the plant was asked for last, 1/mm.
    steered: f64,
    mission: Mission,
    /// A look from another side under way, in place of the mission.
    look: Option<Look>,
    /// Place of the object of the last look: the unit came near, and keeps clear of the object also when it is out of
    /// view.
    looked_at: Option<Point>,
    /// State of turning by backing up.
    turn: Turn,
    /// The guest that drives in place of mission and navigation.
    pilot: Option<Pilot>,
}

/// The ends of the links and channels, with the state that their checks need.
#[derive(Clone)]
struct Links {
    lease: Lease,
    teammates: Teammates,
    seals: Seals,
    gates: Gates,
    session: Option<Session>,
    windows: Windows,
    drive: Sender,
    act: Sender,
}

/// The log, and what was written there last: a state is logged when it changes.
#[derive(Clone)]
struct Logged {
    journal: Journal,
    accounts: Accounts,
    reports: Sequence,
    /// Presence of a fix and of odometry in the last reading.
    present: Option<(bool, bool)>,
    /// Time at which a fix was last logged, and whether fixes were distrusted then.
    located: Option<(Instant, bool)>,
    /// Last logged basis of the unit's judgement.
    judged: Option<Event>,
}

/// The gates in front of the shared-memory channels.
#[derive(Clone)]
struct Gates {
    navigation: BusGate,
    tracks: BusGate,
    seals: BusGate,
}

impl Autonomy {
    /// A core that starts at `now`.
    pub fn new(setup: Setup, config: AutonomyConfig, now: Instant) -> Result<Self, ConfigError> {
        config.check(&setup)?;
        let bounds = setup.bounds;
        let seal_limit = Span::ms(bounds.seal_limit_ms);
        let fence = Arc::new(Geofence::new(&config.geofence));
        let things = Things::new(config.obstacles.iter().map(Thing::of_map).collect(), now);
        let grid = plan(&fence, &things, &bounds, &config.limits);
        let identity = Arc::new(Identity::new(&setup, &config)?);
        let guest = config
            .guest
            .as_ref()
            .map(|guest| (guest.name.clone(), guest.bare, pilot::goal(&config), pilot::start(&setup, &config, now)));
        let mut random = ChaCha8Rng::seed_from_u64(setup.seed);
        // A restart must not repeat the nonces of the boot before: an order of then would be young and new again.
        random.set_stream(u64::from(setup.boot.0));
        let mut core = Autonomy {
            random,
            machine: Machine::start(),
            mint: Mint::new(&setup),
            schedule: Schedule::default(),
            commands: CommandGate::new(config.unit, config.operators, Span::ms(bounds.command_limit_ms)),
            revoked: RevocationList::new(&config.mandates, now),
            health: Health::judge(Findings::default(), identity.waived_guards, Waived::default()),
            status: StatusRecord::default(),
            bounds,
            view: View {
                picture: Picture::default(),
                crops: Crops::default(),
                bearings: Bearings::default(),
                localisation: Localisation::new(config.limits, identity.waived_guards)
                    .telling_repeats(setup.bounds.product_limit())
                    .at_most(setup.bounds.max_speed_mm_s),
                fence,
                things,
            },
            driving: Driving {
                steered: 0.0,
                mission: Mission::new(&config.route, config.looped, grid),
                look: None,
                looked_at: None,
                turn: Turn::default(),
                pilot: config.guest.as_ref().map(|guest| Pilot::new(guest, Span::ms(bounds.control_period_ms), now)),
            },
            links: Links {
                lease: Lease::new(config.contacts, now),
                teammates: Teammates::default(),
                seals: Seals::new(setup.node, setup.boot, seal_limit),
                gates: Gates {
                    navigation: setup.gate(Topic::Navigation, bounds.product_limit())?,
                    tracks: setup.gate(Topic::Tracks, bounds.product_limit())?,
                    seals: setup.gate(Topic::Seals, seal_limit)?,
                },
                session: None,
                windows: Windows::new(bounds.replay_window, bounds.sequence_jump),
                drive: setup.sender(Topic::Drive)?,
                act: setup.sender(Topic::Act)?,
            },
            logged: Logged {
                journal: Journal::new(setup.node, setup.boot, Some(identity.key.clone())),
                accounts: Accounts::default(),
                reports: Sequence(0),
                present: None,
                located: None,
                judged: None,
            },
            out: VecDeque::new(),
            next_control: now + Span::ms(bounds.control_period_ms),
            next_telemetry: now + Span::ms(bounds.telemetry_period_ms),
            quiet: false,
            identity,
        };
        core.write(now, Event::Started);
        if let Some((name, bare, goal, mission)) = guest {
            core.write(now, Event::GuestEngaged { name: Text::new(&name), bare, goal });
            core.out.push_back(mission);
        }
        core.health = core.assess(now);
        Ok(core)
    }

    /// The mode of its machine.
    pub fn mode(&self) -> Mode {
        self.machine.mode()
    }

    /// Time since its supervision lease was granted at the earliest; none before the first grant.
    pub fn lease_age(&self, now: Instant) -> Option<Span> {
        self.links.lease.age(Span::ms(self.identity.bounds.lease_ms), now)
    }

    /// The copy that only a [`Fork`] allows; its one caller is [`Autonomy::fork`].
    fn copy(&self, fork: &Fork) -> Autonomy {
        Autonomy {
            identity: Arc::clone(&self.identity),
            random: self.random.clone(),
            machine: self.machine.fork(fork),
            mint: self.mint.fork(fork),
            schedule: self.schedule.fork(fork),
            commands: self.commands.clone(),
            revoked: self.revoked.clone(),
            health: self.health.clone(),
            status: self.status,
            bounds: self.bounds,
            view: self.view.clone(),
            driving: self.driving.clone(),
            links: self.links.clone(),
            logged: self.logged.clone(),
            out: self.out.clone(),
            next_control: self.next_control,
            next_telemetry: self.next_telemetry,
            quiet: self.quiet,
        }
    }

    fn write(&mut self, now: Instant, event: Event) {
        self.logged.journal.write(now, event, &mut self.out);
    }

    fn nonce(&mut self) -> Nonce {
        Nonce(self.random.next_u64())
    }
}

impl Core for Autonomy {
    fn handle(&mut self, now: Instant, input: &Input) {
        // A unit that did not run finds that out before it hears anything: what waited for it is younger than what it
        // has been driving by.
        if now >= self.next_control + Span::ms(self.identity.bounds.control_period_ms) {
            self.tick(now);
        }
        match input {
            Input::Timeout => self.tick(now),
            Input::Bus { topic, bytes } => self.bus(now, *topic, bytes),
            Input::Opened { session, peer } => self.opened(now, *session, *peer),
            Input::Record { session, bytes } => self.record(now, *session, bytes),
            Input::Closed { session } => self.closed(now, *session),
            Input::Published { subject, bytes } => self.published(now, *subject, bytes),
            Input::SessionLost => self.session_lost(now),
            Input::Guest { bytes } => self.answered(now, bytes),
            Input::Quiesce => self.quiet = true,
            Input::Finish => self.finish(now),
            // Datagrams of relays and the recorder.
            Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. }
            | Input::HostWait { .. }
            | Input::Cue { .. }
            | Input::Act { .. } => {}
        }
    }

    fn deadline(&self) -> Option<Instant> {
        Some(self.next_control.min(self.next_telemetry))
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}

/// Area that may be driven under `bounds`, the platform's or an operator's.
fn plan(fence: &Geofence, things: &Things, bounds: &Bounds, limits: &Limits) -> Grid {
    let wide = f64::from(limits.plan_clearance_mm);
    let narrow = (f64::from(limits.body_mm[1]) / 2.0 + NARROW_MM).min(wide);
    let fence_mm = f64::from(bounds.fence_margin_mm) + wide;
    let flown_over = limits.aloft.map_or(0.0, |aloft| flight::flown_over(&aloft));
    let map: Vec<Extent> =
        things.on_the_map().filter(|thing| thing.top > flown_over).map(|thing| thing.extent).collect();
    Grid::new(fence, &map, Clearance { fence: fence_mm, wide, narrow })
}
