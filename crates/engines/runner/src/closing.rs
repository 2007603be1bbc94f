//! The end of a command that measures, for a person: a summary in one line, and two commands to go on with.
//!
//! The summary is no result: it has the time that the command took, which no object has. With `--json` it is not printed.

use std::path::{Path, PathBuf};

use evidence::trial::{Outcome, Trial};
use parallel::progress::duration;
use recording::{Checked, RunFolder};
use results::mode::Mode;
use results::report::width;

use crate::batch::{self, Batch, odd, reproduce};
use crate::ended::Ended;
use crate::failure::Failure;
use crate::plan::Planned;
use crate::{Context, checked, out, own_arguments, quoted};

/// Classes that a summary counts besides UNSAFE, where any trial ended in them.
const COUNTED: [Outcome; 6] =
    [Outcome::GuestFailed, Outcome::Invalid, Outcome::Late, Outcome::FalseTrip, Outcome::Undetected, Outcome::Stuck];
/// Recordings that are verified at the end of a command, at most.
const MOST_VERIFIED: usize = 32;
/// Time below which a summary has tenths of seconds.
const SHORT_S: f64 = 120.0;
/// Space between the commands of a line.
const GAP: &str = "   ";
/// Word before the commands.
const NEXT: &str = "next: ";

/// Parts of a summary, in their order.
#[derive(Clone, Debug)]
pub struct Closing<'a> {
    context: &'a Context,
    parts: Vec<String>,
}

impl<'a> Closing<'a> {
    /// A summary without any part.
    pub fn new(context: &'a Context) -> Self {
        Self { context, parts: Vec::new() }
    }

    /// Adds a part; an empty one is left out.
    #[must_use]
    pub fn part(mut self, text: impl Into<String>) -> Self {
        self.parts.extend(Some(text.into()).filter(|text| !text.is_empty()));
        self
    }

    /// Adds how the trials of these variations ended; `rows` is the plural name of a variation.
    #[must_use]
    pub fn ended(mut self, rows: &str, all: &[Ended]) -> Self {
        self.parts.extend(ended(rows, all));
        self
    }

    /// Verifies the recordings in these folders, and adds the result; that there is none, too.
    ///
    /// # Errors
    /// When one cannot be read at all.
    pub fn verified(self, folders: &[PathBuf]) -> Result<Self, Failure> {
        if self.context.json {
            return Ok(self);
        }
        let first = folders.iter().take(MOST_VERIFIED).map(|folder| checked::open_run(RunFolder::new(folder)));
        let checked: Vec<Checked> = first.collect::<Result<_, _>>()?;
        Ok(self.checked(&checked.iter().collect::<Vec<_>>(), folders.len()))
    }

    /// Adds the result of these verifications, of so many recordings.
    #[must_use]
    pub fn checked(self, read: &[&Checked], recordings: usize) -> Self {
        let broken = read.iter().filter(|run| !run.verification().holds).count();
        self.part(match (read.len(), broken) {
            (0, _) => "no evidence kept".to_owned(),
            (n, 0) if n == recordings => "evidence verified".to_owned(),
            (n, 0) => format!("evidence of {n} of {recordings} recordings verified"),
            (n, broken) => format!("evidence INVALID in {broken} of {n}"),
        })
    }

    /// Prints the summary, and the commands to go on with, each as [`Context::command`] makes it.
    pub fn print(mut self, next: [String; 2]) {
        if self.context.json {
            return;
        }
        let took_us = link::clock::trace_us().saturating_sub(self.context.started_us);
        let seconds = took_us as f64 / 1e6;
        self.parts.push(if seconds < SHORT_S { format!("{seconds:.1} s") } else { duration(seconds) });
        out::show(joined(&self.parts, " · ", width()).join("\n"));
        let lines = joined(&next, GAP, width().saturating_sub(NEXT.len()));
        out::say(format_args!("{NEXT}{}", lines.join(&format!("\n{}", " ".repeat(NEXT.len())))));
    }
}

fn ended(rows: &str, all: &[Ended]) -> Vec<String> {
    let (stated, unstated): (Vec<&Ended>, Vec<&Ended>) = all.iter().partition(|row| row.unexpected.is_some());
    let trials = |rows: &[&Ended]| rows.iter().map(|row| row.trials()).sum::<u64>();
    let (n, unexpected) = (trials(&stated), stated.iter().filter_map(|row| row.unexpected).sum::<u64>());
    let mut parts = Vec::new();
    if !stated.is_empty() {
        parts.push(format!("{} of {n} ended as stated", n - unexpected.min(n)));
    }
    if unexpected > 0 {
        parts.push(format!("UNEXPECTED {unexpected}"));
    }
    if !unstated.is_empty() {
        parts.push(format!("{} trials without a stated class", trials(&unstated)));
    }
    let all_trials = n + trials(&unstated);
    for class in COUNTED {
        let (of, text) = match all {
            [one] => (one.count(class), format!("of {all_trials}")),
            several => (
                several.iter().filter(|row| row.count(class) > 0).count() as u64,
                format!("of {} {rows}", several.len()),
            ),
        };
        if of > 0 {
            parts.push(format!("{of} {text} {}", class.name()));
        }
    }
    parts.push(format!("UNSAFE {}", all.iter().map(|row| row.count(Outcome::Unsafe)).sum::<u64>()));
    parts
}

/// The texts beside each other, as many as `width` takes; a longer one has its own line.
pub fn joined(texts: &[String], between: &str, width: usize) -> Vec<String> {
    let size = |text: &str| text.chars().count();
    let mut lines: Vec<String> = Vec::new();
    for text in texts {
        match lines.last_mut() {
            Some(line) if size(line) + size(between) + size(text) <= width => line.extend([between, text]),
            Some(_) | None => lines.push(text.clone()),
        }
    }
    lines
}

/// True if a trial of this class lost its mode for a reason, which is then explained without the changes that were asked for.
fn has_reason(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::HoldSafe | Outcome::Degraded | Outcome::FalseTrip)
}

impl Context {
    /// The command that shows why a recorded trial ended as it did: the reason for which it is no evidence, or its changes of mode.
    pub fn see_why(&self, outcome: Outcome, recording: &Path) -> String {
        let recording = recording.to_string_lossy();
        if outcome == Outcome::Invalid {
            self.command(["inspect", "verify", &recording])
        } else if has_reason(outcome) {
            self.command(["inspect", "explain", &recording])
        } else {
            self.command(["inspect", "explain", &recording, "--all"])
        }
    }

    /// The command that explains a simulated trial of a scenario, of its first cell where none is named.
    pub fn explain_of(&self, scenario: &str, cell: Option<&str>) -> String {
        let cell = cell.map(|cell| ["--cell", cell]);
        self.command(["inspect", "explain", "--all", scenario].into_iter().chain(cell.into_iter().flatten()))
    }

    /// The command that makes a page of the results in a folder.
    pub fn report_of(&self, folder: &Path) -> String {
        self.command(["report", &folder.to_string_lossy()])
    }

    /// The command that prints a citation of the results in a folder.
    pub fn citation_of(&self, folder: &Path) -> String {
        self.command(["report", "--format", "cite", &folder.to_string_lossy()])
    }

    /// A folder for a run that a next command keeps, which is free.
    pub fn free_folder(&self, label: &str) -> String {
        let free = |n: &u32| !Path::new(&format!("runs/{label}-{n}")).exists();
        format!("runs/{label}-{}", (1..=MOST_FOLDERS).find(free).unwrap_or(MOST_FOLDERS))
    }
}

/// Folders of a name that are looked through for a free one.
const MOST_FOLDERS: u32 = 10_000;

/// The trial whose reason is asked for first: the gravest that shows anything, then one that does not, then one with a change of mode; of equal
/// ones a recorded one.
fn foremost<'t>(trials: impl IntoIterator<Item = &'t Trial>) -> Option<&'t Trial> {
    let rank = |outcome| match outcome {
        Outcome::Unsafe | Outcome::GuestFailed | Outcome::Late | Outcome::FalseTrip => 0,
        Outcome::Undetected | Outcome::Stuck => 1,
        Outcome::Invalid => 2,
        Outcome::HoldSafe | Outcome::Degraded => 3,
        Outcome::Rejected | Outcome::Nominal => 4,
    };
    trials.into_iter().min_by_key(|trial| (rank(trial.outcome), trial.held.is_none(), trial.outcome))
}

/// A batch that ran, under the name that the user gave its scenario.
pub struct Ran<'a> {
    /// Name or file of the scenario.
    pub scenario: &'a str,
    /// The batch.
    pub batch: &'a Batch<'a>,
    /// Its trials.
    pub trials: &'a [Trial],
}

impl Ran<'_> {
    /// Folders of the recordings that were kept.
    pub fn recordings(&self) -> impl Iterator<Item = PathBuf> {
        self.trials.iter().filter_map(|trial| self.batch.recording(trial))
    }

    /// The line that runs this trial again and keeps it in `folder`.
    fn kept_again(&self, context: &Context, planned: &Planned, trial: &Trial, folder: &str) -> String {
        let line = reproduce(self.batch.mode, planned, trial.seed);
        context.own_command(&format!("{line} --out {}", quoted(folder)))
    }

    /// The command that explains a simulated trial without a recording, where its options are those of that command.
    fn explained(&self, context: &Context, planned: &Planned, trial: &Trial) -> Option<String> {
        let is_known = |option: &str| option.starts_with("cell ") || option.starts_with("policy ");
        let fits = self.batch.mode == Mode::Twin && planned.options.split(" --").skip(1).all(is_known);
        let all = if has_reason(trial.outcome) { "" } else { " --all" };
        let (name, seed) = (quoted(self.scenario), trial.seed);
        fits.then(|| context.own_command(&format!("inspect explain {name} --seed {seed}{}{all}", planned.options)))
    }
}

/// The commands after runs: the reason of the trial that asks for it most, and then the page, or the same again with its evidence.
pub fn next_of_runs(context: &Context, ran: &[Ran<'_>], out: Option<&Path>) -> [String; 2] {
    let odd = |ran: &&Ran<'_>| !odd(ran.batch.planned, ran.trials).is_empty();
    let chosen = ran.iter().find(odd).or(ran.first());
    let found = chosen.and_then(|ran| {
        let unexpected = batch::odd(ran.batch.planned, ran.trials);
        let trial = match unexpected.is_empty() {
            true => foremost(ran.trials),
            false => foremost(unexpected.into_iter().map(|(trial, _)| trial)),
        }?;
        Some((ran, trial, ran.batch.planned.iter().find(|planned| planned.variation.cell == trial.cell)?))
    });
    let Some((ran, trial, planned)) = found else {
        return [context.command(["doctor"]), context.command(["scenario", "list"])];
    };
    let folder = context.free_folder(planned.variation.scenario.name.as_str());
    // A trial that shows nothing may be the host's fault.
    let is_invalid = trial.outcome == Outcome::Invalid;
    let page_of_it = || if is_invalid { context.command(["doctor"]) } else { context.report_of(Path::new(&folder)) };
    let again = context.own_command(&own_arguments(&["--out", &folder]));
    match (ran.batch.recording(trial), out) {
        (Some(recording), Some(dir)) => [context.see_why(trial.outcome, &recording), context.report_of(dir)],
        (_, Some(dir)) if ran.batch.mode == Mode::Stack => [context.report_of(dir), context.citation_of(dir)],
        (_, Some(dir)) => [ran.kept_again(context, planned, trial, &folder), context.report_of(dir)],
        (_, None) if ran.batch.mode == Mode::Stack => [again, page_of_it()],
        (_, None) => match ran.explained(context, planned, trial) {
            Some(explained) => [explained, again],
            None => [ran.kept_again(context, planned, trial, &folder), page_of_it()],
        },
    }
}

#[cfg(test)]
mod tests {
    use parallel::paint::Colour;

    use super::*;

    fn row(outcomes: &[(Outcome, u64)], unexpected: Option<u64>) -> Ended {
        Ended { outcomes: outcomes.iter().copied().collect(), unexpected }
    }

    #[test]
    fn summary_counts_cells_beside_trials() {
        let held = row(&[(Outcome::HoldSafe, 20)], Some(0));
        let open = row(&[(Outcome::Undetected, 20)], Some(0));
        let text = ended("cells", &[held.clone(), open, held]).join(" · ");
        assert_eq!(text, "60 of 60 ended as stated · 1 of 3 cells UNDETECTED · UNSAFE 0");
        let text = ended("cells", &[row(&[(Outcome::Unsafe, 2), (Outcome::Late, 1)], Some(3))]).join(" · ");
        assert_eq!(text, "0 of 3 ended as stated · UNEXPECTED 3 · 1 of 3 LATE · UNSAFE 2");
        let text = ended("cells", &[row(&[(Outcome::Rejected, 2)], None)]).join(" · ");
        assert_eq!(text, "2 trials without a stated class · UNSAFE 0");
    }

    #[test]
    fn every_class_has_the_colour_of_its_meaning() {
        for outcome in Outcome::ALL {
            let expected = match outcome {
                Outcome::Unsafe | Outcome::Late | Outcome::Undetected => Some(Colour::Alarm),
                Outcome::Degraded | Outcome::FalseTrip | Outcome::Invalid | Outcome::GuestFailed | Outcome::Stuck => {
                    Some(Colour::Caution)
                }
                Outcome::HoldSafe | Outcome::Rejected | Outcome::Nominal => None,
            };
            assert_eq!(Colour::of_word(outcome.name()), expected, "{}", outcome.name());
        }
    }

    #[test]
    fn command_that_fits_no_line_stays_whole() {
        let texts = ["a b c d e f".to_owned(), "g".to_owned()];
        assert_eq!(joined(&texts, GAP, 8), ["a b c d e f", "g"]);
        assert_eq!(joined(&texts, GAP, 15), ["a b c d e f   g"]);
    }

    #[test]
    fn gravest_trial_is_asked_about_first() {
        let trials = [Outcome::HoldSafe, Outcome::Invalid, Outcome::Undetected].map(|class| Trial::example(1, class));
        assert_eq!(foremost(&trials).map(|trial| trial.outcome), Some(Outcome::Undetected));
        assert_eq!(foremost(&trials[..2]).map(|trial| trial.outcome), Some(Outcome::Invalid));
        assert!(foremost([]).is_none());
    }
}
