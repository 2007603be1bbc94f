//! Rows of the tour: trials of one variation in one mode, held against the classes that its scenario expects.

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Outcomes, Trial, by_name};
use results::mode::Mode;
use runner::batch;
use runner::failure::Exit;
use runner::plan::Planned;
use serde::Serialize;

use super::words;

/// One variation in one mode.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    /// Scenario.
    pub(super) scenario: String,
    /// Cell, where it has any.
    pub(super) cell: Option<String>,
    /// Conduct of the guest that drove, where one did.
    pub(super) guest: Option<&'static str>,
    /// Twin or live.
    pub(super) mode: Mode,
    /// Trials.
    pub(super) n: usize,
    /// Their classes.
    #[serde(serialize_with = "by_name")]
    pub(super) outcomes: Outcomes,
    /// Classes that the scenario expects.
    pub(super) expected: Vec<Outcome>,
    /// Reason for which the row is shown and not judged, where there is one.
    pub(super) not_judged: Option<String>,
    /// True if every trial ended in an expected class; none where the row is not judged.
    pub(super) as_expected: Option<bool>,
    /// Attack, by the scenario's title.
    pub(super) attacked: String,
    /// Response of the platform and its reason, from the trials' own records.
    pub(super) response: String,
    /// Command that runs the first trial again, of unexpected ones the first of these.
    pub(super) reproduce: String,
}

impl Row {
    /// Row of `trials` of a variation under the base seed.
    pub(super) fn new(
        (planned, mode, seed): (&Planned, Mode, u64),
        trials: &[&Trial],
        not_judged: Option<String>,
        response: String,
    ) -> Self {
        let scenario = &planned.variation.scenario;
        let expected = scenario.expected.to_vec();
        let mut outcomes = Outcomes::new();
        trials.iter().for_each(|trial| *outcomes.entry(trial.outcome).or_default() += 1);
        let odd = trials.iter().find(|trial| trial.outcome.is_unexpected(&expected));
        Self {
            scenario: scenario.name.as_str().to_owned(),
            cell: planned.variation.cell.clone(),
            guest: planned.setup.guest.as_ref().map(|guest| guest.conduct.name()),
            mode,
            n: trials.len(),
            as_expected: not_judged.is_none().then_some(odd.is_none()),
            not_judged,
            attacked: scenario.title.as_str().to_owned(),
            response,
            reproduce: batch::reproduce(mode, planned, odd.map_or(seed, |trial| trial.seed)),
            outcomes,
            expected,
        }
    }

    /// Name in lines.
    pub(super) fn name(&self) -> String {
        let cell = self.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
        let guest = self.guest.map(|conduct| format!(" with a {conduct} guest")).unwrap_or_default();
        format!("{}{cell}{guest}, {}", self.scenario, self.mode.name())
    }

    /// Exit code of the tour by this row alone.
    pub(super) fn exit(&self) -> Exit {
        let mut odd = self.outcomes.keys().filter(|class| class.is_unexpected(&self.expected));
        match self.as_expected {
            None | Some(true) => Exit::Fine,
            Some(false) if odd.any(|class| *class != Outcome::Invalid) => Exit::Unexpected,
            Some(false) => Exit::NoEvidence,
        }
    }

    /// Mark at the margin.
    pub(super) fn mark(&self) -> &'static str {
        match self.as_expected {
            Some(true) => "ok",
            Some(false) => "FAIL",
            None if self.guest.is_some() => "note",
            None => "----",
        }
    }

    /// Line before the row's text: name, trials and their classes.
    pub(super) fn heading(&self) -> String {
        let (name, n, classes) = (self.name(), self.n, words::classes(&self.outcomes));
        match (&self.not_judged, self.as_expected) {
            (Some(why), _) if self.guest.is_some() => format!("{name}, n = {n}: {classes}; not judged: {why}"),
            (Some(why), _) => format!("{name}: not judged: {why}"),
            (None, Some(false)) => format!("{name}, n = {n}: {classes}, expected {}", self.expected_classes()),
            (None, _) => format!("{name}, n = {n}: {classes}"),
        }
    }

    /// Complaint where an expectation failed: row, expected, got and the command that reproduces it.
    pub(super) fn complaint(&self) -> Option<String> {
        let description = || format!("{}: expected {}", self.name(), self.expected_classes());
        (self.as_expected == Some(false)).then(|| {
            let got = report::tried::class_counts(&self.outcomes);
            format!("{}, got {got} of {}\nreproduce: {}", description(), self.n, self.reproduce)
        })
    }

    fn expected_classes(&self) -> String {
        self.expected.iter().map(|class| class.name()).collect::<Vec<_>>().join(" or ")
    }
}

/// The whole tour, as one object.
#[derive(Debug, Serialize)]
pub(super) struct TourObject {
    schema_version: u32,
    seed: u64,
    rows: Vec<Row>,
    /// True if every judged row is as expected.
    as_expected: bool,
    /// Live runs of the tour.
    live: usize,
    /// Live runs that were not judged.
    live_not_judged: usize,
    /// True if the user stopped it before its end.
    interrupted: bool,
    directory: String,
    /// Path of the HTML page, where it was written.
    report: Option<String>,
    /// Commands to go on with.
    next: Vec<String>,
}

impl TourObject {
    /// Object for the rows so far; `live` runs were planned.
    pub(super) fn new(seed: u64, rows: Vec<Row>, live: usize, interrupted: bool, directory: String) -> Self {
        let as_expected = rows.iter().all(|row| row.as_expected != Some(false));
        let unjudged = |row: &&Row| row.mode == Mode::Live && row.not_judged.is_some();
        let live_not_judged = rows.iter().filter(unjudged).count();
        let schema_version = SCHEMA_VERSION;
        let (report, next) = (None, words::next_commands());
        Self { schema_version, seed, rows, as_expected, live, live_not_judged, interrupted, directory, report, next }
    }

    /// The object with the path of the page that was written.
    pub(super) fn with_report(self, report: String) -> Self {
        Self { report: Some(report), ..self }
    }

    /// The closing lines.
    pub(super) fn closing(&self) -> Vec<String> {
        let judged = self.rows.iter().filter(|row| row.as_expected.is_some()).count();
        let failed = self.rows.iter().filter(|row| row.as_expected == Some(false)).count();
        let verdict = match failed {
            _ if judged == 0 => "0 rows judged.".to_owned(),
            0 => format!("{judged} rows judged, each in the classes that its scenario expects."),
            _ => format!("{failed} of {judged} judged rows are outside the classes that their scenarios expect."),
        };
        let stopped = self.interrupted.then(|| "Stopped before its end; the rows above are complete.".to_owned());
        let unjudged = (self.live_not_judged > 0).then(|| {
            format!("{} of {} live runs were not judged; nothing follows from them.", self.live_not_judged, self.live)
        });
        let report = self.report.as_ref().map(|path| format!("Report: {path}"));
        [Some(verdict), stopped, unjudged, report].into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spoilt() -> Row {
        Row {
            scenario: "nominal".to_owned(),
            cell: None,
            guest: None,
            mode: Mode::Live,
            n: 1,
            outcomes: Outcomes::from([(Outcome::Invalid, 1)]),
            expected: vec![Outcome::Nominal],
            not_judged: Some(words::host_stalled(312.0)),
            as_expected: None,
            attacked: "Null attack".to_owned(),
            response: String::new(),
            reproduce: "holdsafe run nominal --trials 1 --seed 1 --live".to_owned(),
        }
    }

    #[test]
    fn spoilt_live_run_is_named_unjudged() {
        let row = spoilt();
        assert_eq!(
            (row.mark(), row.heading().as_str()),
            ("----", "nominal, live: not judged: the host stalled for 312 ms")
        );
        assert_eq!((row.exit(), row.complaint()), (Exit::Fine, None));
        let tour = TourObject::new(1, vec![row], 3, false, String::new());
        let closing = tour.closing();
        assert!(closing.iter().any(|line| line.starts_with("1 of 3 live runs were not judged")), "{closing:?}");
        assert!(closing[0].starts_with("0 rows judged"), "never turned into a pass: {closing:?}");
    }

    #[test]
    fn invalid_row_alone_is_missing_evidence() {
        let judged = Row { not_judged: None, as_expected: Some(false), ..spoilt() };
        assert_eq!(judged.exit(), Exit::NoEvidence);
        let complaint = judged.complaint().unwrap();
        assert!(
            complaint.contains("expected NOMINAL, got INVALID 1 of 1\nreproduce: holdsafe run nominal"),
            "{complaint}"
        );
        let other = Row { outcomes: Outcomes::from([(Outcome::Late, 1)]), ..judged };
        assert_eq!(other.exit(), Exit::Unexpected);
    }
}
