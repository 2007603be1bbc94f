//! The end of an evaluation: its files, the unexpected rows, the rows that were not judged, the totals, and the exit code.

use std::path::Path;

use evidence::trial::{Outcome, Trial};
use results::mode::Mode;
use results::report::{AcceptedRate, Reference, ReferenceRow, latency_table, reference_table, scenario_line};
use runner::closing::Closing;
use runner::ended::Ended;
use runner::failure::{Exit, Failure};
use runner::plan::Planned;
use runner::{Context, batch, out, own_arguments};

use super::Args;
use super::parts::{FIRST, Part, QUICK_TRIALS};
use super::remaining::group_digits;

/// File of the whole table.
const TABLE: &str = "table.txt";
/// File of the result.
pub(super) const RESULT: &str = "reference.json";

/// A row, and the gravest of its trials that was not as expected.
pub(super) struct Judged {
    pub(super) row: ReferenceRow,
    unexpected: Option<Unexpected>,
}

struct Unexpected {
    outcome: Outcome,
    /// Reasons in brackets.
    why: String,
    /// Command that repeats the trial.
    reproduce: String,
}

impl Judged {
    /// The row of one variation of a part.
    pub(super) fn new(part: &Part, planned: &Planned, mode: Mode, trials: &[Trial]) -> Self {
        let variation = &planned.variation;
        let place = (part.platform.clone(), variation.cell.clone());
        let sensing = (mode, planned.setup.rendered);
        let row = ReferenceRow::new(&variation.scenario, place, sensing, &trials.iter().collect::<Vec<_>>());
        let judged = trials.iter().filter(|trial| trial.host_stall_ms.is_none());
        let unexpected = judged.filter(|trial| {
            trial.outcome.is_unexpected(&row.expected) && !AcceptedRate::covers(&row.accepted, trial.outcome)
        });
        // INVALID says less than any other class.
        let gravest = unexpected.min_by_key(|trial| (trial.outcome == Outcome::Invalid, trial.outcome));
        let unexpected = gravest.map(|trial| Unexpected {
            outcome: trial.outcome,
            why: batch::reasons(trial),
            reproduce: batch::reproduce(mode, planned, trial.seed),
        });
        Self { row, unexpected }
    }

    fn name(&self) -> String {
        format!("{} ({})", self.row.name(), self.row.mode.name())
    }
}

/// Writes the result and prints the end of the evaluation.
pub(super) fn finish(context: &Context, args: &Args, dir: &Path, judged: &[Judged]) -> Result<Exit, Failure> {
    let reference = Reference::new(context.seed, judged.iter().map(|judged| judged.row.clone()).collect());
    let table = [quick_line(args), reference_table(&reference), paper_table(&reference)].concat();
    out::write_result(dir, RESULT, "reference", &reference)?;
    out::write_text(dir, TABLE, &table)?;
    let exceptions = [accepted_lines(judged), unexpected_lines(judged), spoilt_lines(judged)].concat();
    if context.json {
        exceptions.iter().for_each(out::note);
        out::print_json("reference", &reference)?;
        return Ok(exit(judged));
    }
    if args.table {
        out::show(format_args!("\n{}", table.trim_end()));
    }
    out::say(format_args!(""));
    exceptions.iter().for_each(out::show);
    out::show(format_args!("{}{}", paper_lines(&reference), paper_table(&reference)));
    out::say(format_args!("{}{}", quick_line(args), totals(context, judged)));
    out::say(format_args!("the whole table is in {}, the result in {RESULT} beside it", dir.join(TABLE).display()));
    let repeat = repeat_line(judged);
    repeat.iter().for_each(out::show);
    let odd = |judged: &Judged| Some(context.own_command(&judged.unexpected.as_ref()?.reproduce));
    let again = repeat.map(|_| context.own_command(&own_arguments(&[])));
    let other = judged.iter().find_map(odd).or(again).unwrap_or_else(|| context.citation_of(dir));
    let ended: Vec<Ended> = judged.iter().map(|judged| Ended::from(&judged.row)).collect();
    Closing::new(context).ended("rows", &ended).print([context.report_of(dir), other]);
    Ok(exit(judged))
}

/// 0 only where every row was judged and is as expected. A live run that the host spoilt is no failure of the platform, and no evidence
/// either: the same command repeats it.
fn exit(judged: &[Judged]) -> Exit {
    let mut unexpected = judged.iter().filter_map(|judged| judged.unexpected.as_ref());
    if unexpected.any(|trial| trial.outcome != Outcome::Invalid) {
        Exit::Unexpected
    } else if !judged.is_empty() && judged.iter().all(|judged| judged.row.is_as_expected()) {
        Exit::Fine
    } else {
        Exit::NoEvidence
    }
}

/// Every row with trials of a class that is accepted below a rate.
fn accepted_lines(judged: &[Judged]) -> Vec<String> {
    let lines = |judged: &Judged| {
        let rates = judged.row.accepted.iter().filter_map(AcceptedRate::line);
        rates.map(|line| format!("{}: {line}", judged.name())).collect::<Vec<_>>()
    };
    judged.iter().flat_map(lines).collect()
}

/// Every row that was not as expected, with the line that runs its gravest trial again.
fn unexpected_lines(judged: &[Judged]) -> Vec<String> {
    let mut lines = Vec::new();
    for (judged, trial) in judged.iter().filter_map(|judged| Some((judged, judged.unexpected.as_ref()?))) {
        let row = &judged.row;
        let (outcome, n) = (trial.outcome.name(), row.summary.n);
        let expected: Vec<&str> = row.expected.iter().map(|class| class.name()).collect();
        let expected = if expected.is_empty() { "any other".to_owned() } else { expected.join(" or ") };
        lines.push(format!(
            "not as expected: {}: {} of {n}, {outcome}{}, expected {expected}",
            judged.name(),
            row.unexpected,
            trial.why
        ));
        lines.push(format!("    reproduce: {}", trial.reproduce));
    }
    lines
}

/// Every row with trials that the host spoilt.
fn spoilt_lines(judged: &[Judged]) -> Vec<String> {
    let line = |judged: &Judged| {
        let longest = judged.row.not_judged_ms.iter().copied().max_by(f64::total_cmp)?;
        Some(format!("not judged: {}: the host stalled for {longest:.0} ms", judged.name()))
    };
    judged.iter().filter_map(line).collect()
}

/// The last line where the host spoilt any.
fn repeat_line(judged: &[Judged]) -> Option<String> {
    let live = judged.iter().filter(|judged| judged.row.mode == Mode::Live);
    let (all, spoilt) = live
        .fold((0, 0), |(all, spoilt), judged| (all + judged.row.summary.n, spoilt + judged.row.not_judged_ms.len()));
    let line = format!(
        "{spoilt} of {all} live runs not judged (the host was busy): run the same command again to repeat only these"
    );
    (spoilt > 0).then_some(line)
}

/// Rows of the paper's findings, each mode for itself.
fn paper_lines(reference: &Reference) -> String {
    let mut lines = String::new();
    for name in FIRST {
        for mode in [Mode::Twin, Mode::Live] {
            let own_rows = reference.rows.iter().filter(|row| row.scenario == name && row.platform.is_none());
            let rows: Vec<&ReferenceRow> = own_rows.filter(|row| row.mode == mode).collect();
            if !rows.is_empty() {
                lines.push_str(&format!("{}\n", scenario_line(name, &rows)));
            }
        }
    }
    if lines.is_empty() { lines } else { format!("the paper's rows:\n{lines}") }
}

/// Live latencies beside the paper's, where there are any.
fn paper_table(reference: &Reference) -> String {
    match reference.live_latency_ms.as_slice() {
        [] => String::new(),
        rows => latency_table(rows),
    }
}

fn totals(context: &Context, judged: &[Judged]) -> String {
    let n = |mode: Mode| {
        let rows = judged.iter().filter(|judged| judged.row.mode == mode);
        group_digits(rows.map(|judged| judged.row.summary.n).sum())
    };
    let fine = judged.iter().filter(|judged| judged.row.is_as_expected()).count();
    format!(
        "{fine} of {} rows as expected, seed {}: {} trials in the twin, {} on the real stacks in memory, {} live runs",
        judged.len(),
        context.seed,
        n(Mode::Twin),
        n(Mode::Stack),
        n(Mode::Live)
    )
}

/// Description of a smoke check; empty for a whole evaluation.
fn quick_line(args: &Args) -> String {
    match args.quick {
        true => format!(
            "a smoke check: n = {QUICK_TRIALS} of each scenario and cell in the twin or on the stacks, none live; no percentile is claimed\n"
        ),
        false => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::slice;

    use runner::plan::{self, PlanOptions};

    use runner::shipped::Shipped;

    use super::*;

    /// A live row of trials of `loss`.
    fn row(trials: &[Trial]) -> Judged {
        let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let (talk, stop) = (parallel::progress::Talk::Quiet, parallel::progress::Stop::default());
        let (json, seed, seed_is_named, shipped, started_us) = (false, 1, false, Shipped::default(), 0);
        let context =
            Context { json, seed, seed_is_named, talk, root: Some(root), stop, started_us, program: "", shipped };
        let file = plan::file_of(&context, "loss").unwrap();
        let (scenario, simulated) = plan::plan(&context, &file, &PlanOptions::default()).unwrap();
        let part = Part { scenario, platform: None, simulated, live: Vec::new() };
        Judged::new(&part, &part.simulated[0], Mode::Live, trials)
    }

    #[test]
    fn exit_is_fine_only_where_all_was_judged() {
        let fine = Trial::example(1, Outcome::HoldSafe);
        let spoilt = Trial { host_stall_ms: Some(312.4), ..Trial::example(1, Outcome::Invalid) };
        let (invalid, late) = (Trial::example(2, Outcome::Invalid), Trial::example(3, Outcome::Late));
        assert_eq!(exit(&[row(slice::from_ref(&fine))]), Exit::Fine);
        assert_eq!(exit(&[row(slice::from_ref(&fine)), row(slice::from_ref(&spoilt))]), Exit::NoEvidence);
        assert_eq!(exit(&[row(slice::from_ref(&invalid))]), Exit::NoEvidence);
        assert_eq!(exit(&[row(&[invalid, spoilt.clone(), late, fine.clone()])]), Exit::Unexpected);
        assert_eq!(exit(&[]), Exit::NoEvidence);

        let judgeds = [row(&[fine]), row(&[spoilt])];
        assert_eq!(spoilt_lines(&judgeds), ["not judged: loss (live): the host stalled for 312 ms"]);
        assert!(unexpected_lines(&judgeds).is_empty());
        assert!(repeat_line(&judgeds).is_some_and(|line| line.starts_with("1 of 2 live runs not judged")));
    }

    #[test]
    fn unexpected_rows_name_their_gravest_trial() {
        let trials = [Trial::example(2, Outcome::Invalid), Trial::example(3, Outcome::Late)];
        let lines = unexpected_lines(&[row(&trials)]);
        assert_eq!(lines[0], "not as expected: loss (live): 2 of 2, LATE, expected HOLD_SAFE");
        assert_eq!(lines[1], "    reproduce: holdsafe run loss --trials 1 --seed 3 --live");
        assert_eq!(repeat_line(&[row(&trials)]), None);
    }
}
