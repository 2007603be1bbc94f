//! Sensor at fault × guard named, over the trials of `evaluate --worlds`.
//!
//! At fault is what the scenario itself says: the sensor of each `[[fault]]`, `process` for a `[[kill]]`, the interface for any other attack; several
//! of these are one further row, joined by `+`. Named is the guard of the first cause of loss after the earliest injection, by the unit's own
//! words (`lost:drift`, `unrecovered:lease`): the guards `localisation` and `drift` hold fix and odometry against each other and do not say which is
//! wrong. INVALID trials are left out.

use std::collections::{BTreeMap, BTreeSet};

use evidence::trial::{Outcome, Trial};
use scenario::{Interface, Scenario};
use serde::{Deserialize, Serialize};
use wire::mode::{Cause, Guard};

use super::layout::Table;
use super::worlds::{Tally, WorldsRow};

/// Trials by the guard that they name, of those that name one.
pub type Named = BTreeMap<String, u64>;

/// The matrix, in own scenes and in drawn worlds apart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Confusion {
    /// Rows in the scenarios' own scenes.
    pub own: Vec<ConfusionRow>,
    /// Rows in drawn worlds.
    pub drawn: Vec<ConfusionRow>,
}

/// A row of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfusionRow {
    /// Sensors, or interface.
    pub at_fault: String,
    /// Trials that were carried out.
    pub n: u64,
    /// Rows that name a guard, by its name.
    pub named: Named,
    /// Rows that name no guard.
    pub none: u64,
}

/// Sensors, processes or interface that a scenario puts at fault, by name, joined by `+`; `none` for a control.
pub(super) fn at_fault(scenario: &Scenario) -> String {
    let mut parts: BTreeSet<&'static str> = scenario.fault.iter().map(|fault| fault.sensor.into()).collect();
    if !scenario.kill.is_empty() {
        parts.insert("process");
    }
    let by_fault_alone = !parts.is_empty() && scenario.attacks().is_empty();
    if !by_fault_alone && scenario.interface != Interface::Control {
        parts.insert(scenario.interface.into());
    }
    if parts.is_empty() {
        parts.insert("none");
    }
    parts.into_iter().collect::<Vec<_>>().join("+")
}

/// Guard of the first cause of loss after the earliest injection.
pub(super) fn named(trial: &Trial) -> Option<Guard> {
    let from_ms = trial.injections.iter().map(|injection| injection.from_ms).min().unwrap_or(0) as f64;
    let after = trial.transitions.iter().filter(|transition| transition.t_ms >= from_ms);
    let row_of = |cause: &str| {
        let is = |guard: &Guard| [Cause::Lost(*guard), Cause::Unrecovered(*guard)].iter().any(|c| c.label() == cause);
        Guard::ALL.into_iter().find(is)
    };
    after.filter_map(|transition| row_of(&transition.cause)).next()
}

/// Counts of the guards that the trials name, INVALID ones left out.
pub(super) fn count(trials: &[&Trial]) -> Named {
    let mut all = Named::new();
    let carried_out = trials.iter().filter(|trial| trial.outcome != Outcome::Invalid);
    for guard in carried_out.filter_map(|trial| named(trial)) {
        *all.entry(guard.name().to_owned()).or_default() += 1;
    }
    all
}

impl Confusion {
    /// Over these rows.
    pub fn from_rows(rows: &[WorldsRow]) -> Self {
        Self { own: summed(rows, |row| &row.own), drawn: summed(rows, |row| &row.drawn) }
    }
}

fn summed(rows: &[WorldsRow], tally: impl Fn(&WorldsRow) -> &Tally) -> Vec<ConfusionRow> {
    let mut all: BTreeMap<&str, (u64, Named)> = BTreeMap::new();
    for row in rows {
        let (n, named) = all.entry(row.at_fault.as_str()).or_default();
        *n += tally(row).carried_out();
        for (guard, times) in &tally(row).named {
            *named.entry(guard.clone()).or_default() += times;
        }
    }
    let carried_out = all.into_iter().filter(|(_, (n, _))| *n > 0);
    let row = |(at_fault, (n, named)): (&str, (u64, Named))| {
        let none = n - named.values().sum::<u64>();
        ConfusionRow { at_fault: at_fault.to_owned(), n, named, none }
    };
    carried_out.map(row).collect()
}

/// Both matrices, for a file; a guard that no trial names has no column.
pub fn confusion_table(confusion: &Confusion) -> String {
    let parts = [("own scene", &confusion.own), ("worlds", &confusion.drawn)];
    let parts = parts.into_iter().filter(|(_, rows)| !rows.is_empty());
    parts.map(|(scene, rows)| matrix(scene, rows)).collect()
}

fn matrix(scene: &str, rows: &[ConfusionRow]) -> String {
    let is_named = |guard: &&str| rows.iter().any(|row| row.named.contains_key(*guard));
    let guards: Vec<&str> = Guard::ALL.iter().map(|guard| guard.name()).filter(is_named).collect();
    let mut table = Table::new(&[&["at fault \\ named"], &guards[..], &["none named", "trials"]].concat());
    for row in rows {
        let counts = guards.iter().map(|guard| row.named.get(*guard).copied().unwrap_or_default());
        let cells = counts.chain([row.none, row.n]).map(|n| n.to_string());
        table.add_row(std::iter::once(row.at_fault.clone()).chain(cells));
    }
    format!("\n{scene}: at fault, and the guard that the first loss after it names\n{}\n", table.with_every_column())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use evidence::trial::TransitionRow;
    use evidence::{FateName, InjectionRow};

    use super::*;

    fn shipped(name: &str) -> Scenario {
        let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        scenario::load(&scenario::find(&root, name).unwrap()).unwrap()
    }

    /// Trial with changes at these times, with an injection at 4 s.
    fn trial(outcome: Outcome, causes: &[(f64, &str)]) -> Trial {
        let mut trial = Trial::example(1, outcome);
        let row = |(t_ms, cause): &(f64, &str)| TransitionRow {
            t_ms: *t_ms,
            from: String::new(),
            to: String::new(),
            cause: (*cause).to_owned(),
        };
        trial.transitions = causes.iter().map(row).collect();
        let value = serde_json::Value::Null;
        trial.injections =
            vec![InjectionRow { what: value, from_ms: 4_000, fate: FateName::Noticed, at_ms: None, mask: None }];
        trial
    }

    #[test]
    fn guard_named_is_that_of_the_first_loss_after_the_injection() {
        let named = |causes: &[(f64, &str)]| named(&trial(Outcome::HoldSafe, causes));
        let both = [(4_300.0, "lost:drift"), (4_700.0, "unrecovered:localisation")];
        assert_eq!(named(&both), Some(Guard::Drift));
        assert_eq!(named(&[(3_000.0, "lost:lease"), (4_700.0, "unrecovered:time_base")]), Some(Guard::TimeBase));
        assert_eq!(named(&[(1_000.0, "operator"), (5_000.0, "recovered")]), None);
        assert_eq!(named(&[]), None);
    }

    /// Several sensors are their own row.
    #[test]
    fn scenario_says_what_is_at_fault() {
        let expected_rows = [
            ("localisation_drift", "localisation"),
            ("odometry_scale", "odometry"),
            ("track_starvation", "depth+lidar"),
            ("loss", "telemetry-link"),
            ("command_cut", "command-plane"),
            ("autonomy_ends", "process"),
            ("nominal", "none"),
        ];
        for (name, expected) in expected_rows {
            assert_eq!(at_fault(&shipped(name)), expected, "{name}");
        }
    }

    #[test]
    fn matrix_counts_rows_of_one_fault_together() {
        let drift = trial(Outcome::HoldSafe, &[(4_300.0, "lost:drift")]);
        let (none, invalid) = (trial(Outcome::Undetected, &[]), trial(Outcome::Invalid, &[(5_000.0, "lost:rgb")]));
        let row = |name: &str, own_trials: &[Trial]| {
            WorldsRow::new(&shipped(name), None, own_trials, &[("yard", &drift), ("yard", &none)])
        };
        let rows = [
            row("localisation_drift", &[drift.clone(), none.clone()]),
            row("localisation_jump", &[drift.clone(), invalid]),
            row("loss", std::slice::from_ref(&none)),
        ];
        let confusion = Confusion::from_rows(&rows);
        let render = |rows: &[ConfusionRow]| {
            let cell = |row: &ConfusionRow| (row.at_fault.clone(), row.named.get("drift").copied(), row.none, row.n);
            rows.iter().map(cell).collect::<Vec<_>>()
        };
        let expected = [("localisation".to_owned(), Some(2), 1, 3), ("telemetry-link".to_owned(), None, 1, 1)];
        assert_eq!(render(&confusion.own), expected);
        assert_eq!(confusion.drawn[0].n, 4);
        let table = confusion_table(&confusion);
        assert!(table.contains("own scene:") && table.contains("worlds:") && !table.contains("rgb"), "{table}");
    }
}
