//! A recording of a console, looked at again: the same core, fed its input journal, to any moment forward and back.
//!
//! The picture at a moment is what the core shows then, so ages grow between two inputs as they did. Copies of the core
//! are kept on the way, so that going back costs no more than a few hundred inputs. The acts of the person and the
//! script are in the journal; new ones are not possible. Drawing is left to `gui`.

use std::io::{BufReader, Read};
use std::path::Path;

use config::setup::Setup;
use link::input_journal::{self, Entry, JournalError};
use wire::core::{Core, Input, Output, Topic};
use wire::id::{Boot, NodeId, UnitId};
use wire::mode::Mode;
use wire::sign::Secret;
use wire::time::{Instant, Span};

use super::ProcessConfig;
use crate::moment::{self, Happened, MAX_MOMENTS, Moment};
use crate::shown::Shown;
use crate::{Console, ConsoleConfig, ConsoleError, picture, text};

/// The file of keys and settings needed to view the recording, beside it.
pub const READING: &str = "console.json";
/// The input journal of a console in the twin, beside it: the twin's other cores leave none.
pub const DISPLAY: &str = "display.cbor";
/// The longest that is read, bytes.
const MAX_READING: u64 = 1 << 20;
/// Inputs that are kept: hours of a console that is fed forty times a second.
const MAX_TURNS: usize = 1 << 20;
/// Inputs between two copies of the core, from which a seek starts.
const APART: usize = 512;
/// The file of true events, beside it: for viewers of the recording, never for a live console.
pub const TRUTH: &str = "truth.json";

/// A recording that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum PlayerError {
    /// The file needed to view it is missing.
    #[error("{0}; is this the folder of a run, or of one of its kept trials?")]
    Reading(String),
    /// The console's input journal cannot be read.
    #[error("the console's input journal: {0}")]
    Journal(#[from] JournalError),
    /// The core cannot be made.
    #[error(transparent)]
    Core(#[from] ConsoleError),
    /// The journal has no inputs.
    #[error("the recording is empty")]
    Empty,
}

impl ProcessConfig {
    /// The part of the configuration needed to view a recording of this console: public keys and the key of the feed,
    /// which is void once the run is over, and no other secret.
    #[must_use]
    pub fn to_read(&self) -> Self {
        let feed = self.setup.channels.iter().filter(|channel| channel.topic == Topic::Feed).cloned();
        let struck = self
            .setup
            .channels
            .iter()
            .filter(|channel| channel.topic != Topic::Feed)
            .map(|channel| config::setup::Channel { key: wire::bus::ChannelKey([0; 32]), ..channel.clone() });
        let channels = feed.chain(struck).collect();
        let revocations = self.config.revocations.iter().map(|(node, _)| (*node, Vec::new())).collect();
        Self {
            setup: Setup { secret: Secret([0; 32]), channels, ..self.setup.clone() },
            config: ConsoleConfig {
                operator_secret: Secret([0; 32]),
                revocations,
                script: Vec::new(),
                eye: None,
                ..self.config.clone()
            },
            window: self.window.clone(),
        }
    }
}

/// An input, and the console's outputs after it.
struct Turn {
    now: Instant,
    input: Input,
    said: Vec<Output>,
}

impl Turn {
    /// True if the replay needs this output: requests to the gateway, and answers to acts.
    fn needs(&self, output: &Output) -> bool {
        let act = matches!(self.input, Input::Act { .. });
        matches!(output, Output::Bus { .. }) || (act && matches!(output, Output::Audit { .. }))
    }
}

/// A recording and where in it we are.
pub struct Player {
    turns: Vec<Turn>,
    /// Copies of the core before every [`APART`]th turn.
    copies: Vec<Console>,
    console: Console,
    /// Turns that `console` has taken.
    taken: usize,
    at: Instant,
    moments: Vec<Moment>,
    /// Start of the run's time, on the console's clock.
    began: Instant,
    /// Time at which a unit was first shown in another mode than before.
    first_change: Option<Instant>,
    /// Time at which a unit was first shown to hold or to be degraded.
    first_loss: Option<Instant>,
    /// Reason for which the recording is INVALID, if it is.
    invalid: Option<String>,
}

impl Player {
    /// The player with every picture marked as INVALID.
    #[must_use]
    pub fn invalid(self, reason: String) -> Self {
        Self { invalid: Some(reason), ..self }
    }

    /// Opens the recording below `run_dir`, goes through it once, and stands where a unit is first shown to hold or to be
    /// degraded, else at the first true event, else at the first change of mode, else at its beginning.
    ///
    /// # Errors
    /// When something of it is missing or is no recording. One that ends within an entry is read up to there.
    pub fn open(run_dir: &Path) -> Result<(Self, ProcessConfig), PlayerError> {
        let path = run_dir.join(READING);
        let reading = |error: &dyn std::fmt::Display| PlayerError::Reading(format!("{}: {error}", path.display()));
        let file = link::files::open(&path).map_err(|e| reading(&e))?;
        let config: ProcessConfig = serde_json::from_reader(file.take(MAX_READING)).map_err(|e| reading(&e))?;
        let live = link::files::input_journal(run_dir, NodeId::CONSOLE, Boot(1));
        let log = if live.exists() { live } else { run_dir.join(DISPLAY) };
        let log = input_journal::Reader::new(BufReader::new(link::files::open(&log).map_err(JournalError::from)?))?;
        let header = log.header();
        let mut player = Self::new(&config, header.boot, header.started, turns(log)?)?;
        player.learn(truth(run_dir));
        let first_truth = player.moments.iter().find(|moment| moment.truth).map(|moment| moment.at);
        if let (None, Some(first)) = (player.first_loss, first_truth) {
            player.seek(first);
        }
        Ok((player, config))
    }

    fn new(config: &ProcessConfig, boot: Boot, started: Instant, turns: Vec<Turn>) -> Result<Self, PlayerError> {
        let setup = Setup { boot, ..config.setup.clone() };
        let console = Console::retrace(setup, config.config.clone(), started)?;
        let at = turns.first().ok_or(PlayerError::Empty)?.now;
        let (copies, moments) = (Vec::new(), Vec::new());
        let (began, first_change, first_loss, invalid) = (at, None, None, None);
        let mut player =
            Self { turns, copies, console, taken: 0, at, moments, began, first_change, first_loss, invalid };
        let mut before = player.shown();
        while player.taken < player.turns.len() {
            if player.taken.is_multiple_of(APART) {
                player.copies.push(player.console.clone());
            }
            player.take();
            let after = player.shown();
            player.mark(&before, &after);
            before = after;
        }
        let first = player.first_loss.or(player.first_change);
        player.seek(first.map_or(Span::ZERO, |time| time.since(player.begins())));
        Ok(player)
    }

    /// The unit that is displayed first.
    pub fn first(&self) -> UnitId {
        self.console.first()
    }

    /// Length of the recording.
    pub fn length(&self) -> Span {
        self.turns.last().map_or(Span::ZERO, |last| last.now.since(self.begins()))
    }

    /// Time at which the run ended, from its beginning: no unit is heard after it.
    pub fn over(&self) -> Span {
        let ended = self.turns.iter().find(|turn| matches!(turn.input, Input::Quiesce));
        ended.map_or(self.length(), |turn| turn.now.since(self.begins()))
    }

    /// Present position, from its beginning.
    pub fn position(&self) -> Span {
        self.at.since(self.begins())
    }

    /// Jump targets, in order; at most twice [`MAX_MOMENTS`].
    pub fn moments(&self) -> &[Moment] {
        &self.moments
    }

    /// The run's time began then, on the console's clock; until that is said, it counts from the recording's beginning.
    pub fn count_from(&mut self, began: Instant) {
        self.began = began;
    }

    /// Offset of the run's start from the recording's beginning.
    pub fn lead(&self) -> Span {
        self.began.since(self.begins())
    }

    /// The picture of that moment, marked as a replay, in which no command is possible.
    pub fn shown(&self) -> Shown {
        let mut shown = self.console.shown(self.at);
        (shown.marks.replay, shown.marks.began) = (true, Some(self.began));
        shown.marks.invalid.clone_from(&self.invalid);
        shown
    }

    /// The picture of that moment in words, and as one JSON object.
    pub fn words(&self) -> (String, String) {
        let shown = self.shown();
        (text::lines(&shown), picture::line(&shown))
    }

    /// Goes to this time from the beginning, or to the end where that is earlier.
    pub fn seek(&mut self, to: Span) {
        let to = self.begins() + to.min(self.length());
        let due = self.turns.partition_point(|turn| turn.now <= to);
        if due < self.taken {
            let copy = (due / APART).min(self.copies.len().saturating_sub(1));
            if let Some(console) = self.copies.get(copy) {
                (self.console, self.taken) = (console.clone(), copy * APART);
            }
        }
        while self.taken < due {
            self.take();
        }
        self.at = to;
    }

    /// Goes a given number of inputs on, or back. Inputs of one instant are passed together, for the picture is of an
    /// instant.
    pub fn step(&mut self, steps: i32) {
        let last = self.turns.len().saturating_sub(1);
        let index = if steps < 0 {
            self.turns.partition_point(|turn| turn.now < self.at)
        } else {
            self.turns.partition_point(|turn| turn.now <= self.at).saturating_sub(1)
        };
        let to = index.saturating_add_signed(steps as isize).min(last);
        if let Some(turn) = self.turns.get(to) {
            self.seek(turn.now.since(self.begins()));
        }
    }

    fn begins(&self) -> Instant {
        self.turns.first().map_or(self.at, |first| first.now)
    }

    /// Feeds the next input.
    fn take(&mut self) {
        let Some(turn) = self.turns.get(self.taken) else { return };
        self.console.handle(turn.now, &turn.input);
        while self.console.output().is_some() {}
        turn.said.iter().for_each(|output| self.console.apply_output(turn.now, output));
        (self.taken, self.at) = (self.taken + 1, turn.now);
    }

    fn mark(&mut self, before: &Shown, after: &Shown) {
        let at = after.at.since(self.begins());
        if self.first_change.is_none() && moment::mode_changed(before, after) {
            self.first_change = Some(after.at);
        }
        let lost = |shown: &Shown| {
            let modes = shown.units.iter().map(|unit| unit.state.get().0.mode);
            modes.filter(|mode| matches!(mode, Mode::HoldSafe | Mode::Degraded)).count()
        };
        if self.first_loss.is_none() && lost(after) > lost(before) {
            self.first_loss = Some(after.at);
        }
        let room = MAX_MOMENTS.saturating_sub(self.moments.len());
        let new = moment::changes(before, after).into_iter().take(room);
        self.moments.extend(new.map(|what| Moment { at, what, truth: false }));
    }

    /// Inserts the true events between the changes of the display.
    fn learn(&mut self, truth: Vec<Happened>) {
        let (begins, length) = (self.begins(), self.length());
        let moment = |happened: Happened| Moment {
            at: Instant(happened.at_us).since(begins).min(length),
            what: happened.what,
            truth: true,
        };
        self.moments.extend(truth.into_iter().take(MAX_MOMENTS).map(moment));
        self.moments.sort_by_key(|moment| moment.at);
    }
}

/// The true events, if they were kept: a recording can be viewed without them.
fn truth(run_dir: &Path) -> Vec<Happened> {
    let Ok(file) = link::files::open(&run_dir.join(TRUTH)) else { return Vec::new() };
    serde_json::from_reader(file.take(MAX_READING)).unwrap_or_default()
}

/// The inputs, each with the outputs that the replay needs.
fn turns<R: Read>(log: input_journal::Reader<R>) -> Result<Vec<Turn>, JournalError> {
    let mut turns: Vec<Turn> = Vec::new();
    for entry in log {
        match entry {
            Ok(Entry::Input { now, input }) if turns.len() < MAX_TURNS => {
                turns.push(Turn { now, input, said: Vec::new() });
            }
            Ok(Entry::Input { .. }) | Err(JournalError::Truncated { .. }) => break,
            // No console is fed sensor frames.
            Ok(Entry::LeftOut { .. }) => {}
            Ok(Entry::Output(output)) => {
                if let Some(last) = turns.last_mut().filter(|last| last.needs(&output)) {
                    last.said.push(output);
                }
            }
            Err(error) => return Err(error),
        }
    }
    Ok(turns)
}
