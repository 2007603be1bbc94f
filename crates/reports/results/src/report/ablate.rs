//! The ablation table: per check the attacks that get through without it, its cost without an attack, and the check
//! that stops the attack in its place. Counts and intervals; gains were decided in `ablation`.

use evidence::SCHEMA_VERSION;
use evidence::ablation::Gain;
use evidence::trial::{Outcome, Outcomes};
use serde::{Deserialize, Serialize};
use stats::paired::{Paired, holm};
use stats::{LEVEL, rate_upper};

use super::layout::folded;
use super::run::Summary;
use super::table::{outcomes, percent};
use crate::report::new_table;

/// The whole ablation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ablation {
    /// Version of this object.
    pub schema_version: u32,
    /// Watermark of every run of it.
    pub watermark: String,
    /// The base seed; pair i has seed + i with and without.
    pub seed: u64,
    /// SHA-256 of the program that ran it.
    pub build: String,
    /// Attacks: variations of scenarios.
    pub attacks: usize,
    /// Pairs of each check and attack; of those without any difference in the first `screened`, only these.
    pub trials: u64,
    /// See `trials`.
    pub screened: u64,
    /// Comparisons that Holm's adjustment is for.
    pub comparisons: usize,
    /// One row a check.
    pub checks: Vec<CheckRow>,
    /// Pairs of checks without which an attack gets through that neither alone lets through.
    pub overlaps: Vec<Overlap>,
    /// Number of disabled checks that the campaign noticed: row N2.
    pub defects: Defects,
}

/// Benefit of a check, by itself or with another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Worth {
    /// Without it an attack gets further.
    Alone,
    /// Without it and another one does.
    Pair,
    /// No attack of the catalogue was seen to get further, in as many trials as were run.
    None,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckRow {
    /// Its place in a policy file.
    pub check: String,
    /// Its benefit.
    pub worth: Worth,
    /// True if the campaign notices that it is disabled.
    pub noticed: bool,
    /// Attacks in which anything differs without it.
    pub attacks: Vec<AttackRow>,
    /// Attacks without an observed effect.
    pub unchanged: usize,
    /// Exact upper 95 % bound on the rate of an effect in the unchanged attack with the fewest pairs; 1 without such an
    /// attack.
    #[serde(default = "unbounded")]
    pub unchanged_upper_95: f64,
    /// Its cost without an attack.
    pub quiet: Option<Quiet>,
}

/// One attack without one check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttackRow {
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Outcomes with the check.
    pub with: Outcomes,
    /// Outcomes without it.
    pub without: Outcomes,
    /// The attack's gain.
    pub gain: Gain,
    /// The rate of getting through, without less with.
    pub paired: Paired,
}

/// Two checks together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    /// The checks.
    pub checks: [String; 2],
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Outcomes without both.
    pub without: Outcomes,
    /// The attack's gain.
    pub gain: Gain,
}

/// The null attack on a lossy link, with a check and without.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quiet {
    /// Simulated hours of each.
    pub hours: f64,
    /// False trips an hour, with and without.
    pub false_trips_per_hour: [f64; 2],
    /// Share of time in nominal control, with and without.
    pub nominal_share: [f64; 2],
    /// CPU seconds a simulated hour, with and without.
    pub cpu_seconds_per_hour: [f64; 2],
}

/// Row N2 of the catalogue: seeded defects, each of them one check disabled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Defects {
    /// Checks disabled.
    pub n: usize,
    /// Number of these that were noticed: some trial left its expected classes only because of it.
    pub found: usize,
    /// The undetected ones.
    pub survivors: Vec<String>,
}

impl Quiet {
    /// Comparison of equal trials with the check and without it.
    pub fn from_summaries(summary: &Summary, ablated_summary: &Summary) -> Self {
        let hours = summary.sim_seconds / 3600.0;
        let each = |value: fn(&Summary) -> f64| [value(summary), value(ablated_summary)];
        Self {
            hours,
            false_trips_per_hour: each(|s| s.false_trips_per_hour),
            nominal_share: each(|s| s.nominal_share),
            cpu_seconds_per_hour: each(|s| s.cpu_seconds / s.sim_seconds.max(1.0) * 3600.0),
        }
    }
}

/// Inputs of the comparison, and their counts.
pub struct Compared {
    /// The base seed.
    pub seed: u64,
    /// SHA-256 of the program.
    pub build: String,
    /// Attacks.
    pub attacks: usize,
    /// Trials of a pair with any difference.
    pub trials: u64,
    /// Trials of a pair without one.
    pub screened: u64,
}

impl Ablation {
    /// Adjusts for the number of comparisons, rates each check, and leaves out pairs without a difference.
    pub fn new(compared: Compared, mut checks: Vec<CheckRow>, overlaps: Vec<Overlap>) -> Self {
        let mut pairs: Vec<&mut Paired> =
            checks.iter_mut().flat_map(|check| check.attacks.iter_mut().map(|attack| &mut attack.paired)).collect();
        // Before unchanged attacks are left out: they were looked at too, and count in the adjustment.
        let comparisons = pairs.len();
        holm(&mut pairs);
        for check in &mut checks {
            let paired = overlaps.iter().any(|overlap| overlap.checks.contains(&check.check));
            check.worth = match (check.attacks.iter().any(|attack| attack.gain.lets_through()), paired) {
                (true, _) => Worth::Alone,
                (false, true) => Worth::Pair,
                (false, false) => Worth::None,
            };
            check.noticed = check.attacks.iter().any(|attack| attack.gain.noticed > 0);
            let (changed, unchanged): (Vec<_>, Vec<_>) = check.attacks.drain(..).partition(|a| a.gain.changed > 0);
            (check.attacks, check.unchanged) = (changed, unchanged.len());
            let least = unchanged.iter().map(|attack| attack.paired.n).min();
            check.unchanged_upper_95 = least.map_or_else(unbounded, |n| rate_upper(0, n, LEVEL));
        }
        let survivors: Vec<String> = checks.iter().filter(|c| !c.noticed).map(|c| c.check.clone()).collect();
        let (n, found) = (checks.len(), checks.len() - survivors.len());
        Self {
            schema_version: SCHEMA_VERSION,
            watermark: "ABLATION: each check waived in turn".to_owned(),
            seed: compared.seed,
            build: compared.build,
            attacks: compared.attacks,
            trials: compared.trials,
            screened: compared.screened,
            comparisons,
            checks,
            overlaps,
            defects: Defects { n, found, survivors },
        }
    }
}

/// The bound without a trial, and of results from before it was stated.
fn unbounded() -> f64 {
    1.0
}

impl CheckRow {
    /// A check and every attack without it; [`Ablation::new`] rates it.
    pub fn new(check: String, attacks: Vec<AttackRow>, quiet: Option<Quiet>) -> Self {
        Self {
            check,
            worth: Worth::None,
            noticed: false,
            attacks,
            unchanged: 0,
            unchanged_upper_95: unbounded(),
            quiet,
        }
    }
}

/// The ablation for a terminal.
pub fn ablation_table(ablation: &Ablation) -> String {
    let mut table = new_table(&[
        "check",
        "worth",
        "gets through in",
        "changed only",
        "the rest differs below",
        "noticed",
        "false trips/h",
        "nominal",
        "CPU s/h",
    ]);
    for check in &ablation.checks {
        table.add_row(row(check));
    }
    let mut text = format!("{}\n{table}\n", ablation.watermark);
    text.push_str("What gets through without a check: attack, outcomes, of n, difference (95 %), p (Holm).\n");
    for check in &ablation.checks {
        let lines = check.attacks.iter().filter(gained).map(|row| format!("{}: {}\n", check.check, line(row)));
        text.extend(lines);
    }
    for overlap in &ablation.overlaps {
        let [a, b] = &overlap.checks;
        let (attack, ablated) = (attack(&overlap.scenario, overlap.cell.as_ref()), outcomes(&overlap.without));
        text.push_str(&format!("only together: {a} and {b}: {attack}: {ablated}\n"));
    }
    let Defects { n, found, survivors } = &ablation.defects;
    let survivors = if survivors.is_empty() { "none".to_owned() } else { survivors.join(", ") };
    text.push_str(&format!(
        "seed {}, {} attacks, {} pairs each ({} where nothing differed in them), {} comparisons.\n\
         Worse is, in this order: NOMINAL, REJECTED, DEGRADED, HOLD_SAFE, FALSE_TRIP or STUCK, UNDETECTED, LATE, \
         UNSAFE; an attack gets through when it ends worse than all that was expected of it.\n\
         Quiet hours: with and without the check. Seeded defects (N2): {found} of {n} noticed; survivors: {survivors}\n",
        ablation.seed, ablation.attacks, ablation.trials, ablation.screened, ablation.comparisons,
    ));
    folded(&text)
}

fn row(check: &CheckRow) -> Vec<String> {
    let worth = match check.worth {
        Worth::Alone => "alone",
        Worth::Pair => "in a pair",
        Worth::None => "none",
    };
    let passed = check.attacks.iter().filter(gained).count();
    let only = check.attacks.len() - passed;
    let quiet = |of: fn(&Quiet) -> [f64; 2], digits: usize| {
        check.quiet.as_ref().map(of).map_or_else(|| "-".to_owned(), |[a, b]| format!("{a:.digits$} / {b:.digits$}"))
    };
    vec![
        check.check.clone(),
        worth.to_owned(),
        passed.to_string(),
        format!("{only} of {}", check.attacks.len() + check.unchanged),
        percent(check.unchanged_upper_95),
        if check.noticed { "yes" } else { "no" }.to_owned(),
        quiet(|q| q.false_trips_per_hour, 2),
        quiet(|q| q.nominal_share, 3),
        quiet(|q| q.cpu_seconds_per_hour, 1),
    ]
}

/// True if the attack gets further without the check.
fn gained(attack: &&AttackRow) -> bool {
    attack.gain.lets_through()
}

fn line(row: &AttackRow) -> String {
    let Paired { n, difference, interval_95: [low, high], p_holm, .. } = row.paired;
    let gain = format!("through {} of {n}", row.gain.through);
    let interval = format!("{difference:.2} ({low:.2} to {high:.2}), p {p_holm:.1e}");
    format!("{}: {}: {gain}: {interval}", attack(&row.scenario, row.cell.as_ref()), outcomes(&row.without))
}

fn attack(scenario: &str, cell: Option<&String>) -> String {
    cell.map_or_else(|| scenario.to_owned(), |cell| format!("{scenario} {cell}"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn attack_row(through: u64) -> AttackRow {
        let gain = Gain { n: 20, through, changed: through, noticed: through, ..Gain::default() };
        AttackRow {
            scenario: "replay".to_owned(),
            cell: None,
            expected: vec![Outcome::Rejected],
            with: BTreeMap::from([(Outcome::Rejected, 20)]),
            without: BTreeMap::from([(Outcome::Undetected, through)]),
            gain,
            paired: Paired::from_counts(20, through, 0),
        }
    }

    #[test]
    fn check_benefit_is_alone_paired_or_none() {
        let compared = Compared { seed: 1, build: String::new(), attacks: 1, trials: 20, screened: 3 };
        let row = |name: &str, passed| CheckRow::new(name.to_owned(), vec![attack_row(passed)], None);
        let overlap = Overlap {
            checks: ["b".to_owned(), "x".to_owned()],
            scenario: "replay".to_owned(),
            cell: None,
            without: BTreeMap::new(),
            gain: Gain { through: 1, ..Gain::default() },
        };
        let ablation = Ablation::new(compared, vec![row("a", 20), row("b", 0), row("c", 0)], vec![overlap]);
        let worths: Vec<Worth> = ablation.checks.iter().map(|check| check.worth).collect();
        assert_eq!(worths, [Worth::Alone, Worth::Pair, Worth::None]);
        assert_eq!((ablation.defects.n, ablation.defects.found), (3, 1));
        assert_eq!(ablation.defects.survivors, ["b", "c"]);
        assert_eq!((ablation.comparisons, ablation.checks[1].unchanged), (3, 1));
        let text = ablation_table(&ablation);
        assert!(text.contains("through 20 of 20") && text.contains("only together: b and x"), "{text}");
    }
}
