//! `holdsafe inspect replay`: replays the inputs of each core of a run and compares its outputs: every byte, or under
//! another policy every decision.

use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use recording::Checked;
use runner::checked::Unverified;
use runner::engine::ReplayRow;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, checked, engine, out, plan};
use serde::Serialize;
use twin::replay::{Parted, ReplayedCore, decisions};
use wire::core::Output;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Directory of a recorded live run, or a scenario that is run in the twin under --seed.
    #[arg(value_name = "RUN")]
    run: String,
    #[command(flatten)]
    unverified: Unverified,
    /// Of a scenario: the decisions of the cores under this policy on the same inputs; the first difference of each is
    /// reported.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Of a scenario: only this cell; else the first.
    #[arg(long)]
    cell: Option<String>,
}

#[derive(Serialize)]
struct Replayed {
    schema_version: u32,
    identical: bool,
    cores: Vec<ReplayRow>,
}

/// A core under another policy.
#[derive(Serialize)]
struct WhatIf {
    core: String,
    inputs: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    first: Option<First>,
    /// Inputs on which it decided otherwise.
    otherwise: Vec<Otherwise>,
}

/// Number of inputs with this pair of decisions, in the run and now.
#[derive(Serialize)]
struct Otherwise {
    then: String,
    now: String,
    inputs: u64,
}

/// The first different decision.
#[derive(Serialize)]
struct First {
    at_us: u64,
    input: u64,
    then: Vec<serde_json::Value>,
    now: Vec<serde_json::Value>,
}

#[derive(Serialize)]
struct Counterfactual {
    schema_version: u32,
    run: String,
    policy: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    watermark: Option<String>,
    cores: Vec<WhatIf>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let path = Path::new(&args.run);
    if path.is_dir() {
        if args.policy.is_some() || args.cell.is_some() {
            let message = "the keys of a recorded run are gone, and with them what its cores could be fed under another policy; \
                           name the scenario to ask it of a run in the twin";
            return Err(Failure::new(Exit::Usage, message));
        }
        let checked = checked::open_one_run(path)?;
        checked::print_marks(context, &[&checked]);
        let own_exit = same(context, &args.run, engine::replay(&checked)?, &[&checked])?;
        return Ok(args.unverified.exit(&[&checked], own_exit));
    }
    let planned = one(context, args)?;
    let Some(policy) = &args.policy else {
        let replayed = engine::replay_in_own_cores(&engine::run_journalled(&planned, context.seed)?)?;
        return same(context, &args.run, replayed.iter().map(ReplayRow::from).collect(), &[]);
    };
    let other = plan::with_policy(context, &planned, policy)?;
    let replayed =
        engine::replay_in_other_cores(&engine::run_journalled(&planned, context.seed)?, &other, context.seed)?;
    let cores = replayed.iter().map(if_otherwise).collect();
    let (run, policy) = (args.run.clone(), policy.display().to_string());
    let watermark = other.setup.watermark();
    what_if(context, Counterfactual { schema_version: SCHEMA_VERSION, run, policy, watermark, cores })
}

fn one(context: &Context, args: &Args) -> Result<Planned, Failure> {
    let wanted = PlanOptions { cell: args.cell.clone(), ..PlanOptions::default() };
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, &args.run)?, &wanted)?;
    if scenario.is_of_stacks() {
        let message = format!("`{}` runs on the real stacks, without cores that could be fed again", args.run);
        return Err(Failure::new(Exit::Usage, message));
    }
    planned.into_iter().next().ok_or_else(|| Failure::new(Exit::NoEvidence, "nothing to run"))
}

fn same(context: &Context, run: &str, cores: Vec<ReplayRow>, read: &[&Checked]) -> Result<Exit, Failure> {
    if cores.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, format!("{run}: no input journals; there is no input to replay")));
    }
    let identical = cores.iter().all(|core| core.difference.is_none());
    if !context.json {
        for core in &cores {
            let verdict = core.difference.as_deref().unwrap_or("identical");
            out::say(format_args!("{:16} {:8} inputs {:8} outputs  {verdict}", core.core, core.inputs, core.outputs));
        }
    }
    if context.json {
        checked::print_json("replay", &Replayed { schema_version: SCHEMA_VERSION, identical, cores }, read)?;
    }
    if !identical {
        link::note!("reproduce: holdsafe inspect replay {run}");
    }
    Ok(if identical { Exit::Fine } else { Exit::Unexpected })
}

fn what_if(context: &Context, mut requested: Counterfactual) -> Result<Exit, Failure> {
    // The first of all is the answer; those after it follow it or come without it.
    requested.cores.sort_by_key(|core| core.first.as_ref().map_or(u64::MAX, |first| first.at_us));
    if context.json {
        out::print_json("what-if", &requested)?;
        return Ok(Exit::Fine);
    }
    requested.watermark.iter().for_each(|mark| out::say(format_args!("{mark}")));
    for core in &requested.cores {
        let Some(first) = &core.first else {
            out::say(format_args!("{:16} {:8} inputs  decides the same", core.core, core.inputs));
            continue;
        };
        let n: u64 = core.otherwise.iter().map(|o| o.inputs).sum();
        let seconds = first.at_us as f64 / 1e6;
        out::say(format_args!(
            "{:16} {:8} inputs  decides otherwise on {n}, first at {seconds:.3} s",
            core.core, core.inputs
        ));
        let lines = |events: &[serde_json::Value]| match events {
            [] => "nothing".to_owned(),
            events => events.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n                 "),
        };
        out::say(format_args!("  in the run     {}", lines(&first.then)));
        out::say(format_args!("  under it       {}", lines(&first.now)));
        for Otherwise { then, now, inputs } in &core.otherwise {
            let word = |kinds: &str| if kinds.is_empty() { "nothing".to_owned() } else { kinds.to_owned() };
            out::say(format_args!("  {inputs:6} inputs  {} → {}", word(then), word(now)));
        }
    }
    if requested.cores.iter().all(|core| core.first.is_none()) {
        out::say(format_args!("every core decides the same under {}", requested.policy));
    }
    Ok(Exit::Fine)
}

fn if_otherwise(replayed: &ReplayedCore) -> WhatIf {
    let events = |outputs: &[Output]| decisions(outputs).iter().filter_map(|e| serde_json::to_value(e).ok()).collect();
    let first = |p: &Parted| First { at_us: p.at, input: p.input, then: events(&p.then), now: events(&p.now) };
    let difference = |((then, now), inputs): (&(String, String), &u64)| {
        let (then, now) = (then.clone(), now.clone());
        Otherwise { then, now, inputs: *inputs }
    };
    WhatIf {
        core: replayed.node.to_string(),
        inputs: replayed.inputs,
        first: replayed.parted.as_ref().map(first),
        otherwise: replayed.otherwise.iter().map(difference).collect(),
    }
}
