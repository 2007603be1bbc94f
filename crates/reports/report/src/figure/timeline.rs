//! Lanes of a run over its seconds on one axis: wide with their names at the left, narrow with their names above.

use super::curve::round_step;
use super::drawing::{Anchor, Drawing};
use super::palette::letters_on;

/// Height of a lane, pixels.
const HIGH: f64 = 22.0;
/// Height of a lane with a curve.
const CURVE: f64 = 58.0;
/// Narrower spans, pixels, are not drawn.
const THIN: f64 = 2.0;
/// Pixels of a small and of a capital letter of 13 px in a wide face, about.
const LETTERS: [f64; 2] = [7.4, 9.2];
/// Space between a span's edge and its name.
const PAD: f64 = 6.0;

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

/// One kind of spans, or a curve.
#[derive(Clone, Debug)]
pub struct Lane {
    /// Its name.
    pub name: String,
    /// Its spans, in order of time.
    pub spans: Vec<Span>,
    /// A value over time instead: seconds and value.
    pub curve: Vec<(f64, f64)>,
    /// Words where the lane has no span.
    pub empty: String,
}

/// Lanes of a run.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// From the top.
    pub lanes: Vec<Lane>,
    /// Length of the axis.
    pub seconds: f64,
    /// A time that goes through all lanes, with its words.
    pub mark: Option<(f64, String)>,
}

/// Places of a drawing's parts.
struct Layout {
    left: f64,
    wide: f64,
    whole: f64,
    /// Space above a lane: its name, where it is narrow.
    above: f64,
    gap: f64,
    ticks: f64,
}

const WIDE: Layout = Layout { left: 150.0, wide: 930.0, whole: 1096.0, above: 0.0, gap: 12.0, ticks: 10.0 };
const NARROW: Layout = Layout { left: 6.0, wide: 348.0, whole: 360.0, above: 20.0, gap: 6.0, ticks: 6.0 };

impl Timeline {
    /// Names at the left, for pages of 1,200 pixels and more, and for files.
    pub fn wide(&self) -> Drawing {
        self.drawn(&WIDE)
    }

    /// Names above, for telephones.
    pub fn narrow(&self) -> Drawing {
        self.drawn(&NARROW)
    }

    fn drawn(&self, layout: &Layout) -> Drawing {
        let step = |lane: &Lane| layout.above + high(lane) + layout.gap;
        let height: f64 = self.lanes.iter().map(step).sum();
        let mut drawing = Drawing::new(layout.whole, height + if self.mark.is_some() { 46.0 } else { 28.0 });
        let x = |s: f64| layout.left + (s / self.seconds.max(1e-9)).clamp(0.0, 1.0) * layout.wide;
        let mut top = 0.0;
        for lane in &self.lanes {
            let line = if layout.above > 0.0 { top + 14.0 } else { top + high(lane) / 2.0 + 5.0 };
            let (anchor, at) =
                if layout.above > 0.0 { (Anchor::Start, layout.left) } else { (Anchor::End, layout.left - 14.0) };
            drawing.words("faint", anchor, (at, line), &lane.name);
            let place = top + layout.above;
            drawing.rect("lane", (layout.left, place), (layout.wide, high(lane)), "");
            lane.draw(&mut drawing, layout, place, &x);
            top += step(lane);
        }
        self.axis(&mut drawing, layout, height, &x);
        drawing
    }

    fn axis(&self, drawing: &mut Drawing, layout: &Layout, height: f64, x: &impl Fn(f64) -> f64) {
        let step = round_step((self.seconds / layout.ticks).max(1e-3));
        let count = (self.seconds / step + 1e-9) as u32;
        for i in 0..=count {
            let tick = f64::from(i) * step;
            drawing.line("axis", (x(tick), height - 4.0), (x(tick), height + 2.0));
            let anchor = match i {
                0 => Anchor::Start,
                last if last == count && layout.left + layout.wide - x(tick) < 20.0 => Anchor::End,
                _ => Anchor::Middle,
            };
            drawing.words("faint", anchor, (x(tick), height + 18.0), &format!("{} s", tidy(tick)));
        }
        if let Some((at, words)) = &self.mark {
            drawing.line("injected", (x(*at), 0.0), (x(*at), height - 4.0));
            let half = width(words) / 2.0;
            let middle = x(*at).clamp(half.min(layout.whole / 2.0), (layout.whole - half).max(layout.whole / 2.0));
            drawing.words("faint", Anchor::Middle, (middle, height + 38.0), words);
        }
    }
}

fn high(lane: &Lane) -> f64 {
    if lane.curve.is_empty() { HIGH } else { CURVE }
}

/// A tick without the digits of a sum of steps.
fn tidy(tick: f64) -> f64 {
    (tick * 1e6).round() / 1e6
}

impl Lane {
    fn draw(&self, drawing: &mut Drawing, layout: &Layout, top: f64, x: &impl Fn(f64) -> f64) {
        if !self.curve.is_empty() {
            return self.draw_curve(drawing, top, x);
        }
        let end = layout.left + layout.wide;
        if self.spans.is_empty() {
            drawing.words("faint", Anchor::Start, (layout.left + PAD, top + 16.0), &fitting(&self.empty, layout.wide));
        }
        let mut taken = layout.left;
        for (i, span) in self.spans.iter().enumerate() {
            let (from, to) = (x(span.from), x(span.to).max(x(span.from) + THIN).min(end));
            let hint = format!("{}, {:.3} to {:.3} s", span.name, span.from, span.to);
            drawing.rect(span.class, (from, top), (to - from, HIGH), &hint);
            let next = self.spans.get(i + 1).map_or(end, |next| x(next.from));
            let inside = fitting(&span.name, to - from - PAD);
            // A name stands in its span, else behind it where there is room.
            if whole_or_long(&inside, &span.name) {
                drawing.words(letters_on(span.class), Anchor::Start, (from + PAD, top + 16.0), &inside);
                taken = to;
            } else if from >= taken - 0.5 {
                let beside = fitting(&span.name, next - to - PAD);
                if whole_or_long(&beside, &span.name) {
                    drawing.words("label", Anchor::Start, (to + PAD, top + 16.0), &beside);
                    taken = to + PAD + width(&beside);
                }
            }
        }
    }

    fn draw_curve(&self, drawing: &mut Drawing, top: f64, x: &impl Fn(f64) -> f64) {
        let peak =
            self.curve.iter().copied().fold((0.0, 0.0), |best, point| if point.1 > best.1 { point } else { best });
        let y = |value: f64| top + CURVE - 4.0 - value / peak.1.max(1e-9) * (CURVE - 22.0);
        let points: Vec<_> = self.curve.iter().map(|(at, value)| (x(*at), y(*value))).collect();
        drawing.path("line-0", &points);
        if peak.1 > 0.0 {
            drawing.words("label", Anchor::Middle, (x(peak.0), y(peak.1) - 5.0), &format!("{:.1}", peak.1));
        }
    }
}

/// The name if it fits, else as much of it as does, with an ellipsis.
fn fitting(name: &str, room: f64) -> String {
    if width(name) <= room {
        return name.to_owned();
    }
    let mut free = room - LETTERS[1];
    let fits = |c: &char| {
        free -= letter(*c);
        free >= 0.0
    };
    format!("{}…", name.chars().take_while(fits).collect::<String>().trim_end())
}

fn width(words: &str) -> f64 {
    words.chars().map(letter).sum()
}

fn letter(c: char) -> f64 {
    LETTERS[usize::from(c.is_uppercase() || c == '_' || c == 'm')]
}

/// True if the name is whole, or so much of it that it still says something.
fn whole_or_long(drawn: &str, name: &str) -> bool {
    drawn == name || drawn.chars().count() > 7
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(name: &str, from: f64, to: f64) -> Span {
        Span { name: name.to_owned(), class: "attack", from, to }
    }

    fn timeline(spans: Vec<Span>, seconds: f64) -> Timeline {
        let lane = Lane { name: "Attack".to_owned(), spans, curve: Vec::new(), empty: "none".to_owned() };
        Timeline { lanes: vec![lane], seconds, mark: None }
    }

    #[test]
    fn instant_events_are_visible_without_overlapping_names() {
        let text = timeline(vec![span("thermal", 1.0, 1.0), span("rgb", 1.1, 1.1)], 9.0).wide().inline("x");
        assert!(text.contains(&format!("width=\"{THIN:.1}\"")), "{text}");
        assert!(!text.contains(">thermal</text>") && text.contains(">rgb</text>"), "{text}");
    }

    #[test]
    fn span_beyond_the_end_is_drawn_there() {
        let text = timeline(vec![span("READY", 5.0, 99.0)], 10.0).wide().inline("x");
        assert!(text.contains("x=\"615.0\"") && text.contains("width=\"465.0\""), "{text}");
    }

    #[test]
    fn narrow_drawing_has_the_same_spans_and_names_above() {
        let both = timeline(vec![span("READY", 0.0, 9.0)], 10.0);
        let (wide, narrow) = (both.wide().inline("x"), both.narrow().inline("x"));
        assert_eq!(wide.matches("<rect").count(), narrow.matches("<rect").count());
        assert!(narrow.contains("viewBox=\"0 0 360 ") && narrow.contains("text-anchor=\"start\">Attack"), "{narrow}");
    }

    #[test]
    fn empty_lane_says_why() {
        assert!(timeline(Vec::new(), 9.0).wide().inline("x").contains(">none</text>"));
    }
}
