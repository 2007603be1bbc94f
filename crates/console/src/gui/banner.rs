//! The banner: the four answers for the chosen unit, in the largest words on the screen.
//!
//! It stands outside of the tiles, so that no layout hides it. The answers are [`crate::banner`]'s; this view arranges
//! them: in a narrow banner the time stands in the mode's block, and words that would not fit are written smaller. Each
//! part is whole in its accessible name and tooltip.

use std::sync::Arc;

use eframe::egui::{
    Align2, Color32, FontId, Galley, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use super::marks::{self, Shape, Tone};
use super::theme::{BODY, Palette, SMALL};
use super::view_state::ViewState;
use crate::banner::{Answer, Sign};
use crate::shown::Shown;

/// Width of the banner from which on the answers have the larger sizes and the time has a column, points.
const WIDE: f32 = 1100.0;
/// Height of the banner, points; and, in a narrow one that is not too narrow for it, a lower one.
const HEIGHT: f32 = 118.0;
const LOW: f32 = 104.0;
/// Width of the banner from which on the lower one has room for the answers.
const ROOMY: f32 = 900.0;
/// Width of the mode's block in a narrow and in a wide banner.
const BLOCKS: [f32; 2] = [224.0, 300.0];
/// Sizes of the mode.
const MODES: [f32; 2] = [28.0, 36.0];
/// Sizes of a headline and of its details: the first that fit are taken.
const SIZES: [[[f32; 2]; 4]; 2] = [
    [[18.0, BODY], [16.0, BODY], [16.0, SMALL], [BODY, SMALL]],
    [[21.0, BODY], [18.0, BODY], [16.0, BODY], [BODY, SMALL]],
];
/// Between two parts.
const GAP: f32 = 14.0;
/// Height of the question above an answer, and room below its headline.
const TITLE: f32 = 23.0;
const BELOW: f32 = 3.0;
/// Indent of a detail with a sign.
const INDENT: f32 = 18.0;

/// Draws the banner of the chosen unit. A press on the note of a worse unit chooses that one.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    let width = ui.available_width();
    let size = usize::from(width >= WIDE);
    let answers = shown.banner(view_state.unit);
    let height = if (ROOMY..WIDE).contains(&width) { LOW } else { HEIGHT };
    let (rect, _) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
    let block = Rect::from_min_size(rect.min, vec2(BLOCKS[size], rect.height()));
    // Without room for a column of its own, the time stands in the mode's block.
    let since = (size == 0).then_some(&answers.since);
    mode(ui, view_state, shown, (&answers.mode, since), (block, size));
    let rest = Rect::from_min_max(pos2(block.right() + GAP, rect.top()), rect.max);
    let mut parts: Vec<(&str, &Answer, f32)> =
        vec![("Why", &answers.why, 1.2), ("Do next", &answers.next, 1.15), ("Is this true?", &answers.truth, 1.05)];
    if since.is_none() {
        parts.insert(1, ("Since", &answers.since, 0.62));
    }
    let total: f32 = parts.iter().map(|(.., share)| share).sum();
    let mut left = rest.left();
    for (at, (title, answer, share)) in parts.iter().enumerate() {
        let width = rest.width() * share / total;
        let room = if at + 1 < parts.len() { width - GAP } else { width };
        let place = Rect::from_min_size(pos2(left, rest.top()), vec2(room, rest.height()));
        if at > 0 {
            let line = Stroke::new(1.0, Palette::current(ui).line);
            ui.painter().vline(left - GAP / 2.0, rest.shrink(8.0).y_range(), line);
        }
        part(ui, (view_state.unit.name(), title), answer, (place, size));
        left += width;
    }
}

/// The mode, in a block that is filled where it is meant to be seen across a room.
fn mode(
    ui: &mut Ui,
    view_state: &mut ViewState,
    shown: &Shown,
    (answer, since): (&Answer, Option<&Answer>),
    (block, size): (Rect, usize),
) {
    let palette = Palette::current(ui);
    let (tone, shape) = marks::sign(answer.sign);
    let color = tone.color(palette);
    let filled = matches!(answer.sign, Sign::Held | Sign::Caution | Sign::Authority);
    let (fill, ink, edge) = match answer.sign {
        _ if filled => (color, palette.on_block, color),
        Sign::Lost | Sign::Past => (palette.raised, color, color),
        Sign::Normal | Sign::Quiet | Sign::Authority | Sign::Caution | Sign::Held => {
            (palette.raised, palette.strong, palette.edge)
        }
    };
    ui.painter().rect(block, 3.0, fill, Stroke::new(1.5, edge), StrokeKind::Inside);
    let inner = block.shrink2(vec2(12.0, 8.0));
    let small = if filled { ink } else { palette.text };
    ui.painter().text(inner.left_top(), Align2::LEFT_TOP, view_state.unit.name(), FontId::proportional(BODY), small);
    let middle = inner.center().y - if since.is_some() { 9.0 } else { 0.0 };
    shape.draw(ui.painter(), pos2(inner.left() + 9.0, middle), MODES[size] * 0.6, ink);
    let room = inner.width() - 26.0;
    let galley = marks::fitted(ui.painter(), &answer.headline, MODES[size], ink, (f32::INFINITY, 1));
    // A long name is written smaller, never cut.
    let scale = (room / galley.size().x).min(1.0);
    let galley = marks::fitted(ui.painter(), &answer.headline, MODES[size] * scale, ink, (f32::INFINITY, 1));
    let place = pos2(inner.left() + 26.0, middle - galley.size().y / 2.0);
    marks::bold_galley(ui.painter(), place, galley, ink);
    let note = answer.details.iter().map(|(_, detail)| detail.as_str()).collect::<Vec<_>>().join(" · ");
    let foot = Rect::from_min_max(pos2(inner.left(), inner.bottom() - 20.0), inner.max);
    marks::text_in(ui.painter(), foot, Align2::LEFT_BOTTOM, &note, FontId::proportional(BODY), small);
    let response = ui.interact(block, ui.scope_id().with("mode"), Sense::hover());
    let text = format!("MODE {}: {}", view_state.unit.name(), answer.sentence());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
    if let Some(since) = since {
        let line = foot.translate(vec2(0.0, -19.0));
        let font = FontId::proportional(BODY);
        marks::text_in(ui.painter(), line, Align2::LEFT_BOTTOM, &lasted(since), font, small);
        named(ui, (view_state.unit.name(), "Since"), since, line);
    }
    worse(ui, view_state, shown, (inner, small));
}

/// The time in the mode's block.
fn lasted(since: &Answer) -> String {
    match since.headline.as_str() {
        "not known" => "since when is not known".to_owned(),
        "the start" => "since the start".to_owned(),
        time if since.details.is_empty() => time.to_owned(),
        _ => format!("for {}", since.sentence()),
    }
}

/// Gives a part its name, which is whole at any width.
fn named(ui: &Ui, (unit, title): (&str, &str), answer: &Answer, place: Rect) {
    let response = ui.interact(place, ui.scope_id().with(title), Sense::hover());
    let text = format!("{} {unit}: {}", title.trim_end_matches('?').to_uppercase(), answer.sentence());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
    response.on_hover_text(answer.sentence());
}

/// Which unit is worse off than the chosen one, or how many there are.
fn worse(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, (inner, ink): (Rect, eframe::egui::Color32)) {
    let units = shown.worst_first();
    let own = units.iter().find(|(unit, _)| *unit == view_state.unit).map_or(Sign::Normal, |(_, sign)| *sign);
    let worst = units.first().filter(|(unit, sign)| *unit != view_state.unit && *sign > own && *sign >= Sign::Past);
    let position = shown.units.iter().position(|unit| unit.unit == view_state.unit).map_or(0, |at| at + 1);
    let text = match worst {
        Some((unit, _)) => format!("F3: {unit} is worse"),
        None if units.len() > 1 && position > 0 => format!("{position} of {} units", units.len()),
        None => return,
    };
    let painted = ui.painter().text(inner.right_top(), Align2::RIGHT_TOP, &text, FontId::proportional(SMALL), ink);
    if let Some((unit, _)) = worst {
        let response = ui.interact(painted.expand(3.0), ui.scope_id().with("worse"), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &text));
        if response.clicked() {
            view_state.choose(*unit);
        }
    }
}

/// An answer as laid out: the headline, and the details with sign and colour.
struct Laid {
    headline: Arc<Galley>,
    details: Vec<(Option<Shape>, Color32, Arc<Galley>)>,
}

impl Laid {
    /// The first sizes that fit into a place, else the smallest.
    fn fitting(ui: &Ui, title: &str, answer: &Answer, (place, sizes): (Rect, &[[f32; 2]])) -> Self {
        let all = sizes.iter().map(|sizes| Self::new(ui, title, answer, place.width(), *sizes));
        let mut last = None;
        for laid in all {
            if laid.height() <= place.height() - TITLE {
                return laid;
            }
            last = Some(laid);
        }
        last.unwrap_or_else(|| Self::new(ui, title, answer, place.width(), [BODY, SMALL]))
    }

    fn new(ui: &Ui, title: &str, answer: &Answer, width: f32, [head, body]: [f32; 2]) -> Self {
        let palette = Palette::current(ui);
        let loud = matches!(answer.sign, Sign::Caution | Sign::Lost | Sign::Past) && title == "Is this true?";
        let color = if loud { marks::sign(answer.sign).0.color(palette) } else { palette.strong };
        let headline = marks::fitted(ui.painter(), &answer.headline, head, color, (width, usize::MAX));
        let detail = |(sign, words): &(Sign, String)| {
            let told = *sign == answer.sign || answer.details.len() > 1 || *sign > Sign::Quiet;
            let marked = told && *sign != Sign::Normal && title != "Why";
            let (tone, shape) = marks::sign(*sign);
            let ink = if tone > Tone::Normal && marked { tone.color(palette) } else { palette.text };
            let room = if marked { width - INDENT } else { width };
            (marked.then_some(shape), ink, marks::fitted(ui.painter(), words, body, ink, (room, usize::MAX)))
        };
        Self { headline, details: answer.details.iter().map(detail).collect() }
    }

    fn height(&self) -> f32 {
        let details = self.details.iter().map(|(.., galley)| galley.size().y + 1.0).sum::<f32>();
        self.headline.size().y + BELOW + details
    }
}

/// One answer: its question, its headline, its details.
fn part(ui: &mut Ui, (unit, title): (&str, &str), answer: &Answer, (place, size): (Rect, usize)) {
    let palette = Palette::current(ui);
    let font = FontId::proportional(BODY);
    ui.painter().text(place.left_top() + vec2(0.0, 3.0), Align2::LEFT_TOP, title, font, palette.weak);
    let laid = Laid::fitting(ui, title, answer, (place, &SIZES[size]));
    let ink = laid.headline.job.sections.first().map_or(palette.strong, |section| section.format.color);
    let mut at = place.left_top() + vec2(0.0, TITLE);
    marks::bold_galley(ui.painter(), at, laid.headline.clone(), ink);
    at.y += laid.headline.size().y + BELOW;
    for (shape, ink, galley) in laid.details {
        let height = galley.size().y;
        if at.y + height > place.bottom() + 2.0 {
            break;
        }
        let indent = if shape.is_some() { INDENT } else { 0.0 };
        if let Some(shape) = shape {
            shape.draw(ui.painter(), at + vec2(6.0, 9.0), 10.0, ink);
        }
        ui.painter().galley(at + vec2(indent, 0.0), galley, ink);
        at.y += height + 1.0;
    }
    named(ui, (unit, title), answer, place);
}
