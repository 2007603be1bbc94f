//! Alarms: one block a cause, the most urgent first, with its consequences; below them the controls for all. History is
//! the other pane here.
//!
//! Which alarms there are, their causes and sounds is `crate::alarms`'s; this draws it.

use eframe::egui::{Align, Event, Frame, Key, Label, Layout, Panel, RichText, ScrollArea, TextEdit, Ui};
use egui_extras::{Column, TableBuilder};
use wire::mode::{Cause, Mode};

use super::alarm_block::{self, AlarmView, LINE, SIZE, SMALL, acknowledge, body, named, sign_of};
use super::marks::{self, Shape, Tone};
use super::theme::Palette;
use super::view_state::ViewState;
use super::{Wish, command, keys, words};
use crate::act::{Act, Alarm};
use crate::alarm::{LedTo, ShownGroup};
use crate::history::{Incident, Past};
use crate::shown::Shown;
use crate::sound::LIMIT_AN_HOUR;

/// Width up to which the controls for all have short words, points.
const SHORT: f32 = 390.0;
/// Least room for the rate beside them.
const LEAST_RATE: f32 = 60.0;
/// Newest events that are drawn below the alarms.
const EVENTS: usize = 3;
/// Longest text that is searched for, bytes.
const MAX_SEARCH: usize = 64;

/// How many alarms there were.
fn rate(shown: &Shown) -> String {
    let flood = if shown.alarm_flood { "FLOOD · " } else { "" };
    format!("{flood}{} in this hour · limit {LIMIT_AN_HOUR}", shown.alarms_in_hour)
}

/// The keys of the pane, which work from anywhere but a text: A acknowledges the first alarm, S silences.
pub(super) fn keys(ui: &Ui, shown: &Shown, wishes: &mut Vec<Wish>) {
    if command::dead(shown).is_some() || ui.ctx().text_edit_focused() {
        return;
    }
    let pressed = |key: Key| {
        ui.input(|input| {
            let plain = input.modifiers.is_none();
            let down =
                |event: &Event| matches!(event, Event::Key { key: of, pressed: true, repeat: false, .. } if *of == key);
            plain && input.events.iter().any(down)
        })
    };
    if pressed(Key::A) {
        wishes.extend(first_open(shown).map(acknowledge));
    }
    if pressed(Key::S) && shown.sound.motif.is_some() {
        wishes.push(Wish::Act(Act::Silence));
    }
}

/// The alarm that is to be dealt with first.
fn first_open(shown: &Shown) -> Option<&ShownGroup> {
    shown.alarms.iter().find(|group| group.open() && group.unfolded(shown.alarm_flood))
}

/// The alarms, and the controls for all of them.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    let view = &mut view_state.alarms;
    view.shelving = view.shelving.filter(|shelving| shown.alarms.iter().any(|group| alarm_block::is(group, *shelving)));
    Panel::bottom("alarm controls").resizable(false).frame(Frame::NONE).show_separator_line(false).show(ui, |ui| {
        foot(ui, view, shown, wishes);
    });
    // However low the pane is, no alarm lies on the controls.
    ScrollArea::vertical().auto_shrink([false, false]).min_scrolled_height(0.0).show(ui, |ui| {
        let first = first_open(shown).map(|group| group.cause);
        let (shelved, listed): (Vec<_>, Vec<_>) = shown.alarms.iter().partition(|group| group.shelved_until.is_some());
        let (open, folded): (Vec<_>, Vec<_>) = listed.into_iter().partition(|group| group.unfolded(shown.alarm_flood));
        if open.is_empty() && folded.is_empty() {
            none(ui, shown);
        }
        for group in open {
            alarm_block::draw(ui, view, shown, group, first == Some(group.cause), wishes);
        }
        if !folded.is_empty() {
            let text = format!("{} less urgent alarms, folded away: more come than can be read", folded.len());
            ui.label(RichText::new(text).size(SIZE).color(Palette::current(ui).caution));
        }
        if view.shelved {
            shelved.into_iter().for_each(|group| alarm_block::draw(ui, view, shown, group, false, wishes));
        }
        if shown.alarms_more > 0 {
            let text = format!("{} more for which there was no room", shown.alarms_more);
            ui.label(RichText::new(text).size(SIZE).color(Palette::current(ui).caution));
        }
        newest(ui, shown);
    });
}

fn none(ui: &mut Ui, shown: &Shown) {
    ui.horizontal(|ui| {
        marks::shape(ui, Shape::Disc, Tone::Normal, "no alarm");
        let text = if shown.alarms_in_hour == 0 { "No alarm in this hour." } else { "No alarm." };
        ui.label(RichText::new(text).size(SIZE));
    });
    ui.label(RichText::new("What you order, and what a unit drives past, is in History.").size(SIZE).weak());
}

/// The controls for all alarms, at the pane's bottom whatever is above.
fn foot(ui: &mut Ui, view: &mut AlarmView, shown: &Shown, wishes: &mut Vec<Wish>) {
    let dead = command::dead(shown);
    ui.add_space(4.0);
    let short = ui.available_width() < SHORT;
    ui.horizontal(|ui| {
        let open: Vec<&ShownGroup> = shown.alarms.iter().filter(|group| group.open()).collect();
        let locked = dead.or(open.is_empty().then_some("every alarm is acknowledged"));
        let button = body(ui, locked, if short { "Ack all" } else { "Acknowledge all" });
        if named(ui, locked, button, "Acknowledge all").clicked() {
            wishes.extend(open.into_iter().map(acknowledge));
        }
        let text = shown.sound.silenced_until.map_or("Silence sound 2 min".to_owned(), |until| {
            format!("Sound silenced, {} left", words::left(until.since(shown.at)))
        });
        let locked = dead.or(shown.sound.motif.is_none().then_some("no alarm sounds"));
        let seen = if short { "Silence" } else { &text };
        let button = body(ui, locked, seen).shortcut_text(RichText::new("S").monospace().size(SMALL));
        if named(ui, locked, button, &text).clicked() {
            wishes.push(Wish::Act(Act::Silence));
        }
        let shelved = shown.alarms.iter().filter(|group| group.shelved_until.is_some()).count();
        let text = format!("Shelved: {shelved}");
        let seen = if short { format!("Shelf: {shelved}") } else { text.clone() };
        let nothing = (shelved == 0).then_some("no alarm is shelved");
        let button = body(ui, nothing, &seen).selected(view.shelved);
        if named(ui, nothing, button, &text).clicked() {
            view.shelved = !view.shelved;
        }
        let bell = if view.bell { "" } else { " · no bell here" };
        let text = format!("{}{bell}", rate(shown));
        if ui.available_width() > LEAST_RATE {
            ui.add(Label::new(RichText::new(text).size(SMALL).weak()).truncate());
        }
    });
}

/// The newest events that are no alarms, below them.
fn newest(ui: &mut Ui, shown: &Shown) {
    let event = |past: &&Past| {
        past.what.priority().is_none()
            && !is_of_alarm(&past.what)
            && !shown.alarms.iter().any(|of| led_to(of, &past.what))
    };
    let newest: Vec<&Past> = shown.past.iter().rev().filter(event).take(EVENTS).collect();
    if newest.is_empty() {
        return;
    }
    ui.separator();
    for past in newest {
        ui.horizontal(|ui| {
            ui.label(RichText::new(words::event_time(shown, past.at)).monospace().size(SMALL).weak());
            let none = matches!(past.what, Incident::TrackEnded(..) | Incident::Ordered(..));
            let text = format!("{}{}", past.what.words(&shown.bounds), if none { " (no alarm)" } else { "" });
            ui.add(Label::new(RichText::new(text).size(SIZE).weak()).truncate());
        });
    }
}

/// True if it is part of an alarm's life, or a mode that an alarm tells: those are drawn above.
fn is_of_alarm(what: &Incident) -> bool {
    match what {
        Incident::Mode(_, mode, cause, _) => {
            matches!(mode, Mode::HoldSafe | Mode::Degraded) && *cause != Cause::Operator
        }
        Incident::Raised(..)
        | Incident::Over(..)
        | Incident::Acknowledged(..)
        | Incident::Shelved(..)
        | Incident::Returned(..)
        | Incident::Silenced => true,
        Incident::Ordered(..) | Incident::TrackEnded(..) | Incident::Stale(..) | Incident::Link(..) => false,
    }
}

/// True if an alarm led to it: it stands above, and is no event beside it.
fn led_to(group: &ShownGroup, what: &Incident) -> bool {
    let led = |wanted: LedTo| group.led_to.iter().any(|(_, led)| *led == wanted);
    match *what {
        Incident::Mode(unit, mode, ..) => led(LedTo::Mode(unit, mode)),
        Incident::TrackEnded(unit, track, class) => led(LedTo::TrackEnded(unit, track, class)),
        Incident::Link(peer, false) => led(LedTo::LinkDown(peer)),
        Incident::Stale(unit, true) => group.cause == Alarm::Silent(unit) || led(LedTo::Silent(unit)),
        Incident::Ordered(..)
        | Incident::Link(_, true)
        | Incident::Stale(_, false)
        | Incident::Raised(..)
        | Incident::Over(..)
        | Incident::Acknowledged(..)
        | Incident::Shelved(..)
        | Incident::Returned(..)
        | Incident::Silenced => false,
    }
}

/// The history, newest first, and a search in it.
pub(super) fn draw_history(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(RichText::new("Search").size(SIZE).weak());
        let edit = TextEdit::singleline(&mut view_state.search).char_limit(MAX_SEARCH).desired_width(150.0);
        ui.add(edit).labelled_by(label.id);
        if shown.past_more > 0 {
            let text = format!("{} older are no longer kept here; a recording has them", shown.past_more);
            ui.label(RichText::new(text).size(SIZE).weak());
        }
    });
    let wanted = view_state.search.to_lowercase();
    let fits = |past: &&Past| past.what.words(&shown.bounds).to_lowercase().contains(&wanted);
    let listed: Vec<&Past> = shown.past.iter().rev().filter(fits).collect();
    if listed.is_empty() {
        ui.label(RichText::new("Nothing that fits has happened.").size(SIZE).weak());
        return;
    }
    keys::scroll_next(ui, "list of what happened");
    let table = TableBuilder::new(ui).striped(true).auto_shrink([false, false]);
    let table = table.cell_layout(Layout::left_to_right(Align::Center));
    table.column(Column::exact(96.0)).column(Column::remainder().clip(true)).body(|body| {
        body.rows(LINE, listed.len(), |mut row| {
            let Some(past) = listed.get(row.index()) else { return };
            row.col(|ui| {
                ui.label(RichText::new(words::event_time(shown, past.at)).monospace().size(SMALL));
            });
            row.col(|ui| {
                if let Some(priority) = past.what.priority() {
                    marks::shape(ui, sign_of(priority).1, Tone::Weak, priority.name());
                }
                ui.add(Label::new(RichText::new(past.what.words(&shown.bounds)).size(SIZE)).truncate());
            });
        });
    });
}
