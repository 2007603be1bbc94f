//! Alarms: one block a cause, the most urgent first, with what it led to; below them the controls for all. History is
//! the other pane here.
//!
//! Which alarms there are, what they are about and whether they sound is `crate::alarms`'s; this draws it.

use eframe::egui::{
    Align, Button, Frame, Key, Label, Layout, Panel, Rect, Response, RichText, Role, ScrollArea, Stroke, StrokeKind,
    TextEdit, Ui, WidgetInfo, vec2,
};
use egui_extras::{Column, TableBuilder};
use wire::codec::Text;

use super::keys;
use super::marks::{self, Shape, Tone};
use super::theme::Palette;
use super::view_state::ViewState;
use super::words;
use super::{Wish, command};
use crate::act::{Act, Alarm, Shelf};
use crate::alarm::{LedTo, Priority, ShownGroup};
use crate::history::{Incident, Past};
use crate::shown::Shown;
use crate::sound::LIMIT_AN_HOUR;
use wire::time::Instant;

/// Size of what is to be read or pressed, points.
const SIZE: f32 = 15.0;
/// Size of times and keys, points.
const SMALL: f32 = 13.0;
/// Height of a line of what an alarm led to, points.
const LINE: f32 = 22.0;
/// Width from which buttons have whole words, points.
const WIDE: f32 = 600.0;
/// Width up to which the controls for all have short words.
const SHORT: f32 = 390.0;
/// Least room for the rate beside them.
const LEAST_RATE: f32 = 60.0;
/// Width of the bar beside an alarm, points.
const BAR: f32 = 5.0;
/// Newest events that are drawn below the alarms: what was none.
const EVENTS: usize = 3;
/// Longest text that is searched for, bytes.
const MAX_SEARCH: usize = 64;
/// Longest reason, bytes, as the act carries it.
const MAX_REASON: usize = 64;

/// What the pane keeps between two pictures.
#[derive(Debug, Default)]
pub(super) struct AlarmView {
    /// The alarm that is about to be put aside.
    shelving: Option<(Alarm, Instant)>,
    /// The typed reason for it.
    reason: String,
    /// True if alarms that were put aside are listed.
    shelved: bool,
    /// True if a bell rings where this window is.
    pub(super) bell: bool,
}

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
            let down = |event: &eframe::egui::Event| {
                matches!(event, eframe::egui::Event::Key { key: of, pressed: true, repeat: false, .. } if *of == key)
            };
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

fn acknowledge(group: &ShownGroup) -> Wish {
    Wish::Act(Act::Acknowledge(group.cause, group.since))
}

/// The alarms, and what can be done about all of them.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    let view = &mut view_state.alarms;
    view.shelving = view.shelving.filter(|shelving| shown.alarms.iter().any(|group| is(group, *shelving)));
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
            block(ui, view, shown, group, first == Some(group.cause), wishes);
        }
        if !folded.is_empty() {
            let text = format!("{} less urgent alarms, folded away: more come than can be read", folded.len());
            ui.label(RichText::new(text).size(SIZE).color(Palette::current(ui).caution));
        }
        if view.shelved {
            shelved.into_iter().for_each(|group| block(ui, view, shown, group, false, wishes));
        }
        if shown.alarms_more > 0 {
            let text = format!("{} more for which there was no room", shown.alarms_more);
            ui.label(RichText::new(text).size(SIZE).color(Palette::current(ui).caution));
        }
        newest(ui, shown);
    });
}

fn is(group: &ShownGroup, (cause, since): (Alarm, Instant)) -> bool {
    group.cause == cause && group.since == since
}

fn none(ui: &mut Ui, shown: &Shown) {
    ui.horizontal(|ui| {
        marks::shape(ui, Shape::Disc, Tone::Normal, "no alarm");
        let text = if shown.alarms_in_hour == 0 { "No alarm in this hour." } else { "No alarm." };
        ui.label(RichText::new(text).size(SIZE));
    });
    ui.label(RichText::new("What you order, and what a unit drives past, is in History.").size(SIZE).weak());
}

/// Sign of a priority.
pub(super) fn sign_of(priority: Priority) -> (Tone, Shape) {
    match priority {
        Priority::High => (Tone::Alarm, Shape::Square),
        Priority::Medium => (Tone::Caution, Shape::Diamond),
        Priority::Low => (Tone::Advice, Shape::Triangle),
    }
}

/// One alarm: bar, priority and cause, its buttons, and what it led to.
fn block(ui: &mut Ui, view: &mut AlarmView, shown: &Shown, group: &ShownGroup, first: bool, wishes: &mut Vec<Wish>) {
    // What no longer asks for an act is weak; what does has its colour although its cause is over.
    let (tone, shape) = sign_of(group.priority);
    let tone = if group.standing || !group.acknowledged { tone } else { Tone::Weak };
    let inner = ui.scope(|ui| {
        head(ui, view, shown, group, (tone, shape), first, wishes);
        line(ui, shown, group.first, &state_of(shown, group));
        for (at, led_to) in &group.led_to {
            line(ui, shown, *at, &format!("led to: {}", led_to.words()));
        }
        if group.led_more > 0 {
            indented(ui, |ui| {
                ui.label(RichText::new(format!("led to {} more", group.led_more)).size(SIZE).weak());
            });
        }
        if view.shelving.is_some_and(|shelving| is(group, shelving)) {
            shelf(ui, view, group, wishes);
        }
    });
    let rect = inner.response.rect;
    let bar = Rect::from_min_size(rect.min, vec2(BAR, rect.height()));
    let color = tone.color(Palette::current(ui));
    if group.open() {
        ui.painter().rect_filled(bar, 0.0, color);
    } else {
        ui.painter().rect_stroke(bar, 0.0, Stroke::new(1.0, color), StrokeKind::Inside);
    }
    ui.add_space(6.0);
}

fn head(
    ui: &mut Ui,
    view: &mut AlarmView,
    shown: &Shown,
    group: &ShownGroup,
    (tone, shape): (Tone, Shape),
    first: bool,
    wishes: &mut Vec<Wish>,
) {
    let (text, wide) = (group.words(), ui.available_width() >= WIDE);
    let palette = Palette::current(ui);
    ui.horizontal(|ui| {
        ui.add_space(BAR + 6.0);
        marks::shape(ui, shape, tone, group.priority.name());
        ui.label(RichText::new(group.priority.name()).size(SIZE).strong().color(tone.color(palette)));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            buttons(ui, view, shown, group, (first, wide), wishes);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let color = if group.standing || group.open() { palette.strong } else { palette.weak };
                ui.add(Label::new(RichText::new(text).size(SIZE).strong().color(color)).truncate());
            });
        });
    });
}

/// Buttons of an alarm, from the right.
fn buttons(
    ui: &mut Ui,
    view: &mut AlarmView,
    shown: &Shown,
    group: &ShownGroup,
    (first, wide): (bool, bool),
    wishes: &mut Vec<Wish>,
) {
    let (dead, cause) = (command::dead(shown), group.words());
    let holds = group.hold_stands.then_some("HOLD_SAFE stands: its alarm cannot be shelved");
    let over = (!group.standing).then_some("it is over");
    let put_aside = group.shelved_until.map(|_| "it is shelved");
    let locked = dead.or(holds).or(over).or(put_aside);
    let response = named(ui, locked, body(if wide { "Shelve ..." } else { "Shelve" }), &format!("Shelve: {cause}"));
    if response.clicked() {
        let this = (group.cause, group.since);
        view.shelving = (view.shelving != Some(this)).then_some(this);
        view.reason.clear();
    }
    let noted = group.acknowledged.then_some("it is acknowledged");
    let mut button = body(if wide { "Acknowledge" } else { "Ack" });
    if first {
        button = button.shortcut_text(RichText::new("A").monospace().size(SMALL));
    }
    if named(ui, dead.or(noted), button, &format!("Acknowledge: {cause}")).clicked() {
        wishes.push(acknowledge(group));
    }
}

fn body(text: &str) -> Button<'_> {
    Button::new(RichText::new(text).size(SIZE))
}

/// A button with a name of its own, or a disabled one with the reason.
fn named(ui: &mut Ui, locked: Option<&str>, button: Button<'_>, name: &str) -> Response {
    let response = command::able(ui, locked, button);
    let enabled = locked.is_none() && ui.is_enabled();
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    response
}

/// When it was raised, and what has become of it.
fn state_of(shown: &Shown, group: &ShownGroup) -> String {
    let mut words = vec!["raised".to_owned()];
    if group.times > 1 {
        words.push(format!("{} times", group.times));
    }
    if !group.standing {
        words.push("over".to_owned());
    }
    if group.acknowledged {
        words.push("acknowledged".to_owned());
    }
    if let Some(until) = group.shelved_until {
        words.push(format!("shelved, back in {}", words::left(until.since(shown.at))));
    }
    words.join(" · ")
}

fn line(ui: &mut Ui, shown: &Shown, at: Instant, text: &str) {
    indented(ui, |ui| {
        ui.set_min_height(LINE - ui.spacing().item_spacing.y);
        ui.label(RichText::new(words::event_time(shown, at)).monospace().size(SMALL).weak());
        ui.add(Label::new(RichText::new(text).size(SIZE)).truncate());
    });
}

fn indented(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        ui.add_space(BAR + 26.0);
        add(ui);
    });
}

/// A reason, and for how long the alarm is put aside.
fn shelf(ui: &mut Ui, view: &mut AlarmView, group: &ShownGroup, wishes: &mut Vec<Wish>) {
    let mut done = false;
    ui.horizontal_wrapped(|ui| {
        ui.add_space(BAR + 26.0);
        let label = ui.label(RichText::new("Reason").size(SIZE));
        let edit = TextEdit::singleline(&mut view.reason).hint_text("required").char_limit(MAX_REASON);
        ui.add(edit.desired_width(150.0)).labelled_by(label.id);
        // What is seen is what will be recorded.
        view.reason = Text::<MAX_REASON>::new(&view.reason).as_str().to_owned();
        let missing = view.reason.trim().is_empty().then_some("no reason is given yet");
        for shelf in Shelf::ALL {
            let (minutes, reason) = (shelf.minutes(), Text::new(view.reason.trim()));
            let name = format!("Shelve for {minutes} min: {}", group.words());
            if named(ui, missing, body(&format!("{minutes} min")), &name).clicked() {
                wishes.push(Wish::Act(Act::Shelve(group.cause, group.since, shelf, reason)));
                done = true;
            }
        }
        done |= named(ui, None, body("Cancel"), &format!("Do not shelve: {}", group.words())).clicked();
    });
    if done {
        view.shelving = None;
        view.reason.clear();
    }
}

/// The controls for all alarms, at the pane's bottom whatever is above.
fn foot(ui: &mut Ui, view: &mut AlarmView, shown: &Shown, wishes: &mut Vec<Wish>) {
    let dead = command::dead(shown);
    ui.add_space(4.0);
    let short = ui.available_width() < SHORT;
    ui.horizontal(|ui| {
        let open: Vec<&ShownGroup> = shown.alarms.iter().filter(|group| group.open()).collect();
        let none = open.is_empty().then_some("every alarm is acknowledged");
        if named(ui, dead.or(none), body(if short { "Ack all" } else { "Acknowledge all" }), "Acknowledge all")
            .clicked()
        {
            wishes.extend(open.into_iter().map(acknowledge));
        }
        let text = shown.sound.silenced_until.map_or("Silence sound 2 min".to_owned(), |until| {
            format!("Sound silenced, {} left", words::left(until.since(shown.at)))
        });
        let quiet = shown.sound.motif.is_none().then_some("no alarm sounds");
        let button =
            body(if short { "Silence" } else { &text }).shortcut_text(RichText::new("S").monospace().size(SMALL));
        if named(ui, dead.or(quiet), button, &text).clicked() {
            wishes.push(Wish::Act(Act::Silence));
        }
        let shelved = shown.alarms.iter().filter(|group| group.shelved_until.is_some()).count();
        let text = format!("Shelved: {shelved}");
        let seen = if short { format!("Shelf: {shelved}") } else { text.clone() };
        let button = Button::selectable(view.shelved, RichText::new(seen).size(SIZE));
        let nothing = (shelved == 0).then_some("no alarm is shelved");
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
            let text = format!("{} (no alarm)", past.what.words());
            ui.add(Label::new(RichText::new(text).size(SIZE).weak()).truncate());
        });
    }
}

/// True if it is part of an alarm's life, which is drawn above.
fn is_of_alarm(what: &Incident) -> bool {
    matches!(
        what,
        Incident::Raised(..)
            | Incident::Over(..)
            | Incident::Acknowledged(..)
            | Incident::Shelved(..)
            | Incident::Returned(..)
            | Incident::Silenced
    )
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
    let fits = |past: &&Past| past.what.words().to_lowercase().contains(&wanted);
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
                ui.add(Label::new(RichText::new(past.what.words()).size(SIZE)).truncate());
            });
        });
    });
}
