//! The bar under a recording: where it stands, and ways to go elsewhere. It is there in a replay only.

use eframe::egui::{Button, Key, RichText, Slider, Ui};
use wire::time::Span;

use super::Wish;
use super::theme::Palette;
use super::words::seconds;

/// Moments that are listed, at most.
pub const MAX_MOMENTS: usize = 256;

/// Where a recording stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tape {
    /// Now, from the recording's beginning.
    pub at: Span,
    /// Its length.
    pub length: Span,
    /// When something changed, and what; in order, at most [`MAX_MOMENTS`].
    pub moments: Vec<(Span, String)>,
    /// Whether it runs by itself.
    pub playing: bool,
}

/// Where to go in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seek {
    /// To this time from its beginning.
    To(Span),
    /// So many pictures on, or back.
    Step(i32),
    /// Let it run, or stand.
    Play(bool),
}

/// The bar.
pub(super) fn draw(ui: &mut Ui, tape: &Tape, wishes: &mut Vec<Wish>) {
    let mut seek = |to: Seek| wishes.push(Wish::Seek(to));
    ui.horizontal(|ui| {
        ui.label(RichText::new("REPLAY").strong().color(Palette::of(ui).advice));
        if ui.button(if tape.playing { "Pause" } else { "Play" }).clicked() {
            seek(Seek::Play(!tape.playing));
        }
        let earlier = tape.moments.iter().rev().find(|(at, _)| *at < tape.at);
        let later = tape.moments.iter().find(|(at, _)| *at > tape.at);
        if ui.add_enabled(earlier.is_some(), Button::new("Change before")).clicked() {
            seek(Seek::To(earlier.map_or(Span::ZERO, |(at, _)| *at)));
        }
        if ui.button("Step back").clicked() || arrow(ui, Key::ArrowLeft) {
            seek(Seek::Step(-1));
        }
        if ui.button("Step on").clicked() || arrow(ui, Key::ArrowRight) {
            seek(Seek::Step(1));
        }
        if ui.add_enabled(later.is_some(), Button::new("Next change")).clicked() {
            seek(Seek::To(later.map_or(tape.length, |(at, _)| *at)));
        }
        ui.label(RichText::new(format!("{} of {}", seconds(tape.at), seconds(tape.length))).monospace());
        let label = ui.label(RichText::new("time").weak());
        let mut at = tape.at.as_ms() / 1000.0;
        let slider = Slider::new(&mut at, 0.0..=tape.length.as_ms() / 1000.0).show_value(false);
        ui.spacing_mut().slider_width = (ui.available_width() - 16.0).max(80.0);
        let response = ui.add(slider).labelled_by(label.id);
        if response.changed() {
            seek(Seek::To(Span((at.max(0.0) * 1e6) as u64)));
        }
    });
    let last = tape.moments.iter().rev().find(|(at, _)| *at <= tape.at);
    let text = last.map_or("no change yet".to_owned(), |(at, what)| format!("last change at {}: {what}", seconds(*at)));
    ui.label(RichText::new(text).color(Palette::of(ui).text));
}

/// Whether an arrow went down while no control has the focus, which it would move in.
fn arrow(ui: &Ui, key: Key) -> bool {
    ui.memory(|memory| memory.focused().is_none()) && ui.input(|input| input.key_pressed(key))
}
