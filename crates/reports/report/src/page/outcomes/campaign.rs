//! A campaign as bars: a variation a row, the observed share of its leading class and the interval around it.

use maud::{Markup, html};
use results::report::{CampaignObject, CampaignRow};

use super::said;
use crate::page::grid::leading;
use crate::page::shape::shape;
use crate::page::words;
use crate::tried::either;

/// The bars.
pub(super) fn bars(campaign: &CampaignObject) -> Markup {
    html! {
        (said("How often each variation ended as it did", "The mark is the observed share of the class that leads, the bar its exact two-sided 95 % interval, from 0 to 100 %. A class leads that was not stated, then harm, then the most frequent."))
        @for row in &campaign.rows { (bar(campaign, row)) }
    }
}

fn bar(campaign: &CampaignObject, row: &CampaignRow) -> Markup {
    let class = leading(&row.outcomes, &row.expected);
    let share = class.and_then(|class| row.bounds.as_ref()?.shares.get(&class));
    let hits = class.and_then(|class| row.outcomes.get(&class)).copied().unwrap_or_default();
    html! { div class="drow" {
        span { (name(row)) @if row.watermark.is_some() { " (ABLATION)" } }
        b { (hits) " of " (row.n) }
        @if let Some(share) = share {
            div class="dbar span" {
                i style=(format!("left:{:.2}%;width:{:.2}%", share.lower_95 * 100.0, (share.upper_95 - share.lower_95) * 100.0)) {}
                u style=(format!("left:calc({:.2}% - 1.5px)", share.share.unwrap_or_default() * 100.0)) {}
            }
        } @else { div class="dbar span" {} }
        span class="lim" { @if let Some(class) = class { (shape(class)) (class.name()) @if row.unexpected > 0 { strong class="bad-word" { ", not stated" } } } }
        small { (bound(campaign, row)) }
    } }
}

/// A variation by its varied values.
fn name(row: &CampaignRow) -> String {
    let cell = row.cell.as_ref().map(|cell| cell.replace('/', ", "));
    let set = row.set.iter().map(|(path, value)| format!("{path} = {value}"));
    let parts: Vec<String> = std::iter::once(row.scenario.clone()).chain(cell).chain(set).collect();
    parts.join(", ")
}

fn bound(campaign: &CampaignObject, row: &CampaignRow) -> String {
    let stated = if row.expected.is_empty() { String::new() } else { format!("stated: {}; ", either(&row.expected)) };
    let claim = campaign.terms.claim.as_ref().zip(row.claim.as_ref());
    let claim = claim.map(|(claim, judged)| format!("; {claim}: {}", judged.alone.verdict.name())).unwrap_or_default();
    match &row.bounds {
        Some(bounds) => format!("{stated}unsafe below {} (95 %){claim}", words::percent(bounds.unsafe_upper_95)),
        None if row.claim.is_some() => format!("{stated}looked at often{claim}"),
        None => format!("{stated}none yet: {} of {} trials", row.n, row.planned),
    }
}
