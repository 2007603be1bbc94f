//! The picture of outcomes: rows and columns of cells, each with shape, word, n, reason and bound. A cell is filled only if it asks for a
//! reader: harm, an attack unnoticed, or a class that was not stated beforehand.

use evidence::trial::{Outcome, Outcomes};
use maud::{Markup, html};

use super::shape::shape;
use super::words;
use crate::figure::{class_of_outcome, is_tinted};
use crate::tried::either;

/// A picture.
#[derive(Debug, Default)]
pub(super) struct Grid<'a> {
    /// Subject, for a screen reader.
    pub label: String,
    /// Heads of the columns, each a word and a note.
    pub columns: Vec<(String, String)>,
    /// Subject of the rows.
    pub rows_are: String,
    /// Rows.
    pub rows: Vec<Row<'a>>,
}

/// A row.
#[derive(Debug, Default)]
pub(super) struct Row<'a> {
    /// Its word.
    pub name: String,
    /// A note below the word.
    pub note: String,
    /// Words at the right of the head.
    pub aside: String,
    /// A cell a column; `None` where there is none.
    pub cells: Vec<Option<Cell<'a>>>,
}

/// A cell.
#[derive(Debug)]
pub(super) struct Cell<'a> {
    /// How its trials ended.
    pub outcomes: &'a Outcomes,
    /// Trials.
    pub n: u64,
    /// The classes that were stated beforehand; empty where none were, or several.
    pub expected: &'a [Outcome],
    /// Trials outside of these.
    pub off: u64,
    /// How it came to that.
    pub reason: String,
    /// A bound on the share, such as `≥ 86 %`.
    pub bound: String,
    /// Anchor of the run that is told below.
    pub run: Option<String>,
}

/// Trials outside the classes that were stated.
pub(super) fn off(outcomes: &Outcomes, expected: &[Outcome]) -> u64 {
    outcomes.iter().filter(|(class, _)| class.is_unexpected(expected)).map(|(_, n)| n).sum()
}

/// The class that leads a cell: one not stated, then harm, then the most frequent.
pub(super) fn leading(outcomes: &Outcomes, expected: &[Outcome]) -> Option<Outcome> {
    let unexpected = outcomes.keys().find(|class| class.is_unexpected(expected));
    let asking = outcomes.keys().find(|class| words::asks(**class));
    let most = outcomes.iter().max_by_key(|(class, n)| (**n, std::cmp::Reverse(**class))).map(|(class, _)| class);
    unexpected.or(asking).or(most).copied()
}

impl Grid<'_> {
    /// The picture, with a key of its classes.
    pub(super) fn markup(&self) -> Markup {
        let columns = self.columns.len().max(1);
        html! {
            div class=(format!("mx c{}", columns.min(4))) role="table" aria-label=(self.label) {
                div class="mrow" role="row" {
                    div class="rowh hd" role="columnheader" { span { (self.rows_are) } }
                    @for (name, note) in &self.columns { div class="colh" role="columnheader" { b { (name) } " " span { (note) } } }
                }
                @for row in &self.rows { div class="mrow" role="row" {
                    div class="rowh" role="rowheader" { b { (row.name) } " " em { (row.aside) } " " span { (row.note) } }
                    @for cell in &row.cells { (slot(cell.as_ref())) }
                } }
            }
            (self.key())
        }
    }

    fn key(&self) -> Markup {
        let mut classes: Vec<Outcome> = self
            .rows
            .iter()
            .flat_map(|row| row.cells.iter().flatten())
            .flat_map(|cell| cell.outcomes.keys().copied())
            .collect();
        classes.sort_unstable();
        classes.dedup();
        html! { ul class="key" { @for class in classes { li { (shape(class)) b { (class.name()) } ": " (words::key(class)) } } } }
    }
}

fn slot(cell: Option<&Cell>) -> Markup {
    html! { div class="slot" role="cell" {
        @if let Some((cell, class)) = cell.and_then(|cell| Some((cell, leading(cell.outcomes, cell.expected)?))) {
            (filled(cell, class))
        } @else { div class="cell none" { "–" } }
    } }
}

fn filled(cell: &Cell, class: Outcome) -> Markup {
    let unexpected = cell.off > 0;
    let name = class_of_outcome(class.name());
    let look = if unexpected || words::asks(class) || !is_tinted(name) {
        format!("cell full full-{name}")
    } else {
        format!("cell tint-{name}")
    };
    let n = cell.outcomes.get(&class).copied().unwrap_or_default();
    let others: Vec<String> = cell
        .outcomes
        .iter()
        .filter(|(other, _)| **other != class)
        .map(|(other, n)| format!("{} {n}", other.name()))
        .collect();
    let stated = (!cell.expected.is_empty() && cell.expected != [class]).then(|| either(cell.expected));
    html! { div class=(look) {
        b { (shape(class)) @if let Some(run) = &cell.run { a href={ "#" (run) } { (class.name()) } } @else { (class.name()) } }
        span class="n" { (n) " of " (cell.n) }
        small { (cell.reason) }
        small class="r" { (cell.bound) }
        @if !others.is_empty() { small class="all" { "also " (others.join(", ")) } }
        @if unexpected { small class="all" { strong { (cell.off) " not stated beforehand" } } }
        @if let Some(stated) = stated { small class="all" { "stated: " (stated) } }
    } }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell<'a>(outcomes: &'a Outcomes, expected: &'a [Outcome]) -> Cell<'a> {
        let n = outcomes.values().sum();
        Cell {
            outcomes,
            n,
            expected,
            off: off(outcomes, expected),
            reason: "in <1> ms".to_owned(),
            bound: "≥ 86 %".to_owned(),
            run: None,
        }
    }

    #[test]
    fn only_a_cell_that_asks_for_a_reader_is_filled() {
        let look = |outcomes: &[(Outcome, u64)], expected: &[Outcome]| {
            slot(Some(&cell(&outcomes.iter().copied().collect(), expected))).into_string()
        };
        let stopped = look(&[(Outcome::HoldSafe, 20)], &[Outcome::HoldSafe]);
        assert!(stopped.contains("tint-hold-safe") && !stopped.contains("full"), "{stopped}");
        assert!(stopped.contains("20 of 20") && stopped.contains("in &lt;1&gt; ms"), "{stopped}");
        let unnoticed = look(&[(Outcome::Undetected, 20)], &[Outcome::HoldSafe, Outcome::Undetected]);
        assert!(unnoticed.contains("full-undetected") && unnoticed.contains("stated: HOLD_SAFE or UNDETECTED"));
        let other = look(&[(Outcome::HoldSafe, 1), (Outcome::Rejected, 19)], &[Outcome::Rejected]);
        assert!(other.contains("full-hold-safe") && other.contains("1 of 20"), "{other}");
        assert!(other.contains("also REJECTED 19") && other.contains("1 not stated beforehand</strong>"), "{other}");
    }

    #[test]
    fn rows_have_a_slot_for_each_column() {
        let outcomes = [(Outcome::Nominal, 1)].into_iter().collect();
        let grid = Grid {
            columns: vec![("a".to_owned(), String::new()), ("b".to_owned(), String::new())],
            rows: vec![Row { cells: vec![Some(cell(&outcomes, &[])), None], ..Row::default() }],
            ..Grid::default()
        };
        let page = grid.markup().into_string();
        assert_eq!((page.matches("role=\"cell\"").count(), page.matches("class=\"key\"").count()), (2, 1), "{page}");
    }
}
