//! The file of a leaderboard: a head, a row a line in canonical order, an end.
//!
//! A file has one form. Its lines are compared with the canonical text of the rows in them, so that no key twice, blank or other spelling of a
//! number gets past the signature. Rows are added and never changed; that a row was taken out is not seen in the file.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::bounds::RowFault;
use crate::row::BoardRow;
use crate::signed::SignedRow;

/// Version of the file.
pub const VERSION: u64 = 1;
/// The longest file, bytes.
pub const MAX_FILE_BYTES: u64 = 16 << 20;
/// The most rows of a file.
pub const MAX_ROWS: usize = 4096;
/// The longest line of a row, bytes.
const MAX_LINE: usize = 256 << 10;
/// The longest first line that is looked at for its version, bytes.
const MAX_HEAD: usize = 256;

const HEAD: &str = r#"{"kind":"guest-board","schema_version":1,"rows":["#;
const END: &str = "\n]}\n";

/// A leaderboard.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Board {
    rows: Vec<SignedRow>,
}

/// A fault of a row, by its number from 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("row {number} ({title}): {fault}")]
pub struct Finding {
    /// Number of the row.
    pub number: usize,
    /// Row in words.
    pub title: String,
    /// Fault.
    pub fault: RowFault,
}

/// Reason for which a file is no leaderboard, or a row cannot be added.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BoardError {
    /// The file is too long.
    #[error("{got} bytes, at most {MAX_FILE_BYTES} expected")]
    TooLong {
        /// Its length, bytes.
        got: usize,
    },
    /// The first line is another.
    #[error("line 1: {HEAD} expected; the file is no leaderboard, or was formatted anew")]
    Head,
    /// A version that this program does not read.
    #[error("line 1: schema_version {VERSION} expected, got {got}; a newer holdsafe reads it")]
    Version {
        /// Its version.
        got: u64,
    },
    /// The last line is another.
    #[error("last line: `]}}` and an end of line expected; the file was cut short or formatted anew")]
    End,
    /// More rows than a file may have.
    #[error("{got} rows, at most {MAX_ROWS} expected; begin another file")]
    TooMany {
        /// Number of rows.
        got: usize,
    },
    /// A line is no row.
    #[error("row {number}: {reason}")]
    Line {
        /// Number of the row.
        number: usize,
        /// Reason.
        reason: String,
    },
    /// A row has a fault.
    #[error(transparent)]
    Row(#[from] Finding),
}

/// Head of a file of any version.
#[derive(Deserialize)]
struct AnyHead {
    kind: String,
    schema_version: u64,
    #[serde(rename = "rows")]
    _rows: Vec<IgnoredAny>,
}

impl Board {
    /// The rows of a file's text. Bounds, signatures and order are left to [`Board::findings`].
    ///
    /// # Errors
    /// The text is not of a leaderboard's form; the first line that is none.
    pub fn parse(text: &str) -> Result<Self, BoardError> {
        if text.len() as u64 > MAX_FILE_BYTES {
            return Err(BoardError::TooLong { got: text.len() });
        }
        let (head, rest) = text.split_once('\n').ok_or(BoardError::Head)?;
        check_head(head)?;
        let body = text.strip_suffix(END).ok_or(BoardError::End)?;
        // The head alone is a file without rows.
        let Some(lines) = body.get(head.len() + 1..) else {
            return if rest.len() + 1 == END.len() { Ok(Self::default()) } else { Err(BoardError::End) };
        };
        let count = lines.split('\n').count();
        if count > MAX_ROWS {
            return Err(BoardError::TooMany { got: count });
        }
        let rows = lines.split('\n').zip(1..).map(|(line, number)| parse_line(line, number, number == count));
        Ok(Self { rows: rows.collect::<Result<_, _>>()? })
    }

    /// The rows of a file's text, each checked.
    ///
    /// # Errors
    /// As [`Board::parse`], or the first finding.
    pub fn verified(text: &str) -> Result<Self, BoardError> {
        let board = Self::parse(text)?;
        board.findings().into_iter().next().map_or(Ok(board), |finding| Err(finding.into()))
    }

    /// Text of the file.
    pub fn text(&self) -> String {
        let lines: Vec<String> = self.rows.iter().map(|row| format!("\n{}", row.line())).collect();
        format!("{HEAD}{}{END}", lines.join(","))
    }

    /// Rows in order.
    pub fn rows(&self) -> &[SignedRow] {
        &self.rows
    }

    /// The first fault of each row: of its bounds, counts and signature, and of its place behind the row before it.
    pub fn findings(&self) -> Vec<Finding> {
        let fault = |index: usize| self.rows[index].check().err().or_else(|| self.misplaced(index));
        let finding = |index: usize| {
            fault(index).map(|fault| Finding { number: index + 1, title: self.rows[index].row.title(), fault })
        };
        (0..self.rows.len()).filter_map(finding).collect()
    }

    /// Rows whose key is none of `keys`.
    pub fn strangers(&self, keys: &[String]) -> Vec<Finding> {
        let stranger = |(index, SignedRow { row, .. }): (usize, &SignedRow)| {
            let got = row.contributor.key.clone();
            let is_known = keys.contains(&got);
            let fault = RowFault::Stranger { got };
            (!is_known).then(|| Finding { number: index + 1, title: row.title(), fault })
        };
        self.rows.iter().enumerate().filter_map(stranger).collect()
    }

    fn misplaced(&self, index: usize) -> Option<RowFault> {
        let before = &self.rows[index.checked_sub(1)?].row;
        match before.place().cmp(&self.rows[index].row.place()) {
            std::cmp::Ordering::Less => None,
            std::cmp::Ordering::Equal => Some(RowFault::Duplicate { other: index }),
            std::cmp::Ordering::Greater => Some(RowFault::Order { before: index }),
        }
    }

    /// Adds a row at its place. Its number in the file is not known to the caller before, so a finding has the number that it would have.
    ///
    /// # Errors
    /// The row has a fault, is a duplicate, or the file is full.
    pub fn add(&mut self, row: SignedRow) -> Result<(), BoardError> {
        let found = self.rows.binary_search_by(|known| known.row.place().cmp(&row.row.place()));
        let (Ok(index) | Err(index)) = found;
        let duplicate = || found.ok().map(|index| RowFault::Duplicate { other: index + 1 });
        if let Some(fault) = row.check().err().or_else(duplicate) {
            return Err(Finding { number: index + 1, title: row.row.title(), fault }.into());
        }
        if self.rows.len() == MAX_ROWS {
            return Err(BoardError::TooMany { got: MAX_ROWS + 1 });
        }
        self.rows.insert(index, row);
        Ok(())
    }

    /// Adds the rows of another file, and gives the number of new ones. A row that is the same in both is taken once.
    ///
    /// # Errors
    /// Two rows of one place differ, a row has a fault, or the file is full.
    pub fn merge(&mut self, other: Self) -> Result<usize, BoardError> {
        let before = self.rows.len();
        for row in other.rows {
            if !self.rows.contains(&row) {
                self.add(row)?;
            }
        }
        Ok(self.rows.len() - before)
    }

    /// Number of the row of the same guest, attack, world, seed, program and contributor.
    pub fn number_of(&self, row: &BoardRow) -> Option<usize> {
        self.rows.binary_search_by(|known| known.row.place().cmp(&row.place())).ok().map(|index| index + 1)
    }

    /// Row by its number from 1.
    pub fn row(&self, number: usize) -> Option<&BoardRow> {
        Some(&self.rows.get(number.checked_sub(1)?)?.row)
    }
}

fn check_head(head: &str) -> Result<(), BoardError> {
    if head == HEAD {
        return Ok(());
    }
    let closed = head.get(..head.len().min(MAX_HEAD)).map(|head| format!("{head}]}}"));
    match closed.and_then(|head| serde_json::from_str::<AnyHead>(&head).ok()) {
        Some(head) if head.kind == "guest-board" && head.schema_version != VERSION => {
            Err(BoardError::Version { got: head.schema_version })
        }
        Some(_) | None => Err(BoardError::Head),
    }
}

fn parse_line(line: &str, number: usize, is_last: bool) -> Result<SignedRow, BoardError> {
    let fault = |reason: String| BoardError::Line { number, reason };
    if line.len() > MAX_LINE {
        return Err(fault(format!("{} bytes, at most {MAX_LINE} expected", line.len())));
    }
    let text = if is_last { Some(line) } else { line.strip_suffix(',') };
    let text = text.ok_or_else(|| fault("a comma at the end expected".to_owned()))?;
    let row: SignedRow = serde_json::from_str(text).map_err(|e| fault(e.to_string()))?;
    if row.line() == text {
        return Ok(row);
    }
    let reason = "another spelling than the canonical one: fields in their order, each once, without blanks";
    Err(fault(reason.to_owned()))
}
