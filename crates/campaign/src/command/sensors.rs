//! `holdsafe sensors RUN`: what the sensors of a live run's unit give, and what the stages find in it, in a window beside the operator's.
//!
//! It reads perception's mouth log while it grows, as `watch` reads the console's: no second subscriber on the unit's bus, no key and no
//! hand in the run. The stages are asked once more, here, so that what is marked is what this program's own stages find.

use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use console::beside::Sight;
use console::gui::sensors::{self, Sensed, Sensors};
use link::clock::trace_us;
use link::mouth::{Entry, MouthError};
use perception::stages::Stages;
use wire::core::{Input, Topic};
use wire::id::NodeId;
use wire::time::{Instant, Span};

use super::Context;
use super::bring::Bring;
use super::failure::{Exit, Failure};
use super::follow::Follow;
use super::frame::sights;
use crate::progress::Stop;

/// How often it is looked whether there is more.
const LOOKS_EVERY: Duration = Duration::from_millis(50);
/// What is taken in may lie in the writer's buffer for this long, and then until it is looked for, microseconds.
const UNSEEN_US: u64 = 100_000 + 50_000;
/// After so many frames one of them has been seen as soon as it could be.
const SETTLED: usize = 5;
/// Perception's log, and that of a perception that was started again.
const BOOTS: [&str; 2] = ["", "-2"];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run's directory, as given to `live --out`.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// With a detector of one's own: what that sees is marked.
    #[command(flatten)]
    bring: Bring,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let mut frames = Newest::open(&args.run)?;
    let first = frames.look()?;
    if frames.finished {
        let run = args.run.display();
        let remedy = format!("{run} is over: `holdsafe console {run}` shows its recording, and what the sensors gave");
        return Err(Failure::new(Exit::NoEvidence, remedy));
    }
    link::display::Environment::own().probe().map_err(|why| Failure::new(Exit::Environment, why.to_string()))?;
    let stages = args.bring.stages()?;
    let slot = Arc::new(Mutex::new(Slot::default()));
    let (shared, stop) = (Arc::clone(&slot), context.stop.clone());
    let reading = std::thread::Builder::new().name("frames".into()).spawn(move || {
        let ended = read(&mut frames, first, &stages, &shared, &stop);
        lock(&shared).over = true;
        ended
    })?;
    let shown = sensors::run(Box::new(Reading(Arc::clone(&slot))));
    lock(&slot).over = true;
    let ended = reading.join().map_err(|_| Failure::internal("the thread that reads frames has ended"))?;
    shown.map_err(|why| Failure::new(Exit::Environment, why))?;
    ended?;
    Ok(if context.stop.asked() { Exit::Interrupted } else { Exit::Fine })
}

/// What was read last.
#[derive(Default)]
struct Slot {
    /// It, and when it was taken in at the earliest, on this program's clock, once that is known.
    newest: Option<(Arc<[Sight]>, Option<u64>)>,
    over: bool,
}

fn lock(slot: &Mutex<Slot>) -> std::sync::MutexGuard<'_, Slot> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Reading(Arc<Mutex<Slot>>);

impl Sensors for Reading {
    fn newest(&mut self) -> Option<Sensed> {
        let (sights, taken) = lock(&self.0).newest.clone()?;
        Some(Sensed { sights, age: taken.map(|taken| Span(trace_us().saturating_sub(taken))) })
    }

    fn over(&mut self) -> bool {
        lock(&self.0).over
    }
}

/// Reads until the run ends, the window is closed, or a person asks.
fn read(
    frames: &mut Newest,
    first: Option<Frame>,
    stages: &Stages,
    slot: &Mutex<Slot>,
    stop: &Stop,
) -> Result<(), Failure> {
    let (_nobody, pause) = channel::<()>();
    let mut frame = first;
    while !frames.finished && !stop.asked() && !lock(slot).over {
        if let Some(frame) = frame.take()
            && let Some(sights) = sights(&frame.bytes, stages)
        {
            lock(slot).newest = Some((sights.into(), frame.taken));
        }
        // Nobody sends: this waits for its time.
        let _ = pause.recv_timeout(LOOKS_EVERY);
        frame = frames.look()?;
    }
    Ok(())
}

/// A frame, and when perception took it in at the earliest, on this program's clock, once that is known.
struct Frame {
    bytes: Vec<u8>,
    taken: Option<u64>,
}

/// The newest frame in the logs of a run's perception.
struct Newest {
    run: PathBuf,
    boot: usize,
    log: Follow,
    shortest: Shortest,
    finished: bool,
}

impl Newest {
    fn open(run: &Path) -> Result<Self, Failure> {
        let path = path(run, BOOTS[0]);
        let log = Follow::open(&path).map_err(|why| unread(&path, &why))?;
        Ok(Self { run: run.to_owned(), boot: 0, log, shortest: Shortest::default(), finished: false })
    }

    /// The newest frame that has come since the last look.
    fn look(&mut self) -> Result<Option<Frame>, Failure> {
        let (mut newest, mut finished) = (None, false);
        let looked = self.log.news(|entry| match entry {
            Entry::Input { now, input: Input::Bus { topic: Topic::Frames, bytes } } => newest = Some((now, bytes)),
            Entry::Input { input: Input::Finish, .. } => finished = true,
            Entry::Input { .. } | Entry::Output(_) => {}
        });
        looked.map_err(|why| unread(&path(&self.run, BOOTS[self.boot]), &why))?;
        self.finished = finished;
        let frame = newest.map(|(now, bytes)| Frame { bytes, taken: self.shortest.taken(now, trace_us()) });
        if let Some(boot) = BOOTS.get(self.boot + 1)
            && let Ok(next) = Follow::open(&path(&self.run, boot))
        {
            (self.log, self.boot, self.shortest) = (next, self.boot + 1, Shortest::default());
        }
        Ok(frame)
    }
}

fn path(run: &Path, boot: &str) -> PathBuf {
    run.join("mouth").join(format!("{}{boot}.cbor", NodeId::PERCEPTION))
}

fn unread(path: &Path, why: &MouthError) -> Failure {
    Failure::new(Exit::NoEvidence, format!("{}: {why}", path.display()))
}

/// From perception's clock to this program's. What lies between the two is not known, so it is taken from the frame that was seen soonest
/// after it was taken in: that one was seen after [`UNSEEN_US`] at most, and every other is as much older as it was seen later.
#[derive(Default)]
struct Shortest {
    took: Option<i128>,
    seen: usize,
}

impl Shortest {
    /// When a frame that was taken in at `now`, on perception's clock, and is seen at `seen` was taken in at the earliest; not known of
    /// the first [`SETTLED`], which may have lain there for long.
    fn taken(&mut self, now: Instant, seen: u64) -> Option<u64> {
        let took = i128::from(seen) - i128::from(now.0);
        let shortest = self.took.map_or(took, |shortest| shortest.min(took));
        (self.took, self.seen) = (Some(shortest), self.seen.saturating_add(1));
        let taken = i128::from(now.0) + shortest - i128::from(UNSEEN_US);
        u64::try_from(taken).ok().filter(|_| self.seen > SETTLED)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use link::mouth::{Header, Writer};
    use wire::id::Boot;

    use super::*;

    #[test]
    fn a_frame_that_is_seen_late_is_no_younger_for_it_whatever_perceptions_clock_shows() {
        for offset in [0, 7_000_000] {
            let mut shortest = Shortest::default();
            let mut age = |at: u64, seen: u64| Some(seen - shortest.taken(Instant(at + offset), seen)?);
            assert_eq!(age(1_000_000, 9_000_000), None, "what lay there when the log was opened");
            for at in (9_000_000..).step_by(100_000).take(SETTLED - 1) {
                assert_eq!(age(at, at + 30_000), None);
            }
            assert_eq!(age(10_000_000, 10_030_000), Some(UNSEEN_US));
            assert_eq!(age(10_100_000, 12_130_000), Some(UNSEEN_US + 2_000_000));
            assert_eq!(age(12_100_000, 12_140_000), Some(UNSEEN_US + 10_000));
            assert_eq!(age(12_200_000, 12_210_000), Some(UNSEEN_US), "one that was seen sooner");
        }
    }

    #[test]
    fn the_newest_frame_is_found_and_after_it_those_of_a_perception_that_was_started_again() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("mouth")).unwrap();
        let write = |boot: &str, frames: &[u8], ends: bool| {
            let mut bytes = Vec::new();
            let header = Header { node: NodeId::PERCEPTION, boot: Boot(1), started: Instant(0) };
            let mut log = Writer::new(&mut bytes, header, 1 << 20).unwrap();
            for frame in frames {
                let input = Input::Bus { topic: Topic::Frames, bytes: vec![*frame; 3] };
                log.input(Instant(u64::from(*frame)), &input).unwrap();
            }
            if ends {
                log.input(Instant(99), &Input::Finish).unwrap();
            }
            std::fs::File::create(path(folder.path(), boot)).unwrap().write_all(&bytes).unwrap();
        };
        write("", &[1, 2, 3], false);
        let mut newest = Newest::open(folder.path()).unwrap();
        let mut look = || newest.look().unwrap().map(|frame| frame.bytes);
        assert_eq!((look(), look()), (Some(vec![3; 3]), None));
        write("-2", &[7, 8], true);
        assert_eq!((look(), look()), (None, Some(vec![8; 3])));
        assert!(newest.finished);
    }
}
