//! Limits of a row's fields, and that its counts add up. The signature is left to `signed`, the order of rows to `file`.

use std::collections::BTreeMap;

use evidence::trial::Outcome;

use crate::row::{BoardRow, BoardTrial};

/// The most trials of a row.
pub const MAX_TRIALS: usize = 1000;
/// The most files of a guest: its own, 64 pins and 64 words of its command.
const MAX_FILES: usize = 129;
/// The longest path, bytes.
const MAX_WORD: usize = 128;
/// The longest name, characters.
const MAX_NAME: usize = 64;
/// The most of anything that a trial can count: way points, steps, metres driven in mm.
const MAX_COUNT: u64 = 1 << 32;

/// Fault of a row.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RowFault {
    /// A text of another form.
    #[error("{field}: {expected} expected, got {got:?}")]
    Text {
        /// Field.
        field: &'static str,
        /// Form in words.
        expected: &'static str,
        /// Beginning of the text.
        got: String,
    },
    /// A number out of its range.
    #[error("{field}: at most {most} expected, got {got}")]
    Number {
        /// Field.
        field: &'static str,
        /// Largest value.
        most: u64,
        /// Value.
        got: u64,
    },
    /// No trial.
    #[error("trials: 1 to {MAX_TRIALS} expected, got none")]
    NoTrials,
    /// Count of a class that the trials do not have.
    #[error("outcomes: {class} {stated} is stated, the trials have {counted}")]
    Count {
        /// Class.
        class: &'static str,
        /// Stated number.
        stated: u64,
        /// Number among the trials.
        counted: u64,
    },
    /// Two seeds never have one log.
    #[error("trials: seeds {first} and {second} have one log; each seed has its own")]
    SameLog {
        /// Seed of the first trial.
        first: u64,
        /// Seed of the second trial.
        second: u64,
    },
    /// The key is no point on the curve, or a weak one.
    #[error("contributor.key: no Ed25519 public key")]
    Key,
    /// The signature is not of this key over this row.
    #[error("signature: not the contributor's over this row; the row was altered, or another key signed it")]
    Signature,
    /// The row's key is none of those that were named.
    #[error("contributor.key: {got} is none of the keys that were named")]
    Stranger {
        /// Key of the row.
        got: String,
    },
    /// The row is not behind the one before it.
    #[error("order: the row belongs before row {before}; `holdsafe guest board merge` writes rows in order")]
    Order {
        /// Number of the row before.
        before: usize,
    },
    /// Row of the same guest, attack, world, seed, program and contributor as another row.
    #[error("duplicate: row {other} is of the same guest, attack, world, seed, program and contributor")]
    Duplicate {
        /// Number of the other row.
        other: usize,
    },
}

/// Checks every field of a row.
///
/// # Errors
/// The first field out of its bounds, or count that does not add up.
pub(crate) fn check(row: &BoardRow) -> Result<(), RowFault> {
    check_draft(row)?;
    check_trials(row.seed, &row.trials)?;
    check_counts(row)?;
    check_availability(row)
}

/// Checks the fields of a row that its trials do not change.
///
/// # Errors
/// The first field out of its bounds.
pub fn check_draft(row: &BoardRow) -> Result<(), RowFault> {
    check_texts(row)?;
    check_files(&row.guest.files)
}

fn check_texts(row: &BoardRow) -> Result<(), RowFault> {
    plain("guest.name", &row.guest.name)?;
    plain("scenario", &row.scenario)?;
    plain("platform", &row.platform)?;
    row.world.as_ref().map_or(Ok(()), |family| plain("world", family))?;
    let optional = [("cell", &row.cell), ("waived", &row.waived)];
    optional.into_iter().try_for_each(|(field, text)| text.as_ref().map_or(Ok(()), |text| word(field, text)))?;
    let words = [
        ("program.version", &row.program.version),
        ("program.commit", &row.program.commit),
        ("host.target", &row.host.target),
        ("host.build", &row.host.build),
    ];
    words.into_iter().try_for_each(|(field, text)| word(field, text))?;
    let digests = [
        ("inputs.scenario", &row.inputs.scenario),
        ("inputs.policy", &row.inputs.policy),
        ("inputs.platform", &row.inputs.platform),
        ("program.sources", &row.program.sources),
        ("contributor.key", &row.contributor.key),
    ];
    digests.into_iter().try_for_each(|(field, text)| hexadecimal(field, text))?;
    check_name(&row.contributor.name)
}

/// Checks the name of a contributor: characters that neither a table nor a terminal takes for more than text.
fn check_name(name: &str) -> Result<(), RowFault> {
    let is_plain = |c: char| c.is_alphanumeric() || " .,'-_@+()".contains(c);
    let fits = name.trim() == name && (1..=MAX_NAME).contains(&name.chars().count()) && name.chars().all(is_plain);
    let expected = "1 to 64 letters, digits, blanks and .,'-_@+() without blanks at the ends";
    fits.then_some(()).ok_or_else(|| text("contributor.name", expected, name))
}

fn text(field: &'static str, expected: &'static str, got: &str) -> RowFault {
    RowFault::Text { field, expected, got: got.chars().take(40).collect() }
}

/// A name that leads to no other folder, where a replay takes it for that of a file.
fn plain(field: &'static str, got: &str) -> Result<(), RowFault> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    let fits = (1..=MAX_NAME).contains(&got.len()) && got.chars().all(is_plain);
    fits.then_some(()).ok_or_else(|| text(field, "1 to 64 letters, digits, - and _", got))
}

/// A name or path: characters that neither Markdown nor a terminal takes for more than text.
fn word(field: &'static str, got: &str) -> Result<(), RowFault> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || " ._-+/:=,@".contains(c);
    let fits = (1..=MAX_WORD).contains(&got.len()) && got.chars().all(is_plain);
    fits.then_some(()).ok_or_else(|| text(field, "1 to 128 letters, digits, blanks and ._-+/:=,@", got))
}

fn hexadecimal(field: &'static str, got: &str) -> Result<(), RowFault> {
    let fits = got.len() == 64 && got.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    fits.then_some(()).ok_or_else(|| text(field, "64 hexadecimal digits in lower case", got))
}

fn at_most(field: &'static str, most: u64, got: u64) -> Result<(), RowFault> {
    if got <= most { Ok(()) } else { Err(RowFault::Number { field, most, got }) }
}

fn check_files(files: &BTreeMap<String, String>) -> Result<(), RowFault> {
    at_most("guest.files", MAX_FILES as u64, files.len() as u64)?;
    for (name, digest) in files {
        // The guest's own file has the empty name.
        if !name.is_empty() {
            word("guest.files", name)?;
        }
        hexadecimal("guest.files", digest)?;
    }
    Ok(())
}

fn check_trials(seed: u64, trials: &[BoardTrial]) -> Result<(), RowFault> {
    let n = trials.len() as u64;
    if n == 0 {
        return Err(RowFault::NoTrials);
    }
    at_most("trials", MAX_TRIALS as u64, n)?;
    at_most("seed", u64::MAX - n, seed)?;
    let mut logs = BTreeMap::new();
    for (trial, seed) in trials.iter().zip(seed..) {
        hexadecimal("trials.log", &trial.log)?;
        if let Some(first) = logs.insert(trial.log.as_str(), seed) {
            return Err(RowFault::SameLog { first, second: seed });
        }
    }
    Ok(())
}

fn check_counts(row: &BoardRow) -> Result<(), RowFault> {
    let counted = BoardRow::counted(&row.trials);
    let count = |class: Outcome| counted.get(&class).copied().unwrap_or_default();
    let differing = Outcome::ALL.into_iter().find(|class| row.outcomes.get(class) != counted.get(class));
    differing.map_or(Ok(()), |class| {
        Err(RowFault::Count { class: class.name(), stated: row.count(class), counted: count(class) })
    })
}

fn check_availability(row: &BoardRow) -> Result<(), RowFault> {
    let (sums, n) = (&row.availability, row.trials.len() as u64);
    let most = n * MAX_COUNT;
    [
        ("availability.routed", n, sums.routed),
        ("availability.stuck", sums.routed, sums.stuck),
        ("availability.points", sums.routed.saturating_mul(MAX_COUNT), sums.points),
        ("availability.passed", sums.points, sums.passed),
        ("availability.driven_mm", most, sums.driven_mm),
        ("availability.false_trips", most, sums.false_trips),
        ("availability.steps", most, sums.steps),
        ("availability.limited", sums.steps, sums.limited),
    ]
    .into_iter()
    .try_for_each(|(field, most, got)| at_most(field, most, got))
}
