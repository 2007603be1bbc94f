//! Lines, boxes and words as SVG. Colours are classes: the page's style sheet gives them, light and dark; a file that stands alone
//! carries the light ones with it.

use core::fmt::{Arguments, Write};

use super::palette;

/// Family and size of all words in a drawing, pixels.
const FONT: &str = "font-family=\"system-ui, sans-serif\" font-size=\"13\"";

/// A place, pixels from the top left.
pub(super) type At = (f64, f64);

/// A drawing of a fixed size.
#[derive(Clone, Debug)]
pub struct Drawing {
    width: f64,
    height: f64,
    body: String,
}

/// End of a text that is at its place.
#[derive(Clone, Copy, Debug)]
pub enum Anchor {
    /// The first letter.
    Start,
    /// The middle.
    Middle,
    /// The last letter.
    End,
}

impl Drawing {
    /// An empty one, pixels.
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    /// A filled box; `hint` is shown to who points at it.
    pub fn rect(&mut self, class: &str, (x, y): At, (w, h): (f64, f64), hint: &str) {
        let hint = if hint.is_empty() { String::new() } else { format!("<title>{}</title>", text(hint)) };
        self.put(format_args!(
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\">{hint}</rect>\n"
        ));
    }

    /// A straight line.
    pub fn line(&mut self, class: &str, (x1, y1): At, (x2, y2): At) {
        self.put(format_args!(
            "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>\n"
        ));
    }

    /// Draws a line through these points.
    pub fn path(&mut self, class: &str, points: &[At]) {
        self.put(format_args!("<polyline class=\"{class}\" points=\"{}\"/>\n", places(points)));
    }

    /// Draws the area between these points.
    pub fn area(&mut self, class: &str, points: &[At]) {
        self.put(format_args!("<polygon class=\"{class}\" points=\"{}\"/>\n", places(points)));
    }

    /// A dot.
    pub fn dot(&mut self, class: &str, (x, y): At, hint: &str) {
        let hint = text(hint);
        self.put(format_args!(
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"><title>{hint}</title></circle>\n"
        ));
    }

    /// Words on one line.
    pub fn words(&mut self, class: &str, anchor: Anchor, (x, y): At, words: &str) {
        let (anchor, words) = (anchor.name(), text(words));
        self.put(format_args!(
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>\n"
        ));
    }

    /// As a part of a page with a style sheet that has the classes.
    pub fn inline(&self, label: &str) -> String {
        let (w, h, label, body) = (self.width, self.height, text(label), &self.body);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" role=\"img\" \
             aria-label=\"{label}\" {FONT}>\n{body}</svg>"
        )
    }

    /// As a file that stands alone.
    pub fn file(&self, label: &str) -> String {
        let (w, h, label, body) = (self.width, self.height, text(label), &self.body);
        let style = palette::light();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" {FONT}>\n\
             <title>{label}</title>\n<style>{style}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{body}</svg>\n"
        )
    }

    fn put(&mut self, name: Arguments<'_>) {
        self.body.write_fmt(name).expect("invariant: writing to a String cannot fail");
    }
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        }
    }
}

fn places(points: &[At]) -> String {
    points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Words as they may be in XML, in an attribute too. Characters that XML 1.0 does not allow are left out.
fn text(words: &str) -> String {
    let mut out = String::with_capacity(words.len());
    for c in words.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_words_leave_their_place_in_the_markup() {
        let mut drawing = Drawing::new(10.0, 10.0);
        drawing.words("label", Anchor::Start, (1.0, 2.0), "</text><script>\u{0}\"&");
        let all = drawing.inline("a \"b\" <c>");
        assert!(all.contains("&lt;/text&gt;&lt;script&gt;&quot;&amp;</text>"), "{all}");
        assert!(all.contains("aria-label=\"a &quot;b&quot; &lt;c&gt;\""), "{all}");
    }

    #[test]
    fn a_file_carries_its_colours() {
        let file = Drawing::new(10.0, 10.0).file("x");
        assert!(file.contains("<style>") && file.contains(".unsafe") && !file.contains("var("), "{file}");
    }
}
