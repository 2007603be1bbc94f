//! The shipped scenarios in drawn worlds beside their own scene: which of their classes hold in both.

use std::collections::BTreeMap;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Outcomes, Trial};
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use stats::Share;

use super::accepted::AcceptedRate;
use super::confusion::{self, Confusion, Named, confusion_table};
use super::layout::Table;
use super::twins::{TwinPair, twins_table};

/// The result of `evaluate --worlds`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InWorlds {
    /// Version of this form.
    pub schema_version: u32,
    /// Seed of every trial in a world, of the first trial in the own scene, and of the first world of each family.
    pub seed: u64,
    /// Worlds of each family.
    pub worlds: u64,
    /// The families.
    pub families: Vec<String>,
    /// One for each scenario and cell.
    pub rows: Vec<WorldsRow>,
    /// Scenarios without a meaning in a drawn world.
    pub apart: Vec<Apart>,
    /// Sensor at fault × guard named, over all rows.
    pub confusion: Confusion,
    /// Honest faults beside the attacks that they look like, where both are among the rows.
    pub twins: Vec<TwinPair>,
}

/// A scenario, or a cell of one, in both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldsRow {
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Sensors or interface that the scenario puts at fault.
    pub at_fault: String,
    /// The attacks that it looks like, where it is an honest fault.
    pub twin_of: Vec<String>,
    /// The classes that were expected, in both.
    pub expected: Vec<Outcome>,
    /// Scenes in which the expected classes hold.
    pub holds: Holds,
    /// Trials in its own scene.
    pub own: Tally,
    /// Trials in drawn worlds, one in each.
    pub drawn: Tally,
    /// Unexpected classes in worlds, by family.
    pub otherwise: BTreeMap<String, Outcomes>,
    /// Command that repeats the gravest of these trials.
    pub reproduce: Option<String>,
}

/// Trials by class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Number of each class.
    pub outcomes: Outcomes,
    /// Trials that name a guard, by its name.
    pub named: Named,
    /// Trials outside the expected and the accepted classes, of those that were not INVALID, or may be.
    pub unexpected: Share,
    /// Trials in which every way point of the route was passed.
    pub completed: u64,
}

/// Scenes in which the expected classes hold: in every trial that was judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Holds {
    /// The claim holds in both.
    Both,
    /// The claim holds in its own scene alone.
    OwnScene,
    /// The claim holds in drawn worlds alone.
    Worlds,
    /// The claim holds in neither.
    Neither,
    /// Every trial in a world was INVALID: the thing that the attack acts on is not there.
    NotCarried,
}

/// A scenario that stays in its own scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Apart {
    /// Scenario.
    pub scenario: String,
    /// Reason.
    pub why: String,
}

impl Holds {
    /// Every one, as it is counted.
    pub const ALL: [Self; 5] = [Self::Both, Self::OwnScene, Self::Worlds, Self::Neither, Self::NotCarried];

    /// Words for it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Both => "in both",
            Self::OwnScene => "in the own scene only",
            Self::Worlds => "in worlds only",
            Self::Neither => "in neither",
            Self::NotCarried => "not carried out in worlds",
        }
    }
}

/// True unless a trial of the class shows nothing: INVALID, where the scenario does not expect it.
fn is_judged(scenario: &Scenario, class: Outcome) -> bool {
    class != Outcome::Invalid || scenario.expected.contains(&class)
}

fn is_unexpected(scenario: &Scenario, accepted: &[AcceptedRate], class: Outcome) -> bool {
    class.is_unexpected(&scenario.expected) && !AcceptedRate::covers(accepted, class)
}

impl Tally {
    /// Tally of these trials of a scenario.
    fn from_trials(scenario: &Scenario, trials: &[&Trial]) -> Self {
        let mut outcomes = Outcomes::new();
        trials.iter().for_each(|trial| *outcomes.entry(trial.outcome).or_default() += 1);
        let judged = || outcomes.iter().filter(|(class, _)| is_judged(scenario, **class));
        let n: u64 = judged().map(|(_, n)| n).sum();
        let accepted = AcceptedRate::from_outcomes(scenario, &outcomes);
        let is_unexpected = |class: Outcome| is_unexpected(scenario, &accepted, class);
        let unexpected: u64 = judged().filter(|(class, _)| is_unexpected(**class)).map(|(_, n)| n).sum();
        let progress = trials.iter().filter_map(|trial| trial.mission.as_ref()?.progress.as_ref());
        let completed =
            progress.filter(|progress| progress.total > 0 && progress.passed == progress.total).count() as u64;
        Self { unexpected: Share::new(unexpected, n), completed, named: confusion::count(trials), outcomes }
    }

    /// Trials that were not INVALID.
    pub(super) fn carried_out(&self) -> u64 {
        self.outcomes.iter().filter(|(class, _)| **class != Outcome::Invalid).map(|(_, n)| n).sum()
    }

    fn holds(&self) -> bool {
        self.unexpected.hits == 0 && self.unexpected.n > 0
    }
}

impl WorldsRow {
    /// The row of a scenario or one of its cells: of `own_trials` trials, and of those in worlds, each with the name of its family.
    pub fn new(
        scenario: &Scenario,
        cell: Option<String>,
        own_trials: &[Trial],
        drawn: &[(&'static str, &Trial)],
    ) -> Self {
        let own = Tally::from_trials(scenario, &own_trials.iter().collect::<Vec<_>>());
        let all = Tally::from_trials(scenario, &drawn.iter().map(|(_, trial)| *trial).collect::<Vec<_>>());
        let accepted = AcceptedRate::from_outcomes(scenario, &all.outcomes);
        let mut otherwise: BTreeMap<String, Outcomes> = BTreeMap::new();
        let of_others = drawn.iter().filter(|(_, trial)| {
            is_judged(scenario, trial.outcome) && is_unexpected(scenario, &accepted, trial.outcome)
        });
        for (family, trial) in of_others {
            *otherwise.entry((*family).to_owned()).or_default().entry(trial.outcome).or_default() += 1;
        }
        let drawn = all;
        let holds = match (own.holds(), drawn.holds()) {
            _ if drawn.unexpected.n == 0 => Holds::NotCarried,
            (true, true) => Holds::Both,
            (true, false) => Holds::OwnScene,
            (false, true) => Holds::Worlds,
            (false, false) => Holds::Neither,
        };
        let at_fault = confusion::at_fault(scenario);
        let twin_of = scenario.twin_of.iter().map(|attack| attack.as_str().to_owned()).collect();
        let (scenario, expected) = (scenario.name.as_str().to_owned(), scenario.expected.to_vec());
        Self { scenario, cell, at_fault, twin_of, expected, holds, own, drawn, otherwise, reproduce: None }
    }

    /// Scenario and cell.
    pub(super) fn title(&self) -> String {
        let cell = self.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
        format!("{}{cell}", self.scenario)
    }
}

impl InWorlds {
    /// Object for these rows.
    pub fn new(seed: u64, worlds: u64, families: &[&str], rows: Vec<WorldsRow>, apart: Vec<Apart>) -> Self {
        let families = families.iter().map(ToString::to_string).collect();
        let (confusion, twins) = (Confusion::from_rows(&rows), TwinPair::pair_rows(&rows));
        Self { schema_version: SCHEMA_VERSION, seed, worlds, families, rows, apart, confusion, twins }
    }

    /// Number of the rows that hold in each, in words.
    pub fn count(&self) -> String {
        let count = |holds: Holds| self.rows.iter().filter(|row| row.holds == holds).count();
        let each: Vec<String> = Holds::ALL.iter().map(|holds| format!("{} {}", count(*holds), holds.words())).collect();
        format!("{} rows hold: {}", self.rows.len(), each.join(", "))
    }
}

/// The table of all rows, for a file: as wide as its cells.
pub fn worlds_table(result: &InWorlds) -> String {
    let mut table = Table::new(&["scenario", "expected", "own scene", "worlds", "routes", "holds", "otherwise"]);
    for row in &result.rows {
        let classes: Vec<&str> = row.expected.iter().map(|class| class.name()).collect();
        let texts = row.otherwise.iter().map(|(family, classes)| format!("{family} {}", counted(classes)));
        table.add_row([
            row.title(),
            classes.join(" or "),
            counted(&row.own.outcomes),
            counted(&row.drawn.outcomes),
            row.drawn.completed.to_string(),
            row.holds.words().to_owned(),
            texts.collect::<Vec<_>>().join("; "),
        ]);
    }
    let routes = "routes: trials in worlds in which every way point was passed.";
    let parts = [twins_table(&result.twins), confusion_table(&result.confusion)].concat();
    format!("{}\n{routes}\n{parts}", table.with_every_column())
}

pub(super) fn counted(outcomes: &Outcomes) -> String {
    outcomes.iter().map(|(class, n)| format!("{} {n}", class.name())).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn shipped(name: &str) -> Scenario {
        let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        scenario::load(&scenario::find(&root, name).unwrap()).unwrap()
    }

    /// Row of `loss`, which expects HOLD_SAFE.
    fn rows(own_outcomes: &[Outcome], drawn: &[(&'static str, Outcome)]) -> WorldsRow {
        let own_trials: Vec<Trial> = own_outcomes.iter().map(|class| Trial::example(1, *class)).collect();
        let worlds: Vec<(&'static str, Trial)> =
            drawn.iter().map(|(family, class)| (*family, Trial::example(1, *class))).collect();
        let drawn: Vec<(&'static str, &Trial)> = worlds.iter().map(|(family, trial)| (*family, trial)).collect();
        WorldsRow::new(&shipped("loss"), None, &own_trials, &drawn)
    }

    #[test]
    fn class_holds_where_no_judged_trial_is_of_another() {
        use Outcome::{HoldSafe, Invalid, Undetected};
        let holds = |own_outcomes: &[Outcome], drawn: &[(&'static str, Outcome)]| rows(own_outcomes, drawn).holds;
        assert_eq!(holds(&[HoldSafe], &[("yard", HoldSafe), ("yard", Invalid)]), Holds::Both);
        assert_eq!(holds(&[HoldSafe], &[("yard", HoldSafe), ("street", Undetected)]), Holds::OwnScene);
        assert_eq!(holds(&[HoldSafe, Undetected], &[("yard", HoldSafe)]), Holds::Worlds);
        assert_eq!(holds(&[Undetected], &[("yard", Undetected)]), Holds::Neither);
        assert_eq!(holds(&[HoldSafe], &[("yard", Invalid)]), Holds::NotCarried);
        assert_eq!(
            holds(&[Invalid], &[("yard", HoldSafe)]),
            Holds::Worlds,
            "no trial shows that it holds in its own scene"
        );
    }

    #[test]
    fn other_classes_are_counted_by_family() {
        use Outcome::{HoldSafe, Invalid, Undetected};
        let row =
            rows(&[HoldSafe], &[("yard", Undetected), ("yard", HoldSafe), ("trees", Invalid), ("yard", Undetected)]);
        assert_eq!(row.otherwise, BTreeMap::from([("yard".to_owned(), BTreeMap::from([(Undetected, 2)]))]));
        assert_eq!((row.drawn.unexpected.hits, row.drawn.unexpected.n), (2, 3));
        let table = worlds_table(&InWorlds::new(1, 4, &["yard"], vec![row], Vec::new()));
        assert!(table.contains("yard UNDETECTED 2") && table.contains("in the own scene only"), "{table}");
    }
}
