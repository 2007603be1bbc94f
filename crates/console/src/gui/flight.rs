//! Attitude, battery, sunlight and contact of a unit that leaves the ground, above its plots.
//!
//! In the air the disc shows the horizon as from the cockpit; in orbit it shows the angle of the line of sight to the
//! vertical. The plan of contacts goes on in silence, the rest is in the past tense.

use eframe::egui::{Align2, Color32, FontId, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};
use wire::event::Freshness;
use wire::motion::{Attitude, ReportedMotion};
use wire::time::Span;

use super::marks;
use super::theme::{BODY, Palette, SMALL};
use crate::aloft;
use crate::shown::ShownUnit;
use crate::silence::Plan;
use crate::wording::lasting;

/// Height of the instruments, points.
const HEIGHT: f32 = 98.0;
/// Radius of the attitude's disc.
const RADIUS: f32 = 42.0;
/// Width up to which the disc stands at the edge.
const NARROW: f32 = 300.0;
/// The longest contact or silence that a bar shows in full.
const LONGEST: Span = Span::s(600);

/// Draws the instruments of a unit that has any.
pub(super) fn draw(ui: &mut Ui, unit: &ShownUnit) {
    let Some(motion) = unit.state.get().0.motion else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let known = unit.state.freshness() <= Freshness::Late;
    let palette = Palette::current(ui);
    let ink = if known { palette.text } else { palette.weak };
    let gap = if rect.width() < NARROW { 2.0 } else { 12.0 };
    let center = rect.left_center() + vec2(RADIUS + gap, 0.0);
    if let Some(attitude) = motion.attitude {
        match motion.sunlit {
            None => horizon(ui, attitude, center, ink),
            Some(_) => nadir(ui, attitude, center, ink),
        }
    }
    if !known {
        let crossed = if unit.is_out_of_contact() { palette.quiet } else { palette.alarm };
        let reach = vec2(RADIUS, -RADIUS) * 0.8;
        ui.painter().line_segment([center - reach, center + reach], Stroke::new(2.0, crossed));
    }
    let words = words(unit, known);
    let column = pos2(center.x + RADIUS + gap + 6.0, rect.top() + 6.0);
    for (at, word) in words.iter().enumerate() {
        let place = column + vec2(0.0, at as f32 * 22.0);
        ui.painter().text(place, Align2::LEFT_TOP, word, FontId::proportional(BODY), ink);
    }
    let bars = Rect::from_min_max(pos2(column.x + 250.0, rect.top() + 6.0), rect.max - vec2(10.0, 6.0));
    if bars.width() > 120.0 {
        battery(ui, &motion, known, Rect::from_min_size(bars.min, vec2(bars.width(), 40.0)));
        let below = Rect::from_min_size(bars.min + vec2(0.0, 46.0), vec2(bars.width(), 40.0));
        contact(ui, unit, below);
    }
    let text = format!(
        "FLIGHT {} {}{}",
        unit.unit,
        words.join(", "),
        aloft::contact(unit.plan()).map_or(String::new(), |plan| format!(", {plan}"))
    );
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
}

fn words(unit: &ShownUnit, known: bool) -> Vec<String> {
    let words = aloft::motion(unit.state.get().0);
    let words = words.iter().flat_map(|word| word.split(", "));
    words.map(|word| if known { word.to_owned() } else { format!("was {word}") }).take(4).collect()
}

/// The horizon as seen from the body: ground below, sky above, the body fixed.
fn horizon(ui: &Ui, attitude: Attitude, center: Pos2, ink: Color32) {
    let palette = Palette::current(ui);
    let [nose, bank] = aloft::nose_and_bank(attitude).map(|angle| angle as f32);
    ui.painter().circle_filled(center, RADIUS, palette.ground);
    // A degree of the nose moves the horizon by a fortieth of the disc.
    let shift = (-nose.to_degrees() / 40.0).clamp(-0.95, 0.95);
    let half = libm::sqrtf(1.0 - shift * shift);
    let (sin, cos) = libm::sincosf(-bank);
    let turned = |east: f32, down: f32| center + vec2(east * cos - down * sin, east * sin + down * cos) * RADIUS;
    let from = libm::asinf(shift);
    let arc = (0..=32).map(|step| {
        let angle = from + (std::f32::consts::PI - 2.0 * from) * step as f32 / 32.0;
        let (down, east) = libm::sincosf(angle);
        turned(east, down)
    });
    ui.painter().add(Shape::convex_polygon(arc.collect(), palette.raised, Stroke::NONE));
    ui.painter().line_segment([turned(-half, shift), turned(half, shift)], Stroke::new(1.5, ink));
    ui.painter().circle_stroke(center, RADIUS, Stroke::new(1.5, palette.edge));
    for side in [-1.0, 1.0] {
        let wing = [center + vec2(side * 10.0, 0.0), center + vec2(side * 26.0, 0.0)];
        ui.painter().line_segment(wing, Stroke::new(2.5, palette.strong));
    }
    ui.painter().circle_filled(center, 2.5, palette.strong);
}

/// The line of sight against the vertical, seen from the side.
fn nadir(ui: &Ui, attitude: Attitude, center: Pos2, ink: Color32) {
    let palette = Palette::current(ui);
    let off = aloft::off_nadir(attitude) as f32;
    ui.painter().circle_filled(center, RADIUS, palette.ground);
    ui.painter().circle_stroke(center, RADIUS, Stroke::new(1.5, palette.edge));
    let (sin, cos) = libm::sincosf(off);
    let dashes = Shape::dashed_line(&[center, center + vec2(0.0, RADIUS)], Stroke::new(1.0, palette.quiet), 4.0, 4.0);
    ui.painter().extend(dashes);
    ui.painter().line_segment([center, center + vec2(sin, cos) * RADIUS], Stroke::new(2.5, ink));
    ui.painter().circle_filled(center, 4.0, palette.strong);
}

/// Charge of the battery as a bar.
fn battery(ui: &Ui, motion: &ReportedMotion, known: bool, place: Rect) {
    let share = f32::from(motion.charge.min(1000)) / 1000.0;
    let was = if known { "" } else { "was " };
    bar(ui, place, "Battery", &format!("{was}{:.0} %", share * 100.0), (share, known));
}

/// The plan of contacts as a bar that runs out.
fn contact(ui: &Ui, unit: &ShownUnit, place: Rect) {
    let (title, left) = match unit.plan() {
        Plan::None => return,
        Plan::Contact(left) => ("In contact", Some(left)),
        Plan::Silence(next) => ("Out of contact", next),
        Plan::Due(_) => ("Contact is due", None),
    };
    let share = left.map_or(0.0, |left| (left.as_ms() / LONGEST.as_ms()).min(1.0) as f32);
    let words = left.map_or_else(|| "none planned".to_owned(), |left| format!("{} more", lasting(left)));
    bar(ui, place, title, &words, (share, matches!(unit.plan(), Plan::Contact(_))));
}

/// A titled bar; hollow where its value is not current.
fn bar(ui: &Ui, place: Rect, title: &str, value: &str, (share, full): (f32, bool)) {
    let palette = Palette::current(ui);
    let upper = Rect::from_min_size(place.min, vec2(place.width(), 20.0));
    marks::text_in(ui.painter(), upper, Align2::LEFT_CENTER, title, FontId::proportional(SMALL), palette.weak);
    marks::text_in(ui.painter(), upper, Align2::RIGHT_CENTER, value, FontId::proportional(BODY), palette.text);
    let track = Rect::from_min_size(place.min + vec2(0.0, 24.0), vec2(place.width(), 9.0));
    ui.painter().rect_filled(track, 2.0, palette.ground);
    let filled = Rect::from_min_size(track.min, vec2(track.width() * share, track.height()));
    if full {
        ui.painter().rect_filled(filled, 2.0, palette.text);
    } else {
        ui.painter().rect_stroke(filled, 2.0, Stroke::new(1.0, palette.text), eframe::egui::StrokeKind::Inside);
    }
}
