//! Ablations in words: how many variations waive a check on purpose, and its meaning.

use std::collections::BTreeSet;

use maud::{Markup, html};

use super::words;
use crate::Dossier;
use crate::reader::FoundResult;
use crate::tried::{Tried, tried};

pub(super) fn note(dossier: &Dossier) -> Markup {
    let marks = marks(dossier);
    let ablations: BTreeSet<&str> = marks.iter().filter_map(|mark| mark.strip_prefix("ABLATION: ")).collect();
    let policies: BTreeSet<&str> = ablations.iter().filter_map(|mark| mark.split('`').nth(1)).collect();
    let all: Vec<Tried> = dossier.results.files().iter().flat_map(tried).collect();
    let waived = all.iter().filter(|one| is_waived(one, &policies)).count();
    let unit = if all.iter().any(|one| one.cell.is_some()) { "cell" } else { "variation" };
    let named = if policies.is_empty() {
        ablations.iter().copied().collect::<Vec<_>>().join("; ")
    } else {
        policy_names(&policies)
    };
    html! {
        @for (kind, rest) in marks.iter().filter_map(|mark| mark.split_once(": ")).filter(|(kind, _)| *kind != "ABLATION") {
            div class="note" role="note" { b { (kind) "." } " " (rest) "." }
        }
        @if !ablations.is_empty() {
            div class="note" role="note" {
                b { "ABLATION." } " "
                @if waived == 0 { "Some of these trials waive a check on purpose (" (named) "). They show " }
                @else if waived == all.len() { "All of these trials waive a check on purpose (" (named) "). They show " }
                @else { (waived) " of the " (words::number(all.len() as u64, unit)) " waive a check on purpose (" (named) "). They show " }
                "what the check is worth, and no claim about the platform rests on that."
            }
        }
    }
}

/// Every watermark of the results and of the manifests beside them, part by part. That a comparison has guests its own words say.
fn marks(dossier: &Dossier) -> BTreeSet<&str> {
    let mut all: BTreeSet<&str> = dossier.watermarks.iter().map(String::as_str).collect();
    let mut compared = false;
    for given in dossier.results.files() {
        match &given.found {
            FoundResult::Search(search) => all.extend(search.watermark.as_deref()),
            FoundResult::Curve(curve) => all.extend(curve.watermarks.iter().map(String::as_str)),
            FoundResult::Comparison(comparison) => {
                compared = true;
                all.extend(comparison.rows.iter().filter_map(|row| row.watermark.as_deref()));
            }
            FoundResult::Matrix(_)
            | FoundResult::Runs(_)
            | FoundResult::Reference(_)
            | FoundResult::Campaign(_)
            | FoundResult::BenchLive(_)
            | FoundResult::Ablation(_)
            | FoundResult::TwinCost(_)
            | FoundResult::Worlds(_) => {}
        }
        all.extend(tried(given).iter().filter_map(|one| one.watermark));
    }
    let parts = all.into_iter().flat_map(|mark| mark.split("; ")).map(str::trim);
    parts.filter(|part| !(compared && part.starts_with("GUEST: "))).collect()
}

/// A cell that names its policy is waived if that policy is; another by its own watermark.
fn is_waived(one: &Tried, policies: &BTreeSet<&str>) -> bool {
    let named = one.cell.is_some_and(|cell| cell.split('/').any(|part| policies.contains(part)));
    let says_policy = one.cell.is_some_and(|cell| cell.split('/').any(words::is_policy));
    named || (one.watermark.is_some() && !says_policy)
}

fn policy_names(policies: &BTreeSet<&str>) -> String {
    let names: Vec<String> = policies.iter().map(|name| name.replace('-', " ")).collect();
    words::list(&names, "and")
}
