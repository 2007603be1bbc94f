//! The bar under a recording: where it stands, and ways to go elsewhere. It is there in a replay only.

use eframe::egui::{Button, Key, Label, RichText, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use wire::time::Span;

use super::Wish;
use super::keys;
use super::theme::Palette;
use super::words;
use crate::source::{Seek, Tape};

/// Height of the line of moments, points.
const LINE: f32 = 30.0;
/// Distance from the pointer within which a moment is named.
const NEAR: f32 = 5.0;

/// A time from the recording's beginning, as the run's.
fn time(tape: &Tape, at: Span) -> String {
    words::on_run(i128::from(at.0) - i128::from(tape.lead.0))
}

/// The bar. `beside` is whether the evidence beside it is looked at, where there is some.
pub(super) fn draw(ui: &mut Ui, tape: &Tape, sidecar: Option<&mut bool>, wishes: &mut Vec<Wish>) {
    let mut seek = |to: Seek| wishes.push(Wish::Seek(to));
    ui.horizontal(|ui| {
        ui.label(RichText::new("REPLAY").strong().color(Palette::current(ui).advice));
        if ui.button(if tape.playing { "Pause" } else { "Play" }).clicked() {
            seek(Seek::Play(!tape.playing));
        }
        let earlier = tape.moments.iter().rev().find(|moment| moment.at < tape.at);
        let later = tape.moments.iter().find(|moment| moment.at > tape.at);
        if ui.add_enabled(earlier.is_some(), Button::new("Change before")).clicked() {
            seek(Seek::To(earlier.map_or(Span::ZERO, |moment| moment.at)));
        }
        if ui.button("Step back").clicked() || arrow(ui, Key::ArrowLeft) {
            seek(Seek::Step(-1));
        }
        if ui.button("Step on").clicked() || arrow(ui, Key::ArrowRight) {
            seek(Seek::Step(1));
        }
        if ui.add_enabled(later.is_some(), Button::new("Next change")).clicked() {
            seek(Seek::To(later.map_or(tape.length, |moment| moment.at)));
        }
        if let Some(sidecar) = sidecar {
            ui.toggle_value(sidecar, "Evidence");
        }
        let time_of = format!("run time {} of {}", time(tape, tape.at), time(tape, tape.length));
        ui.label(RichText::new(time_of).monospace());
    });
    line(ui, tape, wishes);
    ui.columns(2, |sides| {
        for (ui, truth) in sides.iter_mut().zip([false, true]) {
            let last = tape.moments.iter().rev().find(|moment| moment.truth == truth && moment.at <= tape.at);
            let begin = if truth { "what really happened" } else { "what was shown" };
            let text =
                last.map_or("nothing yet".to_owned(), |moment| format!("{} at {}", moment.what, time(tape, moment.at)));
            let text = RichText::new(format!("{begin}: {text}")).color(Palette::current(ui).text);
            if !truth || tape.moments.iter().any(|moment| moment.truth) {
                ui.add(Label::new(text).truncate());
            }
        }
    });
}

/// The whole recording as a line to move along: above it a stroke for each change of the display, below it one for each
/// true event, and the present position. The moment nearest to the pointer is named.
fn line(ui: &mut Ui, tape: &Tape, wishes: &mut Vec<Wish>) {
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::click_and_drag());
    let in_seconds = |span: Span| span.as_ms() / 1000.0;
    let lead = in_seconds(tape.lead);
    response.widget_info(|| WidgetInfo::slider(true, in_seconds(tape.at) - lead, "time of the run"));
    let palette = *Palette::current(ui);
    let painter = ui.painter_at(area);
    painter.rect_filled(area, 2.0, palette.ground);
    let track = area.shrink2(vec2(8.0, 0.0));
    let x = |time: Span| track.left() + track.width() * (time.0 as f32 / tape.length.0.max(1) as f32);
    let middle = area.center().y;
    painter.hline(track.x_range(), middle, Stroke::new(1.0, palette.weak));
    for moment in &tape.moments {
        let (from, to, color) = if moment.truth {
            (middle + 2.0, area.bottom() - 3.0, palette.caution)
        } else {
            (area.top() + 3.0, middle - 2.0, palette.text)
        };
        painter.line_segment([pos2(x(moment.at), from), pos2(x(moment.at), to)], Stroke::new(2.0, color));
    }
    painter.vline(x(tape.at), area.y_range(), Stroke::new(2.0, palette.advice));
    painter.circle_filled(pos2(x(tape.at), middle), 5.0, palette.advice);
    if response.has_focus() {
        keys::frame(ui, area);
    }
    let place = |pointer: f32| {
        let share = f64::from(((pointer - track.left()) / track.width().max(1.0)).clamp(0.0, 1.0));
        Span((share * tape.length.0 as f64) as u64)
    };
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.clicked() || response.dragged()) {
        wishes.push(Wish::Seek(Seek::To(place(pointer.x))));
    }
    if let Some(pointer) = response.hover_pos() {
        let near = tape.moments.iter().filter(|moment| (x(moment.at) - pointer.x).abs() < NEAR);
        let named: Vec<String> =
            near.take(4).map(|moment| format!("{} at {}", moment.what, time(tape, moment.at))).collect();
        let text = if named.is_empty() { time(tape, place(pointer.x)) } else { named.join("\n") };
        response.on_hover_text_at_pointer(text);
    }
}

/// True if an arrow went down while no control has the focus, which it would move in.
fn arrow(ui: &Ui, key: Key) -> bool {
    ui.memory(|memory| memory.focused().is_none()) && ui.input(|input| input.key_pressed(key))
}
