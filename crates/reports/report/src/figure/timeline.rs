//! Events of a run, a lane a kind, over its seconds.

use super::curve::round_step;
use super::drawing::{Anchor, Drawing};

const NAMES: f64 = 130.0;
const WIDE: f64 = 750.0;
const HIGH: f64 = 18.0;
const STEP: f64 = 30.0;
const AXIS: f64 = 34.0;
/// Narrower spans, pixels, are not drawn.
const THIN: f64 = 2.0;
/// Pixels of a letter, about.
const LETTER: f64 = 6.6;

/// Something that lasted.
#[derive(Clone, Debug)]
pub struct Span {
    /// Name.
    pub name: String,
    /// Its class in the style sheet.
    pub class: &'static str,
    /// Lower end, seconds.
    pub from: f64,
    /// End, seconds.
    pub to: f64,
}

/// Spans of one kind.
#[derive(Clone, Debug)]
pub struct Lane {
    /// Its name.
    pub name: String,
    /// Its spans, in order of time.
    pub spans: Vec<Span>,
    /// True if there is room above its spans for their names.
    pub named: bool,
}

/// The drawing of a run of a given number of seconds.
pub fn lanes(all: &[Lane], seconds: f64) -> Drawing {
    let high = |lane: &Lane| if lane.named { STEP + 14.0 } else { STEP };
    let height: f64 = all.iter().map(high).sum();
    let mut drawing = Drawing::new(NAMES + WIDE + 20.0, height + AXIS);
    let x = |s: f64| NAMES + (s / seconds.max(1e-9)).clamp(0.0, 1.0) * WIDE;
    let step = round_step((seconds / 10.0).max(1e-3));
    for i in 0..=(seconds / step + 1e-9) as u32 {
        let tick = f64::from(i) * step;
        drawing.line("grid", (x(tick), 0.0), (x(tick), height));
        drawing.words("faint", Anchor::Middle, (x(tick), height + 16.0), &format!("{tick} s"));
    }
    let mut top = 0.0;
    for lane in all {
        let above = if lane.named { 16.0 } else { 6.0 };
        drawing.words("label", Anchor::End, (NAMES - 10.0, top + above + 13.0), &lane.name);
        let mut free = 0.0;
        for span in &lane.spans {
            let (from, to) = (x(span.from), x(span.to));
            let hint = format!("{}, {:.3} to {:.3} s", span.name, span.from, span.to);
            drawing.rect(span.class, (from, top + above), ((to - from).max(THIN), HIGH), &hint);
            // A name is drawn where it runs into no other and not off the page.
            let ends = from + span.name.chars().count() as f64 * LETTER;
            if lane.named && from >= free && ends <= NAMES + WIDE + 20.0 {
                drawing.words("faint", Anchor::Start, (from, top + above - 4.0), &span.name);
                free = ends + LETTER;
            }
        }
        top += high(lane);
    }
    drawing.line("axis", (NAMES, height), (NAMES + WIDE, height));
    drawing
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(name: &str, from: f64, to: f64) -> Span {
        Span { name: name.to_owned(), class: "attack", from, to }
    }

    #[test]
    fn instant_events_are_visible_without_overlapping_names() {
        let lane = Lane {
            name: "faults".to_owned(),
            spans: vec![span("thermal", 1.0, 1.0), span("rgb", 1.1, 9.0)],
            named: true,
        };
        let text = lanes(&[lane], 9.0).inline("x");
        assert!(text.contains(&format!("width=\"{THIN:.1}\"")), "{text}");
        assert!(text.contains(">thermal</text>") && !text.contains(">rgb</text>"), "{text}");
    }

    #[test]
    fn span_beyond_the_end_is_drawn_there() {
        let lane = Lane { name: "modes".to_owned(), spans: vec![span("READY", 8.0, 99.0)], named: false };
        let text = lanes(&[lane], 10.0).inline("x");
        assert!(text.contains("x=\"730.0\"") && text.contains("width=\"150.0\""), "{text}");
    }
}
