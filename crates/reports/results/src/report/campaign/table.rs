//! A campaign for a terminal: the first variations, the verdict on the claim, the hash.

use super::super::layout::folded;
use super::super::table::{outcomes, percent, sample};
use super::{CampaignObject, CampaignRow, ClaimRow, ClaimVerdicts};
use crate::report::new_table;

/// Most rows of the table for a terminal; the object has all.
const MAX_SHOWN: usize = 60;

/// The campaign for a terminal.
pub fn campaign_table(campaign: &CampaignObject) -> String {
    let columns = [
        "variation",
        "evidence, n",
        "outcomes",
        "unsafe below (together)",
        "claim",
        "to degraded ms",
        "to hold-safe ms",
    ];
    let mut table = new_table(&columns);
    for row in campaign.rows.iter().take(MAX_SHOWN) {
        table.add_row(cells(row));
    }
    let mut text = format!("{table}\n");
    if campaign.rows.len() > MAX_SHOWN {
        text.push_str(&format!("and {} more variations in campaign.json\n", campaign.rows.len() - MAX_SHOWN));
    }
    text.push_str(&conclusion(campaign));
    text.push_str(
        "ms: mean / p95 / upper 95 % bound on p95 (needs n >= 59). * the real mechanism does not run there.\n",
    );
    folded(&(text + &format!("campaign hash {}\n", campaign.hash)))
}

fn cells(row: &CampaignRow) -> Vec<String> {
    let set: Vec<String> = row.set.iter().map(|(path, value)| format!("{path}={value}")).collect();
    let names = [Some(row.scenario.clone()), row.cell.clone(), Some(set.join(" ")), row.watermark.clone()];
    let names: Vec<String> = names.into_iter().flatten().filter(|name| !name.is_empty()).collect();
    let odd = if row.unexpected > 0 { format!(" ({} unexpected)", row.unexpected) } else { String::new() };
    let (mark, missing) = (if row.counts { "" } else { " *" }, row.planned - row.n);
    let missing = if missing > 0 { format!(", {missing} missing") } else { String::new() };
    let dash = || "-".to_owned();
    let bound = row.bounds.as_ref().map_or_else(dash, |bounds| {
        format!("{} ({})", percent(bounds.unsafe_upper_95), percent(bounds.unsafe_upper_95_simultaneous))
    });
    vec![
        names.join(" "),
        format!("{}, {}{missing}{mark}", row.evidence.name(), row.n),
        outcomes(&row.outcomes) + &odd,
        bound,
        row.claim.as_ref().map_or_else(dash, claim),
        sample(&row.latency_ms.to_degraded),
        sample(&row.latency_ms.to_hold_safe),
    ]
}

/// `shown: 0 hits, 0.000 to 0.997 %`.
fn claim(row: &ClaimRow) -> String {
    let invalid = if row.invalid > 0 { format!(" and {} INVALID", row.invalid) } else { String::new() };
    let together = if row.together.verdict == row.alone.verdict { "" } else { "; not together" };
    let (from, to) = (row.alone.lower * 100.0, row.alone.upper * 100.0);
    let look = row.looked_at.map(|n| format!(" at {n}")).unwrap_or_default();
    format!("{}{look}: {} hits{invalid}, {from:.3} to {to:.3} %{together}", row.alone.verdict.name(), row.hits)
}

/// The claim of a sequential campaign that is under way.
fn looks(campaign: &CampaignObject) -> String {
    let Some(claim) = campaign.terms.claim.as_ref().filter(|_| campaign.terms.sequential) else { return String::new() };
    let ClaimVerdicts { shown, refuted, open, .. } = ClaimVerdicts::from_rows(&campaign.rows);
    let n = campaign.rows.len();
    format!(
        "claim {claim} of {n} variations: shown for {shown}, refuted for {refuted}, open at the last look for {open}\n"
    )
}

fn conclusion(campaign: &CampaignObject) -> String {
    let (terms, n) = (&campaign.terms, campaign.rows.len());
    if !campaign.complete {
        let (finished, planned) = (campaign.trials, campaign.planned);
        let text = format!("INCOMPLETE: {finished} of {planned} trials; no claim is made about missing trials\n");
        return text + &looks(campaign);
    }
    let Some((claim, claims)) = terms.claim.as_ref().zip(campaign.claim) else { return String::new() };
    let ClaimVerdicts { shown, refuted, open, shown_together } = claims;
    let together = if shown_together { "it holds for all of them together" } else { "not for all of them together" };
    let manner = if terms.sequential {
        "at every look together (e-process)"
    } else {
        "exact one-sided bounds (Clopper-Pearson)"
    };
    format!(
        "claim {claim}: shown for {shown} of {n} variations, refuted for {refuted}, open for {open}; {together} \
         (Bonferroni). {manner}; an INVALID trial is never a success for it\n"
    )
}
