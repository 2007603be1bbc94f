//! Four numbers of trials, each with its n and its bound.

use evidence::trial::Outcome;
use results::report::LatencySummary;
use stats::Sample;

use super::View;
use crate::Dossier;
use crate::page::finding::{Fact, Rank};
use crate::page::words;
use crate::reader::FoundResult;
use crate::tried::Tried;

impl View<'_> {
    /// The four numbers: as stated, the cells that ask for a reader, the claim or the latency, and the bound on harm.
    pub(super) fn facts(&self, dossier: &Dossier, rank: Rank, class: Outcome, about: &[&Tried]) -> Vec<Fact> {
        let mut all = vec![self.as_stated(), self.asking(class, about)];
        all.extend(self.claim().or_else(|| self.latency(dossier)));
        all.extend(self.not_safe());
        if rank == Rank::Open || all.len() < 4 {
            all.extend(self.armed().filter(|_| all.len() < 4));
        }
        all.truncate(4);
        all
    }

    fn as_stated(&self) -> Fact {
        let off: u64 = self.all.iter().flat_map(|one| one.unexpected()).map(|(_, n)| n).sum();
        let n = self.n();
        let said = if self.all.iter().any(|one| one.expected.is_empty()) {
            "neither UNSAFE nor INVALID; no class was stated"
        } else {
            "ended as stated beforehand"
        };
        Fact::new(format!("{} of {}", words::grouped(n - off), words::grouped(n)), said)
    }

    fn asking(&self, class: Outcome, about: &[&Tried]) -> Fact {
        let (k, m) = (about.len() as u64, self.all.len() as u64);
        if m == 1 {
            let n = self.totals().get(&class).copied().unwrap_or_default();
            return Fact::new(class.name(), format!("{n} of {}", words::number(self.n(), "trial")));
        }
        if about.is_empty() {
            return Fact::new(format!("0 of {}", words::number(m, self.unit)), "harmed or unnoticed");
        }
        let (hits, of): (u64, u64) =
            (about.iter().filter_map(|one| one.outcomes.get(&class)).sum(), about.iter().map(|one| one.n).sum());
        Fact::new(
            format!("{k} of {}", words::number(m, self.unit)),
            format!("{}, {hits} of {}", class.name(), words::number(of, "trial")),
        )
    }

    fn claim(&self) -> Option<Fact> {
        let FoundResult::Campaign(campaign) = &self.given.found else { return None };
        let (claim, verdicts) = (campaign.terms.claim.as_ref()?, campaign.claim?);
        let said = format!("show {claim}; {} refute it, {} leave it open", verdicts.refuted, verdicts.open);
        Some(Fact::new(
            format!("{} of {}", verdicts.shown, words::number(campaign.rows.len() as u64, "variation")),
            said,
        ))
    }

    /// The slowest p95 of the times to HOLD_SAFE, else to DEGRADED, which of them it is, and of how many samples.
    pub(super) fn slowest(&self) -> Option<(&Sample, usize, usize)> {
        let each: Vec<&LatencySummary> = match &self.given.found {
            FoundResult::Runs(runs) => runs.iter().map(|run| &run.summary.latency_ms).collect(),
            FoundResult::Campaign(campaign) => campaign.rows.iter().map(|row| &row.latency_ms).collect(),
            FoundResult::Matrix(matrix) => {
                matrix.rows.iter().flat_map(|row| &row.runs).map(|run| &run.summary.latency_ms).collect()
            }
            FoundResult::Reference(reference) => reference.rows.iter().map(|row| &row.summary.latency_ms).collect(),
            FoundResult::BenchLive(bench) => bench.runs().map(|run| &run.summary.latency_ms).collect(),
            FoundResult::Search(_)
            | FoundResult::Comparison(_)
            | FoundResult::Curve(_)
            | FoundResult::Ablation(_)
            | FoundResult::TwinCost(_)
            | FoundResult::Worlds(_) => return None,
        };
        let worst = |pick: fn(&LatencySummary) -> &Sample| {
            let samples = each.iter().map(|latency| pick(latency)).filter(|sample| sample.p95.is_some());
            samples.max_by(|a, b| a.p95.unwrap_or_default().total_cmp(&b.p95.unwrap_or_default()))
        };
        let hold = worst(|l| &l.to_hold_safe).map(|sample| (sample, 0, each.len()));
        hold.or_else(|| worst(|l| &l.to_degraded).map(|sample| (sample, 1, each.len())))
    }

    fn latency(&self, dossier: &Dossier) -> Option<Fact> {
        let (sample, to, samples) = self.slowest()?;
        let limit = dossier.stories.first().and_then(|story| story.limits_ms.get(to));
        let limit = limit.map(|ms| format!("; limit {} from the loss", words::grouped(*ms))).unwrap_or_default();
        let upper = sample.p95_upper_95.map(|ms| format!(", at most {}", words::three_digits(ms))).unwrap_or_default();
        let worst = if samples > 1 { "slowest " } else { "" };
        let from = if self.noun == "lie" { "lie" } else { "arrival" };
        let mode = if to == 0 { "HOLD_SAFE" } else { "DEGRADED" };
        Some(Fact::new(
            words::milliseconds(sample.p95?),
            format!("{from} to {mode} ({worst}p95, n {}{upper}){limit}", sample.n),
        ))
    }

    fn not_safe(&self) -> Option<Fact> {
        let broken = self.totals().get(&Outcome::Unsafe).copied().unwrap_or_default();
        let bounded = self.all.iter().filter_map(|one| Some((one.unsafe_upper_95?, one.n)));
        let worst = bounded.max_by(|a, b| a.0.total_cmp(&b.0));
        let each = if self.all.len() > 1 { format!(" a {}", self.unit) } else { String::new() };
        let said = worst.map_or_else(
            || "no bound yet".to_owned(),
            |(upper, n)| format!("below {}{each} (95 %, n {n})", words::percent(upper)),
        );
        Some(Fact::new(format!("{broken} of {} unsafe", words::grouped(self.n())), said))
    }

    fn armed(&self) -> Option<Fact> {
        let FoundResult::Runs(runs) = &self.given.found else { return None };
        let (armed, n) = runs.iter().fold((0, 0), |(armed, n), run| (armed + run.mission.armed, n + run.mission.n));
        (n > 0).then(|| Fact::new(format!("{armed} of {n}"), "missions held authority"))
    }
}
