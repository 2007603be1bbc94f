//! Alarms: the most urgent first, with text, start, condition and acknowledgement; or the history, newest first.

use eframe::egui::{Align, Button, Checkbox, Label, Layout, RichText, Role, TextEdit, Ui, WidgetInfo};
use egui_extras::{Column, TableBuilder, TableRow};

use super::keys;
use super::marks::{self, Shape, Tone};
use super::theme::{Palette, ROW};
use super::view_state::ViewState;
use super::words;
use super::{Wish, command};
use crate::act::Act;
use crate::alarm::{self, Priority, ShownAlarm};
use crate::history::Past;
use crate::shown::Shown;

/// Longest text that is searched for, bytes.
const MAX_SEARCH: usize = 64;

/// The list, with its controls above.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    let open = |alarm: &&ShownAlarm| !alarm.acknowledged;
    let dead = command::dead(shown);
    ui.horizontal_wrapped(|ui| {
        let count = shown.alarms.iter().filter(open).count();
        let tone = if count > 0 { Tone::Caution } else { Tone::Weak };
        ui.label(RichText::new(format!("{count} not acknowledged")).color(tone.color(Palette::current(ui))));
        let none = (count == 0).then_some("every alarm is acknowledged");
        if command::able(ui, dead.or(none), Button::new("Acknowledge all")).clicked() {
            wishes.extend(shown.alarms.iter().filter(open).map(acknowledge));
        }
        ui.add_enabled(!view_state.past, Checkbox::new(&mut view_state.acknowledged, "acknowledged too"));
        ui.checkbox(&mut view_state.past, "history");
        ui.horizontal(|ui| {
            let label = ui.label(RichText::new("search").weak());
            let edit = TextEdit::singleline(&mut view_state.search).char_limit(MAX_SEARCH).desired_width(110.0);
            ui.add(edit).labelled_by(label.id);
        });
        if shown.alarms_more > 0 {
            let text = format!("{} more for which there was no room", shown.alarms_more);
            ui.label(RichText::new(text).color(Palette::current(ui).caution));
        }
    });
    let wanted = view_state.search.to_lowercase();
    if view_state.past {
        return happened(ui, shown, &wanted);
    }
    let fits = |alarm: &&ShownAlarm| {
        (view_state.acknowledged || !alarm.acknowledged) && alarm::words(&alarm.alarm).to_lowercase().contains(&wanted)
    };
    let listed: Vec<&ShownAlarm> = shown.alarms.iter().filter(fits).collect();
    if listed.is_empty() {
        ui.label(RichText::new(if shown.alarms.is_empty() { "No alarm." } else { "No alarm fits the search." }).weak());
        return;
    }
    keys::scroll_next(ui, "list of alarms");
    let table = table(ui).column(Column::exact(84.0)).column(Column::exact(84.0)).column(Column::exact(92.0));
    table.column(Column::remainder().clip(true)).body(|body| {
        body.rows(ROW, listed.len(), |mut row| {
            if let Some(of) = listed.get(row.index()) {
                cells(&mut row, shown, of, dead, wishes);
            }
        });
    });
}

fn table(ui: &mut Ui) -> TableBuilder<'_> {
    let table = TableBuilder::new(ui).striped(true).auto_shrink([false, false]);
    table.cell_layout(Layout::left_to_right(Align::Center))
}

/// The history, newest first.
pub(super) fn draw_history(ui: &mut Ui, _: &mut ViewState, shown: &Shown) {
    happened(ui, shown, "");
}

/// The history, newest first.
fn happened(ui: &mut Ui, shown: &Shown, wanted: &str) {
    if shown.past_more > 0 {
        let text = format!("{} older are no longer kept here; a recording has them", shown.past_more);
        ui.label(RichText::new(text).weak());
    }
    let fits = |past: &&Past| past.what.words().to_lowercase().contains(wanted);
    let listed: Vec<&Past> = shown.past.iter().rev().filter(fits).collect();
    if listed.is_empty() {
        ui.label(RichText::new("Nothing that fits has happened.").weak());
        return;
    }
    keys::scroll_next(ui, "list of what happened");
    table(ui).column(Column::exact(84.0)).column(Column::remainder().clip(true)).body(|body| {
        body.rows(ROW, listed.len(), |mut row| {
            let Some(past) = listed.get(row.index()) else { return };
            row.col(|ui| {
                ui.label(RichText::new(words::event_time(shown, past.at)).monospace());
            });
            row.col(|ui| {
                if let Some(priority) = past.what.priority() {
                    marks::shape(ui, sign_of(priority).1, Tone::Weak, priority.name());
                }
                ui.add(Label::new(past.what.words()).truncate());
            });
        });
    });
}

fn acknowledge(alarm: &ShownAlarm) -> Wish {
    Wish::Act(Act::Acknowledge(alarm.alarm, alarm.since))
}

/// Sign of a priority.
fn sign_of(priority: Priority) -> (Tone, Shape) {
    match priority {
        Priority::High => (Tone::Alarm, Shape::Square),
        Priority::Medium => (Tone::Caution, Shape::Diamond),
        Priority::Low => (Tone::Advice, Shape::Triangle),
    }
}

fn cells(row: &mut TableRow<'_, '_>, shown: &Shown, of: &ShownAlarm, dead: Option<&str>, wishes: &mut Vec<Wish>) {
    let (tone, shape) = sign_of(of.priority);
    // What was taken note of is no longer asked for.
    let tone = if of.acknowledged { Tone::Weak } else { tone };
    let text = alarm::words(&of.alarm);
    row.col(|ui| {
        marks::shape(ui, shape, tone, of.priority.name());
        ui.label(RichText::new(of.priority.name()).color(tone.color(Palette::current(ui))));
    });
    row.col(|ui| {
        let since = words::event_time(shown, of.since);
        ui.label(RichText::new(since).monospace());
    });
    row.col(|ui| {
        if of.acknowledged {
            ui.label(RichText::new("acknowledged").weak());
            return;
        }
        let button = command::able(ui, dead, Button::new("acknowledge").small());
        let enabled = dead.is_none() && ui.is_enabled();
        let named = || WidgetInfo::labeled(Role::Button, enabled, format!("acknowledge: {text}"));
        button.widget_info(named);
        if button.clicked() {
            wishes.push(acknowledge(of));
        }
    });
    row.col(|ui| {
        let color = if of.acknowledged { Palette::current(ui).weak } else { Palette::current(ui).strong };
        let prefix = if of.standing { "" } else { "over: " };
        ui.add(Label::new(RichText::new(format!("{prefix}{text}")).color(color)).truncate());
    });
}
