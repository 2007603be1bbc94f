//! Conversion of a command line to a campaign: scenarios, cells and grids crossed with each other, each combination
//! checked as a cell of its file would be.

use std::collections::BTreeMap;

use results::campaign::draw::Distribution;
use results::campaign::{MAX_VARIATIONS, PLAN_VERSION, Plan, PlanVariation, Terms, draw};
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, plan, probe};
use scenario::{Settings, Variation};
use serde_json::Value;

use super::run::Args;

/// Default number of trials of each variation, without a claim: the fewest that bound a 95th percentile.
const TRIALS: u64 = 59;
/// Largest number of trials of a sequential campaign, as a multiple of the fixed number, unless the user gives one.
const SEQUENTIAL_FACTOR: u64 = 10;
/// Settings that a trial cannot draw: they are read before the first trial.
const NOT_DRAWN: [&str; 2] = ["bounds", "platform"];

/// One path and the values that it takes.
#[derive(Clone, Debug)]
pub(super) struct Grid(String, Vec<Value>);

/// One path and the distribution of its value.
#[derive(Clone, Debug)]
pub(super) struct Draw(String, Distribution);

/// Reads `--grid PATH=V1,V2,…`.
pub(super) fn grid(text: &str) -> Result<Grid, String> {
    match text.split_once('=') {
        Some((path, values)) if !path.is_empty() && !values.is_empty() => Ok(Grid(path.to_owned(), draw::list(values))),
        Some(_) | None => Err("a grid is PATH=V1,V2,…, such as loss.0.share=0.2,0.5,1".to_owned()),
    }
}

/// Reads `--draw PATH=DISTRIBUTION`.
pub(super) fn drawn(text: &str) -> Result<Draw, String> {
    let (path, manner) = text.split_once('=').unwrap_or((text, ""));
    manner.parse().map(|distribution| Draw(path.to_owned(), distribution))
}

/// The campaign, and the plan of each of its variations, ready to run.
pub(super) fn lay_out(context: &Context, args: &Args) -> Result<(Plan, Vec<Planned>), Failure> {
    let (grids, draws) = paths(args)?;
    let (policy, cell, detector) = (args.policy.clone(), args.cell.clone(), args.bring.load()?);
    let (rendered, guest) = (args.rendered, args.engage.load()?);
    let wanted = PlanOptions { policy, cell, rendered, detector, guest, ..PlanOptions::default() };
    let mut planned = Vec::new();
    for name in &args.scenarios {
        let (_, cells) = plan::plan(context, &plan::file_of(context, name)?, &wanted)?;
        for cell in cells {
            planned.extend(crossed(context, &wanted, &cell, &grids, planned.len())?);
        }
    }
    probe::probe(planned.iter_mut().map(|(planned, _)| planned), context.seed)?;
    let terms = Terms {
        plan_version: PLAN_VERSION,
        program: context.program.to_owned(),
        seed: context.seed,
        trials: trials(args),
        rendered: args.rendered,
        policy: args.policy.as_deref().map(plan::stem),
        guest: wanted.guest.as_ref().map(|engaged| engaged.options.clone()),
        claim: args.claim.clone(),
        sequential: args.sequential,
        draws,
    };
    let variations = planned.iter().map(|(planned, set)| described(planned, set)).collect::<Result<_, _>>()?;
    let plan = Plan { terms, variations };
    plan.bounded().map_err(|reason| Failure::new(Exit::Usage, reason))?;
    let planned: Vec<Planned> = planned.into_iter().map(|(planned, _)| planned).collect();
    planned.iter().try_for_each(|one| drawable(one, &plan.terms.draws))?;
    Ok((plan, planned))
}

fn trials(args: &Args) -> u64 {
    let claimed = args.claim.as_ref().map(|claim| claim.trials());
    let factor = if args.sequential { SEQUENTIAL_FACTOR } else { 1 };
    args.trials.or(claimed.map(|n| n.saturating_mul(factor))).unwrap_or(TRIALS)
}

type Paths = (BTreeMap<String, Vec<Value>>, BTreeMap<String, Distribution>);

/// Grids and draws by path. A path may be in one of the two, and once.
fn paths(args: &Args) -> Result<Paths, Failure> {
    let duplicate = |path: &str| Failure::new(Exit::Usage, format!("`{path}` is set twice; name each path once"));
    let (mut grids, mut draws) = (BTreeMap::new(), BTreeMap::new());
    for Grid(path, values) in &args.grid {
        if values.iter().enumerate().any(|(i, value)| values[..i].contains(value)) {
            return Err(Failure::new(Exit::Usage, format!("--grid {path} has a value twice; name each once")));
        }
        if grids.insert(path.clone(), values.clone()).is_some() {
            return Err(duplicate(path));
        }
    }
    for Draw(path, how) in &args.draw {
        if NOT_DRAWN.contains(&path.split('.').next().unwrap_or_default()) {
            return Err(Failure::new(
                Exit::Usage,
                format!("`{path}` is the same for all trials of a variation; use --grid"),
            ));
        }
        if grids.contains_key(path) || draws.insert(path.clone(), how.clone()).is_some() {
            return Err(duplicate(path));
        }
    }
    Ok((grids, draws))
}

/// A cell with every combination of the grids in force.
fn crossed(
    context: &Context,
    wanted: &PlanOptions,
    cell: &Planned,
    grids: &BTreeMap<String, Vec<Value>>,
    index: usize,
) -> Result<Vec<(Planned, Settings)>, Failure> {
    let count = grids.values().try_fold(1usize, |n, values| n.checked_mul(values.len()));
    let fits = |n: &usize| n.saturating_add(index) <= MAX_VARIATIONS;
    let count = count.filter(fits).ok_or_else(|| {
        let message = format!("more than {MAX_VARIATIONS} variations: scenarios, cells and grids are crossed");
        Failure::new(Exit::Usage, format!("{message}; leave some out, or draw values with --draw"))
    })?;
    let one = |at: usize| {
        let set = combination(grids, at);
        let scenario = cell.variation.with_settings(&set).map_err(|error| plan::unfit(&cell.variation, &error))?;
        let cell = cell.variation.cell.clone();
        Ok((plan::prepare(context, Variation { cell, scenario }, wanted)?, set))
    };
    (0..count).map(one).collect()
}

/// Combination `at` of all: the last path changes fastest.
fn combination(grids: &BTreeMap<String, Vec<Value>>, mut at: usize) -> Settings {
    let pick = |(path, values): (&String, &Vec<Value>)| {
        let value = values[at % values.len()].clone();
        at /= values.len();
        (path.clone(), value)
    };
    grids.iter().rev().map(pick).collect()
}

/// Checks that the ends of the drawn ranges fit, all lower ones together, all upper ones, and every choice.
fn drawable(planned: &Planned, draws: &BTreeMap<String, Distribution>) -> Result<(), Failure> {
    let ends: Vec<(&String, Vec<Value>)> =
        draws.iter().map(|(path, distribution)| (path, distribution.ends())).collect();
    // Not every combination of ends, of which there may be many: a trial that still does not fit is reported when it is
    // drawn.
    let most = ends.iter().map(|(_, ends)| ends.len()).max().unwrap_or(0);
    (0..most).try_for_each(|k| {
        let set: Settings = ends.iter().map(|(path, ends)| ((*path).clone(), ends[k % ends.len()].clone())).collect();
        planned.variation.with_settings(&set).map(|_| ()).map_err(|error| plan::unfit(&planned.variation, &error))
    })
}

fn described(planned: &Planned, set: &Settings) -> Result<PlanVariation, Failure> {
    let (variation, mode) = (&planned.variation, planned.mode());
    Ok(PlanVariation {
        scenario: variation.scenario.name.as_str().to_owned(),
        cell: variation.cell.clone(),
        set: set.clone(),
        policy: planned.setup.policy_name.clone(),
        watermark: planned.setup.watermark(),
        mode,
        counts: mode.counts_for(variation.scenario.evidence),
        expected: variation.scenario.expected.to_vec(),
        content: planned.content()?,
    })
}
