//! Published figures: the list of them, the measurement of each, and the pages that carry them.
//!
//! `list` reads docs/results/records.toml, `fill` puts numbers of a result into a sentence, `kept` is one measurement with its origin, `page`
//! writes docs/results.md, and `quotes` the sentences of other pages. `tests/tidy` holds the pages with the same sources of `list`, `kept`,
//! `page` and `quotes`. Running the commands is left to `command::records`.

pub mod fill;
pub mod kept;
pub mod list;
pub mod page;
pub mod quotes;

/// Folder of the list and the records, below the repository.
pub const FOLDER: &str = "docs/results";
/// The page of all figures, below the repository.
pub const PAGE: &str = "docs/results.md";
