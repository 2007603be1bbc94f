//! `lab tamper`: detection of changes to a recording, all of them tried.
//!
//! The recording is of one run in the twin, written as the recorder of a live run writes it: flushed with every seal.

use std::fs;
use std::path::Path;
use std::sync::Mutex;

use adversary::insider::{InsiderRecorder, RecordedEntry};
use adversary::plan::Tampering;
use evidence::SCHEMA_VERSION;
use evidence::anchors::TrustAnchors;
use evidence::log::{Logged, by_recorder};
use link::instrument::Frame;
use link::recorder::Recording;
use parallel::progress::Progress;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use recording::log::LogVerifier;
use recording::log::sweep::{Detection, Sweep, is_seal};
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, engine, out, plan};
use serde::Serialize;
use topology::Topology;
use twin::verified::Verified;
use wire::id::NodeId;

/// Logs that a hostile recorder rewrites, of each kind.
const STORIES: u64 = 100;
/// Bytes that one piece of work changes.
const PIECE: usize = 256;
/// Misses that are named.
const NAMED: usize = 20;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scenario whose run is recorded, in the twin under --seed.
    #[arg(value_name = "SCENARIO", default_value = "nominal")]
    scenario: String,
    /// Number of other values to which each byte is changed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..))]
    values: u8,
}

/// One kind of change.
#[derive(Clone, Debug, Default, Serialize)]
struct Tally {
    n: u64,
    /// No recorded entry differs; of bytes, the digest of the whole file finds it alone.
    harmless: u64,
    /// A time was moved by less than the resolution of the check; the digest of the whole file finds it alone.
    retimed: u64,
    retimed_at_most_us: u64,
    /// An entry differs, and the digest of the whole file finds it alone.
    unchained: u64,
    /// Found by chains, signatures, heads or clocks.
    found: u64,
    /// Number of these reported at the entry itself or at the next of its chain.
    located: u64,
    missed: u64,
    /// The first that were missed, or found by the digest alone though an entry differs.
    misses: Vec<String>,
}

impl Tally {
    fn note(&mut self, detection: &Detection, change: impl FnOnce() -> String) {
        self.n += 1;
        match *detection {
            Detection::Harmless => self.harmless += 1,
            Detection::Retimed(shift_us) => {
                self.retimed += 1;
                self.retimed_at_most_us = self.retimed_at_most_us.max(shift_us);
            }
            Detection::Found { located } => {
                self.found += 1;
                self.located += u64::from(located);
            }
            Detection::Unchained | Detection::Missed => {
                let missed = *detection == Detection::Missed;
                self.missed += u64::from(missed);
                self.unchained += u64::from(!missed);
                if self.misses.len() < NAMED {
                    self.misses.push(change());
                }
            }
        }
    }

    fn add(&mut self, other: Tally) {
        self.n += other.n;
        self.harmless += other.harmless;
        self.retimed += other.retimed;
        self.retimed_at_most_us = self.retimed_at_most_us.max(other.retimed_at_most_us);
        self.found += other.found;
        self.located += other.located;
        self.missed += other.missed;
        self.unchained += other.unchained;
        self.misses.extend(other.misses);
        self.misses.truncate(NAMED);
    }
}

/// The file cut at every byte.
#[derive(Clone, Debug, Default, Serialize)]
struct Cuts {
    n: u64,
    /// The entries read are those written first, and everything up to the last seal before the cut is among them.
    recovered: u64,
    /// The loss is noticed; or there is none.
    found: u64,
    misses: Vec<usize>,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    scenario: String,
    seed: u64,
    entries: usize,
    bytes: usize,
    seals: usize,
    /// Number of other values to which each byte was changed.
    values: u8,
    /// Every byte of the file, each to values of its own that the seed draws.
    changes: Tally,
    deletions: Tally,
    /// Every entry once more behind itself, and once more somewhere.
    insertions: Tally,
    /// Neighbours; a seal may stand elsewhere among the entries of others, which is harmless.
    swaps: Tally,
    cuts: Cuts,
    /// Whole logs whose chains and seals were recomputed.
    rewritten: Tally,
    /// Logs that end at a seal.
    cut_at_a_seal: Tally,
}

/// Length of the file and number of entries after a seal.
type Sealed = (usize, usize);

/// A recording, and the inputs of its verification.
struct Recorded {
    file: Vec<u8>,
    sealed: Vec<Sealed>,
    topology: Topology,
    log: Vec<Logged>,
    anchors: TrustAnchors,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let of = recorded(context, args)?;
    let sweep = Sweep::new(&of.file, &of.anchors, Verified::default().shared()).map_err(Failure::internal)?;
    let n = sweep.entries();
    let changes = changes(context, &sweep, &of, args.values)?;
    let mut rng = ChaCha8Rng::seed_from_u64(context.seed);
    let (mut deletions, mut insertions, mut swaps) = (Tally::default(), Tally::default(), Tally::default());
    for i in 0..n {
        deletions.note(&sweep.deleted(i), || format!("entry {}", i + 1));
        let somewhere = rng.next_u64() as usize % (n + 1);
        for to in [i + 1, somewhere] {
            insertions.note(&sweep.inserted(i, to), || format!("entry {} before {}", i + 1, to + 1));
        }
        if i + 1 < n {
            swaps.note(&sweep.swapped(i), || format!("entries {} and {}", i + 1, i + 2));
        }
    }
    let measured = Measured {
        schema_version: SCHEMA_VERSION,
        scenario: args.scenario.clone(),
        seed: context.seed,
        entries: n,
        bytes: of.file.len(),
        seals: of.sealed.len(),
        values: args.values,
        changes,
        deletions,
        insertions,
        swaps,
        cuts: cuts(context, &sweep, &of)?,
        rewritten: rewrites(&of, Tampering::Rechain),
        cut_at_a_seal: rewrites(&of, Tampering::CutAtSeal),
    };
    match context.json {
        true => out::print_json("bench-tamper", &measured)?,
        false => show(&measured),
    }
    let tallies = [&measured.changes, &measured.deletions, &measured.insertions, &measured.swaps];
    let rewrites = [&measured.rewritten, &measured.cut_at_a_seal];
    let missed: u64 = tallies.iter().chain(&rewrites).map(|tally| tally.missed + tally.unchained).sum();
    Ok(if missed == 0 && measured.cuts.misses.is_empty() { Exit::Fine } else { Exit::Unexpected })
}

/// Runs it, and records it as a recorder does.
fn recorded(context: &Context, args: &Args) -> Result<Recorded, Failure> {
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, &args.scenario)?, &PlanOptions::default())?;
    let one = planned.first().filter(|_| !scenario.is_of_stacks());
    let one = one.ok_or_else(|| Failure::new(Exit::Usage, format!("`{}` has no run in the twin", args.scenario)))?;
    let run = engine::run_twin(&one.variation.scenario, &one.setup, context.seed)?;
    let log: Vec<Logged> = run.log;
    let folder = std::env::temp_dir().join(format!("holdsafe-tamper-{}", std::process::id()));
    let file = write(&folder, &log);
    let _ = fs::remove_dir_all(&folder);
    let (file, sealed) = file?;
    Ok(Recorded { file, sealed, topology: run.topology, log, anchors: run.anchors })
}

fn write(folder: &Path, log: &[Logged]) -> Result<(Vec<u8>, Vec<Sealed>), Failure> {
    let mut recording = Recording::new(folder.to_owned());
    let path = folder.join("audit-0.mcap");
    let mut sealed = Vec::new();
    for (i, logged) in log.iter().enumerate() {
        recording.write(Frame { trace_us: logged.at, node: logged.node, bytes: logged.bytes.clone() });
        if is_seal(logged) {
            recording.flush();
            sealed.push((fs::metadata(&path)?.len() as usize, i + 1));
        }
    }
    if recording.finish().lost > 0 {
        return Err(Failure::internal("the recording cannot be written"));
    }
    Ok((fs::read(&path)?, sealed))
}

fn changes(context: &Context, sweep: &Sweep<'_>, recorded: &Recorded, values: u8) -> Result<Tally, Failure> {
    let pieces = recorded.file.len().div_ceil(PIECE);
    let progress = Progress::new("pieces of 256 bytes", pieces, context.talk);
    let all = Mutex::new(vec![Tally::default(); pieces]);
    parallel::each(parallel::cores(), pieces, |piece| {
        stopped(context)?;
        let mut rng = ChaCha8Rng::seed_from_u64(context.seed);
        rng.set_stream(piece as u64 + 1);
        let mut tally = Tally::default();
        for at in (piece * PIECE..recorded.file.len()).take(PIECE) {
            let first = rng.next_u32() % 255;
            // Steps that share no factor with 255 come to each of its values once.
            for with in (0..u32::from(values)).map(|n| ((first + n * 97) % 255 + 1) as u8) {
                tally.note(&sweep.changed_byte(at, with), || format!("byte {at} ^ {with:#04x}"));
            }
        }
        if let Ok(mut all) = all.lock() {
            all[piece] = tally;
        }
        progress.step();
        Ok::<(), Failure>(())
    })?;
    progress.finish();
    let all = all.into_inner().map_err(|_| Failure::internal("a worker ended early"))?;
    Ok(all.into_iter().fold(Tally::default(), |mut sum, tally| {
        sum.add(tally);
        sum
    }))
}

/// Number of bytes at which the recording of a nominal run was cut, and of those after which everything up to the last seal was read.
pub(super) fn power_cuts(context: &Context) -> Result<(u64, u64), Failure> {
    let of = recorded(context, &Args { scenario: "nominal".to_owned(), values: 1 })?;
    let sweep = Sweep::new(&of.file, &of.anchors, Verified::default().shared()).map_err(Failure::internal)?;
    let cuts = cuts(context, &sweep, &of)?;
    Ok((cuts.n, cuts.n - cuts.misses.len() as u64))
}

fn cuts(context: &Context, sweep: &Sweep<'_>, recorded: &Recorded) -> Result<Cuts, Failure> {
    let mut cuts = Cuts::default();
    for length in 0..recorded.file.len() {
        if length % PIECE == 0 {
            stopped(context)?;
        }
        let sealed = recorded.sealed.iter().rev().find(|(end, _)| *end <= length).map_or(0, |(_, entries)| *entries);
        let recovered = sweep.cut(length).is_some_and(|read| read >= sealed);
        // Verifying takes longer than reading: it is done at every seal, and at every `PIECE`th length between.
        let judged = recorded.sealed.iter().any(|(end, _)| *end == length) || length % PIECE == 0;
        let found = !judged || sweep.cut_is_found(length);
        cuts.n += 1;
        cuts.recovered += u64::from(recovered);
        cuts.found += u64::from(judged && found);
        if !(recovered && found) && cuts.misses.len() < NAMED {
            cuts.misses.push(length);
        }
    }
    Ok(cuts)
}

/// A recorder with its own key rewrites the whole log.
fn rewrites(recorded: &Recorded, does: Tampering) -> Tally {
    let mut tally = Tally::default();
    let Some(recorder) = recorded.topology.members.iter().find(|m| m.node() == NodeId::RECORDER) else { return tally };
    // The entries of guards and launcher are out of the recorder's hands.
    let (log, witnessed): (Vec<&Logged>, Vec<&Logged>) = recorded.log.iter().partition(|l| by_recorder(l.node));
    let log = log.into_iter().map(|l| RecordedEntry { at: l.at, node: l.node, bytes: l.bytes.clone() });
    let log: Vec<RecordedEntry> = log.collect();
    for seed in 0..STORIES {
        let mut hands = log.clone();
        if InsiderRecorder::new(recorder.setup.key(), does, seed).lay_on(&mut hands).is_none() {
            continue;
        }
        let mut log_verifier = LogVerifier::new(&recorded.anchors);
        for kept in &hands {
            // The verifier notes an entry that does not follow.
            let _ = log_verifier.take(kept.at, kept.node, &kept.bytes);
        }
        for logged in &witnessed {
            let _ = log_verifier.take(logged.at, logged.node, &logged.bytes);
        }
        let found = !log_verifier.close().flaws.is_empty();
        let detection = if found { Detection::Found { located: false } } else { Detection::Missed };
        tally.note(&detection, || format!("rewrite {seed}"));
    }
    tally
}

fn stopped(context: &Context) -> Result<(), Failure> {
    match context.stop.is_requested() {
        true => Err(runner::error::EngineError::Stopped.into()),
        false => Ok(()),
    }
}

fn show(measured: &Measured) {
    let Measured { scenario, seed, entries, bytes, seals, .. } = measured;
    out::say(format_args!("{scenario}, seed {seed}: {entries} entries, {bytes} bytes, {seals} seals"));
    out::say(format_args!("what changes no entry, or moves a time, is told by the digest of the whole file alone"));
    for (what, of) in [
        ("bytes changed", &measured.changes),
        ("entries deleted", &measured.deletions),
        ("entries put in again", &measured.insertions),
        ("neighbours swapped", &measured.swaps),
        ("whole logs rewritten", &measured.rewritten),
        ("cut cleanly at a seal", &measured.cut_at_a_seal),
    ] {
        let Tally { n, harmless, retimed, retimed_at_most_us, unchained, found, located, missed, misses } = of;
        out::say(format_args!(
            "{what:22} {n:8}: {found} found, {located} of them told at the entry or the next of its chain; {harmless} change no entry; \
             {retimed} moved a time by at most {retimed_at_most_us} us; {unchained} changed an entry and only the file's digest tells; \
             {missed} missed"
        ));
        misses.iter().for_each(|miss| out::say(format_args!("  missed: {miss}")));
    }
    let Cuts { n, recovered, found, misses } = &measured.cuts;
    out::say(format_args!(
        "{:22} {n:8}: {recovered} with everything up to the last seal before, {found} judged and found; missed {misses:?}",
        "cut at every byte"
    ));
}
