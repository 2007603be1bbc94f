//! `holdsafe campaign run SCENARIO…`: many trials over scenarios, cells, grids and draws, in the twin or on the stacks in memory.
//!
//! Each finished trial is in the folder's journal before the next of its thread begins, so a campaign resumes after any
//! interruption. Threads and partitions decide which of them runs a trial, and have no other effect.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use evidence::log::hex;
use evidence::trial::Outcome;
use parallel::progress::Progress;
use results::campaign::Plan;
use results::campaign::claim::Claim;
use results::campaign::partition::Partition;
use results::campaign::row::TrialRow;
use results::report::{CampaignObject, ClaimVerdicts, Fold, campaign_table};
use runner::closing::Closing;
use runner::custom_detector::DetectorOptions;
use runner::ended::Ended;
use runner::failure::{Exit, Failure};
use runner::guest_options::GuestOptions;
use runner::plan::Planned;
use runner::{Context, batch, out, plan};
use scenario::Variation;
use sha2::{Digest, Sha256};

use super::journal::{Journal, each_row, read_plan, same};
use super::space::{self, Draw, Grid};
use super::table::{self, TrialFile};
use crate::command::emit::Shares;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Scenarios, by name or by file.
    #[arg(required = true, value_name = "SCENARIO")]
    pub(super) scenarios: Vec<String>,
    /// Trials of each variation, or at most so many if --sequential [default: the number that the claim requires, else
    /// 59].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=results::campaign::MAX_TRIALS))]
    pub(super) trials: Option<u64>,
    /// Claim about each variation, such as unsafe<0.1%@95 or unsafe+late<1%@99.
    #[arg(long, value_name = "CLAIM")]
    pub(super) claim: Option<Claim>,
    /// End a variation at the first look, one each 50 trials, at which its claim is shown or refuted.
    #[arg(long, requires = "claim")]
    pub(super) sequential: bool,
    /// Values by their path in the scenario, as in a cell's `set`; several grids are crossed.
    #[arg(long, value_name = "PATH=V1,V2,…", value_parser = space::grid)]
    pub(super) grid: Vec<Grid>,
    /// A value that each trial draws: uniform:LOW:HIGH, loguniform:LOW:HIGH, integer:LOW:HIGH or choice:A|B.
    #[arg(long, value_name = "PATH=HOW", value_parser = space::drawn)]
    pub(super) draw: Vec<Draw>,
    /// Only this cell.
    #[arg(long)]
    pub(super) cell: Option<String>,
    /// A policy file in place of the scenarios' own.
    #[arg(long, value_name = "FILE")]
    pub(super) policy: Option<PathBuf>,
    /// Render the sensors and run the detector.
    #[arg(long)]
    pub(super) rendered: bool,
    #[command(flatten)]
    pub(super) bring: DetectorOptions,
    #[command(flatten)]
    pub(super) engage: GuestOptions,
    /// Trials at a time [default: as many as there are cores].
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1_024))]
    pub(super) jobs: Option<u16>,
    /// Only part i of N; `holdsafe campaign merge` puts the parts together.
    #[arg(long, value_name = "i/N")]
    pub(super) partition: Option<Partition>,
    /// Run a sequential campaign's partition one round further than the merged campaign in this folder.
    #[arg(long, value_name = "DIR", requires = "partition", requires = "sequential")]
    pub(super) after: Option<PathBuf>,
    /// Keep finished trials and the result here, and resume from there [default: runs/campaign-PLAN-PROGRAM].
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
}

impl Args {
    /// Its pieces of work for partitions.
    pub(in crate::command) fn shares(&self, context: &Context) -> Result<Shares, Failure> {
        let (plan, _) = space::lay_out(context, self)?;
        let set = self.partition.is_some() || self.out.is_some() || self.after.is_some();
        Ok(Shares { pieces: plan.total(), of: "trials", threads: self.jobs, set, rounds: self.sequential })
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (plan, planned) = space::lay_out(context, args)?;
    let partition = args.partition.unwrap_or(Partition::WHOLE);
    let label = format!("campaign-{}-{}", &plan.digest()[..12], &context.program[..12]);
    let default = context.runs_folder()?.join(&label);
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), &label)?;
    let journal = Journal::open(&dir, &plan, &context.stop)?;
    out::write_manifest(&dir, &out::Manifest::new(context, &planned)?)?;
    let known = Known { journal: &journal, merged: merged(args, &plan)? };
    let jobs = args.jobs.map_or_else(parallel::cores, usize::from);
    all(context, &plan, &planned, partition, jobs, &known).map_err(|failure| match failure.exit() {
        Exit::Interrupted => stopped(&dir, &plan, &journal),
        Exit::Fine | Exit::Internal | Exit::Usage | Exit::Unexpected | Exit::NoEvidence | Exit::Environment => failure,
    })?;
    let campaign = conclude(&dir, &plan, &journal, partition)?;
    print_result(context, &dir, &campaign)?;
    Ok(exit(&campaign, partition.is_whole()))
}

/// The finished trials that a partition knows of.
struct Known<'a> {
    journal: &'a Journal,
    /// Trials that were merged when its round began.
    merged: BTreeMap<u64, Outcome>,
}

impl Known<'_> {
    fn outcome(&self, number: u64) -> Option<Outcome> {
        self.journal.outcome(number).or_else(|| self.merged.get(&number).copied())
    }
}

/// Trials of the campaign that `--after` names; none before the first round has been merged.
fn merged(args: &Args, plan: &Plan) -> Result<BTreeMap<u64, Outcome>, Failure> {
    let mut merged = BTreeMap::new();
    if let Some(directory) = args.after.as_deref().filter(|directory| directory.exists()) {
        same(directory, plan, &read_plan(directory)?)?;
        each_row(directory, plan, |row| {
            merged.insert(row.trial, row.outcome);
            Ok(())
        })?;
    }
    Ok(merged)
}

/// Runs every trial of the partition that is not finished: all at once, in a sequential campaign look by look, and of a partition of one
/// a single round.
fn all(
    context: &Context,
    plan: &Plan,
    planned: &[Planned],
    partition: Partition,
    jobs: usize,
    known: &Known<'_>,
) -> Result<(), Failure> {
    let finished = |number: &u64| known.outcome(*number).is_some();
    let most = (0..plan.total()).filter(|number| partition.holds(*number) && !finished(number)).count();
    let progress = Progress::new("campaign", most, context.talk);
    loop {
        let variations = 0..plan.variations.len();
        let wanted = variations.flat_map(|v| {
            let wanted = match partition.is_whole() {
                true => plan.wanted(v, |number| known.outcome(number)),
                false => plan.wanted_in_round(v, |number| known.outcome(number)),
            };
            (0..wanted).map(move |i| plan.number(v, i))
        });
        let missing: Vec<u64> = wanted.filter(|n| partition.holds(*n) && !finished(n)).collect();
        if missing.is_empty() {
            progress.finish();
            return Ok(());
        }
        batch::each(jobs, missing.len(), &context.stop, |k| {
            let row = one(context, plan, planned, missing[k], &progress)?;
            known.journal.add(plan, &row)?;
            progress.step();
            Ok(())
        })?;
    }
}

fn one(
    context: &Context,
    plan: &Plan,
    planned: &[Planned],
    number: u64,
    progress: &Progress,
) -> Result<TrialRow, Failure> {
    let (v, i) = plan.place(number);
    let planned = planned.get(v).ok_or_else(|| Failure::internal("a trial without a variation"))?;
    let drawn = plan.drawn(v, i);
    let scenario = planned.variation.with_settings(&drawn).map_err(|error| plan::unfit(&planned.variation, &error))?;
    let variation = Variation { cell: planned.variation.cell.clone(), scenario };
    let planned = Planned { variation, command: Some(plan.command(v, i)), ..planned.clone() };
    let trial = batch::trial(planned.mode(), &planned, &planned.setup, plan.seed(i), &context.stop)?;
    progress.count(trial.outcome as usize, trial.outcome.name());
    Ok(TrialRow::from_trial(number, &trial))
}

/// Message after Ctrl-C.
fn stopped(dir: &Path, plan: &Plan, journal: &Journal) -> Failure {
    let (n, total, dir) = (journal.len(), plan.total(), dir.display());
    let message = format!("stopped; {n} of {total} trials are finished and kept in {dir}, and none of them runs again");
    let resume = format!("to go on, the same command again: {}", runner::own_line());
    Failure::new(Exit::Interrupted, format!("{message}\n{resume}"))
}

/// Folds the journal's trials into the folder's `campaign.json` and `trials.parquet`: those that count, and of a partition, which cannot know
/// which count, all.
pub(super) fn conclude(
    dir: &Path,
    plan: &Plan,
    journal: &Journal,
    partition: Partition,
) -> Result<CampaignObject, Failure> {
    let mut table = TrialFile::create(dir, plan)?;
    let of_journal = (|number| journal.outcome(number), |number| journal.row(number));
    let campaign = folded(plan, partition.is_whole(), of_journal, |v, i, row| table.add_trial(v, i, row))?;
    table.finish()?;
    out::write_result(dir, "campaign.json", "campaign", &campaign)?;
    Ok(campaign)
}

/// Folds the finished trials that count, and of a partition all; `outcome` and `row` give each by its number. `each` is given those that
/// are folded, in order.
pub(super) fn folded(
    plan: &Plan,
    whole: bool,
    (outcome, row): (impl Fn(u64) -> Option<Outcome>, impl Fn(u64) -> Result<Option<TrialRow>, Failure>),
    mut each: impl FnMut(usize, u64, &TrialRow) -> Result<(), Failure>,
) -> Result<CampaignObject, Failure> {
    let mut digest = Sha256::new_with_prefix("holdsafe campaign\n");
    digest.update(plan.digest());
    let mut rows = Vec::new();
    for (v, variation) in plan.variations.iter().enumerate() {
        let counts = whole.then(|| plan.wanted(v, &outcome));
        let wanted = counts.unwrap_or(plan.terms.trials);
        let mut fold = Fold::default();
        for i in 0..wanted {
            let Some(row) = row(plan.number(v, i))? else { continue };
            digest.update(line(plan, v, i, &row)?);
            each(v, i, &row)?;
            fold.take(plan, variation, i, row);
        }
        rows.push(fold.row(plan, v, variation, wanted));
    }
    Ok(CampaignObject::new(plan, hex(&digest.finalize()), rows))
}

/// A trial in the campaign's hash: a line of JSON.
fn line(plan: &Plan, v: usize, i: u64, row: &TrialRow) -> Result<String, Failure> {
    let parts = (v, plan.seed(i), plan.drawn(v, i), row.outcome, &row.log_hash);
    let text = serde_json::to_string(&parts).map_err(Failure::internal)?;
    Ok(format!("\n{text}"))
}

/// Prints the result.
pub(super) fn print_result(context: &Context, dir: &Path, campaign: &CampaignObject) -> Result<(), Failure> {
    if context.json {
        return out::print_json("campaign", campaign);
    }
    out::show(format_args!("{}{}{}", campaign_table(campaign), unexpected_line(campaign), dir.display()));
    if !table::IS_BUILT {
        link::note!("{}", table::LEFT_OUT);
    }
    let ended: Vec<Ended> = campaign.rows.iter().map(Ended::from).collect();
    let repeated = campaign.rows.iter().find_map(|row| row.reproduce.as_ref()).map(|line| context.own_command(line));
    let other = repeated.unwrap_or_else(|| context.citation_of(dir));
    let closing = Closing::new(context).ended("variations", &ended).part(claim_line(campaign));
    closing.print([context.report_of(dir), other]);
    Ok(())
}

/// Verdicts on the claim, and trials that are missing.
fn claim_line(campaign: &CampaignObject) -> String {
    let claim = campaign.claim.as_ref().map(|claims| {
        let ClaimVerdicts { shown, refuted, open, .. } = claims;
        format!("claim shown {shown}, refuted {refuted}, open {open}")
    });
    let lacking = (!campaign.complete).then(|| format!("{} of {} trials", campaign.trials, campaign.planned));
    claim.into_iter().chain(lacking).collect::<Vec<_>>().join(" · ")
}

/// A line on unexpected trials beside a claim that is shown, which decides the exit code alone.
fn unexpected_line(campaign: &CampaignObject) -> String {
    let shown = campaign.claim.is_some_and(|claims| claims.shown > 0);
    let unexpected: u64 = campaign.rows.iter().map(|row| row.unexpected).sum();
    if !shown || unexpected == 0 {
        return String::new();
    }
    let trials = if unexpected == 1 { "1 trial" } else { &format!("{unexpected} trials") };
    format!(
        "outside of the expected classes: {trials}. The claim says nothing of them, and it alone decides the exit code; \
         campaign.json names the first of each variation\n"
    )
}

/// With a claim the claim decides; otherwise the expected classes do. A campaign that lacks trials is no evidence. A partition is not
/// judged: what its trials say is said once, by the merged campaign.
pub(super) fn exit(campaign: &CampaignObject, whole: bool) -> Exit {
    if let Some(claims) = campaign.claim {
        return match (claims.refuted, claims.open) {
            (0, 0) => Exit::Fine,
            (0, _) => Exit::NoEvidence,
            _ => Exit::Unexpected,
        };
    }
    if !whole {
        return Exit::Fine;
    }
    if !campaign.complete {
        return Exit::NoEvidence;
    }
    let unexpected = campaign.rows.iter().filter(|row| row.unexpected > 0);
    let invalid =
        |row: &results::report::CampaignRow| row.outcomes.get(&Outcome::Invalid).is_some_and(|n| *n == row.unexpected);
    let only_invalid = unexpected.clone().all(invalid);
    match (unexpected.count(), only_invalid) {
        (0, _) => Exit::Fine,
        (_, true) => Exit::NoEvidence,
        (_, false) => Exit::Unexpected,
    }
}
