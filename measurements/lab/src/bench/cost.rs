//! `lab twin`: cost of the twin of the null attack by stage, beside bare rapier on the same course in the same process;
//! and the cost of the first trial when it is repeated from a known run. It measures and prints; no test asserts its
//! numbers.
//!
//! Rounds alternate (bare, twin, twin watched, followed, forked), so that all see the same machine. CPU time is the
//! thread's; the stages' shares are of the watched runs' elapsed time, for a thread's CPU clock costs more to read than
//! most stages take. Shares are laid over the CPU time of the unwatched runs.

use std::hint::black_box;

use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use results::mode::Mode;
use results::report::{Spread, StageCost, TwinCost, cost_table};
use runner::error::EngineError;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, engine, out, plan};
use twin::cost::{Course, Known, Watched, watched};
use twin::stopwatch::WorkStage;
use wire::id::NodeId;
use wire::sign::{Key, Keyring, Purpose, Signed};

/// Signatures made and verified in one round to calibrate the cost of one.
const CALIBRATION: u32 = 200;
/// Bytes of a calibration payload: about those of a report.
const PAYLOAD: usize = 300;
/// Simulated part of a forked trial, up to the end of its time, microseconds.
const SUFFIX: u64 = 3_000_000;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Rounds of bare rapier, the twin, the twin watched, and the first trial followed by itself and forked.
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    rounds: u32,
    /// Trials a round; 10, or 2 rendered, when not given.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    trials: Option<u64>,
    /// With rendered sensors and the detector.
    #[arg(long)]
    rendered: bool,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let wanted = PlanOptions { rendered: args.rendered, ..PlanOptions::default() };
    let planned = plan::plan(context, &plan::file_of(context, "nominal")?, &wanted)?.1;
    let [planned] = planned.as_slice() else {
        return Err(Failure::internal("`nominal` has more than one variation"));
    };
    let trials = args.trials.unwrap_or(if args.rendered { 2 } else { 10 });
    let bench = Bench::prepare(context, planned, trials)?;
    let progress = Progress::new("rounds", args.rounds as usize, context.talk);
    let round = |_| bench.round().inspect(|_| progress.step());
    let rounds = (0..args.rounds).map(round).collect::<Result<Vec<_>, _>>()?;
    progress.finish();
    let cost = bench.sum_up(args.rendered, &rounds);
    if context.json {
        out::print_json("bench-twin", &cost)?;
    } else {
        out::say(format_args!("{}", cost_table(&cost)));
    }
    Ok(Exit::Fine)
}

/// Trials shared by every round.
struct Bench<'a> {
    context: &'a Context,
    planned: &'a Planned,
    courses: Vec<Course>,
    /// The first trial.
    known: Known,
}

/// One round: CPU seconds, and the watched trials.
struct Round {
    bare: f64,
    twin: f64,
    watched: f64,
    along: f64,
    forked: f64,
    trials: Vec<Watched>,
    sign: f64,
    verify: f64,
}

impl<'a> Bench<'a> {
    fn prepare(context: &'a Context, planned: &'a Planned, trials: u64) -> Result<Self, Failure> {
        let course = |i| {
            let course = Course::record(&planned.variation.scenario, &planned.setup, context.seed.wrapping_add(i));
            course.map_err(failed)?.ok_or_else(|| Failure::internal("a topology without a sim"))
        };
        let courses = (0..trials).map(course).collect::<Result<_, _>>()?;
        let known =
            Known::measure(&planned.variation.scenario, &planned.setup, context.seed, SUFFIX).map_err(failed)?;
        Ok(Self { context, planned, courses, known })
    }

    fn seeds(&self) -> impl Iterator<Item = u64> {
        let (seed, n) = (self.context.seed, self.courses.len() as u64);
        (0..n).map(move |i| seed.wrapping_add(i))
    }

    fn round(&self) -> Result<Round, Failure> {
        let (scenario, setup) = (&self.planned.variation.scenario, &self.planned.setup);
        let mut worlds: Vec<_> = self.courses.iter().map(Course::bare).collect();
        let ((), bare) = timed(|| worlds.iter_mut().for_each(|world| world.drive()));
        if self.context.stop.is_requested() {
            return Err(EngineError::Stopped.into());
        }
        let one = |seed| engine::trial(Mode::Twin, scenario, setup, seed, &self.context.stop).map(|_| ());
        let (ran, twin) = timed(|| self.seeds().try_for_each(one));
        ran?;
        let one = |seed| watched(scenario, setup, seed, link::clock::trace_us);
        let (trials, watched) = timed(|| self.seeds().map(one).collect::<Result<Vec<_>, _>>());
        let one = |_| self.known.run_with_baseline(scenario, setup).map(|_| ());
        let (ran, along) = timed(|| self.seeds().try_for_each(one));
        ran.map_err(failed)?;
        let ((), forked) = timed(|| self.seeds().for_each(|_| drop(self.known.forked(setup))));
        let (sign, verify) = calibrate();
        Ok(Round { bare, twin, watched, along, forked, trials: trials.map_err(failed)?, sign, verify })
    }

    fn sum_up(&self, rendered: bool, rounds: &[Round]) -> TwinCost {
        let sim_seconds: f64 = self.courses.iter().map(Course::seconds).sum();
        let per_second = |of: fn(&Round) -> f64| Spread::from_values(rounds.iter().map(|r| of(r) / sim_seconds * 1e6));
        let (bare, twin) = (per_second(|r| r.bare), per_second(|r| r.twin));
        let times = self.courses.len() as f64;
        let repeated = self.courses.first().map_or(0.0, Course::seconds) * times;
        let suffix = SUFFIX as f64 / 1e6 * times;
        let counted = |of: fn(&Watched) -> u64| {
            let all = rounds.iter().flat_map(|r| &r.trials).map(of).sum::<u64>();
            all as f64 / (sim_seconds * rounds.len() as f64)
        };
        TwinCost {
            schema_version: SCHEMA_VERSION,
            scenario: self.planned.variation.scenario.name.as_str().to_owned(),
            rendered,
            seed: self.context.seed,
            rounds: rounds.len(),
            trials: self.courses.len(),
            sim_seconds,
            per_cpu_second: Spread::from_values(rounds.iter().map(|r| sim_seconds / r.twin)),
            bare_per_cpu_second: Spread::from_values(rounds.iter().map(|r| sim_seconds / r.bare)),
            ratio: Spread::from_values(rounds.iter().map(|r| r.twin / r.bare)),
            watching: Spread::from_values(rounds.iter().map(|r| r.watched / r.twin)),
            along_per_cpu_second: Spread::from_values(rounds.iter().map(|r| repeated / r.along)),
            forked_per_cpu_second: Spread::from_values(rounds.iter().map(|r| repeated / r.forked)),
            suffix_per_cpu_second: Spread::from_values(rounds.iter().map(|r| suffix / r.forked)),
            stages: stages(rounds, twin.median, bare.median),
            twin_us: twin,
            bare_us: bare,
            sign_us: Spread::from_values(rounds.iter().map(|r| r.sign)),
            verify_us: Spread::from_values(rounds.iter().map(|r| r.verify)),
            signatures_made: counted(|w| w.signatures.made),
            signatures_asked: counted(|w| w.signatures.asked),
            signatures_verified: counted(|w| w.signatures.verified),
        }
    }
}

/// Every stage's share of the watched time of all rounds, laid over `twin` microseconds a simulated second. The sim's
/// own is parted: the share of bare rapier is physics, the rest is sensing.
fn stages(rounds: &[Round], twin: f64, bare: f64) -> Vec<StageCost> {
    let spent = |stage: WorkStage| rounds.iter().flat_map(|r| &r.trials).map(|w| w.stopwatch.spent(stage)).sum::<u64>();
    let all = WorkStage::ALL.map(spent).iter().sum::<u64>() as f64;
    let mut rows = Vec::new();
    for stage in WorkStage::ALL {
        let us = spent(stage) as f64 / all * twin;
        if stage == WorkStage::Sim {
            rows.push(StageCost::new("physics", bare, twin));
            rows.push(StageCost::new("sensing and truth", us - bare, twin));
        } else {
            rows.push(StageCost::new(stage.name(), us, twin));
        }
    }
    rows
}

/// Runs `f` and gives its CPU seconds.
fn timed<T>(f: impl FnOnce() -> T) -> (T, f64) {
    let before = batch::cpu_seconds(Mode::Twin);
    let result = f();
    (result, batch::cpu_seconds(Mode::Twin) - before)
}

/// Microseconds of one signature and of one verification.
fn calibrate() -> (f64, f64) {
    let key = Key::from_bytes(&[7; 32]);
    let mut ring = Keyring::default();
    ring.insert(NodeId::UNIT_A, &key.public());
    let payload = [5; PAYLOAD];
    let sign = || (0..CALIBRATION).fold(Vec::new(), |_, _| black_box(key.sign(Purpose::Report, &payload)));
    let (bytes, signing) = timed(sign);
    let verify = || {
        let signed = Signed::parse(&bytes, 2 * PAYLOAD)?;
        (0..CALIBRATION).try_for_each(|_| black_box(ring.verify(NodeId::UNIT_A, Purpose::Report, &signed)))
    };
    let (good, verifying) = timed(verify);
    debug_assert!(good.is_ok(), "our own signature is good");
    let each = |seconds: f64| seconds / f64::from(CALIBRATION) * 1e6;
    (each(signing), each(verifying))
}

fn failed(error: impl std::fmt::Display) -> Failure {
    EngineError::Failed(error.to_string()).into()
}
