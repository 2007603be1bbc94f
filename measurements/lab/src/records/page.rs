//! docs/results.md, written from the list and the records; and the quoted sentences of other pages.

use std::path::Path;

use super::kept::{self, Kept};
use super::list::{Entry, List, Older, PARTS, Tier};
use super::quotes;

/// Longest commands that a row shows, in bytes.
const LONGEST_COMMAND: usize = 110;

/// The page for a program of these sources: records of other sources are marked with their commit and day.
///
/// # Errors
/// A record cannot be read.
pub fn page(list: &List, folder: &Path, sources: &str) -> Result<String, String> {
    let mut taken = Vec::new();
    let mut missing = Vec::new();
    for entry in &list.records {
        match kept::read(folder, &entry.name)? {
            Some(kept) => taken.push((entry, kept)),
            None => missing.push(entry),
        }
    }
    let mut text = head(list, &taken, sources);
    for part in PARTS {
        let rows: Vec<&(&Entry, Kept)> = taken.iter().filter(|(entry, _)| entry.part == part).collect();
        if !rows.is_empty() {
            text += &format!(
                "\n## {part}\n\n| quantity | figure | sample, interval | before | command |\n|---|---|---|---|---|\n"
            );
            text.extend(rows.iter().map(|(entry, kept)| taken_row(entry, kept, sources)));
        }
    }
    if !missing.is_empty() {
        text += "\n## Not taken again\n\nPublished before, with the command that takes them and its minutes on two idle cores.\n\n";
        text += "| quantity | figure before | minutes | needs | command |\n|---|---|---|---|---|\n";
        text.extend(missing.iter().map(|entry| missing_row(entry)));
    }
    if !list.older.is_empty() {
        text += "\n## Figures of other pages\n\nSections with figures that no record takes, with the commit of their measurement.\n\n";
        text += "| section | command or file | commit | no record, since |\n|---|---|---|---|\n";
        text.extend(list.older.iter().map(older_row));
    }
    Ok(text)
}

/// The sources that a written page was made for.
pub fn sources_of(page: &str) -> Option<&str> {
    page.split("sources `").nth(1)?.split('`').next()
}

fn head(list: &List, taken: &[(&Entry, Kept)], sources: &str) -> String {
    let current: Vec<&Kept> = taken.iter().map(|(_, kept)| kept).filter(|kept| kept.sources == sources).collect();
    let sum = |tier: Tier| -> f64 { list.records.iter().filter(|e| e.tier == tier).map(|e| e.minutes).sum() };
    let origin = current.iter().max_by_key(|kept| &kept.day).map_or_else(
        || "No record is of it.".to_owned(),
        |kept| {
            let minutes = current.iter().map(|kept| kept.seconds).sum::<f64>() / 60.0;
            format!(
                "{} of {} records are of it, taken on {} in {minutes:.0} minutes together.",
                current.len(),
                list.records.len(),
                kept.host
            )
        },
    );
    format!(
        "\
# Results

After this page you can quote or check every headline figure: its sample, its command, its commit. Written by `lab records` from docs/results/records.toml and
the records beside it; a test holds it equal. Do not edit.

The program has the sources `{sources}`, as `holdsafe --version` prints. {origin} The first seed is {}, fresh for these records. A record of other sources has its commit and day.

`lab records --tier hour` takes those of {:.0} minutes again, `lab records --tier long` the rest, {:.1} hours on two cores ([build](../CONTRIBUTING.md#build-and-test)). Intervals are at 95 %. Trials
of the twin, of the real stacks in memory and of live runs are never added. *Live* runs are rendered, with the detector in the loop. Classes: [outcomes](reference/outcomes.md);
known weaknesses: [limits](limits.md).
",
        list.seed,
        sum(Tier::Hour),
        sum(Tier::Long) / 60.0
    )
}

fn taken_row(entry: &Entry, kept: &Kept, sources: &str) -> String {
    let mut figure = kept.figure.clone();
    for claim in kept.claims.iter().filter(|claim| !claim.holds) {
        figure += &format!("; **does not hold**: `{}`", claim.claim);
    }
    if !entry.note.is_empty() {
        figure += &format!(". {}", entry.note);
    }
    let mut sample = kept.sample.clone();
    if kept.sources != sources {
        sample += &format!("; **older**: `{}`, {}", kept.commit, kept.day);
    }
    row(&[&entry.what, &figure, &sample, &entry.before, &commands(entry)])
}

fn missing_row(entry: &Entry) -> String {
    let needs = entry.needs.join(", ");
    row(&[&entry.what, &entry.before, &format!("{:.0}", entry.minutes), &needs, &commands(entry)])
}

fn older_row(older: &Older) -> String {
    let place = older.page.strip_prefix("docs/").map_or_else(|| format!("../{}", older.page), str::to_owned);
    let section = format!(
        "[{}]({place}), {}",
        older.page.trim_start_matches("docs/"),
        older.section.trim_start_matches(['#', ' '])
    );
    row(&[&section, &format!("`{}`", older.command), &format!("`{}`", older.commit), &older.why])
}

/// The commands without their folders where they are short, else the command that runs them.
fn commands(entry: &Entry) -> String {
    let short = |command: &String| command.split(" --out $OUT").next().unwrap_or_default().to_owned();
    let all: Vec<String> = entry.run.iter().map(|command| format!("`{}`", short(command))).collect();
    let text = all.join(", ");
    if text.len() > LONGEST_COMMAND || text.contains('$') { format!("`lab records {}`", entry.name) } else { text }
}

fn row(cells: &[&str]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
    format!("| {} |\n", cells.join(" | "))
}

/// A page of the repository with every sentence that these records have for it.
///
/// # Errors
/// A sentence of the list is not in the page.
pub fn quoted(page: &str, text: &str, list: &List, folder: &Path) -> Result<String, String> {
    let mut text = text.to_owned();
    for entry in &list.records {
        let kept = kept::read(folder, &entry.name)?;
        for (i, quote) in entry.quotes.iter().enumerate().filter(|(_, quote)| quote.page == page) {
            let place =
                quotes::place(&text, &quote.text).map_err(|reason| format!("{page}, {}: {reason}", entry.name))?;
            if let Some(new) = kept.as_ref().and_then(|kept| kept.quotes.get(i)) {
                text.replace_range(place, &new.text);
            }
        }
    }
    Ok(text)
}
