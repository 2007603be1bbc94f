//! The measurements, one a file: here `lab live`, latencies of the paper's losses over many live runs and the cost of protection in quiet.
//!
//! It measures and prints; no test asserts its numbers.

mod agreement;
mod cost;
mod detector;
mod drawn;
mod faults;
mod growth;
mod hold;
mod intervene;
mod judges;
mod kill;
mod leak;
mod liveness;
mod load;
mod mavlink;
mod minima;
mod plant;
mod rendering;
mod replay;
mod sensing;
mod soak;
mod stages;
mod tamper;
mod transitions;
mod window;
mod worth;

use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use results::mode::Mode;
use results::report::{BenchLive, LiveLatency, PAPER, RunObject, latency_table, run_table};
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, out, plan};
use scenario::Scenario;

/// Seconds of simulated time in one twin trial of the long null attack.
const SOAK_TRIAL_S: f64 = 3600.0;
/// Loss on the telemetry link during the long null attack.
const SOAK_LOSS: f64 = 0.02;

/// Measurements.
#[derive(Debug, clap::Subcommand)]
pub enum Bench {
    /// Live runs of thermal and RGB loss, a long live null attack, and hours of null attack with loss in the twin.
    Live(LiveArgs),
    /// Kill each process of live runs at a random moment: the mode the platform ends in, and how soon.
    Kill(kill::Args),
    /// Faults of processes, clocks, disk, memory, links and files: attempts, survivals, times, and anything that is left behind.
    Faults(faults::Args),
    /// An operator's HOLD, live: from the hand to the unit, and back to the display, stage by stage.
    Hold(hold::Args),
    /// Duration of each stage live and in the twin, and the gap.
    Stages(stages::Args),
    /// Detectors of silence on a modelled stream: latency against false trips, by loss and jitter.
    Liveness(liveness::Args),
    /// Cost of the twin by stage, beside bare rapier on the same course.
    Twin(cost::Args),
    /// Many sessions on the real accept loop, and a flood of datagrams that are no records beside a valid stream.
    Load(load::Args),
    /// Attacks on a MAVLink 2 link between ends of other authors, beside the published signing rules.
    Mavlink(mavlink::Args),
    /// Cost of the twin with more objects in view, and with more platforms.
    Growth(growth::Args),
    /// The anti-replay window: late records that it refuses against what it lets in again, by width, loss and lateness.
    Window(window::Args),
    /// Every kind of change to a recording, tried: the share that is found, and the place at which it is reported.
    Tamper(tamper::Args),
    /// Accuracy with which lengths and times on the links tell the unit's mode, against chance, in the twin.
    Leak(leak::Args),
    /// Time until each strategy of drawing finds each weakness of a list, and the results of shrinking its findings.
    Search(worth::Args),
    /// The oracle beside a second judge in another language, over logs of the twin, seeded defects among them.
    Judges(judges::Args),
    /// Correctness of explanations: the named cause taken away takes the loss away, in the twin.
    Explain(intervene::Args),
    /// Replay of the cores of runs in the twin: equality of every byte, and speed.
    Replay(replay::Args),
    /// Agreement of live runs with the twin, over sequences drawn at random: findings, safe sequences, sequences at an
    /// edge.
    Agreement(agreement::Args),
    /// Quality of the detector and of the stages beside it, by conditions, on frames that were not used in training.
    Detector(detector::Args),
    /// Responses of a body that flies, for a referee of the physics.
    Plant(plant::Args),
    /// The same seeds with rendered sensors and without: the share of trials that end otherwise.
    Rendering(rendering::Args),
    /// One long live run: growth of each process's memory and descriptors, and the run's class.
    Soak(soak::Args),
    /// Rides through random scenes: accuracy of the tracks, and the noise model beside the stages it stands in for.
    Sensing(sensing::Args),
}

/// Arguments of the live measurement.
#[derive(Debug, clap::Args)]
pub struct LiveArgs {
    /// Live runs of each loss.
    #[arg(long, default_value_t = 59, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    runs: u64,
    /// Minutes of live null attack.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(0..=60))]
    minutes: u64,
    /// Simulated hours of null attack at 2 % loss, in the twin.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u64).range(0..=1_000))]
    hours: u64,
    /// Live runs at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    /// Keep manifest, trials, result and recordings here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Measures it.
///
/// # Errors
/// The reason for which it could not be measured.
pub fn run(context: &Context, bench: &Bench) -> Result<Exit, Failure> {
    match bench {
        Bench::Live(args) => live(context, args),
        Bench::Kill(args) => kill::run(context, args),
        Bench::Faults(args) => faults::run(context, args),
        Bench::Hold(args) => hold::run(context, args),
        Bench::Stages(args) => stages::run(context, args),
        Bench::Liveness(args) => liveness::run(context, args),
        Bench::Window(args) => window::run(context, args),
        Bench::Tamper(args) => tamper::run(context, args),
        Bench::Leak(args) => leak::run(context, args),
        Bench::Search(args) => worth::run(context, args),
        Bench::Twin(args) => cost::run(context, args),
        Bench::Load(args) => load::run(context, args),
        Bench::Mavlink(args) => mavlink::run(context, args),
        Bench::Growth(args) => growth::run(context, args),
        Bench::Judges(args) => judges::run(context, args),
        Bench::Explain(args) => intervene::run(context, args),
        Bench::Replay(args) => replay::run(context, args),
        Bench::Agreement(args) => agreement::run(context, args),
        Bench::Detector(args) => detector::run(context, args),
        Bench::Plant(args) => plant::run(context, args),
        Bench::Rendering(args) => rendering::run(context, args),
        Bench::Soak(args) => soak::run(context, args),
        Bench::Sensing(args) => sensing::run(context, args),
    }
}

fn live(context: &Context, args: &LiveArgs) -> Result<Exit, Failure> {
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "bench")).transpose()?;
    let wanted = PlanOptions { rendered: true, ..PlanOptions::default() };
    let mut bench = Measuring { context, out, jobs: args.jobs, exit: Exit::Fine };
    let mut losses = Vec::new();
    for paper in PAPER.iter().filter(|_| args.runs > 0) {
        let planned = plan::plan(context, &plan::file_of(context, &paper.scenario)?, &wanted)?.1;
        losses.push(bench.measure(Mode::Live, &planned, args.runs)?);
    }
    let nominal = scenario::load(&plan::file_of(context, "nominal")?)?;
    let mut quiet = None;
    if args.minutes > 0 {
        let long = nominal.soak(args.minutes as f64 * 60.0, 0.0);
        let repeated = format!("lab live --runs 0 --hours 0 --minutes {}", args.minutes);
        quiet = Some(bench.measure(Mode::Live, &soaked(context, &long, &wanted, &repeated)?, 1)?);
    }
    let mut soak = None;
    if args.hours > 0 {
        let long = nominal.soak(SOAK_TRIAL_S, SOAK_LOSS);
        let repeated = "lab live --runs 0 --minutes 0 --hours 1";
        let planned = soaked(context, &long, &PlanOptions::default(), repeated)?;
        soak = Some(bench.measure(Mode::Twin, &planned, args.hours)?);
    }
    let live_latency_ms = losses.iter().filter_map(LiveLatency::of_run).collect();
    let measured = BenchLive {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        losses,
        live_latency_ms,
        live_null_attack: quiet,
        twin_null_attack_at_2_percent_loss: soak,
    };
    if let Some(dir) = &bench.out {
        out::write_result(dir, "result.json", "bench-live", &measured)?;
    }
    show(context, &measured)?;
    Ok(bench.exit)
}

/// A soak's variations, with the command that reproduces it: it is no scenario of a file.
fn soaked(context: &Context, long: &Scenario, wanted: &PlanOptions, repeated: &str) -> Result<Vec<Planned>, Failure> {
    let mut planned = plan::of_scenario(context, long, wanted)?;
    for one in &mut planned {
        one.command = Some(repeated.to_owned());
    }
    Ok(planned)
}

/// A measurement under way.
struct Measuring<'a> {
    context: &'a Context,
    out: Option<PathBuf>,
    jobs: usize,
    exit: Exit,
}

impl Measuring<'_> {
    fn measure(&mut self, mode: Mode, planned: &[Planned], n: u64) -> Result<RunObject, Failure> {
        let Some(first) = planned.first() else {
            return Err(Failure::new(Exit::NoEvidence, "nothing to run"));
        };
        let scenario = &first.variation.scenario;
        let label = format!("{} ({}, {:.0} s)", scenario.name.as_str(), mode.name(), scenario.duration_s.get());
        let (context, out) = (self.context, self.out.as_deref());
        let trials = Batch { label: &label, mode, planned, n, seed: context.seed, jobs: self.jobs, out }
            .run(context.talk, &context.stop)?;
        self.exit = batch::graver(self.exit, batch::judge(mode, planned, &trials));
        Ok(runner::batch::fold(scenario, mode, context.seed, planned, trials))
    }
}

fn show(context: &Context, measured: &BenchLive) -> Result<(), Failure> {
    if context.json {
        return out::print_json("bench-live", measured);
    }
    for run in &measured.losses {
        out::say(format_args!("{}", run_table(run)));
    }
    if !measured.live_latency_ms.is_empty() {
        out::say(format_args!("{}", latency_table(&measured.live_latency_ms)));
    }
    let quiet = [&measured.live_null_attack, &measured.twin_null_attack_at_2_percent_loss];
    for run in quiet.into_iter().flatten() {
        out::say(format_args!("{}", run_table(run)));
        let s = &run.summary;
        let upper = s.false_trips_per_hour_upper_95.map_or_else(|| "-".to_owned(), |u| format!("{u:.3}"));
        let hours = s.sim_seconds / 3600.0;
        out::say(format_args!(
            "{:.2} h: {:.3} false trips an hour, below {upper} (95 %)",
            hours, s.false_trips_per_hour
        ));
    }
    Ok(())
}
