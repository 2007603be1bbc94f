//! Reasons for a unit's mode, or its obstacles to READY: each condition with its value and its limit.

use eframe::egui::{Align, Label, Layout, RichText, Role, ScrollArea, Ui, WidgetInfo};
use wire::event::Freshness;
use wire::mode::Mode;

use super::keys;
use super::marks::{self, Shape, Tone};
use super::theme::Palette;
use super::view_state::ViewState;
use super::words::{event_time, seconds};
use crate::interlock::Predicate;
use crate::shown::Shown;

/// The conditions of the chosen unit.
pub(super) fn draw(ui: &mut Ui, view_state: &ViewState, shown: &Shown) {
    let Some(unit) = shown.unit(view_state.unit) else {
        ui.label(format!("Nothing was received of {}: nothing is known of its state.", view_state.unit));
        return;
    };
    let (state, freshness) = unit.state.get();
    let question = match state.mode {
        Mode::Ready => "Why READY",
        Mode::PrepareToAct => "Why PREPARE_TO_ACT",
        Mode::HoldSafe => "Why HOLD_SAFE, and why not READY",
        Mode::Degraded => "Why DEGRADED, and why not READY",
        Mode::Idle => "Why IDLE, and why not READY",
    };
    let current = freshness == Freshness::Fresh;
    let known = if current { "" } else { ", last known" };
    let question = RichText::new(format!("{}: {question}{known}", unit.unit)).color(Palette::current(ui).strong);
    ui.add(Label::new(question).wrap());
    let tone = if current { Tone::Weak } else { marks::freshness(freshness).0 };
    let (age, since) = (seconds(unit.state.age()), event_time(shown, unit.since));
    let age = format!("as reported {age} ago; last change: {}, {since}", state.cause());
    ui.add(Label::new(RichText::new(age).color(tone.color(Palette::current(ui)))).wrap());
    if let Some(waits) = unit.waits_for(&shown.bounds) {
        let waits = format!("{} for {waits}", if current { "waits" } else { "waited" });
        ui.add(Label::new(RichText::new(waits).color(Palette::current(ui).text)).wrap());
    }
    let mut guards = unit.guards(&shown.bounds);
    // What fails stands first.
    guards.sort_by_key(|guard| guard.holds);
    keys::scroll_next(ui, "list of guards");
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for guard in &guards {
            row(ui, guard, current);
        }
    });
}

/// Draws a condition: whether it holds, its name, value and limit. A condition that is not current is worded in the
/// past.
pub(super) fn row(ui: &mut Ui, predicate: &Predicate, current: bool) {
    let palette = Palette::current(ui);
    let (tone, shape, word) = match (predicate.holds, current) {
        (true, _) if !predicate.judged => (Tone::Weak, Shape::Ring, "-"),
        (true, true) => (Tone::Weak, Shape::Disc, "ok"),
        (true, false) => (Tone::Weak, Shape::Ring, "was ok"),
        (false, true) => (Tone::Caution, Shape::Diamond, "NO"),
        (false, false) => (Tone::Caution, Shape::Diamond, "was NO"),
    };
    let color = match (predicate.holds, current) {
        (true, _) if !predicate.judged => palette.weak,
        (true, true) => palette.text,
        (true, false) => palette.weak,
        (false, _) => palette.caution,
    };
    let value = predicate.measured();
    let text = format!("{word} {} {value}", predicate.name);
    let row = ui.horizontal(|ui| {
        ui.spacing_mut().interact_size.y = 16.0;
        marks::shape(ui, shape, tone, word);
        ui.label(RichText::new(word).small().color(color));
        ui.label(RichText::new(predicate.name).color(color));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add(Label::new(RichText::new(value).monospace().color(color)).truncate());
        });
    });
    row.response.widget_info(|| WidgetInfo::labeled(Role::ListItem, true, &text));
}
