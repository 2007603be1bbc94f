//! Honest faults beside the attacks that look like them: classes of both, the share of each that is stopped, and if that tells them apart.

use evidence::trial::{Outcome, Outcomes};
use serde::{Deserialize, Serialize};
use stats::Share;

use super::layout::Table;
use super::worlds::{Tally, WorldsRow, counted};

/// An honest fault and an attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwinPair {
    /// The honest fault, with its cell.
    pub honest: String,
    /// The attack, with its cell.
    pub attack: String,
    /// Comparison in each scenario's own scene.
    pub own: Beside,
    /// Comparison in drawn worlds.
    pub drawn: Beside,
}

/// Both in one kind of scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Beside {
    /// Classes of the honest fault.
    pub honest: Outcomes,
    /// Its stopped share.
    pub honest_stopped: Share,
    /// Classes of the attack.
    pub attack: Outcomes,
    /// Its stopped share.
    pub attack_stopped: Share,
    /// Relation of the two.
    pub told: Told,
}

/// Relation of the two stopped shares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Told {
    /// Their intervals at 95 % are apart.
    Apart,
    /// Their intervals overlap.
    NotApart,
    /// Neither is stopped in any trial.
    NeitherStopped,
    /// One of them has no trial.
    NotShown,
}

impl Told {
    /// Words for it.
    fn words(self) -> &'static str {
        match self {
            Told::Apart => "told apart",
            Told::NotApart => "not told apart",
            Told::NeitherStopped => "neither stopped",
            Told::NotShown => "-",
        }
    }

    fn from_shares(honest: &Share, attack: &Share) -> Self {
        match (honest.n.min(attack.n), honest.hits.max(attack.hits)) {
            (0, _) => Told::NotShown,
            (_, 0) => Told::NeitherStopped,
            _ if honest.upper_95 < attack.lower_95 || attack.upper_95 < honest.lower_95 => Told::Apart,
            _ => Told::NotApart,
        }
    }
}

/// Share that ends in HOLD_SAFE, DEGRADED or, where no fault is injected, FALSE_TRIP; INVALID trials are left out.
fn stopped(tally: &Tally) -> Share {
    let count = |class: Outcome| tally.outcomes.get(&class).copied().unwrap_or_default();
    let hits = [Outcome::HoldSafe, Outcome::Degraded, Outcome::FalseTrip].map(count).iter().sum();
    Share::new(hits, tally.carried_out())
}

impl Beside {
    fn new(honest: &Tally, attack: &Tally) -> Self {
        let (honest_stopped, attack_stopped) = (stopped(honest), stopped(attack));
        let told = Told::from_shares(&honest_stopped, &attack_stopped);
        let (honest, attack) = (honest.outcomes.clone(), attack.outcomes.clone());
        Self { honest, honest_stopped, attack, attack_stopped, told }
    }
}

impl TwinPair {
    /// Every pair among these rows.
    pub fn pair_rows(rows: &[WorldsRow]) -> Vec<Self> {
        let attacks = |honest: &WorldsRow| rows.iter().filter(|row| honest.twin_of.contains(&row.scenario)).collect();
        let pairs = |honest: &WorldsRow| {
            let attacks: Vec<&WorldsRow> = attacks(honest);
            attacks.into_iter().map(|attack| Self::new(honest, attack)).collect::<Vec<_>>()
        };
        rows.iter().flat_map(pairs).collect()
    }

    fn new(honest: &WorldsRow, attack: &WorldsRow) -> Self {
        let (own, drawn) = (Beside::new(&honest.own, &attack.own), Beside::new(&honest.drawn, &attack.drawn));
        Self { honest: honest.title(), attack: attack.title(), own, drawn }
    }
}

/// The table of all pairs, for a file.
pub fn twins_table(pairs: &[TwinPair]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let mut table = Table::new(&[
        "honest fault",
        "attack",
        "scene",
        "classes of the fault",
        "stopped",
        "classes of the attack",
        "stopped",
        "relation",
    ]);
    for pair in pairs {
        let shown = |comparison: &&Beside| comparison.told != Told::NotShown;
        for (scene, beside) in [("own", &pair.own), ("worlds", &pair.drawn)].into_iter().filter(|(_, b)| shown(b)) {
            table.add_row([
                pair.honest.clone(),
                pair.attack.clone(),
                scene.to_owned(),
                counted(&beside.honest),
                interval(&beside.honest_stopped),
                counted(&beside.attack),
                interval(&beside.attack_stopped),
                beside.told.words().to_owned(),
            ]);
        }
    }
    format!("\n{}\nstopped: HOLD_SAFE, DEGRADED, or FALSE_TRIP without an injected fault.\n", table.with_every_column())
}

fn interval(share: &Share) -> String {
    let percent = |of: f64| (of * 100.0).round();
    format!("{} of {} ({} to {} %)", share.hits, share.n, percent(share.lower_95), percent(share.upper_95))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use evidence::trial::Trial;
    use scenario::Scenario;

    use super::*;

    fn shipped(name: &str) -> Scenario {
        let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        scenario::load(&scenario::find(&root, name).unwrap()).unwrap()
    }

    fn row(name: &str, twin_of: &[&str], outcomes: &[(Outcome, u64)]) -> WorldsRow {
        let trials: Vec<Trial> =
            outcomes.iter().flat_map(|(class, n)| (0..*n).map(|seed| Trial::example(seed, *class))).collect();
        let twin_of = twin_of.iter().map(ToString::to_string).collect();
        WorldsRow { twin_of, ..WorldsRow::new(&shipped(name), None, &trials, &[]) }
    }

    #[test]
    fn shares_whose_intervals_part_are_told_apart() {
        use Outcome::{Degraded, FalseTrip, HoldSafe, Invalid, Undetected};
        let attack = row("loss", &[], &[(HoldSafe, 59)]);
        let verdict = |outcomes: &[(Outcome, u64)]| {
            TwinPair::pair_rows(&[row("nominal", &["loss"], outcomes), attack.clone()])[0].clone()
        };
        assert_eq!(verdict(&[(Undetected, 59)]).own.told, Told::Apart);
        assert_eq!(verdict(&[(HoldSafe, 30), (Degraded, 20), (FalseTrip, 9)]).own.told, Told::NotApart);
        assert_eq!(verdict(&[(Undetected, 1)]).own.told, Told::NotApart, "one trial shows no difference");
        let invalid = verdict(&[(Invalid, 59)]);
        assert_eq!((invalid.own.told, invalid.drawn.told), (Told::NotShown, Told::NotShown));
    }

    #[test]
    fn only_named_attacks_are_paired() {
        let undetected = [(Outcome::Undetected, 20)];
        let rows =
            [row("nominal", &["loss"], &undetected), row("loss", &[], &undetected), row("delay", &[], &undetected)];
        let pairs = TwinPair::pair_rows(&rows);
        assert_eq!(pairs.iter().map(|pair| pair.attack.as_str()).collect::<Vec<_>>(), ["loss"]);
        assert_eq!(pairs[0].own.told, Told::NeitherStopped);
        let table = twins_table(&pairs);
        assert!(table.contains("neither stopped") && table.contains("0 of 20 (0 to "), "{table}");
        assert_eq!(twins_table(&[]), "");
    }
}
