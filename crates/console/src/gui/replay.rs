//! The bar under a recording: where it stands, and ways to go elsewhere. It is there in a replay only.

use eframe::egui::{Button, Color32, Key, RichText, Role, Sense, Slider, Stroke, Ui, WidgetInfo, pos2, vec2};
use wire::time::Span;

use super::Wish;
use super::theme::Palette;
use super::words;
use crate::source::{Seek, Tape};

/// Height of the line of moments, points.
const LINE: f32 = 14.0;

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
        let label = ui.label(RichText::new("time").weak());
        let in_seconds = |span: Span| span.as_ms() / 1000.0;
        let lead = in_seconds(tape.lead);
        let mut seconds = in_seconds(tape.at) - lead;
        let slider = Slider::new(&mut seconds, -lead..=in_seconds(tape.length) - lead).show_value(false);
        ui.spacing_mut().slider_width = (ui.available_width() - 16.0).max(80.0);
        let response = ui.add(slider).labelled_by(label.id);
        if response.changed() {
            seek(Seek::To(Span(((seconds + lead).max(0.0) * 1e6) as u64)));
        }
    });
    line(ui, tape);
    for truth in [false, true] {
        let last = tape.moments.iter().rev().find(|moment| moment.truth == truth && moment.at <= tape.at);
        let (begin, none) = if truth { ("what really happened", "nothing") } else { ("last change", "none yet") };
        let text = last.map_or(none.to_owned(), |moment| format!("{} at {}", moment.what, time(tape, moment.at)));
        if !truth || tape.moments.iter().any(|moment| moment.truth) {
            ui.label(RichText::new(format!("{begin}: {text}")).color(Palette::current(ui).text));
        }
    }
}

/// The whole recording as a line: a stroke above it for each change of the display, one below for each true event, and
/// the present position.
fn line(ui: &mut Ui, tape: &Tape) {
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
    let really = tape.moments.iter().filter(|moment| moment.truth).count();
    let text = format!("timeline: {} changes shown, {really} things that happened", tape.moments.len() - really);
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
    let palette = Palette::current(ui);
    let x = |time: Span| area.left() + area.width() * (time.0 as f32 / tape.length.0.max(1) as f32);
    let stroke = |time: Span, from: f32, to: f32, color: Color32| {
        ui.painter().line_segment([pos2(x(time), from), pos2(x(time), to)], Stroke::new(1.5, color));
    };
    ui.painter().hline(area.x_range(), area.center().y, Stroke::new(1.0, palette.weak));
    for moment in &tape.moments {
        if moment.truth {
            stroke(moment.at, area.center().y, area.bottom(), palette.caution);
        } else {
            stroke(moment.at, area.top(), area.center().y, palette.text);
        }
    }
    stroke(tape.at, area.top(), area.bottom(), palette.advice);
}

/// True if an arrow went down while no control has the focus, which it would move in.
fn arrow(ui: &Ui, key: Key) -> bool {
    ui.memory(|memory| memory.focused().is_none()) && ui.input(|input| input.key_pressed(key))
}
