//! One alarm of the alarms pane: its cause, state, consequences and controls.

use eframe::egui::{Align, Button, Label, Layout, Rect, Response, RichText, Role, Stroke, StrokeKind, TextEdit, Ui};
use eframe::egui::{WidgetInfo, vec2};
use wire::codec::Text;
use wire::time::Instant;

use super::marks::{self, Shape, Tone};
use super::theme::Palette;
use super::{Wish, command, words};
use crate::act::{Act, Alarm, Shelf};
use crate::alarm::{Priority, ShownGroup};
use crate::shown::Shown;

/// Size of texts to be read or pressed, points.
pub(super) const SIZE: f32 = 15.0;
/// Size of times and keys, points.
pub(super) const SMALL: f32 = 13.0;
/// Height of a line of a consequence, points.
pub(super) const LINE: f32 = 22.0;
/// Width from which buttons have whole words, points.
const WIDE: f32 = 600.0;
/// Width of the bar beside an alarm, points.
const BAR: f32 = 5.0;
/// Longest reason, bytes, as the act carries it.
const MAX_REASON: usize = 64;

/// State of the pane between two pictures.
#[derive(Debug, Default)]
pub(super) struct AlarmView {
    /// The alarm that is about to be put aside.
    pub(super) shelving: Option<(Alarm, Instant)>,
    /// The typed reason for it.
    pub(super) reason: String,
    /// True if alarms that were put aside are listed.
    pub(super) shelved: bool,
    /// True if a bell rings where this window is.
    pub(super) bell: bool,
}

/// Sign of a priority.
pub(super) fn sign_of(priority: Priority) -> (Tone, Shape) {
    match priority {
        Priority::High => (Tone::Alarm, Shape::Square),
        Priority::Medium => (Tone::Caution, Shape::Diamond),
        Priority::Low => (Tone::Advice, Shape::Triangle),
    }
}

pub(super) fn acknowledge(group: &ShownGroup) -> Wish {
    Wish::Act(Act::Acknowledge(group.cause, group.since))
}

pub(super) fn is(group: &ShownGroup, (cause, since): (Alarm, Instant)) -> bool {
    group.cause == cause && group.since == since
}

/// One alarm: bar, priority and cause, its buttons, and its consequences.
pub(super) fn draw(
    ui: &mut Ui,
    view: &mut AlarmView,
    shown: &Shown,
    group: &ShownGroup,
    first: bool,
    wishes: &mut Vec<Wish>,
) {
    // What no longer asks for an act is weak; what does has its colour although its cause is over.
    let (tone, shape) = sign_of(group.priority);
    let tone = if group.standing || !group.acknowledged { tone } else { Tone::Weak };
    let inner = ui.scope(|ui| {
        head(ui, view, shown, group, (tone, shape), first, wishes);
        line(ui, shown, group.first, &state_of(shown, group));
        for (at, led_to) in &group.led_to {
            line(ui, shown, *at, &led_to.line());
        }
        if group.led_more > 0 {
            indented(ui, |ui| {
                ui.label(RichText::new(format!("led to: {} more", group.led_more)).size(SIZE).weak());
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
    let button = body(ui, locked, if wide { "Shelve ..." } else { "Shelve" });
    if named(ui, locked, button, &format!("Shelve: {cause}")).clicked() {
        let this = (group.cause, group.since);
        view.shelving = (view.shelving != Some(this)).then_some(this);
        view.reason.clear();
    }
    let locked = dead.or(group.acknowledged.then_some("it is acknowledged"));
    let mut button = body(ui, locked, if wide { "Acknowledge" } else { "Ack" });
    if first {
        button = button.shortcut_text(RichText::new("A").monospace().size(SMALL));
    }
    if named(ui, locked, button, &format!("Acknowledge: {cause}")).clicked() {
        wishes.push(acknowledge(group));
    }
}

/// A control's text and looks: one that cannot be pressed now is weak.
pub(super) fn body<'t>(ui: &Ui, locked: Option<&str>, text: &str) -> Button<'t> {
    let palette = Palette::current(ui);
    let (ink, edge) = if locked.is_some() { (palette.weak, palette.line) } else { (palette.text, palette.edge) };
    Button::new(RichText::new(text).size(SIZE).color(ink)).stroke(Stroke::new(1.0, edge))
}

/// A button with a name of its own, or a disabled one with the reason.
pub(super) fn named(ui: &mut Ui, locked: Option<&str>, button: Button<'_>, name: &str) -> Response {
    let response = command::able(ui, locked, button);
    let enabled = locked.is_none() && ui.is_enabled();
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    response
}

/// Time at which it was raised, and its state.
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
            let button = body(ui, missing, &format!("{minutes} min"));
            if named(ui, missing, button, &name).clicked() {
                wishes.push(Wish::Act(Act::Shelve(group.cause, group.since, shelf, reason)));
                done = true;
            }
        }
        let cancel = body(ui, None, "Cancel");
        done |= named(ui, None, cancel, &format!("Do not shelve: {}", group.words())).clicked();
    });
    if done {
        view.shelving = None;
        view.reason.clear();
    }
}
