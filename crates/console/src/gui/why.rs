//! Reasons for a unit's mode, or its obstacles to READY: each guard with its value and its limit. A press leads to its
//! plot.

use eframe::egui::{Align, Label, Layout, Response, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo};
use wire::event::Freshness;
use wire::mode::Guard;

use super::keys;
use super::layout::Pane;
use super::marks::{self, Shape, Tone};
use super::plots;
use super::theme::Palette;
use super::view_state::ViewState;
use super::words::seconds;
use crate::interlock::Predicate;
use crate::shown::Shown;

/// The guards of the chosen unit, those that fail first.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    let Some(unit) = shown.unit(view_state.unit) else {
        ui.label(format!("Nothing was received of {}: nothing is known of its state.", view_state.unit));
        return;
    };
    let current = unit.state.freshness() == Freshness::Fresh;
    let expected = current || unit.is_out_of_contact();
    let tone = if expected { Tone::Weak } else { marks::freshness(unit.state.freshness()).0 };
    let age = format!("{} as reported {} ago", unit.unit, seconds(unit.state.age()));
    ui.add(Label::new(RichText::new(age).color(tone.color(Palette::current(ui)))).truncate());
    let mut guards: Vec<(Guard, Predicate)> = Guard::ALL.into_iter().zip(unit.guards(&shown.bounds)).collect();
    guards.sort_by_key(|(_, guard)| guard.holds);
    keys::scroll_next(ui, "list of guards");
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for (guard, predicate) in &guards {
            let plotted = plots::can_plot(shown, *guard);
            if row(ui, predicate, (current, plotted)).clicked() {
                view_state.plotted = Some(*guard);
                view_state.open = Some(Pane::Plots);
            }
        }
        if let Some(waits) = unit.waits_for(&shown.bounds) {
            ui.add(Label::new(RichText::new(format!("Waits for {waits}.")).weak()).wrap());
        }
    });
}

/// Draws a condition: whether it holds, its name, value and limit. A condition that is not current is worded in the
/// past. One that leads to a plot is a control.
pub(super) fn row(ui: &mut Ui, predicate: &Predicate, (current, leads): (bool, bool)) -> Response {
    let palette = Palette::current(ui);
    let (tone, shape, word) = match (predicate.holds, current) {
        (true, _) if !predicate.judged => (Tone::Weak, Shape::Ring, "not judged"),
        (true, true) => (Tone::Weak, Shape::Disc, "ok"),
        (true, false) => (Tone::Weak, Shape::Ring, "was ok"),
        (false, true) => (Tone::Caution, Shape::Diamond, "FAILS"),
        (false, false) => (Tone::Caution, Shape::Diamond, "FAILED"),
    };
    let color = match (predicate.holds, current) {
        (true, _) if !predicate.judged => palette.weak,
        (true, true) => palette.text,
        (true, false) => palette.weak,
        (false, _) => palette.caution,
    };
    let was = if current { "" } else { "was " };
    let value = predicate.measured();
    let value = if value.is_empty() { value } else { format!("{was}{value}") };
    let text = format!("GUARD {} {word} {value}", predicate.title);
    let row = ui.horizontal(|ui| {
        marks::shape(ui, shape, tone, word);
        let name = RichText::new(predicate.title).color(color);
        ui.label(if predicate.holds { name } else { name.strong().color(palette.caution) });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add(Label::new(RichText::new(value).color(color)).truncate());
        });
    });
    if !leads {
        row.response.widget_info(|| WidgetInfo::labeled(Role::ListItem, true, &text));
        return row.response.on_hover_text(text);
    }
    let response = ui.interact(row.response.rect, row.response.id.with("plot"), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &text));
    if response.has_focus() {
        keys::frame(ui, response.rect);
    }
    if response.gained_focus() {
        response.scroll_to_me(None);
    }
    response.on_hover_text(text)
}
