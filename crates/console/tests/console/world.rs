//! Everything that can happen to a console, in one sequence of moves: arrivals, gaps, replays, forgeries, jumps of
//! clocks and boots, gateway statements, answers, and a person's acts. `properties` holds the checks after each move.

use console::act::{Act, Alarm, Order, Role, Shelf};
use console::shown::Shown;
use proptest::prelude::*;
use sha2::{Digest, Sha256};
use wire::codec::{self, List, Text};
use wire::command::{Ack, CommandKind, Intent, IntentHash};
use wire::core::Input;
use wire::event::Event;
use wire::feed::{CommandStage, Feed};
use wire::id::{Boot, NodeId, PeerId, Sequence, TrackId, UnitId};
use wire::mode::{Guards, Mode};
use wire::person::Numbered;
use wire::refusal::Reason;
use wire::report::{Report, ReportedAuthority, ReportedTrack};
use wire::time::{Instant, PeerStamp, Span};

use crate::bench::{Asked, Bench, report, sign};

/// Content of a report.
#[derive(Clone, Debug)]
pub(crate) struct Says {
    mode: usize,
    /// Bit n: track n is reported.
    tracks: u8,
    failing: bool,
    authority: bool,
    /// True if the report has eight tracks that no report had before.
    others: bool,
    /// True if the report repeats the last command given.
    heard: bool,
    /// The unit has started again.
    reboot: bool,
    /// So old, ms, and its stamp off by this much, µs.
    age: u64,
    stamp: i64,
}

/// An act of the person.
#[derive(Clone, Debug)]
pub(crate) enum Does {
    Now(CommandKind),
    Prepare(CommandKind),
    /// A one-step order, of the act that the shown mode allows.
    NowFitting,
    /// The order that the shown mode allows.
    PrepareFitting,
    /// Confirms the prepared order, with or without a reason.
    Confirm(bool),
    ConfirmUnprepared(CommandKind),
    Withdraw,
    /// Takes note of one of the alarms.
    Note(usize),
    /// Takes note of the oldest track that ended.
    NoteTrack,
    /// Puts one of the alarms aside.
    Shelve(usize),
    Silence,
    Revoke,
    Garbage(Vec<u8>),
    /// The last act once more, under the same number: a key that repeats.
    Again,
}

/// A move of the property tests.
#[derive(Clone, Debug)]
pub(crate) enum Move {
    Gap(u64),
    Report(Says),
    /// An earlier report comes again, as if it were young.
    Replay(usize),
    /// A report that is made now and kept on its way.
    Kept(Says),
    /// The last one that was kept comes after all, said to be as old as it is.
    Late,
    /// A report under another unit's key.
    Forged(Says),
    Session(bool),
    Refused(bool),
    /// The gateway moves a command along.
    Stage(usize, CommandStage),
    /// An acknowledgement: by the unit itself or by another, of a refusal or not.
    Ack(usize, bool, bool),
    Person(Does),
}

/// A report as it was made.
#[derive(Clone)]
pub(crate) struct Told {
    pub(crate) signed: Vec<u8>,
    pub(crate) report: Report,
    /// The latest instant at which its content can have been true.
    pub(crate) made: Instant,
    pub(crate) forged: bool,
}

/// A console in a world in which anything may happen.
pub(crate) struct World {
    pub(crate) bench: Bench,
    pub(crate) role: Role,
    pub(crate) told: Vec<Told>,
    /// Reports that are still on their way.
    kept: Vec<Told>,
    /// Acknowledgements under the unit's own key, by intent: whether it executed the command.
    pub(crate) answered: Vec<(IntentHash, bool)>,
    pub(crate) staged: Vec<IntentHash>,
    /// Intents away from safe that were given up again, by a person's word or by a step towards safe.
    pub(crate) withdrawn: Vec<IntentHash>,
    /// Refusals as the gateway counts them: from unknown peers, and from B.
    pub(crate) counted: [u64; 2],
    /// The gateway's last word.
    pub(crate) fed: Option<Instant>,
    boot: u32,
    sequence: u64,
    serial: u64,
    last: Option<Act>,
}

/// State before and after a move, and its outcome.
pub(crate) struct Step<'a> {
    pub(crate) world: &'a World,
    pub(crate) moved: &'a Move,
    pub(crate) before: &'a Shown,
    pub(crate) after: &'a Shown,
    /// The act of this move.
    pub(crate) act: Option<Act>,
    pub(crate) asked: &'a [Asked],
    pub(crate) events: &'a [(Instant, Event)],
}

const KINDS: [CommandKind; 6] = [
    CommandKind::Hold,
    CommandKind::Disarm,
    CommandKind::Enable,
    CommandKind::Resume,
    CommandKind::Arm(TrackId(1)),
    CommandKind::Confirm(TrackId(1)),
];

fn statements() -> impl Strategy<Value = Says> {
    let small = prop_oneof![4 => Just(0i64), 1 => -3_000_000i64..3_000_000];
    let rare = prop::bool::weighted(0.1);
    let flags = (prop::bool::weighted(0.2), any::<bool>(), prop::bool::weighted(0.15), any::<bool>(), rare);
    let moves = (0usize..5, 0u8..16, flags, prop_oneof![3 => 0u64..100, 1 => 0u64..2_500], small);
    moves.prop_map(|(mode, tracks, (failing, authority, others, heard, reboot), age, stamp)| Says {
        mode,
        tracks,
        failing,
        authority,
        others,
        heard,
        reboot,
        age,
        stamp,
    })
}

fn does() -> impl Strategy<Value = Does> {
    let kind = || prop::sample::select(&KINDS[..]);
    prop_oneof![
        3 => prop::sample::select(&[CommandKind::Hold, CommandKind::Disarm, CommandKind::Resume][..]).prop_map(Does::Now),
        2 => kind().prop_map(Does::Prepare),
        5 => Just(Does::PrepareFitting),
        6 => prop::bool::weighted(0.8).prop_map(Does::Confirm),
        1 => kind().prop_map(Does::ConfirmUnprepared),
        1 => Just(Does::Withdraw),
        4 => (0usize..8).prop_map(Does::Note),
        2 => Just(Does::NoteTrack),
        2 => (0usize..8).prop_map(Does::Shelve),
        1 => Just(Does::Silence),
        1 => Just(Does::Revoke),
        1 => prop::collection::vec(any::<u8>(), 0..200).prop_map(Does::Garbage),
        2 => Just(Does::Again),
    ]
}

fn moves() -> impl Strategy<Value = Vec<Move>> {
    let stage = prop::sample::select(
        &[CommandStage::Staged, CommandStage::Sent, CommandStage::Refused, CommandStage::Expired][..],
    );
    let one = prop_oneof![
        4 => prop_oneof![6 => 0u64..200, 1 => 0u64..12_000].prop_map(Move::Gap),
        8 => statements().prop_map(Move::Report),
        1 => (0usize..6).prop_map(Move::Replay),
        1 => statements().prop_map(Move::Kept),
        1 => Just(Move::Late),
        1 => statements().prop_map(Move::Forged),
        1 => any::<bool>().prop_map(Move::Session),
        1 => any::<bool>().prop_map(Move::Refused),
        4 => (0usize..3, stage).prop_map(|(back, stage)| Move::Stage(back, stage)),
        3 => (0usize..3, prop::bool::weighted(0.8), any::<bool>()).prop_map(|(b, is_own, no)| Move::Ack(b, is_own, no)),
        9 => does().prop_map(Move::Person),
    ];
    let hold = || [Move::Person(Does::Now(CommandKind::Hold)), Move::Gap(1_100)];
    let holds: Vec<Move> = std::iter::repeat_with(hold).take(20).flatten().collect();
    let some = prop_oneof![60 => one.prop_map(|one| vec![one]), 6 => order(), 1 => overtaken(), 1 => Just(holds), 1 => Just(crowd())];
    prop::collection::vec(some, 1..40).prop_map(|some| some.concat())
}

/// An order away from safe on its whole way to the unit's answer, now and then withdrawn on it, repeated by a key that
/// is held down, or given when the picture is old: by itself that much hardly ever comes together.
fn order() -> impl Strategy<Value = Vec<Move>> {
    let union = prop_oneof![
        6 => Just(vec![Does::PrepareFitting, Does::Confirm(true)]),
        2 => Just(vec![Does::PrepareFitting, Does::Confirm(true), Does::Withdraw]),
        3 => Just(vec![Does::PrepareFitting, Does::Confirm(false)]),
        1 => Just(vec![Does::NowFitting]),
        1 => Just(vec![Does::PrepareFitting, Does::Again, Does::Confirm(true), Does::Again]),
    ];
    let answered = prop_oneof![
        2 => Just(vec![]),
        1 => any::<bool>().prop_map(|refused| vec![Move::Ack(0, true, refused)]),
        1 => any::<bool>().prop_map(|first| vec![Move::Ack(0, true, first), Move::Ack(0, true, !first)]),
    ];
    let gap = prop_oneof![6 => Just(0u64), 1 => 250u64..2_500];
    (statements(), gap, union, answered).prop_map(|(statement, gap, moves, answered)| {
        let statement =
            Says { tracks: 1, failing: false, others: false, reboot: false, age: 20, stamp: 0, ..statement };
        let moves = moves.into_iter().map(Move::Person);
        let before = [Move::Report(statement), Move::Gap(gap)];
        before.into_iter().chain(moves).chain([Move::Stage(0, CommandStage::Staged)]).chain(answered).collect()
    })
}

/// A report that is overtaken by a later one.
fn overtaken() -> impl Strategy<Value = Vec<Move>> {
    let young = |statement: Says| Says { age: 20, stamp: 0, reboot: false, ..statement };
    (statements(), statements()).prop_map(move |(first, second)| {
        vec![Move::Kept(young(first)), Move::Gap(1), Move::Report(young(second)), Move::Late]
    })
}

/// More tracks than are kept once they are lost.
fn crowd() -> Vec<Move> {
    let statement = Says {
        mode: 1,
        tracks: 0,
        failing: false,
        authority: false,
        others: true,
        heard: false,
        reboot: false,
        age: 20,
        stamp: 0,
    };
    // Each is later than the one before, or it would not be newer.
    let report = || [Move::Report(statement.clone()), Move::Gap(1)];
    std::iter::repeat_with(report).take(9).flatten().collect()
}

/// Sequences that a property is tried with; `HOLDSAFE_CASES` asks for another number.
const CASES: u32 = 16;

/// Runs sequences in every role, and asks after each move of each whether `holds`.
pub(crate) fn always(holds: impl Fn(&Step<'_>) -> Result<(), TestCaseError>) {
    let cases = std::env::var("HOLDSAFE_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES);
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    let roles = prop::sample::select(&[Role::Supervise, Role::Supervise, Role::Operate, Role::View][..]);
    let outcome = proptest::test_runner::TestRunner::new(config)
        .run(&(roles, moves()), |(role, moves)| check_sequence(role, &moves, &holds));
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

/// Asks after each move of one sequence whether `holds`.
pub(crate) fn check_sequence(
    role: Role,
    moves: &[Move],
    holds: &impl Fn(&Step<'_>) -> Result<(), TestCaseError>,
) -> Result<(), TestCaseError> {
    let mut world = World::new(role);
    for moved in moves {
        let before = world.bench.console.shown(world.bench.now);
        let (requested, events) = (world.bench.asked.len(), world.bench.events.len());
        let act = world.happens(moved);
        let after = world.bench.console.shown(world.bench.now);
        let (asked, events) = (&world.bench.asked[requested..], &world.bench.events[events..]);
        let step = Step { world: &world, moved, before: &before, after: &after, act, asked, events };
        holds(&step)?;
    }
    Ok(())
}

/// An order that the gateway refuses, of which note is taken, and that the unit refuses after that.
pub(crate) fn refused_by_both() -> Vec<Move> {
    let statement = Says {
        mode: 4,
        tracks: 1,
        failing: false,
        authority: false,
        others: false,
        heard: false,
        reboot: false,
        age: 20,
        stamp: 0,
    };
    vec![
        Move::Report(statement),
        Move::Person(Does::PrepareFitting),
        Move::Person(Does::Confirm(true)),
        Move::Stage(0, CommandStage::Staged),
        Move::Stage(0, CommandStage::Refused),
        Move::Person(Does::Note(1)),
        Move::Gap(1),
        Move::Ack(0, true, true),
    ]
}

fn fitting(mode: Mode) -> CommandKind {
    match mode {
        Mode::Idle | Mode::Degraded => CommandKind::Enable,
        Mode::Ready => CommandKind::Arm(TrackId(1)),
        Mode::PrepareToAct => CommandKind::Confirm(TrackId(1)),
        Mode::HoldSafe => CommandKind::Resume,
    }
}

impl World {
    fn new(role: Role) -> Self {
        Self {
            bench: Bench::seating(role),
            role,
            told: Vec::new(),
            kept: Vec::new(),
            answered: Vec::new(),
            staged: Vec::new(),
            withdrawn: Vec::new(),
            counted: [0; 2],
            fed: None,
            boot: 1,
            sequence: 0,
            serial: 0,
            last: None,
        }
    }

    /// Applies the move; returns the act, if a person did a readable one.
    fn happens(&mut self, moved: &Move) -> Option<Act> {
        match moved {
            Move::Gap(ms) => self.bench.pass(Span::ms(*ms)),
            Move::Report(says) => {
                let heard = self.made(says, NodeId::UNIT_A);
                self.deliver(heard, Span::ms(says.age));
            }
            Move::Forged(says) => {
                let heard = self.made(says, NodeId::UNIT_B);
                self.deliver(heard, Span::ms(says.age));
            }
            Move::Kept(says) => {
                let heard = self.made(says, NodeId::UNIT_A);
                self.kept.push(heard);
            }
            Move::Late => {
                if let Some(heard) = self.kept.pop() {
                    let age = self.bench.now.since(heard.made);
                    self.deliver(heard, age);
                }
            }
            Move::Replay(back) => {
                if let Some(heard) = self.told.iter().rev().nth(*back) {
                    let signed = heard.signed.clone();
                    self.bench.heard_as(&signed, UnitId::A, Some(Span::ZERO), self.bench.now);
                    self.fed = Some(self.bench.now);
                }
            }
            Move::Session(open) => self.feed(&Feed::Session(PeerId::UNIT_A, *open)),
            Move::Refused(known) => {
                // As many again as before, and one: not all are reported.
                let counted = &mut self.counted[usize::from(*known)];
                *counted = *counted * 2 + 1;
                let counted = *counted;
                self.feed(&Feed::Refused(Reason::Stale, known.then_some(PeerId::UNIT_B), counted));
            }
            Move::Stage(back, stage) => self.stage(*back, *stage),
            Move::Ack(back, own, refused) => self.acknowledge(*back, *own, *refused),
            Move::Person(does) => return self.person(does),
        }
        None
    }

    fn feed(&mut self, message: &Feed<'_>) {
        self.fed = Some(self.bench.now);
        self.bench.feed(message);
    }

    /// A report that says this, made now or as long ago as it says.
    fn made(&mut self, statement: &Says, author: NodeId) -> Told {
        if statement.reboot {
            (self.boot, self.sequence) = (self.boot + 1, 0);
        }
        self.sequence += 1;
        let now = self.bench.now;
        let stamp = (now.0 as i64 + statement.stamp).max(1) as u64;
        let made = (now - Span::ms(statement.age)).max(Instant(stamp));
        let report = self.bench.with_challenge(self.reported(statement, stamp));
        Told { signed: sign(author, &report), report, made, forged: author != NodeId::UNIT_A }
    }

    /// The gateway passes it on as so old.
    fn deliver(&mut self, heard: Told, age: Span) {
        self.bench.heard_as(&heard.signed, UnitId::A, Some(age), self.bench.now);
        self.fed = Some(self.bench.now);
        self.told.push(heard);
    }

    fn reported(&self, statement: &Says, stamp: u64) -> Report {
        let bare = report(self.sequence, stamp, Mode::ALL[statement.mode]);
        let track = bare.tracks.0[0];
        // Each report has every track at its own place.
        let place = |id: u32| ((self.told.len() + self.kept.len()) * 16) as i32 + id as i32;
        let track = |id: u32| ReportedTrack { id: TrackId(id), x_mm: place(id), ..track };
        let new = 100 + (self.told.len() + self.kept.len()) as u32 * 8;
        let few = (1..5u32).filter(|id| statement.tracks & 1 << (id - 1) != 0);
        let ids: Vec<u32> = if statement.others { (new..new + 8).collect() } else { few.collect() };
        let last = self.bench.intents().last().map(|(intent, _)| (intent.id, None));
        Report {
            boot: Boot(self.boot),
            sequence: Sequence(self.sequence),
            stamp: PeerStamp(stamp),
            failing: if statement.failing { Guards(1) } else { Guards::default() },
            authority: statement.authority.then_some(ReportedAuthority { track: TrackId(1), left: Span::s(3) }),
            last_command: last.filter(|_| statement.heard),
            tracks: ids.into_iter().map(track).collect::<List<_, 8>>(),
            ..bare
        }
    }

    fn stage(&mut self, back: usize, stage: CommandStage) {
        let Some((_, bytes)) = self.bench.intents().into_iter().rev().nth(back) else { return };
        if stage == CommandStage::Staged {
            self.staged.push(Sha256::digest(&bytes).into());
        }
        self.fed = Some(self.bench.now);
        self.bench.staged(&bytes, stage);
    }

    fn acknowledge(&mut self, back: usize, is_own: bool, refused: bool) {
        let Some((intent, bytes)) = self.bench.intents().into_iter().rev().nth(back) else { return };
        let hash: IntentHash = Sha256::digest(&bytes).into();
        let refused = refused.then_some(Reason::Interlock);
        let ack = Ack { id: intent.id, intent: hash, refused, mode: Mode::Idle, due: None };
        if is_own {
            self.answered.push((hash, refused.is_none()));
        }
        self.fed = Some(self.bench.now);
        self.bench.acknowledged(if is_own { NodeId::UNIT_A } else { NodeId::UNIT_B }, &ack);
    }

    fn person(&mut self, does: &Does) -> Option<Act> {
        let shown = self.bench.console.shown(self.bench.now);
        let command = |kind: &CommandKind| Order::Command(UnitId::A, *kind);
        let reason = Text::new("as planned");
        let act = match does {
            Does::Now(kind) => Act::Now(command(kind)),
            Does::NowFitting => Act::Now(command(&fitting(shown.units.first()?.state.get().0.mode))),
            Does::Prepare(kind) => Act::Prepare(command(kind)),
            Does::PrepareFitting => Act::Prepare(command(&fitting(shown.units.first()?.state.get().0.mode))),
            Does::Confirm(with) => Act::Confirm(shown.prepared?.order, if *with { reason } else { Text::new("") }),
            Does::ConfirmUnprepared(kind) => Act::Confirm(command(kind), reason),
            Does::Withdraw => Act::Withdraw,
            Does::Note(which) => shown.alarms.get(*which).map(|group| Act::Acknowledge(group.cause, group.since))?,
            Does::NoteTrack => {
                let unit = shown.unit(UnitId::A)?;
                let lost = unit.lost.first()?;
                Act::Acknowledge(Alarm::TrackLost(UnitId::A, lost.boot, lost.track.get().0.id), lost.since)
            }
            Does::Shelve(which) => {
                let group = shown.alarms.get(*which)?;
                Act::Shelve(group.cause, group.since, Shelf::Minute, reason)
            }
            Does::Silence => Act::Silence,
            Does::Revoke => Act::Prepare(Order::Revoke(NodeId::OPERATOR_2)),
            Does::Garbage(bytes) => {
                self.bench.give(&Input::Act { bytes: bytes.clone() });
                return None;
            }
            Does::Again => {
                let act = self.last?;
                self.give(act);
                return Some(act);
            }
        };
        self.serial += 1;
        self.last = Some(act);
        self.give(act);
        Some(act)
    }

    fn give(&mut self, act: Act) {
        self.bench.give(&Input::Act { bytes: codec::encode(&Numbered { serial: self.serial, act }) });
        let done = self.bench.console.shown(self.bench.now).answers.last().is_some_and(|answer| answer.outcome.is_ok());
        if done && matches!(act, Act::Withdraw | Act::Now(_)) {
            let outgoing = self.bench.intents().into_iter().filter(|(intent, _)| !intent.kind.towards_safe());
            self.withdrawn.extend(outgoing.map(|(_, bytes)| IntentHash::from(Sha256::digest(&bytes))));
        }
    }

    /// True if this alarm was acknowledged.
    pub(crate) fn noted(&self, wanted: &Alarm) -> bool {
        self.bench.events.iter().any(|(_, event)| {
            matches!(event, Event::Act { act: Some(Act::Acknowledge(alarm, _)), refused: None, .. } if alarm == wanted)
        })
    }

    /// The act that confirmed an intent's command, by the events so far.
    pub(crate) fn given_by(&self, intent: &Intent) -> Option<Act> {
        self.bench.events.iter().find_map(|(_, event)| match event {
            Event::Act { act, command: Some(id), .. } if *id == intent.id => *act,
            _ => None,
        })
    }
}
