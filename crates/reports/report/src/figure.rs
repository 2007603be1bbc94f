//! A figure: a drawing, the same as a table, and the caption below it.
//!
//! Everything visible in a drawing is in its table too, so that the numbers need neither eyes, colours nor a plotting program. The
//! modules below decide the content; `drawing` turns lines and words into SVG.

mod bars;
mod curve;
mod drawing;
mod ecdf;
mod palette;
mod timeline;

pub(crate) use bars::table as bar_table;
pub use bars::{Bar, Segment, bars};
pub(crate) use curve::table as series_table;
pub use curve::{Series, SharePoint, series};
pub use drawing::Drawing;
pub(crate) use ecdf::table as ecdf_table;
pub use ecdf::{Mark, Steps, ecdf};
pub use palette::{class_of_mode, class_of_outcome};
pub(crate) use palette::{is_tinted, sheet as palette_sheet};
pub use timeline::{Lane, Span, Timeline};

/// A table of words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Its columns.
    pub head: Vec<String>,
    /// Its rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these columns and no rows.
    pub fn new(head: &[&str]) -> Self {
        Self { head: head.iter().map(|&h| h.to_owned()).collect(), rows: Vec::new() }
    }

    /// As comma-separated values (RFC 4180).
    pub fn csv(&self) -> String {
        let line = |cells: &[String]| cells.iter().map(|c| quoted(c)).collect::<Vec<_>>().join(",") + "\r\n";
        std::iter::once(&self.head).chain(&self.rows).map(|cells| line(cells)).collect()
    }

    /// As a LaTeX table with the rules of the package `booktabs`.
    pub fn latex(&self) -> String {
        let line = |cells: &[String]| cells.iter().map(|c| escaped(c)).collect::<Vec<_>>().join(" & ") + " \\\\\n";
        let rows: String = self.rows.iter().map(|cells| line(cells)).collect();
        let columns = "l".repeat(self.head.len());
        let head = line(&self.head);
        format!("\\begin{{tabular}}{{{columns}}}\n\\toprule\n{head}\\midrule\n{rows}\\bottomrule\n\\end{{tabular}}\n")
    }
}

/// A drawing with its table, for the page and for files.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of its files and its anchor: lower case, digits and hyphens.
    pub name: String,
    /// Subject, in a few words.
    pub title: String,
    /// Further facts: n, bounds, seeds.
    pub caption: String,
    /// The picture.
    pub drawing: Drawing,
    /// Its numbers.
    pub table: Table,
}

fn quoted(cell: &str) -> String {
    if cell.contains(['"', ',', '\r', '\n']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

fn escaped(cell: &str) -> String {
    let mut text = String::with_capacity(cell.len());
    for c in cell.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => text.extend(['\\', c]),
            '\\' => text.push_str("\\textbackslash{}"),
            '~' => text.push_str("\\textasciitilde{}"),
            '^' => text.push_str("\\textasciicircum{}"),
            '<' => text.push_str("\\textless{}"),
            '>' => text.push_str("\\textgreater{}"),
            _ => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table {
            head: vec!["a_b".to_owned(), "c".to_owned()],
            rows: vec![vec!["50 %".to_owned(), "x, \"y\"".to_owned()]],
        }
    }

    #[test]
    fn cell_with_comma_or_quote_stays_one() {
        assert_eq!(table().csv(), "a_b,c\r\n50 %,\"x, \"\"y\"\"\"\r\n");
    }

    #[test]
    fn latex_commands_are_escaped() {
        let text = table().latex();
        assert!(text.contains("a\\_b & c \\\\") && text.contains("50 \\% &"), "{text}");
        assert!(text.starts_with("\\begin{tabular}{ll}\n\\toprule\n") && text.ends_with("\\end{tabular}\n"), "{text}");
    }
}
