//! A list of weaknesses: each of checks that are waived and bounds that are set wrong, with the scenario and the attack space in
//! which a search is to find it.
//!
//! Measuring the time to find it, by strategy, is the part of `lab::bench`.

use std::path::Path;

use evidence::ablation::Switch;
use evidence::trial::Outcome;
use serde::Deserialize;
use wire::bounds::Bounds;

use super::file::read_text;
use super::value::{List, Located, Name};
use super::{Problem, Problems};

/// A list of weaknesses.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weaknesses {
    /// The weaknesses, in the order in which they are reported.
    pub weakness: Located<List<Weakness, 128>>,
}

/// One of them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weakness {
    /// Name in reports.
    pub name: Located<Name>,
    /// The scenario that runs meanwhile, of one cell.
    pub scenario: Name,
    /// The attack space.
    #[serde(alias = "alphabet")]
    pub space: Name,
    /// Checks that are waived.
    #[serde(default)]
    pub waive: List<Switch, 4>,
    /// Bounds that the services are made with wrong values of. The oracle judges by the right ones.
    #[serde(default)]
    pub misset: List<Misset, 4>,
    /// Classes that count as found.
    pub find: Located<List<Outcome, 9>>,
}

/// A bound with a value that is not the platform's.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Misset {
    /// The bound.
    pub bound: BoundName,
    /// Its wrong value, milliseconds.
    pub to_ms: u32,
}

/// Bounds on time, by their name in a platform's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(clippy::enum_variant_names, reason = "they are spelt as in a platform's file")]
pub enum BoundName {
    /// *Tf*.
    FreshnessMs,
    /// The supervision lease.
    LeaseMs,
    /// Greatest age of a stage's product.
    ProductLimitMs,
    /// Time for which a loss may last that driving depends on.
    UnrecoveredMs,
    /// Greatest age of a track.
    TrackLimitMs,
    /// Greatest age of an order.
    CommandLimitMs,
    /// Lifetime of authority.
    AuthorityMs,
    /// Time for which all has to be well before DEGRADED ends.
    HysteresisMs,
    /// Time for which a set-point is followed.
    SetPointLeaseMs,
    /// Time for which the log may go unsealed.
    SealLimitMs,
}

impl Misset {
    /// `bounds` with the wrong value.
    #[must_use]
    pub fn apply(&self, mut bounds: Bounds) -> Bounds {
        *self.bound.value(&mut bounds) = u64::from(self.to_ms);
        bounds
    }
}

impl BoundName {
    fn value(self, bounds: &mut Bounds) -> &mut u64 {
        match self {
            BoundName::FreshnessMs => &mut bounds.freshness_ms,
            BoundName::LeaseMs => &mut bounds.lease_ms,
            BoundName::ProductLimitMs => &mut bounds.product_limit_ms,
            BoundName::UnrecoveredMs => &mut bounds.unrecovered_ms,
            BoundName::TrackLimitMs => &mut bounds.track_limit_ms,
            BoundName::CommandLimitMs => &mut bounds.command_limit_ms,
            BoundName::AuthorityMs => &mut bounds.authority_ms,
            BoundName::HysteresisMs => &mut bounds.hysteresis_ms,
            BoundName::SetPointLeaseMs => &mut bounds.set_point_lease_ms,
            BoundName::SealLimitMs => &mut bounds.seal_limit_ms,
        }
    }
}

impl Weakness {
    /// The waived checks, and the bounds with their wrong values, as a report gives them.
    pub fn wrong(&self) -> String {
        let waived = self.waive.iter().map(|check| check.name());
        let misset = self.misset.iter().map(|of| format!("{} = {}", <&str>::from(of.bound), of.to_ms));
        waived.chain(misset).collect::<Vec<_>>().join(", ")
    }

    /// The controls: for each part, the same with this part alone put right. A finding in any of them rests on less than the
    /// whole weakness.
    pub fn controls(&self) -> impl Iterator<Item = Weakness> + '_ {
        let waive = |right| List::from_first(self.waive.iter().filter(|check| **check != right).copied());
        let misset = |right| List::from_first(self.misset.iter().filter(|misset| misset.bound != right).cloned());
        let checks = self.waive.iter().map(move |right| Weakness { waive: waive(*right), ..self.clone() });
        checks.chain(self.misset.iter().map(move |right| Weakness { misset: misset(right.bound), ..self.clone() }))
    }
}

impl Weaknesses {
    /// Reads the list at `path`.
    ///
    /// # Errors
    /// Everything that is wrong with it, in its place.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        let file = path.display().to_string();
        Self::parse(&file, &read_text(path, &file)?)
    }

    /// Checks the text of a list.
    ///
    /// # Errors
    /// Everything that is wrong with it, with `file` as its name.
    pub fn parse(file: &str, text: &str) -> Result<Self, Problems> {
        let list: Self = toml::from_str(text).map_err(|e| Problem::from_toml(file, text, &e))?;
        let wrong = list.wrong();
        let problem = |(bytes, message, remedy): (_, String, &str)| Problem::new(file, text, bytes, message, remedy);
        Problems::none_or(wrong.into_iter().map(problem).collect())?;
        Ok(list)
    }

    fn wrong(&self) -> Vec<(std::ops::Range<usize>, String, &'static str)> {
        let mut wrong = Vec::new();
        if self.weakness.is_empty() {
            wrong.push((self.weakness.bytes(), "no weakness".to_owned(), "add a `[[weakness]]`"));
        }
        for (i, of) in self.weakness.iter().enumerate() {
            let name = of.name.as_str();
            if self.weakness.iter().take(i).any(|before| before.name.as_str() == name) {
                wrong.push((of.name.bytes(), format!("weakness {name} is there twice"), "give each its own name"));
            }
            if of.waive.is_empty() && of.misset.is_empty() {
                let remedy = "name checks under `waive`, or bounds and their wrong values under `misset`";
                wrong.push((of.name.bytes(), format!("weakness {name} has nothing wrong"), remedy));
            }
            let waived = (0..of.waive.len()).any(|n| of.waive[..n].contains(&of.waive[n]));
            let misset = (0..of.misset.len()).any(|n| of.misset[..n].iter().any(|one| one.bound == of.misset[n].bound));
            if waived || misset {
                let remedy = "name each check and each bound once";
                wrong.push((of.name.bytes(), format!("weakness {name} names a part twice"), remedy));
            }
            if of.find.is_empty() || of.find.contains(&Outcome::Invalid) {
                let remedy = "name classes such as \"UNSAFE\"; what is INVALID shows nothing";
                wrong.push((of.find.bytes(), "no class that can be found".to_owned(), remedy));
            }
        }
        wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find_root;

    const TEXT: &str = "[[weakness]]\nname = \"a\"\nscenario = \"nominal\"\nspace = \"path\"\n\
                        waive = [\"boundary.freshness\"]\nfind = [\"UNSAFE\"]\n\
                        [[weakness]]\nname = \"b\"\nscenario = \"nominal\"\nspace = \"path\"\n\
                        waive = [\"guards.lease\"]\nfind = [\"LATE\"]\n";

    const LEASE_TWICE: &str = "misset = [{ bound = \"lease_ms\", to_ms = 1 }, { bound = \"lease_ms\", to_ms = 2 }]";

    #[test]
    fn the_shipped_list_is_read() {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        for list in ["checks", "bounds", "deep"] {
            let file = root.join(format!("scenarios/weaknesses/{list}.toml"));
            assert!(!Weaknesses::load(&file).unwrap().weakness.is_empty());
        }
    }

    #[test]
    fn misset_changes_one_bound_alone() {
        let text = TEXT.replace("waive = [\"guards.lease\"]", "misset = [{ bound = \"lease_ms\", to_ms = 670 }]");
        let list = Weaknesses::parse("w.toml", &text).unwrap();
        let wrong = list.weakness[1].misset[0].apply(Bounds::GROUND);
        assert_eq!(wrong, Bounds { lease_ms: 670, ..Bounds::GROUND });
        assert_eq!(list.weakness[1].wrong(), "lease_ms = 670");
    }

    #[test]
    fn each_control_puts_one_part_right() {
        let more = "\"guards.lease\", \"record_guard\"]\nmisset = [{ bound = \"lease_ms\", to_ms = 670 }]";
        let list = Weaknesses::parse("w.toml", &TEXT.replace("\"guards.lease\"]", more)).unwrap();
        let controls: Vec<String> = list.weakness[1].controls().map(|control| control.wrong()).collect();
        let expected = ["record_guard, lease_ms = 670", "guards.lease, lease_ms = 670", "guards.lease, record_guard"];
        assert_eq!(controls, expected);
        assert_eq!(list.weakness[0].controls().map(|control| control.wrong()).collect::<Vec<_>>(), [""]);
    }

    #[test]
    fn senseless_list_is_refused_in_its_place() {
        assert_eq!(Weaknesses::parse("w.toml", TEXT).unwrap().weakness.len(), 2);
        for (wrong, with, message, marked) in [
            ("name = \"b\"", "name = \"a\"", "weakness a is there twice", "\"a\""),
            ("waive = [\"guards.lease\"]", "", "weakness b has nothing wrong", "\"b\""),
            ("[\"guards.lease\"]", "[\"guards.lease\", \"guards.lease\"]", "weakness b names a part twice", "\"b\""),
            ("waive = [\"guards.lease\"]", LEASE_TWICE, "weakness b names a part twice", "\"b\""),
            ("[\"LATE\"]", "[]", "no class that can be found", "[]"),
            ("[\"LATE\"]", "[\"INVALID\"]", "no class that can be found", "[\"INVALID\"]"),
            (
                "guards.lease",
                "guards.leash",
                "no check `guards.leash`; there are: boundary.freshness",
                "[\"guards.leash\"]",
            ),
        ] {
            let problems = Weaknesses::parse("w.toml", &TEXT.replace(wrong, with)).unwrap_err();
            let problem = &problems.all()[0];
            assert!(problem.message().starts_with(message), "{}", problem.message());
            assert_eq!(problem.marked(), Some(marked));
        }
    }
}
