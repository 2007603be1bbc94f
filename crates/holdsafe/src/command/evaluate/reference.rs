//! The reference evaluation. Every shipped scenario at least 59 times in the twin, or on the real stacks in
//! memory where it has no platform, and once live; each row as it comes, a table, and a run directory.

use std::path::Path;

use evidence::trial::Trial;
use parallel::progress::Talk;
use results::mode::Mode;
use results::report::{Reference, ReferenceRow, latency_table, reference_line, reference_table};
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{Planned, Wanted};
use runner::{Context, batch, out, plan};
use scenario::Scenario;

/// The paper's findings, which the table begins with; the others follow by name.
const FIRST: [&str; 5] = ["teammate", "naive_relay", "thermal_loss", "rgb_loss", "track_starvation"];
/// Twin trials of each scenario and of each cell: the fewest that bound a 95th percentile.
const TWIN_TRIALS: u64 = 59;
/// Repetitions of a live run that a stall of the host alone makes INVALID; the tables name the repeated ones.
const RETRIES: u32 = 2;
/// Live runs side by side for each core: they wait most of their time.
const LIVE_PER_CORE: usize = 2;

pub(super) fn run(context: &Context) -> Result<Exit, Failure> {
    let root = context.root()?;
    // Every file is read before anything runs.
    let mut plans = Vec::new();
    for file in scenario::shipped(&root)? {
        let (twin, live) = (Wanted::default(), Wanted { rendered: true, ..Wanted::default() });
        let (scenario, for_twin) = plan::plan(context, &file, &twin)?;
        let mut for_live = one_of_each_policy(plan::of_scenario(context, &scenario, &live)?);
        for_live.iter_mut().for_each(|of| of.setup.retries = RETRIES);
        plans.push((scenario, for_twin, for_live));
    }
    plans.sort_by_key(|(scenario, ..)| {
        FIRST.iter().position(|name| *name == scenario.name.as_str()).unwrap_or(FIRST.len())
    });
    if plans.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, format!("no scenario in {}", root.join("scenarios").display())));
    }
    let dir = out::directory(&root, None, "reference")?;
    let all: Vec<Planned> = plans.iter().flat_map(|(_, twin, _)| twin.clone()).collect();
    out::write_json(&dir, "manifest.json", &out::Manifest::of(context, &all)?)?;

    let mut told = Told { dir: &dir, json: context.json, exit: Exit::Fine, rows: Vec::new() };
    let batch = |label: &str, mode: Mode, planned: &[Planned], n: u64, jobs: usize| {
        let batch = Batch { label, mode, planned, n, seed: context.seed, jobs, out: Some(&dir) };
        batch.run(context.talk, &context.stop)
    };
    for (scenario, twin, _) in &plans {
        let mode = if scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin };
        let mut trials = Vec::new();
        // One variation at a time, so that its verdict is printed before the next one runs.
        for one in twin {
            let cell = one.variation.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
            let label = format!("{}{cell} ({})", scenario.name.as_str(), mode.name());
            let own = batch(&label, mode, std::slice::from_ref(one), TWIN_TRIALS, 1)?;
            told.row(one, mode, &own);
            trials.extend(own);
        }
        told.keep(scenario, mode, twin, &trials)?;
    }
    plans.retain(|(scenario, ..)| !scenario.is_of_stacks());
    let live: Vec<Planned> = plans.iter().flat_map(|(_, _, live)| live.clone()).collect();
    let trials = batch("live", Mode::Live, &live, 1, LIVE_PER_CORE * parallel::cores())?;
    let mut left = trials.as_slice();
    for (scenario, _, live) in &plans {
        let own = left.split_off(..live.len()).unwrap_or_default();
        live.iter().for_each(|one| told.row(one, Mode::Live, own));
        told.keep(scenario, Mode::Live, live, own)?;
    }
    let exit = told.exit;
    finish(context, &Reference::new(context.seed, told.rows), &dir)?;
    Ok(exit)
}

/// The first variation under each policy: a scenario without cells has one, the teammate table one a policy.
fn one_of_each_policy(mut planned: Vec<Planned>) -> Vec<Planned> {
    let mut seen = std::collections::BTreeSet::new();
    planned.retain(|p| seen.insert(p.setup.policy_name.clone()));
    planned
}

/// The rows so far, printed and written.
struct Told<'a> {
    dir: &'a Path,
    json: bool,
    exit: Exit,
    rows: Vec<ReferenceRow>,
}

impl Told<'_> {
    /// The row of one variation, whose trials are among these.
    fn row(&mut self, planned: &Planned, mode: Mode, trials: &[Trial]) {
        let variation = &planned.variation;
        let own: Vec<&Trial> = trials.iter().filter(|t| t.cell == variation.cell).collect();
        let row = ReferenceRow::new(&variation.scenario, variation.cell.clone(), mode, &own);
        if !self.json {
            out::say(format_args!("{}", reference_line(&row)));
        }
        self.rows.push(row);
    }

    /// Writes and judges all trials of a scenario.
    fn keep(&mut self, scenario: &Scenario, mode: Mode, planned: &[Planned], trials: &[Trial]) -> Result<(), Failure> {
        out::write_trials(self.dir, &format!("{}.{}.jsonl", scenario.name.as_str(), mode.name()), trials)?;
        self.exit = batch::graver(self.exit, batch::judge(mode, planned, trials));
        Ok(())
    }
}

fn finish(context: &Context, reference: &Reference, dir: &Path) -> Result<(), Failure> {
    out::write_result(dir, "reference.json", "reference", reference)?;
    if context.json {
        out::print_json("reference", reference)?;
    } else {
        out::say(format_args!("{}", reference_table(reference)));
        out::say(format_args!("{}", latency_table(&reference.live_latency_ms)));
    }
    if context.talk == Talk::Normal {
        link::note!("seed {}, run directory {}", context.seed, dir.display());
    }
    Ok(())
}
