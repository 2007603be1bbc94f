//! Marks for a mode, a freshness or a life: always a shape and a word, and a colour where it is abnormal.
//!
//! `map` writes the labels on the map, `text` and `page/ages.js` outside the window have their own marks. When a value
//! is stale is decided in `age`.
//!
//! Shapes are drawn, never typed: fonts lack most of them. Each has a name that tests and screen readers find.

use std::sync::Arc;

use eframe::egui::{
    Align2, Color32, FontId, Galley, Painter, Pos2, Rect, Response, Role, Sense, Shape as Drawn, Stroke, StrokeKind,
    TextStyle, Ui, Vec2, WidgetInfo, text::LayoutJob, vec2,
};
use wire::event::Freshness;
use wire::mode::Mode;

use super::theme::Palette;
use crate::banner::Sign;
use crate::life::Life;

/// Degree of abnormality.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Tone {
    /// Out of use, or over.
    Weak,
    /// Normal.
    Normal,
    /// A mark of the run; no statement about the world.
    Mark,
    /// Worth a look.
    Advice,
    /// Not to be relied on, or out of normal.
    Caution,
    /// Act now.
    Alarm,
}

impl Tone {
    /// Colour of the tone.
    pub(super) fn color(self, palette: &Palette) -> Color32 {
        match self {
            Tone::Weak => palette.weak,
            Tone::Normal => palette.text,
            Tone::Mark => palette.mark,
            Tone::Advice => palette.advice,
            Tone::Caution => palette.caution,
            Tone::Alarm => palette.alarm,
        }
    }
}

/// A shape, drawn beside a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// As it should be.
    Disc,
    /// Not quite.
    Ring,
    /// Not to be relied on.
    Diamond,
    /// Gone.
    Cross,
    /// Stands still.
    Square,
    /// Moves, or holds authority.
    Triangle,
}

impl Shape {
    /// Draws it around `center`, `size` points across.
    pub(super) fn draw(self, painter: &Painter, center: Pos2, size: f32, color: Color32) {
        let r = size / 2.0;
        let stroke = Stroke::new((size / 6.0).max(1.5), color);
        let corner = |x: f32, y: f32| center + vec2(x * r, y * r);
        let filled = |points: Vec<Pos2>| Drawn::convex_polygon(points, color, Stroke::NONE);
        match self {
            Shape::Disc => painter.circle_filled(center, r * 0.85, color),
            Shape::Ring => painter.circle_stroke(center, r * 0.75, stroke),
            Shape::Diamond => {
                painter.add(filled(vec![corner(0.0, -1.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(-1.0, 0.0)]))
            }
            Shape::Square => painter.rect_filled(Rect::from_center_size(center, Vec2::splat(size * 0.8)), 1.0, color),
            Shape::Triangle => painter.add(filled(vec![corner(0.0, -0.9), corner(0.95, 0.75), corner(-0.95, 0.75)])),
            Shape::Cross => {
                painter.line_segment([corner(-0.7, -0.7), corner(0.7, 0.7)], stroke);
                painter.line_segment([corner(-0.7, 0.7), corner(0.7, -0.7)], stroke)
            }
        };
    }
}

/// Sign of a freshness.
pub(super) fn freshness(freshness: Freshness) -> (Tone, Shape, &'static str) {
    match freshness {
        Freshness::Fresh => (Tone::Normal, Shape::Disc, "fresh"),
        Freshness::Late => (Tone::Advice, Shape::Ring, "LATE"),
        Freshness::Stale => (Tone::Caution, Shape::Diamond, "STALE"),
        Freshness::Lost => (Tone::Alarm, Shape::Cross, "LOST"),
    }
}

/// Sign of a track. One that its unit no longer reports is lost, however young its last report is; it is worth a look,
/// where a unit that is lost with all its tracks asks for more.
pub(super) fn track(of: Freshness, dropped: bool) -> (Tone, Shape, &'static str) {
    match (of, dropped) {
        (_, true) => (Tone::Advice, Shape::Cross, "LOST"),
        (Freshness::Lost, false) => (Tone::Caution, Shape::Cross, "LOST"),
        (of, false) => freshness(of),
    }
}

/// Tone and shape of a sign.
pub(super) fn sign(sign: Sign) -> (Tone, Shape) {
    match sign {
        Sign::Normal => (Tone::Normal, Shape::Disc),
        Sign::Quiet => (Tone::Weak, Shape::Ring),
        Sign::Authority => (Tone::Mark, Shape::Triangle),
        Sign::Past => (Tone::Advice, Shape::Ring),
        Sign::Caution => (Tone::Caution, Shape::Diamond),
        Sign::Held => (Tone::Caution, Shape::Square),
        Sign::Lost => (Tone::Alarm, Shape::Cross),
    }
}

/// Sign of a mode.
pub(super) fn mode(mode: Mode) -> (Tone, Shape) {
    match mode {
        Mode::Idle => (Tone::Normal, Shape::Ring),
        Mode::Ready => (Tone::Normal, Shape::Disc),
        Mode::PrepareToAct => (Tone::Mark, Shape::Triangle),
        Mode::Degraded => (Tone::Caution, Shape::Diamond),
        Mode::HoldSafe => (Tone::Caution, Shape::Square),
    }
}

/// Sign of a command's progress.
pub(super) fn life(life: Life) -> (Tone, Shape) {
    match life {
        Life::Requested | Life::Staged | Life::Released | Life::Sent | Life::Stored(_) => (Tone::Normal, Shape::Ring),
        Life::Executed => (Tone::Normal, Shape::Disc),
        Life::RefusedByUnit(_) | Life::RefusedByGateway(_) | Life::Expired => (Tone::Caution, Shape::Diamond),
        Life::NotAcknowledged => (Tone::Alarm, Shape::Cross),
    }
}

/// A shape with a name, as wide as a row is high.
pub(super) fn shape(ui: &mut Ui, shape: Shape, tone: Tone, name: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
    shape.draw(ui.painter(), rect.center(), 10.0, tone.color(Palette::current(ui)));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    response
}

/// Offset at which a text is painted a second time: the face has no bold one.
const BOLD: f32 = 0.55;

/// A text that stands out, at `place` by `align`. Returns its rectangle.
pub(super) fn bold(painter: &Painter, place: Pos2, align: Align2, text: &str, size: f32, color: Color32) -> Rect {
    painter.text(place + vec2(BOLD, 0.0), align, text, FontId::proportional(size), color);
    painter.text(place, align, text, FontId::proportional(size), color)
}

/// A text within a width and a number of rows. Its last row ends in an ellipsis where there is more.
pub(super) fn fitted(
    painter: &Painter,
    text: &str,
    size: f32,
    color: Color32,
    (width, rows): (f32, usize),
) -> Arc<Galley> {
    let mut job = LayoutJob::simple(text.to_owned(), FontId::proportional(size), color, width);
    job.wrap.max_rows = rows;
    painter.layout_job(job)
}

/// A galley, painted twice.
pub(super) fn bold_galley(painter: &Painter, place: Pos2, galley: Arc<Galley>, color: Color32) {
    painter.galley(place + vec2(BOLD, 0.0), galley.clone(), color);
    painter.galley(place, galley, color);
}

/// A chip: a shape and a text in a box, `width` wide; filled where it is meant to be seen across a room. Named by
/// `name`.
pub(super) fn chip(ui: &mut Ui, width: f32, sign: (Tone, Shape), text: &str, filled: bool, name: &str) -> Response {
    let palette = Palette::current(ui);
    let color = sign.0.color(palette);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 24.0), Sense::hover());
    let (fill, ink) = if filled { (color, palette.on_block) } else { (palette.raised, color) };
    // Grey is normal: its own edge colour is for what is not.
    let edge = if sign.0 <= Tone::Normal { palette.line } else { color };
    ui.painter().rect(rect, 2.0, fill, Stroke::new(1.0, edge), StrokeKind::Inside);
    sign.1.draw(ui.painter(), rect.left_center() + vec2(12.0, 0.0), 11.0, ink);
    let font = TextStyle::Body.resolve(ui.style());
    let room = Rect::from_min_max(rect.min + vec2(23.0, 0.0), rect.max - vec2(4.0, 0.0));
    text_in(ui.painter(), room, Align2::LEFT_CENTER, text, font, ink);
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, name));
    response
}

/// A text that keeps within `rect`; overflow ends in an ellipsis.
pub(super) fn text_in(painter: &Painter, rect: Rect, align: Align2, text: &str, font: FontId, color: Color32) {
    let mut job = LayoutJob::simple_singleline(text.to_owned(), font, color);
    job.wrap.max_width = rect.width();
    job.wrap.max_rows = 1;
    job.wrap.break_anywhere = true;
    let galley = painter.layout_job(job);
    let at = align.align_size_within_rect(galley.size(), rect);
    painter.galley(at.min, galley, color);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So no label is shown by colour alone.
    #[test]
    fn labels_never_share_a_shape() {
        let all = [Freshness::Fresh, Freshness::Late, Freshness::Stale, Freshness::Lost].map(freshness);
        let modes = Mode::ALL.map(mode);
        for at in 0..all.len() {
            assert!(
                all[..at].iter().all(|(_, shape, word)| *shape != all[at].1 && *word != all[at].2),
                "{:?}",
                all[at]
            );
        }
        for at in 0..modes.len() {
            assert!(modes[..at].iter().all(|(_, shape)| *shape != modes[at].1), "{:?}", modes[at]);
        }
    }
}
