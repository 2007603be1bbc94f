//! `campaign.json` against the finished trials beside it, for every command that reads it.

use std::collections::BTreeMap;
use std::path::Path;

use results::campaign::row::TrialRow;
use results::report::{CampaignObject, CampaignRow};
use runner::failure::Failure;

use super::journal::{each_row, has_journal, read_plan};
use super::run::folded;

/// The first difference between the campaign in `directory` as `stated` and as its finished trials give it; none without these.
///
/// # Errors
/// When plan or trials cannot be read, or a line of these is not as it was written.
pub(in crate::command) fn contradiction(directory: &Path, stated: &CampaignObject) -> Result<Option<String>, Failure> {
    if !has_journal(directory) {
        return Ok(None);
    }
    let plan = read_plan(directory)?;
    let mut rows: BTreeMap<u64, TrialRow> = BTreeMap::new();
    each_row(directory, &plan, |row| {
        rows.insert(row.trial, row);
        Ok(())
    })?;
    // The object does not say if it is of a partition, of which every trial counts.
    let mut text = None;
    for whole in [true, false] {
        let finished = (|number| rows.get(&number).map(|row| row.outcome), |number| Ok(rows.get(&number).cloned()));
        let folded = folded(&plan, whole, finished, |_, _, _| Ok(()))?;
        match difference(stated, &folded) {
            None => return Ok(None),
            differs => text = text.or(differs),
        }
    }
    Ok(text)
}

/// Difference in any value that a reader takes from a campaign.
fn difference(stated: &CampaignObject, folded: &CampaignObject) -> Option<String> {
    let shown = |row: &CampaignRow| (row.n, row.outcomes.clone(), row.unexpected, row.claim);
    let mut rows = stated.rows.iter().zip(&folded.rows);
    let differs = rows.find(|(stated, folded)| shown(stated) != shown(folded));
    if let Some((row, _)) = differs {
        return Some(format!(
            "campaign.json does not follow from the finished trials in trials.jsonl: {}",
            row.scenario
        ));
    }
    let same = (stated.rows.len(), &stated.hash, stated.claim) == (folded.rows.len(), &folded.hash, folded.claim);
    (!same).then(|| "campaign.json does not follow from the finished trials in trials.jsonl".to_owned())
}
