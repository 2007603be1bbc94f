//! The finding of results whose trials end in classes: runs, matrix, reference evaluation, campaign, live losses. `facts` has its four
//! numbers.

mod facts;

use std::collections::{BTreeMap, BTreeSet};

use evidence::trial::{Outcome, Outcomes, Trial};
use results::report::{CampaignObject, RunObject};

use super::{Finding, Part, Rank, subject};
use crate::Dossier;
use crate::page::words;
use crate::reader::{FoundResult, Given};
use crate::tried::{Tried, tried};

/// Variations of one kind that are named in a sentence.
const NAMED: usize = 4;

/// Everything that a sentence needs of a result.
struct View<'a> {
    given: &'a Given,
    all: Vec<Tried<'a>>,
    /// Deed done to the platform, in a word: `lie`, `attack`, `fault`, `quiet run`.
    noun: &'static str,
    /// A variation in a word: `cell`, `threat`, `variation`, `scenario`.
    unit: &'static str,
}

/// The finding; `None` without trials.
pub(super) fn found(dossier: &Dossier, given: &Given) -> Option<Finding> {
    let mut seen = BTreeSet::new();
    // A variation may be in several rows of a matrix, with the same trials.
    let all: Vec<Tried> = tried(given).into_iter().filter(|one| seen.insert((one.name(), one.watermark))).collect();
    if all.is_empty() {
        return None;
    }
    let mut view = View { given, noun: noun(given, &[]), unit: unit(given), all };
    let (rank, class) = view.worst();
    view.noun = noun(given, &view.with(class, rank));
    let about = view.with(class, rank);
    let campaign = if let FoundResult::Campaign(campaign) = &given.found { Some(campaign) } else { None };
    let claim = campaign.and_then(claimed).filter(|_| rank > Rank::Harm);
    let told = view.sentence(rank, class, &about);
    let mut lead = campaign.and_then(|campaign| incomplete(given, campaign)).into_iter().collect::<Vec<_>>();
    lead.extend(
        claim.as_ref().filter(|_| rank == Rank::Unnoticed).map(|_| format!("{}.", plain(&told).trim_end_matches('.'))),
    );
    lead.extend(view.numbers(rank, class, &about));
    let (rank, sentence) = claim.unwrap_or((rank, told));
    let facts = view.facts(dossier, rank, class, &about);
    let about = about.iter().map(|one| one.name()).collect();
    Some(Finding { rank, sentence, lead: lead.join(" "), facts, about })
}

fn plain(parts: &[Part]) -> String {
    let word = |part: &Part| match part {
        Part::Plain(words) | Part::Marked(words) => words.clone(),
    };
    parts.iter().map(word).collect()
}

/// Deed done in the trials of these variations, by their own records.
fn noun(given: &Given, about: &[&Tried]) -> &'static str {
    let runs: Vec<&RunObject> = if let FoundResult::BenchLive(bench) = &given.found {
        bench.losses.iter().collect()
    } else {
        given.found.runs().iter().collect()
    };
    if runs.is_empty() {
        return if matches!(given.found, FoundResult::Matrix(_)) { "threat" } else { "variation" };
    }
    let trials = || runs.iter().flat_map(|run| run.trials.iter().filter(|trial| is_about(run, trial, about)));
    let done = || trials().filter(|trial| !trial.injections.is_empty());
    if done().next().is_none() {
        "quiet run"
    } else if done().all(|trial| trial.claims.as_ref().is_some_and(|claims| claims.said > 0)) {
        "lie"
    } else if done().flat_map(|trial| &trial.injections).all(|injection| injection.what.get("fault").is_some()) {
        "fault"
    } else {
        "attack"
    }
}

/// True for a trial of one of these variations; of all where none is named.
fn is_about(run: &RunObject, trial: &Trial, about: &[&Tried]) -> bool {
    let is_one = |one: &&Tried| one.scenario == run.scenario && one.watermark == run.watermark.as_deref();
    about.is_empty() || about.iter().any(|one| is_one(one) && (one.cell.is_none() || one.cell == trial.cell.as_deref()))
}

/// A variation in a word.
fn unit(given: &Given) -> &'static str {
    let with_cells = given.found.runs().iter().filter(|run| !run.cells.is_empty()).count();
    match given.found.runs().len() {
        0 if matches!(given.found, FoundResult::BenchLive(_)) => "scenario",
        0 => "variation",
        n if n == with_cells => "cell",
        _ if with_cells > 0 => "variation",
        _ => "scenario",
    }
}

/// The claim of a complete campaign, as a sentence with its rank.
fn claimed(campaign: &CampaignObject) -> Option<(Rank, Vec<Part>)> {
    let (claim, verdicts) = (campaign.terms.claim.as_ref()?, campaign.claim?);
    let n = campaign.rows.len();
    let (rank, verb) = match (verdicts.refuted, verdicts.open) {
        (0, 0) => (Rank::Fine, format!(" is shown for {}", all_of(n))),
        (0, open) => (Rank::Open, format!(" stays open for {open} of {}", words::number(n as u64, "variation"))),
        (refuted, _) => {
            (Rank::NotStated, format!(" is refuted for {refuted} of {}", words::number(n as u64, "variation")))
        }
    };
    let parts = [
        Part::Plain(format!("The claim {claim}")),
        if rank == Rank::Fine { Part::Plain(verb) } else { Part::Marked(verb) },
    ];
    Some((rank, [&parts[..], &[Part::Plain(".".to_owned())]].concat()))
}

fn all_of(n: usize) -> String {
    if n == 1 { "the one variation".to_owned() } else { format!("all {n} variations") }
}

fn incomplete(given: &Given, campaign: &CampaignObject) -> Option<String> {
    let name = if campaign.terms.sequential { "trials up to the next look" } else { "trials" };
    (!campaign.complete)
        .then(|| format!("{} is incomplete: {} of {} {name}.", given.file, campaign.trials, campaign.planned))
}

impl View<'_> {
    /// The worst class, and why it leads.
    fn worst(&self) -> (Rank, Outcome) {
        let each = |keep: &dyn Fn(&Tried, Outcome) -> bool| {
            let all = self.all.iter();
            all.flat_map(|one| one.outcomes.keys().filter(|class| keep(one, **class)).copied().collect::<Vec<_>>())
                .min()
        };
        if let Some(class) = each(&|one, class| class.is_unexpected(one.expected)) {
            return (Rank::NotStated, class);
        }
        if let Some(class) = each(&|_, class| words::asks(class) && class != Outcome::Undetected) {
            return (Rank::Harm, class);
        }
        if let Some(class) = each(&|_, class| class == Outcome::Undetected) {
            return (Rank::Unnoticed, class);
        }
        let most = self.totals().into_iter().max_by_key(|(_, n)| *n).map_or(Outcome::Nominal, |(class, _)| class);
        (Rank::Fine, most)
    }

    /// The variations that the sentence is about.
    fn with(&self, class: Outcome, rank: Rank) -> Vec<&Tried<'_>> {
        let is_meant = |one: &&Tried| {
            one.outcomes.contains_key(&class) && (rank != Rank::NotStated || class.is_unexpected(one.expected))
        };
        if rank == Rank::Fine { Vec::new() } else { self.all.iter().filter(is_meant).collect() }
    }

    fn totals(&self) -> Outcomes {
        let mut all = Outcomes::new();
        self.all.iter().flat_map(|one| &one.outcomes).for_each(|(class, n)| *all.entry(*class).or_default() += n);
        all
    }

    fn n(&self) -> u64 {
        self.all.iter().map(|one| one.n).sum()
    }

    fn sentence(&self, rank: Rank, class: Outcome, about: &[&Tried]) -> Vec<Part> {
        if rank == Rank::Fine {
            return vec![Part::Plain(self.fine())];
        }
        let hits: u64 = about.iter().filter_map(|one| one.outcomes.get(&class)).sum();
        let of: u64 = about.iter().map(|one| one.n).sum();
        // Single trials count where not all of them ended so, and where the class is about the trial itself.
        let by_trial = class == Outcome::Invalid || (self.unit == "scenario" && hits < of);
        let subject = if by_trial {
            format!("{hits} of {}", words::number(of, "trial"))
        } else {
            subject(about.len() as u64, self.noun)
        };
        let [one, many] = words::deed(class);
        let deed = if (by_trial && hits == 1) || (!by_trial && about.len() == 1) { one } else { many };
        let (verb, rest) = deed.split_once(' ').unwrap_or((deed, ""));
        let is_off = rank == Rank::NotStated && about.iter().any(|one| !one.expected.is_empty());
        let not_stated = if is_off { ", which was not stated beforehand" } else { "" };
        vec![
            Part::Plain(format!("{subject} {verb} ")),
            Part::Marked(rest.to_owned()),
            Part::Plain(format!("{not_stated}{}.", self.which(about))),
        ]
    }

    /// Which variations, after the verb.
    fn which(&self, about: &[&Tried]) -> String {
        match about {
            [one] => {
                let told = one.cell.filter(|_| one.row.is_none()).and_then(words::sentence);
                told.map_or_else(
                    || if self.all.len() == 1 { format!(" in {}", label(one)) } else { format!(": {}", label(one)) },
                    |told| format!(": {told}"),
                )
            }
            few if few.len() <= NAMED => {
                let mut names: Vec<String> = few.iter().map(|one| label(one)).collect();
                names.dedup();
                format!(": {}", words::list(&names, "and"))
            }
            many => format!(" in {} of {}", many.len(), words::number(self.all.len() as u64, self.unit)),
        }
    }

    /// The sentence where no class asks for a reader.
    fn fine(&self) -> String {
        let classes: Vec<Outcome> = self.totals().keys().copied().collect();
        let n = self.n();
        let who = if n == 1 { format!("The {}", self.noun) } else { format!("Every {}", self.noun) };
        match classes.as_slice() {
            [Outcome::Nominal] if self.noun == "quiet run" => {
                format!(
                    "Nothing happens where nothing is done: {} of {} stay NOMINAL.",
                    words::grouped(n),
                    words::number(n, "run")
                )
            }
            some => {
                let deeds: Vec<&str> = some.iter().map(|class| words::deed(*class)[0]).collect();
                let within =
                    self.slowest().filter(|_| some.len() == 1).map(|(sample, ..)| sample.p95.unwrap_or_default());
                let within = within.map(|ms| {
                    if n == 1 {
                        format!(" in {}", words::milliseconds(ms))
                    } else {
                        format!(", 95 % of times within {}", words::milliseconds(ms))
                    }
                });
                format!("{who} {}{}.", words::list(&deeds, "or"), within.unwrap_or_default())
            }
        }
    }

    /// Sentences of numbers.
    fn numbers(&self, rank: Rank, class: Outcome, about: &[&Tried]) -> Vec<String> {
        let mut all = Vec::new();
        if rank == Rank::Fine {
            let of = if let [one] = self.all.as_slice() {
                one.scenario.to_owned()
            } else {
                words::number(self.all.len() as u64, self.unit)
            };
            let stated = if self.all.iter().any(|one| one.expected.is_empty()) { "" } else { ", as stated beforehand" };
            all.push(format!(
                "{} of {of} ended with {}{stated}.",
                words::number(self.n(), "trial"),
                self.endings(&self.all.iter().collect::<Vec<_>>())
            ));
        } else {
            let (hits, of): (u64, u64) =
                (about.iter().filter_map(|one| one.outcomes.get(&class)).sum(), about.iter().map(|one| one.n).sum());
            let these = if about.len() == 1 { format!("that {}", self.unit) } else { format!("these {}s", self.unit) };
            all.push(format!("{} of {} of {these}.", words::grouped(hits), words::number(of, "trial")));
            let others: Vec<&Tried> =
                self.all.iter().filter(|one| !about.iter().any(|other| std::ptr::eq(*one, *other))).collect();
            if !others.is_empty() {
                let n = others.iter().map(|one| one.n).sum();
                let which = if others.len() == 1 {
                    format!("the other {}", self.unit)
                } else {
                    format!("the {} other {}s", others.len(), self.unit)
                };
                all.push(format!("In {which} {} ended with {}.", words::number(n, "trial"), self.endings(&others)));
            }
        }
        all.extend(self.believed(about).filter(|_| class != Outcome::Invalid));
        all.extend(self.stated_harm(rank, class));
        all
    }

    /// How these variations ended, with counts where they ended in several ways.
    fn endings(&self, of: &[&Tried]) -> String {
        let (mut totals, noun) = (Outcomes::new(), noun(self.given, of));
        of.iter().flat_map(|one| &one.outcomes).for_each(|(class, n)| *totals.entry(*class).or_default() += n);
        let one = |(class, n): (&Outcome, &u64)| {
            let ending = words::ending(*class, noun);
            if totals.len() == 1 { ending } else { format!("{ending} ({})", words::grouped(*n)) }
        };
        words::list(&totals.iter().map(one).collect::<Vec<_>>(), "or")
    }

    /// Distance of believed claims from the truth.
    fn believed(&self, about: &[&Tried]) -> Option<String> {
        let FoundResult::Runs(runs) = &self.given.found else { return None };
        if about.is_empty() {
            return None;
        }
        let each = runs.iter().flat_map(|run| run.trials.iter().filter(|trial| is_about(run, trial, about)));
        let most = each.filter_map(|trial| trial.claims.as_ref()).map(|claims| claims.believed_mm).max()?;
        Some(match most {
            0 => "What was believed was true: 0 m of error.".to_owned(),
            mm => format!("At most {} m of error was believed.", words::three_digits(f64::from(mm) / 1e3)),
        })
    }

    /// Harm that was stated beforehand is harm all the same.
    fn stated_harm(&self, rank: Rank, worst: Outcome) -> Option<String> {
        let mut harm: BTreeMap<Outcome, u64> = BTreeMap::new();
        for one in self.all.iter().filter(|one| one.watermark.is_none()) {
            for (class, n) in one.outcomes.iter().filter(|(class, _)| **class <= Outcome::Late) {
                if !class.is_unexpected(one.expected) && (rank, worst) != (Rank::Harm, *class) {
                    *harm.entry(*class).or_default() += n;
                }
            }
        }
        let each: Vec<String> = harm.iter().map(|(class, n)| format!("{} {n}", class.name())).collect();
        (!each.is_empty()).then(|| format!("Stated beforehand is not harmless: {}.", each.join(", ")))
    }
}

/// A variation in a sentence.
fn label(one: &Tried) -> String {
    if let Some(row) = one.row {
        return format!("{} ({})", row.id, one.scenario);
    }
    let set: Vec<String> =
        one.cell.map(|cell| cell.replace('/', ", ")).into_iter().chain(one.set.iter().cloned()).collect();
    let guest = one
        .watermark
        .and_then(|mark| mark.strip_prefix("GUEST: "))
        .map(|of| format!(", where {}", of.replace('`', "")));
    let with = if set.is_empty() { String::new() } else { format!(" with {}", set.join(", ")) };
    format!("{}{with}{}", one.scenario, guest.unwrap_or_default())
}
