//! `lab judges`: the oracle beside the second judge (`tools/judge`), over logs of the twin.
//!
//! The logs cover every variation of every scenario with a platform, each as it is, with its receipts denied,
//! and with each check of the policy waived in turn: the seeded defects. The second judge is given the lines that a run
//! leaves (`recording::events::write_lines`) and no output of the oracle. Properties for which it has no rule it lists, and those
//! are counted apart: to abstain is no agreement.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, PoisonError};

use evidence::ablation::Switch;
use evidence::trial::Outcome;
use evidence::{Evidence, SCHEMA_VERSION};
use oracle::Verdict;
use parallel::progress::Progress;
use recording::events::write_lines;
use runner::failure::{Exit, Failure};
use runner::plan::Planned;
use runner::{Context, engine, out, plan};
use serde::{Deserialize, Serialize};
use topology::is_attacked;

/// Largest number of disagreements printed in full.
const MAX_TOLD: usize = 50;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Logs to judge.
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    logs: u64,
    /// The second judge [default: tools/judge].
    #[arg(long, value_name = "PATH")]
    judge: Option<PathBuf>,
}

/// Deliberate defect of a log.
#[derive(Clone, Copy)]
enum Defect {
    None,
    Denied,
    Waived(Switch),
}

/// Verdict of the second judge.
#[derive(Debug, Deserialize)]
struct Second {
    outcome: Option<Outcome>,
    findings: Vec<String>,
    not_judged: Vec<String>,
    latency_ms: BTreeMap<String, Option<f64>>,
}

/// Two judges, one log, two classes.
#[derive(Debug, Serialize)]
struct Disagreement {
    case: String,
    seed: u64,
    oracle: Outcome,
    oracle_says: Vec<String>,
    second: Outcome,
    second_says: Vec<String>,
}

#[derive(Debug, Default, Serialize)]
struct Compared {
    schema_version: u32,
    seed: u64,
    logs: u64,
    agree: u64,
    abstained: u64,
    disagree: u64,
    /// Agreed class, and latencies of more than a microsecond's difference.
    latencies_differ: u64,
    /// Agreed, by class.
    agreed: BTreeMap<Outcome, u64>,
    /// Properties without a rule, by kind.
    not_judged: BTreeMap<String, u64>,
    disagreements: Vec<Disagreement>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let judge = match &args.judge {
        Some(judge) => judge.clone(),
        None => context.root()?.join("tools").join("judge"),
    };
    let cases = plan::plan_shipped(context)?;
    let defects = defects();
    let progress = Progress::new("logs", args.logs as usize, context.talk);
    let compared = Mutex::new(Compared { schema_version: SCHEMA_VERSION, seed: context.seed, ..Compared::default() });
    let threads = parallel::cores();
    parallel::each(threads, threads, |thread| {
        let mut second = Judge::start(&judge)?;
        for i in (thread as u64..args.logs).step_by(threads) {
            if context.stop.is_requested() {
                return Err(Failure::from(runner::error::EngineError::Stopped));
            }
            // Every defect meets every case: the shift lets few logs cover many defects.
            let (case, round) = (i as usize % cases.len(), i as usize / cases.len());
            let defect = defects[(case + round) % defects.len()];
            one(&mut second, &cases[case], defect, context.seed + i, &compared)?;
            progress.step();
        }
        Ok(())
    })?;
    progress.finish();
    let mut compared = compared.into_inner().unwrap_or_else(PoisonError::into_inner);
    compared.disagreements.sort_by(|a, b| (&a.case, a.seed).cmp(&(&b.case, b.seed)));
    compared.disagreements.truncate(MAX_TOLD);
    if context.json {
        out::print_json("bench-judges", &compared)?;
    } else {
        show(&compared);
    }
    Ok(if compared.disagree > 0 { Exit::Unexpected } else { Exit::Fine })
}

fn defects() -> Vec<Defect> {
    [Defect::None, Defect::Denied].into_iter().chain(Switch::all().into_iter().map(Defect::Waived)).collect()
}

/// One log before both judges.
fn one(
    second: &mut Judge,
    case: &Planned,
    defect: Defect,
    seed: u64,
    compared: &Mutex<Compared>,
) -> Result<(), Failure> {
    let (evidence, verdict, name) = made(case, defect, seed)?;
    let told = second.ask(&evidence)?;
    let mut c = compared.lock().unwrap_or_else(PoisonError::into_inner);
    c.logs += 1;
    told.not_judged.into_iter().for_each(|kind| *c.not_judged.entry(kind).or_default() += 1);
    match told.outcome {
        None => c.abstained += 1,
        Some(class) if class == verdict.outcome => {
            c.agree += 1;
            *c.agreed.entry(class).or_default() += 1;
            let of = |key: &str| told.latency_ms.get(key).copied().flatten();
            let near = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(a == b, |(a, b)| (a - b).abs() < 0.001);
            let our_latency = verdict.latency;
            let same =
                near(of("to_degraded"), our_latency.to_degraded) && near(of("to_hold_safe"), our_latency.to_hold_safe);
            c.latencies_differ += u64::from(!same);
        }
        Some(class) => {
            c.disagree += 1;
            let texts = verdict
                .findings
                .iter()
                .take(5)
                .map(|f| format!("{:?} at {} ms: {}", f.property, f.at_us / 1000, f.message));
            let oracle_says = texts.chain((!verdict.receipt).then(|| "no receipt".to_owned())).collect();
            c.disagreements.push(Disagreement {
                case: name,
                seed,
                oracle: verdict.outcome,
                oracle_says,
                second: class,
                second_says: told.findings,
            });
        }
    }
    Ok(())
}

fn made(case: &Planned, defect: Defect, seed: u64) -> Result<(Evidence, Verdict, String), Failure> {
    let (scenario, mut setup) = (&case.variation.scenario, case.setup.clone());
    let cell = case.variation.cell.as_deref().map(|c| format!(" {c}")).unwrap_or_default();
    let name = format!("{}{cell}", scenario.name.as_str());
    let (name, denied) = match defect {
        Defect::Denied if is_attacked(scenario) => (format!("{name}, denied"), true),
        Defect::None | Defect::Denied => (name, false),
        Defect::Waived(switch) => {
            switch.waive(&mut setup.policy);
            (format!("{name}, {} waived", switch.name()), false)
        }
    };
    let (evidence, verdict) = match denied {
        true => engine::run_denied(&scenario.sabotaged(), &setup, seed)?,
        false => engine::twin_verdict(scenario, &setup, seed)?,
    };
    Ok((evidence, verdict, name))
}

/// The second judge, its own process.
struct Judge {
    process: Child,
    to: Option<BufWriter<ChildStdin>>,
    from: BufReader<ChildStdout>,
}

impl Judge {
    fn start(file: &Path) -> Result<Self, Failure> {
        let started = Command::new("python3").arg(file).arg("-").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let missing = |e| Failure::new(Exit::Environment, format!("python3 {}: {e}", file.display()));
        let mut process = started.map_err(missing)?;
        let pipes = process.stdin.take().zip(process.stdout.take());
        let (to, from) = pipes.ok_or_else(|| Failure::internal("the second judge has no pipes"))?;
        Ok(Self { process, to: Some(BufWriter::new(to)), from: BufReader::new(from) })
    }

    fn ask(&mut self, evidence: &Evidence) -> Result<Second, Failure> {
        let Some(to) = &mut self.to else { return Err(Failure::internal("the second judge is gone")) };
        write_lines(to, evidence)?;
        to.write_all(b"{\"end\":true}\n")?;
        to.flush()?;
        let mut line = String::new();
        self.from.read_line(&mut line)?;
        serde_json::from_str(&line).map_err(|e| Failure::internal(format!("the second judge said no verdict: {e}")))
    }
}

impl Drop for Judge {
    /// The process ends at the end of its input; it is waited for.
    fn drop(&mut self) {
        self.to = None;
        let _gone = self.process.wait();
    }
}

fn show(c: &Compared) {
    let Compared { logs, agree, abstained, disagree, latencies_differ, .. } = c;
    out::say(format_args!(
        "{logs} logs: {agree} agree, {disagree} disagree, {abstained} not judged by the second judge"
    ));
    out::say(format_args!("latencies differ in {latencies_differ} of those that agree"));
    let classes: Vec<String> = c.agreed.iter().map(|(class, n)| format!("{} {n}", class.name())).collect();
    out::say(format_args!("agreed: {}", classes.join(", ")));
    let unknown: Vec<String> = c.not_judged.iter().map(|(kind, n)| format!("{kind} {n}")).collect();
    out::say(format_args!("no rule for: {}", unknown.join(", ")));
    for d in &c.disagreements {
        let (oracle, second) = (d.oracle.name(), d.second.name());
        out::say(format_args!("{} (seed {}): oracle {oracle}, second judge {second}", d.case, d.seed));
        d.oracle_says.iter().for_each(|text| out::say(format_args!("  oracle: {text}")));
        d.second_says.iter().take(5).for_each(|text| out::say(format_args!("  second: {text}")));
    }
}
