//! The list of units, the worst first: mode, since when, why, room before the fence, speed, age.
//!
//! In a narrow window a unit is a line under the banner; in one of full width it is a card in a column.

use eframe::egui::{Align2, Color32, FontId, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};
use wire::event::Freshness;
use wire::id::UnitId;
use wire::measured::Limit;
use wire::mode::Guard;

use super::marks::{self, Shape, Tone};
use super::theme::{BODY, Palette, SMALL};
use super::view_state::ViewState;
use crate::banner::Sign;
use crate::shown::{Shown, ShownUnit};
use crate::wording::{self, at_most, lasting};

/// Units that have a line of their own in a narrow window.
const MOST_LINES: usize = 8;
/// Height of a line and of a card, points.
const LINE: f32 = 28.0;
const CARD: f32 = 80.0;

/// One unit's words.
struct Line {
    unit: UnitId,
    sign: Sign,
    mode: String,
    since: String,
    why: String,
    /// True if the values were so, and are not known to be.
    was: bool,
    room: String,
    speed: String,
    age: (Tone, Shape, String),
}

/// Lines under the banner.
pub(super) fn lines(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    let units = all(shown);
    for line in units.iter().take(MOST_LINES) {
        if row(ui, view_state, line) {
            view_state.choose(line.unit);
        }
    }
    let rest = units.len().saturating_sub(MOST_LINES);
    if rest > 0 {
        ui.weak(format!("{rest} more, none worse"));
    }
}

/// Cards in a column.
pub(super) fn cards(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    for line in all(shown) {
        if card(ui, view_state, &line) {
            view_state.choose(line.unit);
        }
    }
}

/// The unit below or above the chosen one in the list.
pub(super) fn step(view_state: &mut ViewState, shown: &Shown, steps: i32) {
    let units = shown.worst_first();
    let at = units.iter().position(|(unit, _)| *unit == view_state.unit).unwrap_or(0) as i32;
    if let Some((unit, _)) = units.get((at + steps).rem_euclid(units.len().max(1) as i32) as usize) {
        view_state.choose(*unit);
    }
}

fn all(shown: &Shown) -> Vec<Line> {
    let line =
        |(unit, sign): (UnitId, Sign)| shown.unit(unit).map_or_else(|| unheard(unit), |of| heard(shown, of, sign));
    shown.worst_first().into_iter().map(line).collect()
}

fn unheard(unit: UnitId) -> Line {
    let age = (Tone::Alarm, Shape::Cross, "never".to_owned());
    let (mode, why) = ("NOT HEARD".to_owned(), "nothing was received of it".to_owned());
    Line {
        unit,
        sign: Sign::Lost,
        mode,
        since: String::new(),
        why,
        was: false,
        room: String::new(),
        speed: String::new(),
        age,
    }
}

fn heard(shown: &Shown, unit: &ShownUnit, sign: Sign) -> Line {
    let banner = shown.banner(unit.unit);
    let (state, freshness) = unit.state.get();
    let was = freshness > Freshness::Late;
    let prefix = if was { "was " } else { "" };
    let room = state
        .measured
        .value(Guard::Geofence)
        .map_or(String::new(), |value| format!("{prefix}{}", wording::reading(value, Limit::Spare(0))));
    let speed = format!("{prefix}{} m/s", wording::tenths(f64::from(state.speed_mm_s) / 1000.0));
    let (tone, shape, _) = marks::freshness(freshness);
    let (tone, shape) = if unit.is_out_of_contact() { (Tone::Weak, Shape::Ring) } else { (tone, shape) };
    let since = if was { lasting(unit.state.age()) } else { lasting(shown.at.since(unit.since)) };
    let age = (tone, shape, at_most(unit.state.age()));
    Line { unit: unit.unit, sign, mode: banner.mode.headline, since, why: banner.why.headline, was, room, speed, age }
}

/// The frame of a unit: its rectangle, and whether it was pressed.
fn frame(ui: &mut Ui, view_state: &ViewState, line: &Line, height: f32) -> (Rect, bool) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    let palette = Palette::current(ui);
    let chosen = view_state.unit == line.unit;
    if chosen {
        ui.painter().rect_filled(rect, 0.0, palette.raised);
        ui.painter().rect_filled(Rect::from_min_size(rect.min, vec2(3.0, rect.height())), 0.0, palette.mark);
    }
    if response.has_focus() {
        super::keys::frame(ui, rect);
    }
    let (_, _, age) = &line.age;
    let speed = if line.speed.is_empty() { String::new() } else { format!(", {}, {}", line.room, line.speed) };
    let text = format!("UNIT {} {} {}, {}{speed}, age {age}", line.unit, line.mode, line.since, line.why);
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, &text));
    (rect, response.clicked())
}

/// The mode's mark: filled where the unit is held.
fn mode(ui: &Ui, line: &Line, place: Rect) {
    let palette = Palette::current(ui);
    let (tone, shape) = marks::sign(line.sign);
    let color = if tone > Tone::Normal { tone.color(palette) } else { palette.quiet };
    let (ink, sign) = match line.sign {
        Sign::Held => {
            ui.painter().rect(place, 2.0, color, Stroke::NONE, StrokeKind::Inside);
            (palette.on_block, palette.on_block)
        }
        _ if tone > Tone::Normal => (color, color),
        Sign::Normal | Sign::Quiet | Sign::Authority | Sign::Past | Sign::Caution | Sign::Lost => (palette.text, color),
    };
    shape.draw(ui.painter(), place.left_center() + vec2(12.0, 0.0), 11.0, sign);
    let room = Rect::from_min_max(pos2(place.left() + 25.0, place.top()), place.max);
    marks::text_in(ui.painter(), room, Align2::LEFT_CENTER, &line.mode, FontId::proportional(BODY), ink);
}

fn write(ui: &Ui, place: Rect, align: Align2, text: &str, color: Color32) {
    marks::text_in(ui.painter(), place, align, text, FontId::proportional(BODY), color);
}

fn row(ui: &mut Ui, view_state: &ViewState, line: &Line) -> bool {
    let (rect, pressed) = frame(ui, view_state, line, LINE);
    let palette = Palette::current(ui);
    let at = |from: f32, to: f32| {
        Rect::from_min_max(pos2(rect.left() + from, rect.top()), pos2(rect.left() + to, rect.bottom()))
    };
    let right = rect.width();
    write(ui, at(12.0, 80.0), Align2::LEFT_CENTER, line.unit.name(), palette.strong);
    mode(ui, line, at(80.0, 240.0).shrink2(vec2(0.0, 3.0)));
    write(ui, at(250.0, 340.0), Align2::LEFT_CENTER, &line.since, palette.weak);
    let ink = if line.was { palette.weak } else { palette.text };
    // Without room for all, the reason outweighs the room to the fence.
    let rooms = right > 900.0;
    write(ui, at(335.0, right - if rooms { 360.0 } else { 215.0 }), Align2::LEFT_CENTER, &line.why, palette.text);
    if rooms {
        write(ui, at(right - 355.0, right - 215.0), Align2::RIGHT_CENTER, &line.room, ink);
    }
    write(ui, at(right - 210.0, right - 115.0), Align2::RIGHT_CENTER, &line.speed, ink);
    age(ui, line, at(right - 105.0, right - 8.0));
    pressed
}

fn age(ui: &Ui, line: &Line, place: Rect) {
    let palette = Palette::current(ui);
    let (tone, shape, words) = &line.age;
    let color = if *tone > Tone::Normal { tone.color(palette) } else { palette.text };
    let sign = if *tone > Tone::Normal { color } else { palette.quiet };
    let galley = marks::fitted(ui.painter(), words, BODY, color, (place.width() - 16.0, 1));
    let left = place.right() - galley.size().x;
    shape.draw(ui.painter(), pos2(left - 12.0, place.center().y), 10.0, sign);
    ui.painter().galley(pos2(left, place.center().y - galley.size().y / 2.0), galley, color);
}

fn card(ui: &mut Ui, view_state: &ViewState, line: &Line) -> bool {
    let (rect, pressed) = frame(ui, view_state, line, CARD);
    let palette = Palette::current(ui);
    let row = |at: f32| Rect::from_min_size(rect.min + vec2(12.0, at), vec2(rect.width() - 24.0, 24.0));
    marks::bold(ui.painter(), row(4.0).left_center(), Align2::LEFT_CENTER, line.unit.name(), BODY, palette.strong);
    age(ui, line, row(4.0));
    let mid = row(29.0);
    mode(ui, line, Rect::from_min_size(mid.min, vec2(mid.width() - 92.0, 22.0)));
    write(ui, mid, Align2::RIGHT_CENTER, &line.since, palette.weak);
    let foot = row(53.0);
    let why = Rect::from_min_max(foot.min, pos2(foot.right() - 70.0, foot.bottom()));
    marks::text_in(ui.painter(), why, Align2::LEFT_CENTER, &line.why, FontId::proportional(SMALL), palette.text);
    let ink = if line.was { palette.weak } else { palette.text };
    marks::text_in(ui.painter(), foot, Align2::RIGHT_CENTER, &line.speed, FontId::proportional(SMALL), ink);
    pressed
}
