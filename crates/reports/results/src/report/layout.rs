//! Tables of text for a person at a terminal: as wide as that is, without a break inside a word or a number.
//!
//! A column with the same in every row is said once above the table. Where the words of a row have no room beside each other, its first
//! cells have their own lines above the others.

use std::fmt;

/// Columns of text that a table takes at most where no terminal says how many it has: the room of a page, a mail and half a screen.
pub(crate) const WIDTH: usize = 100;
/// The fewest columns of text that are taken for a terminal's.
const LEAST_WIDTH: usize = 20;
/// Characters of the frame beside a cell.
const BESIDE: usize = 3;
/// Characters of the frame at the ends of a line.
const ENDS: usize = 4;

/// A table: headings, and rows of as many cells.
#[derive(Clone, Debug)]
pub struct Table {
    headings: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these headings.
    pub fn new(headings: &[&str]) -> Self {
        Self { headings: headings.iter().map(ToString::to_string).collect(), rows: Vec::new() }
    }

    /// Adds a row; cells that it lacks are empty.
    pub fn add_row(&mut self, cells: impl IntoIterator<Item = impl ToString>) {
        let cells = cells.into_iter().map(|cell| cell.to_string());
        self.rows.push(cells.chain(std::iter::repeat(String::new())).take(self.headings.len()).collect());
    }

    /// The table in lines of at most `width` characters; only a longer word makes a line longer.
    pub fn fitted(&self, width: usize) -> String {
        let (text, varied) = self.parted();
        let text: String = wrapped(&text, width).iter().map(|line| format!("{line}\n")).collect();
        let all = varied.headings.len();
        // A table with headings is drawn at the latest where its longest word fits.
        let mut widths = if all == 0 { width..width } else { width..usize::MAX };
        text + &widths.find_map(|width| (0..all).find_map(|above| varied.drawn(above, width))).unwrap_or_default()
    }

    /// The table as wide as its cells, with every column: for a file.
    pub fn with_every_column(&self) -> String {
        self.drawn(0, usize::MAX).unwrap_or_default()
    }

    /// The columns with the same in every row in words, and the table without them. The first column names the rows and stays.
    fn parted(&self) -> (String, Self) {
        let first = self.rows.first().filter(|_| self.rows.len() > 1);
        let same = |column: usize| {
            let name = first.map(|row| &row[column]).filter(|_| column > 0)?;
            self.rows.iter().all(|row| row[column] == *name).then(|| format!("{} {name}", self.headings[column]))
        };
        let texts: Vec<Option<String>> = (0..self.headings.len()).map(same).collect();
        let kept = |cells: &Vec<String>| {
            let varied = cells.iter().zip(&texts).filter(|(_, line)| line.is_none());
            varied.map(|(cell, _)| cell.clone()).collect()
        };
        let varied = Self { headings: kept(&self.headings), rows: self.rows.iter().map(kept).collect() };
        let texts: Vec<String> = texts.into_iter().flatten().collect();
        let text = if texts.is_empty() { String::new() } else { format!("in every row: {}", texts.join("; ")) };
        (text, varied)
    }

    /// The table with its first `above` cells of each row above the others; none where `width` has no room for its words.
    fn drawn(&self, above: usize, width: usize) -> Option<String> {
        let lines: Vec<&Vec<String>> = std::iter::once(&self.headings).chain(&self.rows).collect();
        let heads: Vec<String> = lines.iter().map(|cells| head(&cells[..above])).collect();
        let cells: Vec<&[String]> = lines.iter().map(|cells| &cells[above..]).collect();
        let columns = self.headings.len() - above;
        let (ends, space) = (width.checked_sub(ENDS)?, BESIDE * columns.saturating_sub(1));
        let mut widths = widths(&cells, ends.checked_sub(space)?)?;
        let inner = widths.iter().sum::<usize>() + space;
        if heads.iter().map(|head| longest_word(head)).max()? > ends {
            return None;
        }
        let wanted = heads.iter().map(|head| longest_line(head)).max()?.min(ends);
        *widths.last_mut()? += wanted.saturating_sub(inner);
        let inner = inner.max(wanted);

        let row = |at: usize| line(&heads[at], inner) + &row(cells[at], &widths);
        let rows: String = (1..lines.len()).map(row).collect();
        let [top, middle, bottom] = ["┌─┬┐", "╞═╪╡", "└─┴┘"].map(|name| rule(name, &widths));
        Some(format!("{top}\n{}{middle}\n{rows}{bottom}", row(0)))
    }
}

impl fmt::Display for Table {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(&self.fitted(width()))
    }
}

/// The text with each line that is longer than the terminal's broken at spaces; as it is where stdout is no terminal.
pub(super) fn folded(text: &str) -> String {
    let Some(width) = terminal() else { return text.to_owned() };
    let fold = |line: &str| if size(line) > width { wrapped(line, width).join("\n") } else { line.to_owned() };
    text.split('\n').map(fold).collect::<Vec<_>>().join("\n")
}

/// Columns of text for a person: those of the terminal, else of a page.
pub fn width() -> usize {
    terminal().unwrap_or(WIDTH)
}

/// A text behind its name, in lines of the terminal's width below each other; in one line where stdout is no terminal.
pub fn wrap_labelled(name: &str, text: &str) -> String {
    let room = terminal().map_or(usize::MAX, |width| width.saturating_sub(size(name)));
    name.to_owned() + &wrapped(text, room).join(&format!("\n{}", " ".repeat(size(name))))
}

/// Columns of text of the terminal, as `COLUMNS` or else the terminal on stdout says.
fn terminal() -> Option<usize> {
    // A test gives the width itself, or sees that of a page.
    if cfg!(test) {
        return None;
    }
    let said = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    said.or_else(|| comfy_table::Table::new().width().map(usize::from)).filter(|width| *width >= LEAST_WIDTH)
}

/// The cells above the others, as one text.
fn head(cells: &[String]) -> String {
    cells.iter().filter(|cell| !cell.is_empty()).map(String::as_str).collect::<Vec<_>>().join("  ")
}

/// The width of each column, together at most `room`; none where their longest words take more.
fn widths(lines: &[&[String]], room: usize) -> Option<Vec<usize>> {
    let columns = lines.first()?.len();
    let widest = |width: fn(&str) -> usize| -> Vec<usize> {
        (0..columns).map(|index| lines.iter().map(|cells| width(&cells[index])).max().unwrap_or_default()).collect()
    };
    let (mut widths, whole) = (widest(longest_word), widest(longest_line));
    let mut left = room.checked_sub(widths.iter().sum())?;
    // The next character goes to the column that is the most lines high.
    let broken = |widths: &[usize]| {
        (0..columns)
            .filter(|index| widths[*index] < whole[*index])
            .max_by_key(|index| whole[*index].div_ceil(widths[*index].max(1)))
    };
    while left > 0
        && let Some(index) = broken(&widths)
    {
        widths[index] += 1;
        left -= 1;
    }
    Some(widths)
}

/// The parts of a line that stand whole: its words, and a number with the `%` or the `/` behind it.
fn words(line: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in line.split(' ') {
        match words.last_mut() {
            Some(last) if word.starts_with('%') || word == "/" => last.extend([" ", word]),
            Some(_) | None => words.push(word.to_owned()),
        }
    }
    words
}

/// The text in lines of at most `width` characters, as far as its words allow.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for line in text.lines() {
        let mut words = words(line).into_iter();
        lines.extend(words.next());
        for word in words {
            match lines.last_mut() {
                Some(last) if size(last) + 1 + size(&word) <= width => last.extend([" ", &word]),
                Some(_) | None => lines.push(word),
            }
        }
    }
    lines
}

fn size(text: &str) -> usize {
    text.chars().count()
}

fn longest_word(text: &str) -> usize {
    text.lines().flat_map(words).map(|word| size(&word)).max().unwrap_or_default()
}

fn longest_line(text: &str) -> usize {
    text.lines().map(size).max().unwrap_or_default()
}

/// A text across the frame, `inner` characters wide.
fn line(text: &str, inner: usize) -> String {
    wrapped(text, inner).iter().map(|line| format!("│ {line:inner$} │\n")).collect()
}

/// A row of cells beside each other.
fn row(cells: &[String], widths: &[usize]) -> String {
    let cells: Vec<Vec<String>> = cells.iter().zip(widths).map(|(cell, width)| wrapped(cell, *width)).collect();
    let height = cells.iter().map(Vec::len).max().unwrap_or_default().max(1);
    let part = |at: usize, cell: &Vec<String>, width: usize| {
        format!("{:width$}", cell.get(at).map(String::as_str).unwrap_or_default())
    };
    let padded = |at: usize| cells.iter().zip(widths).map(|(cell, width)| part(at, cell, *width)).collect::<Vec<_>>();
    (0..height).map(|index| format!("│ {} │\n", padded(index).join(" ┆ "))).collect()
}

/// A rule of the frame: the characters at its start, between, at a column's end and at its end.
fn rule(name: &str, widths: &[usize]) -> String {
    let mut chars = name.chars();
    let mut next = || chars.next().unwrap_or(' ').to_string();
    let [start, fill, cross, end] = [next(), next(), next(), next()];
    let parts: Vec<String> = widths.iter().map(|width| fill.repeat(width + 2)).collect();
    format!("{start}{}{end}", parts.join(&cross))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide() -> Table {
        let mut table =
            Table::new(&["cell", "n", "outcomes", "accepted / refused", "unsafe below (together)", "to hold-safe ms"]);
        for cell in ["verbatim/present/session-only", "relabelled/present/origin-signed"] {
            table.add_row([
                cell,
                "2",
                "HOLD_SAFE 22, UNDETECTED 2",
                "933 / no_echo 8, signature 80",
                "77.64 % (95.23 %)",
                "1001 / 1875 / -",
            ]);
        }
        table.add_row(["all", "4", "HOLD_SAFE 44, UNDETECTED 4", "1866 / 176", "52.71 % (95.23 %)", "1001 / 1876 / -"]);
        table
    }

    #[test]
    fn narrow_table_keeps_its_width_and_its_words() {
        let table = wide();
        for width in [40, 60, 80, 100, 200] {
            let text = table.fitted(width);
            assert!(text.lines().all(|line| size(line) <= width), "{width}: {text}");
            let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split([' ', '│', '┆']).collect()).collect();
            let contains = |word: &str| lines.iter().any(|line| line.contains(&word));
            let cells = table.rows.iter().flatten().chain(&table.headings);
            let words: Vec<&str> = cells.flat_map(|cell| cell.split(' ')).collect();
            words.iter().for_each(|word| assert!(contains(word), "{word} at {width}: {text}"));
        }
    }

    #[test]
    fn number_stays_with_its_sign() {
        assert_eq!(wrapped("77.64 % (95.23 %)", 6), ["77.64 %", "(95.23 %)"]);
        assert_eq!(wrapped("1001 / 1875 / -", 5), ["1001 /", "1875 /", "-"]);
    }

    #[test]
    fn only_a_longer_word_makes_a_line_longer() {
        let mut table = Table::new(&["file", "n"]);
        table.add_row(["relabelled/present/origin-signed", "2"]);
        let widest = table.fitted(20).lines().map(size).max();
        assert_eq!(widest, Some("relabelled/present/origin-signed".len() + ENDS));
        assert_eq!(Table::new(&[]).fitted(80), "");
    }

    #[test]
    fn same_in_every_row_is_said_once() {
        let mut table = Table::new(&["cell", "n", "outcomes"]);
        table.add_row(["a", "59", "HOLD_SAFE 59"]);
        assert!(!table.fitted(80).contains("in every row"), "one row is shown whole");
        table.add_row(["b", "59", "LATE 59"]);
        let text = table.fitted(80);
        assert!(text.starts_with("in every row: n 59\n") && text.matches("59").count() == 3, "{text}");
        assert!(
            !table.with_every_column().contains("in every row") && table.with_every_column().contains("┆ n "),
            "{}",
            table.with_every_column()
        );
    }
}
