//! `holdsafe watch --sensors RUN`: the sensor frames of a live run's unit, and the stages' detections in them, in a
//! window beside the operator's.
//!
//! It reads perception's input journal while it grows, as `watch` reads the console's: no second subscriber on the
//! unit's bus, no key and no access to the run. Only frames that perception used are shown. The stages run once more,
//! here, so that the marks are the detections of this program's own stages.

use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use console::process::open;
use console::sidecar::Sight;
use console::source::{Sensed, Sensors};
use export::LARGEST;
use link::clock::trace_us;
use link::drive::FLUSH_EVERY;
use link::input_journal::{Entry, JournalError};
use parallel::progress::Stop;
use perception::stages::Stages;
use recording::RunFolder;
use recording::find::find_one_run;
use runner::Context;
use runner::failure::{Exit, Failure};
use wire::bus::body;
use wire::codec::decode;
use wire::core::{Input, Output, Topic};
use wire::id::{Boot, NodeId};
use wire::sensor::Frames;
use wire::time::{Instant, Span};

use super::Args;
use super::follow::Follow;
use super::frame::sights;

/// Time between two looks for new entries.
const LOOKS_EVERY: Duration = Duration::from_millis(50);
/// Number of first frames with an unknown age: before at least one of them the writer did not stand still.
const SETTLED: usize = 5;
/// Boot numbers of perception: that of the first start, and that of a restart.
const BOOTS: [Boot; 2] = [Boot(1), Boot(2)];

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let run = find_one_run(&args.run)?;
    let mut frames = Newest::open(&run)?;
    let first = frames.look(trace_us())?;
    if frames.finished {
        let run = run.path().display();
        let remedy = format!("{run} is over: `holdsafe watch --window {run}` shows its recording");
        return Err(Failure::new(Exit::NoEvidence, remedy));
    }
    open::probe().map_err(|window| Failure::new(Exit::Environment, window.to_string()))?;
    let stages = args.bring.stages()?;
    let slot = Arc::new(Mutex::new(Slot::default()));
    let (shared, stop) = (Arc::clone(&slot), context.stop.clone());
    let reading = std::thread::Builder::new().name("frames".into()).spawn(move || {
        let closes = Closes(&shared);
        let ended = read(&mut frames, first, &stages, &shared, &stop);
        if let Err(failure) = &ended {
            // The window stays open and shows why the frames have stopped.
            lock(&shared).trouble = Some(failure.to_string());
            std::mem::forget(closes);
        }
        ended
    })?;
    let shown = open::sensors(Box::new(Reading { slot: Arc::clone(&slot), stop: context.stop.clone() }));
    lock(&slot).over = true;
    let ended = reading.join().map_err(|_| Failure::internal("the thread that reads frames has ended"))?;
    shown.map_err(|window| Failure::new(Exit::Environment, window.to_string()))?;
    ended?;
    Ok(if context.stop.is_requested() { Exit::Interrupted } else { Exit::Fine })
}

/// The last frame read.
#[derive(Default)]
struct Slot {
    newest: Option<Read>,
    trouble: Option<String>,
    over: bool,
}

/// A processed frame and its times on this program's clock: `seen` bounds its age from below, `taken` from above, once
/// that is known.
#[derive(Clone)]
struct Read {
    sights: Arc<[Sight]>,
    seen: u64,
    taken: Option<u64>,
}

fn lock(slot: &Mutex<Slot>) -> MutexGuard<'_, Slot> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Closes the window when the reading thread ends, for whatever reason.
struct Closes<'s>(&'s Mutex<Slot>);

impl Drop for Closes<'_> {
    fn drop(&mut self) {
        lock(self.0).over = true;
    }
}

/// The window's access to the reader.
struct Reading {
    slot: Arc<Mutex<Slot>>,
    stop: Stop,
}

impl Sensors for Reading {
    fn newest(&mut self) -> Option<Sensed> {
        let Read { sights, seen, taken } = lock(&self.slot).newest.clone()?;
        let since = |then: u64| Span(trace_us().saturating_sub(then));
        Some(Sensed { sights, at_least: since(seen), at_most: taken.map(since) })
    }

    fn trouble(&mut self) -> Option<String> {
        lock(&self.slot).trouble.clone()
    }

    fn is_ended(&mut self) -> bool {
        lock(&self.slot).over || self.stop.is_requested()
    }
}

/// Reads until the run ends, the window is closed, or the user stops it.
fn read(
    frames: &mut Newest,
    first: Option<Frame>,
    stages: &Stages,
    slot: &Mutex<Slot>,
    stop: &Stop,
) -> Result<(), Failure> {
    let (_nobody, pause) = channel::<()>();
    let mut frame = first;
    while !frames.finished && !stop.is_requested() && !lock(slot).over {
        if let Some(Frame { bytes, seen, taken }) = frame.take() {
            let sights = sights(&bytes, stages);
            let mut slot = lock(slot);
            slot.trouble = sights.is_none().then(|| "a frame came that cannot be read".to_owned());
            slot.newest = sights.map(|sights| Read { sights: sights.into(), seen, taken }).or(slot.newest.take());
        }
        // The channel has no sender: this is a sleep.
        let _ = pause.recv_timeout(LOOKS_EVERY);
        frame = frames.look(trace_us())?;
    }
    Ok(())
}

/// A frame, the time at which it was seen in the log, and its earliest time of capture, on this program's clock.
struct Frame {
    bytes: Vec<u8>,
    seen: u64,
    taken: Option<u64>,
}

/// The newest frame in the logs of a run's perception.
struct Newest {
    run: RunFolder,
    boot: usize,
    log: Follow,
    /// A frame that came in and has had no outcome yet.
    waiting: Option<(Instant, Vec<u8>)>,
    lag: Lag,
    finished: bool,
}

impl Newest {
    /// Opens the newest run's perception channel, of the process that was started last.
    fn open(run: &RunFolder) -> Result<Self, Failure> {
        let started = |boot: &usize| path(run, BOOTS[*boot]).exists();
        let boot = (0..BOOTS.len()).rev().find(started).unwrap_or_default();
        let path = path(run, BOOTS[boot]);
        let log = Follow::open(&path).map_err(|error| unread(&path, &error))?;
        Ok(Self { run: run.clone(), boot, log, waiting: None, lag: Lag::default(), finished: false })
    }

    /// The newest frame that perception used and that was not there at the last look; it is `stamp`, on this program's
    /// clock. A refused frame is not returned: perception gives tracks for every frame that it uses.
    fn look(&mut self, stamp: u64) -> Result<Option<Frame>, Failure> {
        let (mut newest, waiting, finished) = (None, &mut self.waiting, &mut self.finished);
        let looked = self.log.news(|entry| match entry {
            Entry::Input { now, input: Input::Bus { topic: Topic::Frames, bytes } } => *waiting = Some((now, bytes)),
            Entry::Output(Output::Bus { topic: Topic::Tracks, .. }) => newest = waiting.take().or(newest.take()),
            Entry::Input { input, .. } => {
                *waiting = None;
                *finished |= matches!(input, Input::Finish);
            }
            // A thinned log shows the newest kept frame, and none for tracks of another.
            Entry::LeftOut { .. } => *waiting = None,
            Entry::Output(_) => {}
        });
        looked.map_err(|error| unread(&path(&self.run, BOOTS[self.boot]), &error))?;
        let seen = trace_us().max(stamp);
        let frame = newest.map(|(now, bytes)| {
            let time = body(&bytes)
                .and_then(|payload| decode::<Frames<'_>>(payload, LARGEST).ok())
                .map_or(now, |frames| frames.stamp);
            Frame { taken: self.lag.taken_at(now, time.min(now), seen), bytes, seen }
        });
        self.lag.looked = Some(stamp);
        if let Some(boot) = BOOTS.get(self.boot + 1)
            && let Ok(next) = Follow::open(&path(&self.run, *boot))
        {
            (self.log, self.boot, self.lag, self.waiting) = (next, self.boot + 1, Lag::default(), None);
        }
        Ok(frame)
    }
}

fn path(run: &RunFolder, boot: Boot) -> PathBuf {
    run.input_journal(NodeId::PERCEPTION, boot)
}

fn unread(path: &Path, error: &JournalError) -> Failure {
    Failure::new(Exit::NoEvidence, format!("{}: {error}", path.display()))
}

/// Offset from the vehicle's clock to this program's. An entry that was not in the log at the last look was written
/// after that, or lay in the writer's buffer for at most one flush period: so each frame gives a least value of how far
/// this clock is ahead. It is too great where the writer stood still, so the least of all counts.
#[derive(Default)]
struct Lag {
    least: Option<i128>,
    seen: usize,
    looked: Option<u64>,
}

impl Lag {
    /// Earliest time at which a reading of `stamp` was taken, in a frame that came in at `now` and is seen at `seen`;
    /// unknown for the first [`SETTLED`], whose writer may have stood still.
    fn taken_at(&mut self, now: Instant, stamp: Instant, seen: u64) -> Option<u64> {
        let looked = self.looked?;
        let written = i128::from(looked.min(seen)) - FLUSH_EVERY.as_micros() as i128;
        let ahead = written - i128::from(now.0);
        let least = self.least.map_or(ahead, |least| least.min(ahead));
        (self.least, self.seen) = (Some(least), self.seen.saturating_add(1));
        u64::try_from(i128::from(stamp.0) + least).ok().filter(|_| self.seen > SETTLED)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use link::input_journal::{Header, Writer};

    use super::*;

    /// Seen late or taken in late, on any offset of its clock.
    #[test]
    fn late_reading_is_never_shown_younger() {
        let flush = FLUSH_EVERY.as_micros() as u64;
        for offset in [0, 7_000_000] {
            let mut lag = Lag::default();
            // A frame that came in, at a time of this clock, of a reading before that, seen in the second of two looks.
            let mut age = |came: u64, before: u64, looks: [u64; 2]| {
                lag.looked = Some(looks[0]);
                let instant = |time: u64| Instant(time + offset);
                Some(looks[1] - lag.taken_at(instant(came), instant(came - before), looks[1])?)
            };
            assert_eq!(age(1_000_000, 0, [8_900_000, 9_000_000]), None, "what lay there for eight seconds");
            for came in (9_000_000..).step_by(100_000).take(SETTLED - 1) {
                assert_eq!(age(came, 0, [came - 20_000, came + 30_000]), None);
            }
            // The log did not have it 20 ms before it came in: that much is unknown, plus one flush period.
            let unknown = flush + 20_000;
            assert_eq!(age(10_000_000, 0, [9_980_000, 10_030_000]), Some(30_000 + unknown));
            assert_eq!(age(10_100_000, 250_000, [10_090_000, 10_130_000]), Some(280_000 + unknown), "an old reading");
            assert_eq!(age(10_200_000, 0, [12_200_000, 12_230_000]), Some(2_030_000 + unknown), "a writer that stood");
        }
        assert_eq!(Lag::default().taken_at(Instant(5), Instant(5), 9), None, "the first look");
    }

    /// The newest frame that perception used is found, and after it frames of a perception that was started again.
    #[test]
    fn newest_used_frame_is_found_after_restarts() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("inputs")).unwrap();
        let run = RunFolder::new(folder.path());
        let write = |boot: u32, frames: &[(u8, bool)], ends: bool| {
            let mut bytes = Vec::new();
            let header = Header { node: NodeId::PERCEPTION, boot: Boot(1), started: Instant(0) };
            let mut log = Writer::new(&mut bytes, header, 1 << 20).unwrap();
            for (frame, taken) in frames {
                let input = Input::Bus { topic: Topic::Frames, bytes: vec![*frame; 3] };
                log.input(Instant(u64::from(*frame)), &input).unwrap();
                if *taken {
                    log.output(&Output::Bus { topic: Topic::Tracks, bytes: vec![0] }).unwrap();
                }
            }
            if ends {
                log.input(Instant(99), &Input::Finish).unwrap();
            }
            std::fs::File::create(path(&run, Boot(boot))).unwrap().write_all(&bytes).unwrap();
        };
        write(1, &[(1, true), (2, true), (3, false)], false);
        let mut newest = Newest::open(&run).unwrap();
        let mut look = || newest.look(7).unwrap().map(|frame| frame.bytes);
        assert_eq!((look(), look()), (Some(vec![2; 3]), None), "the third was refused");
        write(2, &[(7, true), (8, true), (9, false)], true);
        assert_eq!((look(), look()), (None, Some(vec![8; 3])));
        assert!(newest.finished);
        let of_a_whole = Newest::open(&run).unwrap().look(7).unwrap().unwrap();
        assert_eq!(of_a_whole.bytes, vec![8; 3]);
        // The second and the fourth are left out; the third was refused.
        write(1, &[(1, true), (2, true), (3, false), (4, true)], true);
        std::fs::remove_file(path(&run, Boot(2))).unwrap();
        let whole = std::fs::read(path(&run, Boot(1))).unwrap();
        let mut thinned = Vec::new();
        link::input_journal::thin(link::input_journal::Reader::new(whole.as_slice()).unwrap(), &mut thinned, 2)
            .unwrap();
        std::fs::write(path(&run, Boot(1)), thinned).unwrap();
        let kept = Newest::open(&run).unwrap().look(7).unwrap().unwrap();
        assert_eq!(kept.bytes, vec![1; 3], "of the third perception said nothing");
        write(2, &[(7, true), (8, true), (9, false)], true);
        let mut later = Newest::open(&run).unwrap();
        assert!(later.look(7).unwrap().is_some() && later.finished, "one look tells that it is over");
    }
}
