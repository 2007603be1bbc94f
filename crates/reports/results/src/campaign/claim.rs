//! A claim about a rate, such as `unsafe<0.1%@95`: how many trials it takes, and whether trials show or refute it.
//!
//! An INVALID trial is no evidence. So that it can help no side, it counts as a hit where the claim is to be shown and as
//! none where it is to be refuted.

use core::fmt;
use core::str::FromStr;

use evidence::trial::Outcome;
use serde::{Deserialize, Serialize};
use stats::{rate_lower, rate_upper, sequential, simultaneous_level};

/// Trials between two looks of a campaign that may stop early.
pub const LOOK: u64 = 50;

/// A claim: the classes together have a rate below a bound, at a level of confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Claim {
    classes: Vec<Outcome>,
    below_percent: f64,
    level_percent: f64,
}

/// Trials as a claim sees them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Trials of a class that the claim names.
    pub hits: u64,
    /// INVALID and GUEST_FAILED, where the claim does not name them.
    pub invalid: u64,
    /// All.
    pub n: u64,
}

/// Verdict of trials on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClaimVerdict {
    /// The rate is below the bound, at the level.
    Shown,
    /// The rate is not below the bound, at the level.
    Refuted,
    /// Undecided: the trials show neither.
    Open,
}

/// A claim judged: the verdict, and one-sided bounds on the rate, each at the level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JudgedClaim {
    /// The verdict.
    pub verdict: ClaimVerdict,
    /// Lower bound, INVALID as no hit.
    pub lower: f64,
    /// Upper bound, INVALID as a hit.
    pub upper: f64,
}

impl Claim {
    /// Bound that the claim states.
    pub fn rate_limit(&self) -> f64 {
        self.below_percent / 100.0
    }

    /// Its level of confidence.
    pub fn level(&self) -> f64 {
        self.level_percent / 100.0
    }

    /// The fewest trials that show it where none is a hit.
    pub fn trials(&self) -> u64 {
        let least = libm::log(1.0 - self.level()) / libm::log1p(-self.rate_limit());
        // The logarithms may round to one trial too few: the bound that judges the claim decides.
        let least = least.ceil().max(1.0) as u64;
        (least..least.saturating_add(2)).find(|n| rate_upper(0, *n, self.level()) < self.rate_limit()).unwrap_or(least)
    }

    /// Takes one more trial into account.
    pub fn count(&self, tally: &mut Tally, outcome: Outcome) {
        let hit = self.classes.contains(&outcome);
        tally.n += 1;
        tally.hits += u64::from(hit);
        tally.invalid += u64::from(!hit && matches!(outcome, Outcome::Invalid | Outcome::GuestFailed));
    }

    /// Judges all planned trials. `together` such judgements hold jointly at the claim's level.
    pub fn judge(&self, tally: Tally, together: usize) -> JudgedClaim {
        let level = simultaneous_level(together, self.level());
        let (lower, upper) =
            (rate_lower(tally.hits, tally.n, level), rate_upper(tally.counted_against(), tally.n, level));
        let verdict = ClaimVerdict::new(upper < self.rate_limit(), lower >= self.rate_limit());
        JudgedClaim { verdict, lower, upper }
    }

    /// Verdict on the trials so far, at a look. Over all looks together it is wrong no more often than the level
    /// allows.
    pub fn at_look(&self, tally: Tally, together: usize) -> ClaimVerdict {
        let enough = self.alpha(together).recip();
        let shown = sequential::evidence_below(tally.counted_against(), tally.n, self.rate_limit()) >= enough;
        ClaimVerdict::new(shown, sequential::evidence_above(tally.hits, tally.n, self.rate_limit()) >= enough)
    }

    /// Verdict with the bounds that hold at every look.
    pub fn look(&self, tally: Tally, together: usize) -> JudgedClaim {
        let alpha = self.alpha(together);
        JudgedClaim {
            verdict: self.at_look(tally, together),
            lower: sequential::lower(tally.hits, tally.n, alpha),
            upper: sequential::upper(tally.counted_against(), tally.n, alpha),
        }
    }

    fn alpha(&self, together: usize) -> f64 {
        1.0 - simultaneous_level(together, self.level())
    }
}

impl Tally {
    /// Count against a claim: hits, and trials without evidence.
    fn counted_against(self) -> u64 {
        self.hits + self.invalid
    }
}

impl ClaimVerdict {
    fn new(shown: bool, refuted: bool) -> Self {
        match (shown, refuted) {
            (true, false) => ClaimVerdict::Shown,
            (false, true) => ClaimVerdict::Refuted,
            (false, false) | (true, true) => ClaimVerdict::Open,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            ClaimVerdict::Shown => "shown",
            ClaimVerdict::Refuted => "refuted",
            ClaimVerdict::Open => "open",
        }
    }
}

impl FromStr for Claim {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let example = "such as unsafe<0.1%@95 or unsafe+late<1%@99";
        let parts = text.split_once('<').and_then(|(classes, rest)| Some((classes, rest.split_once("%@")?)));
        let (classes, (below, level)) = parts.ok_or_else(|| format!("a claim is CLASS<RATE%@LEVEL, {example}"))?;
        let mut classes = classes.split('+').map(class).collect::<Result<Vec<_>, _>>()?;
        classes.sort();
        classes.dedup();
        let parse_number = |text: &str, from: f64, name: &str| match text.parse::<f64>() {
            Ok(percent) if percent.is_finite() && percent > from && percent < 100.0 => Ok(percent),
            Ok(_) | Err(_) => Err(format!("`{text}` is no {name}: above {from} and below 100, {example}")),
        };
        let (below_percent, level_percent) = (parse_number(below, 0.0, "rate")?, parse_number(level, 50.0, "level")?);
        Ok(Self { classes, below_percent, level_percent })
    }
}

fn class(text: &str) -> Result<Outcome, String> {
    let name = text.trim().to_ascii_uppercase().replace('-', "_");
    let known = || Outcome::ALL.map(|class| class.name().to_ascii_lowercase()).join(", ");
    Outcome::ALL
        .into_iter()
        .find(|class| class.name() == name)
        .ok_or_else(|| format!("no class `{text}`; there are: {}", known()))
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let classes: Vec<String> = self.classes.iter().map(|class| class.name().to_ascii_lowercase()).collect();
        write!(f, "{}<{}%@{}", classes.join("+"), self.below_percent, self.level_percent)
    }
}

impl TryFrom<String> for Claim {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Claim> for String {
    fn from(claim: Claim) -> Self {
        claim.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(text: &str) -> Claim {
        text.parse().unwrap()
    }

    fn tally(hits: u64, invalid: u64, n: u64) -> Tally {
        Tally { hits, invalid, n }
    }

    #[test]
    fn claim_takes_so_many_trials_without_hits() {
        for (text, trials) in
            [("unsafe<1%@95", 299), ("unsafe<0.1%@95", 2_995), ("unsafe<5%@95", 59), ("late<50%@95", 5)]
        {
            let claim = claim(text);
            assert_eq!(claim.trials(), trials, "{text}");
            assert_eq!(claim.judge(tally(0, 0, trials), 1).verdict, ClaimVerdict::Shown);
            assert_eq!(claim.judge(tally(0, 0, trials - 1), 1).verdict, ClaimVerdict::Open);
        }
    }

    #[test]
    fn single_claim_need_not_hold_jointly() {
        let (claim, clean) = (claim("unsafe<1%@95"), tally(0, 0, 299));
        assert_eq!(
            (claim.judge(clean, 1).verdict, claim.judge(clean, 2).verdict),
            (ClaimVerdict::Shown, ClaimVerdict::Open)
        );
        assert_eq!(
            (claim.look(tally(0, 0, 400), 1).verdict, claim.look(tally(0, 0, 400), 2).verdict),
            (ClaimVerdict::Shown, ClaimVerdict::Open)
        );
    }

    #[test]
    fn invalid_trial_neither_shows_nor_refutes() {
        let claim = claim("unsafe<10%@95");
        assert_eq!(claim.judge(tally(0, 0, 60), 1).verdict, ClaimVerdict::Shown);
        assert_eq!(claim.judge(tally(0, 3, 60), 1).verdict, ClaimVerdict::Open);
        assert_eq!(claim.judge(tally(20, 0, 60), 1).verdict, ClaimVerdict::Refuted);
        assert_eq!(claim.judge(tally(0, 20, 60), 1).verdict, ClaimVerdict::Open);
        assert_eq!(claim.look(tally(0, 0, 60), 1).verdict, ClaimVerdict::Shown);
        assert_eq!(claim.look(tally(0, 3, 60), 1).verdict, ClaimVerdict::Open);
        assert_eq!(claim.look(tally(20, 0, 60), 1).verdict, ClaimVerdict::Refuted);
        assert_eq!(claim.look(tally(0, 20, 60), 1).verdict, ClaimVerdict::Open);
    }

    #[test]
    fn trial_counts_by_the_claims_classes() {
        let counted = |text: &str| {
            let mut sum = Tally::default();
            let outcomes = [Outcome::Unsafe, Outcome::Late, Outcome::Invalid, Outcome::HoldSafe];
            outcomes.into_iter().for_each(|outcome| claim(text).count(&mut sum, outcome));
            sum
        };
        assert_eq!(counted("unsafe<1%@95"), tally(1, 1, 4));
        assert_eq!(counted("late+unsafe<1%@95"), tally(2, 1, 4));
        assert_eq!(counted("invalid<1%@95"), tally(1, 0, 4));
    }

    #[test]
    fn a_claim_is_written_as_it_is_read() {
        assert_eq!(claim("LATE+unsafe+late<0.10%@95").to_string(), "unsafe+late<0.1%@95");
        assert_eq!(claim("hold-safe<50%@99.9").to_string(), "hold_safe<50%@99.9");
        for (text, told) in [
            ("unsafe", "a claim is"),
            ("unsafe<0.1@95", "a claim is"),
            ("unsave<1%@95", "no class `unsave`; there are: unsafe, guest_failed, invalid"),
            ("unsafe<0%@95", "`0` is no rate"),
            ("unsafe<nan%@95", "`nan` is no rate"),
            ("unsafe<1%@100", "`100` is no level"),
            ("unsafe<1%@40", "`40` is no level"),
        ] {
            let error = text.parse::<Claim>().unwrap_err();
            assert!(error.starts_with(told), "{text}: {error}");
        }
    }
}
