//! `holdsafe campaign curve SCENARIO`: one value of a scenario taken through the range that its `[curve]` names, in the twin, each
//! point on the same seeds.
//!
//! The lines are the scenario's cells. `results::report` folds the trials of a point.

use std::path::PathBuf;

use evidence::trial::Trial;
use results::mode::Mode;
use results::report::{CurveLine, CurveObject, CurvePoint, curve_table, svg};
use runner::batch::Batch;
use runner::closing::Closing;
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::guest_options::GuestOptions;
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, out, own_arguments, plan, probe};
use scenario::Curve;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// A scenario with a curve, by name or by file.
    #[arg(value_name = "SCENARIO")]
    scenario: String,
    /// Trials of each point.
    #[arg(long, value_name = "N", default_value_t = 59, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    trials: u64,
    /// A policy file in place of the scenario's own; only the lines under it.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// A platform in place of the scenario's own, by name or by file.
    #[arg(long)]
    platform: Option<String>,
    /// Only the line of this cell.
    #[arg(long)]
    cell: Option<String>,
    /// Only this value of the range.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    at: Option<f64>,
    /// With rendered sensors and the detector.
    #[arg(long)]
    rendered: bool,
    #[command(flatten)]
    bring: DetectorOptions,
    #[command(flatten)]
    engage: GuestOptions,
    /// Keep manifest, trials, result and plot here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// One line of the curve, its points planned in order.
struct Line {
    cell: Option<String>,
    policy: String,
    points: Vec<(f64, Planned)>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (policy, cell, detector) = (args.policy.clone(), args.cell.clone(), args.bring.load()?);
    let (rendered, guest) = (args.rendered, args.engage.load()?);
    let platform = args.platform.as_ref().map(|name| plan::platform_of(context, name)).transpose()?;
    let wanted = PlanOptions { policy, platform, cell, rendered, detector, guest, ..PlanOptions::default() };
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, &args.scenario)?, &wanted)?;
    let Some(curve) = &scenario.curve else {
        let message = format!("`{}` has no curve; add a `[curve]` table to it", scenario.name.as_str());
        return Err(Failure::new(Exit::Usage, message));
    };
    let ready = |line: Planned| points(context, args, &wanted, curve, line);
    let mut lines = planned.into_iter().map(ready).collect::<Result<Vec<_>, _>>()?;
    let points = lines.iter_mut().flat_map(|line| &mut line.points);
    probe::probe(points.map(|(_, planned)| planned), context.seed)?;
    let all: Vec<Planned> = lines.iter().flat_map(|line| &line.points).map(|(_, planned)| planned.clone()).collect();
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "curve")).transpose()?;
    if let Some(dir) = &out {
        out::write_manifest(dir, &out::Manifest::new(context, &all)?)?;
    }
    let label = format!("curve of {}", scenario.name.as_str());
    let (n, seed) = (args.trials, context.seed);
    let batch = Batch { label: &label, mode: Mode::Twin, planned: &all, n, seed, jobs: 1, out: None };
    let trials = batch.run(context.talk, &context.stop)?;
    let exit = batch::judge(Mode::Twin, &all, &trials);
    let mut watermarks: Vec<String> = all.iter().filter_map(|one| one.setup.watermark()).collect();
    watermarks.sort();
    watermarks.dedup();
    let lines = lines.into_iter().map(|line| fold(curve, line, &trials)).collect();
    let detector = plan::detector(&all);
    let object = CurveObject { detector, ..CurveObject::new(scenario.name.as_str(), curve, seed, watermarks, lines) };
    if let Some(dir) = &out {
        out::write_trials(dir, &format!("{}.jsonl", object.scenario), &trials)?;
        out::write_result(dir, "result.json", "curve", &object)?;
        out::write_text(dir, &format!("{}.svg", object.scenario), &svg(&object))?;
    }
    if context.json {
        out::print_json("curve", &object)?;
    } else {
        out::show(curve_table(&object));
    }
    let ended = batch::ended(&all, &trials);
    let folder = out.clone().unwrap_or_else(|| PathBuf::from(context.free_folder(scenario.name.as_str())));
    let first = match out {
        Some(dir) => context.citation_of(&dir),
        None => context.own_command(&own_arguments(&["--out", &folder.to_string_lossy()])),
    };
    Closing::new(context).ended("points", &ended).print([first, context.report_of(&folder)]);
    Ok(exit)
}

/// The points of one line, ready to run.
fn points(context: &Context, args: &Args, wanted: &PlanOptions, curve: &Curve, line: Planned) -> Result<Line, Failure> {
    let requested = |value: &f64| args.at.is_none_or(|at| at == *value);
    let values: Vec<f64> = curve.values.iter().map(|value| value.get()).filter(requested).collect();
    if values.is_empty() {
        let all: Vec<String> = curve.values.iter().map(|value| value.get().to_string()).collect();
        return Err(Failure::new(Exit::Usage, format!("no such value on the curve; there are: {}", all.join(", "))));
    }
    let point = |value: f64| {
        let variation = curve.variation_at(&line.variation, value).map_err(Failure::internal)?;
        let command = format!("holdsafe campaign curve {} --trials 1 --at {value}{}", args.scenario, line.options);
        Ok((value, Planned { command: Some(command), ..plan::prepare(context, variation, wanted)? }))
    };
    let points = values.into_iter().map(point).collect::<Result<Vec<_>, Failure>>()?;
    Ok(Line { cell: line.variation.cell.clone(), policy: line.setup.policy_name.clone(), points })
}

fn fold(curve: &Curve, line: Line, trials: &[Trial]) -> CurveLine {
    let point = |(value, planned): &(f64, Planned)| {
        let own_trials: Vec<&Trial> = trials.iter().filter(|t| t.cell == planned.variation.cell).collect();
        CurvePoint::new(*value, curve, &planned.variation.scenario.expected, &own_trials)
    };
    let points = line.points.iter().map(point).collect();
    CurveLine::new(line.cell, &line.policy, points)
}
