//! Claims with their evidence: a row a threat and place of evidence, each with n, its bound, and the result that it is from.

use results::campaign::claim::JudgedClaim;
use results::report::{CampaignObject, ClaimRow, Matrix, RateBounds};

use super::matrix::unmarked;
use super::words::percent;
use crate::Dossier;
use crate::figure::Table;
use crate::reader::FoundResult;
use crate::tried::class_counts;

/// Only rows under a full policy, and only where the mechanism that is claimed about really runs. A claim holds as far as its outcomes say:
/// harm that was stated beforehand is as stated.
pub(super) fn rows(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&[
        "claim",
        "evidence",
        "n",
        "outcomes",
        "not as claimed",
        "unsafe below (95 %)",
        "together with all others",
        "from",
    ]);
    for given in dossier.results.files() {
        match &given.found {
            FoundResult::Matrix(matrix) => of_matrix(&mut rows, matrix, &given.file),
            FoundResult::Campaign(campaign) => of_campaign(&mut rows, campaign, &given.file),
            FoundResult::Runs(_)
            | FoundResult::Reference(_)
            | FoundResult::Search(_)
            | FoundResult::Comparison(_)
            | FoundResult::BenchLive(_)
            | FoundResult::Curve(_)
            | FoundResult::Ablation(_)
            | FoundResult::TwinCost(_)
            | FoundResult::Worlds(_) => {}
        }
    }
    rows
}

fn of_matrix(rows: &mut Table, matrix: &Matrix, file: &str) {
    for row in &matrix.rows {
        for kind in row.kinds.iter().filter(|k| k.counts && !k.ablation) {
            rows.rows.push(vec![
                format!("{}: {}", row.id, unmarked(&row.containment)),
                kind.evidence.name().to_owned(),
                kind.n.to_string(),
                class_counts(&kind.outcomes),
                kind.unexpected.to_string(),
                percent(kind.unsafe_upper_95),
                percent(kind.unsafe_upper_95_simultaneous),
                file.to_owned(),
            ]);
        }
    }
}

fn of_campaign(rows: &mut Table, campaign: &CampaignObject, file: &str) {
    for row in campaign.rows.iter().filter(|r| r.counts && r.watermark.is_none()) {
        let name = row.cell.as_ref().map_or_else(|| row.scenario.clone(), |cell| format!("{} ({cell})", row.scenario));
        let classes: Vec<&str> = row.expected.iter().map(|class| class.name()).collect();
        let set: String = row.set.iter().map(|(path, value)| format!(", {path} = {value}")).collect();
        let ends = format!("{name}{set} under policy {} ends in {}", row.policy, classes.join(" or "));
        let tested = campaign.terms.claim.as_ref().zip(row.claim.as_ref());
        let tested = tested.map(|(claim, judged)| format!("; {claim}: {}", judged.alone.verdict.name()));
        let bound =
            |bound_of: fn(&RateBounds) -> f64, judged: fn(&ClaimRow) -> JudgedClaim| match (&row.bounds, &row.claim) {
                (Some(bounds), _) => percent(bound_of(bounds)),
                (None, Some(claim)) => looked(campaign, claim, judged(claim), row.n),
                (None, None) => format!("none yet: {} of {} trials", row.n, row.planned),
            };
        rows.rows.push(vec![
            ends + &tested.unwrap_or_default(),
            row.evidence.name().to_owned(),
            row.n.to_string(),
            class_counts(&row.outcomes),
            row.unexpected.to_string(),
            bound(|b| b.unsafe_upper_95, |claim| claim.alone),
            bound(|b| b.unsafe_upper_95_simultaneous, |claim| claim.together),
            file.to_owned(),
        ]);
    }
}

/// The claim of a sequential campaign, with the upper bound that holds at every look.
fn looked(campaign: &CampaignObject, claim: &ClaimRow, judged: JudgedClaim, n: u64) -> String {
    let claimed = campaign.terms.claim.as_ref().map(ToString::to_string).unwrap_or_default();
    let look = claim.looked_at.unwrap_or(n);
    format!(
        "looked at often; {claimed}: {} at {look} trials, its rate at most {}",
        judged.verdict.name(),
        percent(judged.upper)
    )
}
