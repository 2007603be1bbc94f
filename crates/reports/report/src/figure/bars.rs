//! Bars of parts, one below the other, each from 0 to the whole.

use super::Table;
use super::drawing::{Anchor, Drawing};

/// Left of the bars, pixels: their names.
const NAMES: f64 = 250.0;
const WIDE: f64 = 420.0;
/// Right of the bars: their labels.
const SAID: f64 = 270.0;
const HIGH: f64 = 14.0;
const STEP: f64 = 22.0;
/// Longest name or label that is drawn whole, letters.
const LETTERS: usize = 34;

/// A part of a bar.
#[derive(Clone, Debug)]
pub struct Segment {
    /// Name.
    pub name: String,
    /// Its class in the style sheet.
    pub class: &'static str,
    /// Amount.
    pub amount: f64,
}

/// A bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Its name.
    pub name: String,
    /// Its parts, from the left.
    pub parts: Vec<Segment>,
    /// Label at its right.
    pub said: String,
}

/// All bars; each fills the width with its whole, or with its share of `most` where that is given.
pub fn bars(all: &[Bar], most: Option<f64>) -> Drawing {
    let mut drawing = Drawing::new(NAMES + WIDE + SAID, all.len() as f64 * STEP + 6.0);
    for (i, bar) in all.iter().enumerate() {
        let top = i as f64 * STEP + 4.0;
        let line = top + HIGH - 3.0;
        drawing.words("label", Anchor::End, (NAMES - 8.0, line), &cut(&bar.name));
        let whole: f64 = most.unwrap_or_else(|| bar.parts.iter().map(|p| p.amount).sum());
        let mut from = NAMES;
        for part in bar.parts.iter().filter(|p| p.amount > 0.0) {
            let wide = if whole > 0.0 { (part.amount / whole * WIDE).max(1.0) } else { 0.0 };
            let hint = format!("{}: {} {}", bar.name, part.name, part.amount);
            drawing.rect(part.class, (from, top), (wide, HIGH), &hint);
            from += wide;
        }
        drawing.words("faint", Anchor::Start, (NAMES + WIDE + 8.0, line), &cut(&bar.said));
    }
    drawing
}

/// Numbers of the bars as a table.
pub(crate) fn table(all: &[Bar], named: &str, text: &str) -> Table {
    let mut table = Table::new(&[named, "parts", text]);
    for bar in all {
        let parts: Vec<String> = bar.parts.iter().map(|p| format!("{} {}", p.name, round(p.amount))).collect();
        table.rows.push(vec![bar.name.clone(), parts.join(", "), bar.said.clone()]);
    }
    table
}

fn round(amount: f64) -> String {
    if amount.fract() == 0.0 { format!("{amount}") } else { format!("{amount:.1}") }
}

fn cut(words: &str) -> String {
    match words.char_indices().nth(LETTERS) {
        None => words.to_owned(),
        Some((at, _)) => format!("{}…", words.get(..at).unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(name: &str, amounts: &[f64]) -> Bar {
        let part = |&amount: &f64| Segment { name: "REJECTED".to_owned(), class: "rejected", amount };
        Bar { name: name.to_owned(), parts: amounts.iter().map(part).collect(), said: "n 3".to_owned() }
    }

    #[test]
    fn bar_parts_fill_it_and_absent_ones_vanish() {
        let text = bars(&[bar("a", &[1.0, 0.0, 2.0]), bar("b", &[0.0])], None).inline("x");
        assert_eq!(text.matches("<rect").count(), 2);
        assert!(
            text.contains("x=\"250.0\"") && text.contains("width=\"140.0\"") && text.contains("width=\"280.0\""),
            "{text}"
        );
        assert!(!text.contains("NaN"), "{text}");
    }

    #[test]
    fn long_name_is_cut_in_the_drawing_only() {
        let name = "ü".repeat(60);
        let long = [bar(&name, &[1.0])];
        assert!(bars(&long, None).inline("x").contains(&format!(">{}…<", "ü".repeat(LETTERS))));
        assert_eq!(table(&long, "a", "b").rows[0][0], name);
    }
}
