//! `lab explain`: correctness of explanations, scored by taking the named cause away.
//!
//! Each run has one fault drawn from the attack spaces, every other run a second one; it counts when one of them by
//! itself brings about the first loss of the run, and the other by itself does not. The explanation names a place,
//! never a fault. The fault that a place means is read off a table written beforehand ([`Fault::shows`]): of the run's
//! faults that can show there and had begun, the newest. An explanation is right if it means the fault without which
//! the loss does not come and with which alone it does. So a run whose two faults show at one place can only be
//! distinguished by the times at which they began, and a fault that shows where the table does not have it is a miss.

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Micros, SCHEMA_VERSION};
use explain::{Explanation, FaultSite, Origin, explain};
use ground_truth::Sensor;
use parallel::progress::Progress;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, engine, out, plan, search_config};
use scenario::{AttackSpace, Scenario};
use search::{Action, AttackSequence};
use serde::Serialize;
use stats::Share;
use wire::id::UnitId;

/// Times at which faults begin, milliseconds: the unit is under way, and the consequences still happen within the run.
const BEGINS_MS: (u64, u64) = (3_000, 6_000);
/// Largest number of drawings for one run that counts.
const MAX_DRAWS: u32 = 400;
/// A loss is the same one when it comes within this time of it.
const SAME: Micros = 400_000;
/// A place's observation may be dated this much before the fault began: its date is that of the last good product.
const DATED_BACK: Micros = 400_000;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Runs that count.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    runs: u64,
}

/// One fault of a run.
#[derive(Clone)]
struct Fault<'a> {
    space: &'a AttackSpace,
    action: Action,
}

/// One run that counted.
#[derive(Debug, Serialize)]
struct Row {
    seed: u64,
    /// The faults, each by itself, the one that brought the loss about first.
    faults: Vec<String>,
    loss: String,
    named: FaultSite,
    /// Places that the explanation cannot tell apart from the named one.
    or: Vec<FaultSite>,
    why: String,
    told: Told,
    /// The fault that the explanation means; none where no fault of the run shows there.
    meant: Option<String>,
    #[serde(skip)]
    kind: String,
}

/// Score of an explanation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Told {
    /// It names one place, and means the fault that brought the loss about.
    Right,
    /// It reports several places that the log cannot tell apart, and the fault shows at one of them. Never counted as
    /// right.
    Undecided,
    /// It means another fault, or none of the run.
    Wrong,
}

/// Runs with so many faults, or with one kind of fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
struct Tally {
    n: u64,
    right: u64,
    undecided: u64,
}

impl Tally {
    fn from_rows<'a>(rows: impl Iterator<Item = &'a Row>) -> Tally {
        rows.fold(Tally::default(), |tally, row| Tally {
            n: tally.n + 1,
            right: tally.right + u64::from(row.told == Told::Right),
            undecided: tally.undecided + u64::from(row.told == Told::Undecided),
        })
    }
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    drawn: u64,
    /// Named right; undecided runs are not among the hits.
    single: Share,
    double: Share,
    single_undecided: u64,
    double_undecided: u64,
    /// Rows by the action type that brought the loss about.
    by_move: BTreeMap<String, Tally>,
    /// Every row that is not right.
    misses: Vec<Row>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (_, planned) = plan::plan(context, &plan::file_of(context, "nominal")?, &PlanOptions::default())?;
    let base = planned.first().ok_or_else(|| Failure::new(Exit::NoEvidence, "nothing to run"))?;
    let names = search_config::shipped(context, "spaces")?;
    let spaces = names.iter().map(|name| search_config::space(context, name)).collect::<Result<Vec<_>, _>>()?;
    let progress = Progress::new("runs", args.runs as usize, context.talk);
    let seeds: Vec<u64> = (0..args.runs).map(|i| context.seed + i).collect();
    let rows = parallel::map(parallel::cores(), &seeds, |seed| {
        let row = counted(context, base, &spaces, *seed, (*seed - context.seed) % 2 == 1);
        progress.step();
        row
    })?;
    progress.finish();
    let drawn = rows.iter().map(|(drawn, _)| u64::from(*drawn)).sum();
    let rows: Vec<Row> = rows.into_iter().filter_map(|(_, row)| row).collect();
    let with = |n: usize| Tally::from_rows(rows.iter().filter(|row| row.faults.len() == n));
    let (single, double) = (with(1), with(2));
    let moves: BTreeSet<&String> = rows.iter().map(|row| &row.kind).collect();
    let by_move =
        moves.iter().map(|kind| ((*kind).clone(), Tally::from_rows(rows.iter().filter(|row| row.kind == **kind))));
    let measured = Measured {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        drawn,
        single: Share::new(single.right, single.n),
        double: Share::new(double.right, double.n),
        single_undecided: single.undecided,
        double_undecided: double.undecided,
        by_move: by_move.collect(),
        misses: rows.into_iter().filter(|row| row.told != Told::Right).collect(),
    };
    if context.json {
        out::print_json("bench-explain", &measured)?;
    } else {
        show(&measured);
    }
    Ok(if measured.single.n + measured.double.n == 0 { Exit::NoEvidence } else { Exit::Fine })
}

fn show(measured: &Measured) {
    let rows = [
        ("one fault", measured.single, measured.single_undecided),
        ("two faults", measured.double, measured.double_undecided),
    ];
    for (what, share, undecided) in rows {
        let (hits, n, lower) = (share.hits, share.n, share.lower_95 * 100.0);
        let wrong = n - hits - undecided;
        out::say(format_args!(
            "{what:10}  {hits} of {n} named right, at least {lower:.1} % (95 %, two-sided); {undecided} cannot be told apart, {wrong} wrong"
        ));
    }
    out::say(format_args!("{} drawings in all", measured.drawn));
    for row in &measured.misses {
        let (seed, faults, loss) = (row.seed, row.faults.join(" | "), &row.loss);
        let name = if row.told == Told::Undecided { "cannot be told apart" } else { "missed" };
        out::say(format_args!("{name}: seed {seed}: {faults}\n  {loss}; named {:?}: {}", row.named, row.why));
    }
}

/// Draws until a run counts. Gives the number of drawings.
fn counted(
    context: &Context,
    base: &Planned,
    spaces: &[AttackSpace],
    seed: u64,
    two: bool,
) -> Result<(u32, Option<Row>), Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for drawn in 1..=MAX_DRAWS {
        if context.stop.is_requested() {
            return Err(runner::error::EngineError::Stopped.into());
        }
        let faults: Vec<Fault<'_>> = (0..if two { 2 } else { 1 }).map(|_| Fault::draw(spaces, &mut rng)).collect();
        if let Some(row) = tried(base, &faults, seed)? {
            return Ok((drawn, Some(row)));
        }
    }
    Ok((MAX_DRAWS, None))
}

/// One drawing; `None` where it does not count.
fn tried(base: &Planned, faults: &[Fault<'_>], seed: u64) -> Result<Option<Row>, Failure> {
    let with = |kept: &[bool]| -> Result<Option<Vec<Explanation>>, Failure> {
        let Some(scenario) = scenario(&base.variation.scenario, faults, kept) else { return Ok(None) };
        let (evidence, _) = engine::twin_verdict(&scenario, &base.setup, seed)?;
        Ok(Some(explain(&evidence.entries, &base.setup.bounds)))
    };
    let Some(all) = with(&vec![true; faults.len()])? else { return Ok(None) };
    let Some(loss) = all.iter().find(|e| e.restricts()) else { return Ok(None) };
    let lost = |explained: &[Explanation]| {
        explained.iter().any(|e| e.to == loss.to && e.cause == loss.cause && e.at_us.abs_diff(loss.at_us) <= SAME)
    };
    // Each fault by itself; with one fault the run without it must not have the loss.
    let mut brings = Vec::new();
    for i in 0..faults.len() {
        let alone: Vec<bool> = (0..faults.len()).map(|k| k == i).collect();
        brings.push(with(&alone)?.is_some_and(|explained| lost(&explained)));
    }
    let quiet = with(&vec![false; faults.len()])?.is_some_and(|explained| !lost(&explained));
    let mut bringers = (0..faults.len()).filter(|i| brings[*i]);
    let (Some(truth), None) = (bringers.next(), bringers.next()) else { return Ok(None) };
    if !quiet {
        return Ok(None);
    }
    let meant = fault_at(faults, loss.origin.place, loss.origin.since_us);
    let mut order: Vec<usize> = (0..faults.len()).collect();
    order.sort_by_key(|i| *i != truth);
    Ok(Some(Row {
        seed,
        faults: order.iter().map(|i| faults[*i].describe()).collect(),
        loss: format!(
            "{} to {} at {} ms ({})",
            loss.from.name(),
            loss.to.name(),
            loss.at_us / 1000,
            loss.cause.label()
        ),
        named: loss.origin.place,
        why: format!("{} (since {} ms)", loss.origin.what, loss.origin.since_us / 1000),
        or: loss.origin.or.clone(),
        told: score(faults, &loss.origin, truth),
        meant: meant.map(|m| faults[m].describe()),
        kind: faults[truth].name(),
    }))
}

/// The base with the kept faults in it, and every participant that any of the faults needs.
fn scenario(base: &Scenario, faults: &[Fault<'_>], kept: &[bool]) -> Option<Scenario> {
    faults.iter().zip(kept).try_fold(base.clone(), |scenario, (fault, kept)| {
        let actions = if *kept { vec![fault.action.clone()] } else { Vec::new() };
        AttackSequence::new(actions).in_scenario(fault.space, &scenario).ok()
    })
}

/// Score of an origin where `truth` is the fault that brought the loss about.
fn score(faults: &[Fault<'_>], origin: &Origin, truth: usize) -> Told {
    let means_it = |place: &FaultSite| fault_at(faults, *place, origin.since_us) == Some(truth);
    match origin.or.is_empty() {
        true if means_it(&origin.place) => Told::Right,
        false if means_it(&origin.place) || origin.or.iter().any(means_it) => Told::Undecided,
        true | false => Told::Wrong,
    }
}

/// The fault that a place means: of those that can show there and had begun, the newest.
fn fault_at(faults: &[Fault<'_>], place: FaultSite, since: Micros) -> Option<usize> {
    let fits = |fault: &Fault<'_>| fault.shows().contains(&place) && fault.begins() <= since.saturating_add(DATED_BACK);
    (0..faults.len()).filter(|i| fits(&faults[*i])).max_by_key(|i| faults[*i].begins())
}

impl<'a> Fault<'a> {
    /// Any action type of any attack space, at any time and strength.
    fn draw(spaces: &'a [AttackSpace], rng: &mut ChaCha8Rng) -> Self {
        let mut below = |n: u64| rng.next_u64() % n.max(1);
        let space = &spaces[below(spaces.len() as u64) as usize];
        let kind = below(space.moves.len() as u64) as usize;
        let begins = BEGINS_MS.0 + below(BEGINS_MS.1 - BEGINS_MS.0);
        let begins = (begins / space.tick_ms.unsigned()) as u32;
        let places = space.moves[kind].ranges().map(|range| below(u64::from(range.last()) + 1) as u32).collect();
        Fault { space, action: Action { begins, kind, places } }
    }

    fn begins(&self) -> Micros {
        u64::from(self.action.begins) * self.space.tick_ms.unsigned() * 1000
    }

    /// Its attack space and action type.
    fn name(&self) -> String {
        let of = &self.space.moves[self.action.kind];
        format!("{} {}", self.space.name.as_str(), of.name.as_str())
    }

    fn describe(&self) -> String {
        AttackSequence::new(vec![self.action.clone()]).describe(self.space)
    }

    /// Places at which it can show to the services: its target, and the dependants of that alone.
    fn shows(&self) -> Vec<FaultSite> {
        let of = &self.space.moves[self.action.kind];
        let value = |key: &str| of.set.get(key).and_then(|v| v.as_str()).unwrap_or_default();
        match of.table.as_str() {
            "fault" => match value("sensor") {
                "rgb" => vec![FaultSite::Sensor(Sensor::Rgb), FaultSite::Track],
                "depth" => vec![FaultSite::Sensor(Sensor::Depth), FaultSite::Track],
                "thermal" => vec![FaultSite::Sensor(Sensor::Thermal), FaultSite::Track],
                "lidar" => vec![FaultSite::Sensor(Sensor::Lidar), FaultSite::Track],
                "localisation" => vec![FaultSite::Sensor(Sensor::Localisation), FaultSite::Course],
                "odometry" => vec![FaultSite::Sensor(Sensor::Odometry)],
                _ => Vec::new(),
            },
            "kill" => match value("process") {
                "sim" => vec![FaultSite::World],
                "perception" => vec![FaultSite::Perception, FaultSite::Track],
                "autonomy" => vec![FaultSite::Unit],
                "gateway" => vec![FaultSite::Gateway],
                "broker" => vec![FaultSite::CommandPlane],
                "console" => vec![FaultSite::Console],
                "recorder" => vec![FaultSite::Recorder],
                "adversary" => {
                    vec![FaultSite::Telemetry, FaultSite::Uplink, FaultSite::Downlink, FaultSite::CommandPlane]
                }
                _ => Vec::new(),
            },
            "forge" | "republish" => match value("topic") {
                "tracks" | "candidates" | "frames" => vec![FaultSite::Perception, FaultSite::Track],
                "navigation" => vec![FaultSite::World, FaultSite::Sensor(Sensor::Localisation)],
                "seals" => vec![FaultSite::Recorder],
                _ => Vec::new(),
            },
            "loss" | "burst_loss" | "delay" | "jitter" | "replay" | "duplicate" | "reorder" | "corrupt" | "inject"
            | "reoriginate" => match value("direction") {
                "up" => vec![FaultSite::Uplink],
                "down" => vec![FaultSite::Downlink],
                _ => vec![FaultSite::Telemetry, FaultSite::Uplink, FaultSite::Downlink],
            },
            "teammate" | "falsehood" | "mode_confusion" | "session_replay" | "malformed" => {
                vec![FaultSite::Teammate(UnitId::B), FaultSite::Teammate(UnitId::C)]
            }
            // Orders are requested from any side; their transport is not part of it.
            "rogue" => vec![FaultSite::Operator],
            "alter" => vec![FaultSite::Track],
            // Byte streams, the broker, the display's feed and the operator's requests.
            _ => vec![FaultSite::CommandPlane],
        }
    }
}
