//! The command column. Towards safe takes one step, from every state of the window; away from safe takes three: choose,
//! arm, confirm with a reason. It never covers the rest: a confirmation is in the column.
//!
//! Permission is no decision of this view: it draws the interlocks and the prepared order as the model has them.

use eframe::egui::{
    self, Align2, Button, FontId, Frame, Key, Label, Layout, Margin, Modifiers, RadioButton, Response, RichText, Role,
    ScrollArea, Stroke, TextEdit, Ui, Widget, WidgetInfo, vec2,
};
use wire::codec::Text;
use wire::command::CommandKind;
use wire::id::UnitId;
use wire::mode::Mode;

use super::marks::{self, Shape, Tone};
use super::theme::{BODY, Palette};
use super::view_state::ViewState;
use super::words;
use super::{Wish, given, images, settings};
use crate::act::{Act, Order, Prepared};
use crate::interlock::Predicate;
use crate::shown::Shown;
use crate::silence::Plan;
use crate::wording::lasting;

/// Width of the column in a window of this width, points.
pub(super) fn width(window: f32) -> f32 {
    match window {
        w if w < 1440.0 => 262.0,
        w if w < 1920.0 => 284.0,
        _ => 324.0,
    }
}

/// Height of HOLD, points.
const HOLD: f32 = 74.0;
/// Longest reason, bytes, as the intent carries it.
const MAX_REASON: usize = 64;

/// The keys that command, read before any control sees them: so HOLD works during typing.
pub(super) fn keys(ui: &Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    for (key, modifiers) in pressed(ui) {
        match (key, modifiers.shift) {
            (Key::F1 | Key::F9 | Key::Escape, _) if dead(shown).is_some() => {}
            (Key::F1, false) => wishes.push(hold(view_state.unit)),
            (Key::F1, true) => wishes.extend(units(shown).map(hold)),
            (Key::F9, _) => wishes.extend(shown.prepared.and_then(|prepared| confirm(view_state, &prepared))),
            (Key::F2, _) => super::units::step(view_state, shown, 1),
            (Key::F3, _) => view_state.choose(shown.worst_first().first().map_or(view_state.unit, |(unit, _)| *unit)),
            (Key::Escape, _) if shown.prepared.is_some() => withdraw(view_state, wishes),
            _ => {}
        }
    }
}

/// HOLD before there is a picture: the key works from the window's first moment. Whether it may is the core's to judge.
pub(super) fn keys_unseen(ui: &Ui, unit: UnitId) -> Vec<Wish> {
    let held = pressed(ui).into_iter().filter(|(key, _)| *key == Key::F1);
    held.map(|_| hold(unit)).collect()
}

/// Keys that went down in this frame. One that is held down repeats itself; that is no further press.
fn pressed(ui: &Ui) -> Vec<(Key, Modifiers)> {
    let press = |event: &egui::Event| {
        let egui::Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event else { return None };
        Some((*key, *modifiers))
    };
    ui.input(|input| input.events.iter().filter_map(press).collect())
}

/// Takes repeated Enter and Space out of this frame: a control that has the focus would be pressed again by each.
pub(super) fn no_repeats(ui: &Ui) {
    let repeated = |event: &egui::Event| {
        matches!(event, egui::Event::Key { key: Key::Enter | Key::Space, pressed: true, repeat: true, .. })
    };
    ui.input_mut(|input| input.events.retain(|event| !repeated(event)));
}

/// Draws the column of commands.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    towards_safe(ui, view_state, shown, wishes);
    ui.add_space(2.0);
    ui.separator();
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        match &shown.prepared {
            Some(prepared) => confirmation(ui, view_state, shown, prepared, wishes),
            None => {
                next(ui, view_state, shown);
                choice(ui, view_state, shown, wishes);
            }
        }
        ui.separator();
        given::draw(ui, shown);
        if shown.prepared.is_none() {
            revocations(ui, view_state, shown, wishes);
        }
    });
}

fn hold(unit: UnitId) -> Wish {
    Wish::Act(Act::Now(Order::Command(unit, CommandKind::Hold)))
}

fn units(shown: &Shown) -> impl Iterator<Item = UnitId> {
    shown.units.iter().map(|unit| unit.unit).chain(shown.silent.iter().copied())
}

fn confirm(view_state: &mut ViewState, prepared: &Prepared) -> Option<Wish> {
    let reason = view_state.reason.trim();
    if reason.is_empty() {
        return None;
    }
    let act = Act::Confirm(prepared.order, Text::new(reason));
    view_state.put_down();
    Some(Wish::Act(act))
}

fn withdraw(view_state: &mut ViewState, wishes: &mut Vec<Wish>) {
    view_state.put_down();
    wishes.push(Wish::Act(Act::Withdraw));
}

/// Reason for which the console cannot command, if any. It locks the whole column, and acknowledgements, and is named
/// once, below HOLD.
pub(super) fn dead(shown: &Shown) -> Option<&'static str> {
    if shown.marks.replay {
        Some("REPLAY: a recording takes no commands")
    } else if shown.role == crate::act::Role::View {
        Some("ROLE VIEW: this console takes no commands")
    } else {
        None
    }
}

fn towards_safe(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    let palette = Palette::current(ui);
    let dead = dead(shown);
    hold_button(ui, view_state, shown, wishes);
    let [wider, rest] = [0.62, 0.38].map(|share| vec2((ui.available_width() - 6.0) * share, 34.0));
    let small = |text: String| match dead {
        None => Button::new(text),
        Some(_) => lifeless(RichText::new(text), palette),
    };
    ui.horizontal(|ui| {
        if able(ui, dead, small("HOLD all  Shift F1".to_owned()).min_size(wider)).clicked() {
            wishes.extend(units(shown).map(hold));
        }
        let response = able(ui, dead, small("Disarm".to_owned()).min_size(rest));
        let name = format!("Disarm {}", view_state.unit);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, dead.is_none(), &name));
        if response.clicked() {
            wishes.push(Wish::Act(Act::Now(Order::Command(view_state.unit, CommandKind::Disarm))));
        }
    });
    // Below, so that HOLD has its place in every state.
    if let Some(reason) = dead {
        ui.label(RichText::new(reason).color(palette.caution).strong());
    }
}

/// HOLD: one block with the largest words of the column, and below them its key and its reach.
fn hold_button(ui: &mut Ui, view_state: &ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    let palette = Palette::current(ui);
    let dead = dead(shown);
    let reach = match shown.unit(view_state.unit).map(crate::shown::ShownUnit::plan) {
        Some(Plan::Silence(Some(next))) => format!("F1 · goes out in {}", lasting(next)),
        Some(Plan::Silence(None)) => "F1 · no contact is planned".to_owned(),
        _ => "F1 · works from anywhere".to_owned(),
    };
    let ink = if dead.is_some() { palette.weak } else { palette.on_block };
    let (fill, edge) = if dead.is_some() { (palette.pane, palette.faint) } else { (palette.text, palette.line) };
    let text = format!("HOLD {}   F1", view_state.unit);
    let button = Button::new("").fill(fill).stroke(Stroke::new(1.0, edge));
    let response = able(ui, dead, button.min_size(vec2(ui.available_width(), HOLD)));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, dead.is_none(), &text));
    let (middle, painter) = (response.rect.center(), ui.painter());
    let words = format!("HOLD {}", view_state.unit);
    let drawn = marks::bold(painter, middle - vec2(0.0, 10.0), Align2::CENTER_CENTER, &words, 28.0, ink);
    painter.text(middle + vec2(0.0, 20.0), Align2::CENTER_CENTER, reach, FontId::proportional(BODY), ink);
    if dead.is_some() {
        painter.hline(drawn.x_range(), drawn.center().y, Stroke::new(1.5, ink));
    }
    if response.clicked() {
        wishes.push(hold(view_state.unit));
    }
}

/// A button that takes no press in this window: struck out, and no block that rises from the pane.
fn lifeless<'a>(text: RichText, palette: &Palette) -> Button<'a> {
    Button::new(text.color(palette.weak).strikethrough()).fill(palette.pane).stroke(Stroke::new(1.0, palette.faint))
}

/// A control, or a disabled one with the reason.
pub(super) fn able(ui: &mut Ui, dead: Option<&str>, control: impl Widget) -> Response {
    let response = ui.add_enabled(dead.is_none(), control);
    match dead {
        None => response,
        Some(why) => response.on_disabled_hover_text(format!("disabled: {why}")),
    }
}

/// A button as wide as the column; whether it was pressed.
fn wide(ui: &mut Ui, dead: Option<&str>, height: f32, button: Button<'_>) -> bool {
    let size = vec2(ui.available_width(), height);
    let add = |ui: &mut Ui| able(ui, dead, button.min_size(size)).clicked();
    ui.allocate_ui_with_layout(size, Layout::centered_and_justified(egui::Direction::LeftToRight), add).inner
}

/// Orders away from safe for the chosen unit, on the chosen track.
fn orders(view_state: &ViewState, shown: &Shown) -> Vec<Order> {
    let mut kinds = vec![CommandKind::Configure(view_state.settings(shown)), CommandKind::Enable, CommandKind::Resume];
    if let Some((_, track)) = view_state.track.filter(|(unit, _)| *unit == view_state.unit) {
        kinds.push(CommandKind::Arm(track));
    }
    let held = shown.unit(view_state.unit).and_then(|unit| unit.state.fresh()).and_then(|state| state.authority);
    kinds.extend(held.map(|held| CommandKind::Confirm(held.track)));
    kinds.into_iter().map(|kind| Order::Command(view_state.unit, kind)).collect()
}

/// The order that the banner's next step asks for, if it asks for one, with the first condition that it waits for.
fn next(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    heading(ui, "Next for you");
    let palette = *Palette::current(ui);
    let order = due(view_state, shown).filter(|_| dead(shown).is_none());
    let frame =
        Frame::new().fill(palette.raised).stroke(Stroke::new(1.0, palette.edge)).inner_margin(Margin::symmetric(10, 8));
    let answer = shown.banner(view_state.unit).next;
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        let Some(order) = order else {
            ui.add(Label::new(RichText::new(&answer.headline).size(18.0).color(palette.strong)).wrap());
            for (_, detail) in &answer.details {
                ui.add(Label::new(RichText::new(detail).color(palette.text)).wrap());
            }
            return;
        };
        let chosen = view_state.order == Some(order);
        let text = RichText::new(words::capital(&words::order(&order))).size(18.0).color(palette.strong);
        if able(ui, dead(shown), Button::selectable(chosen, text)).clicked() {
            view_state.order = Some(order);
        }
        let interlocks = shown.interlocks(&order);
        let Some(failing) = interlocks.iter().find(|predicate| !predicate.holds) else {
            ui.label(RichText::new("possible now: arm, then confirm").color(palette.text));
            return;
        };
        ui.horizontal(|ui| {
            marks::shape(ui, Shape::Diamond, Tone::Caution, "not yet");
            let text = format!("not yet: {}", why_not(failing));
            ui.add(Label::new(RichText::new(text).color(palette.caution)).wrap());
        });
    });
    ui.add_space(6.0);
}

/// The order that the unit's mode waits for; none in a recording.
fn due(view_state: &ViewState, shown: &Shown) -> Option<Order> {
    if shown.marks.replay {
        return None;
    }
    let unit = shown.unit(view_state.unit)?;
    let state = unit.state.fresh()?;
    let kind = match state.mode {
        Mode::Idle => CommandKind::Enable,
        Mode::HoldSafe => CommandKind::Resume,
        Mode::PrepareToAct => CommandKind::Confirm(state.authority?.track),
        Mode::Ready | Mode::Degraded => return None,
    };
    Some(Order::Command(view_state.unit, kind))
}

/// A condition that does not hold, in words that follow *not yet*.
fn why_not(failing: &Predicate) -> String {
    match failing.name {
        "mode" => format!("only from {}", failing.limit),
        "state fresh" => format!("its state is {} old", failing.value),
        "guards failing" => format!("{} fails", failing.value),
        "role" => format!("role {} is needed", failing.limit),
        "live" => "this is a recording".to_owned(),
        _ => format!("{}: {}", failing.title, failing.value),
    }
}

/// First step: choose; second step: arm. An order with a failed interlock names the first beside it.
fn choice(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    heading(ui, "Away from safe: choose, arm, confirm");
    let orders = orders(view_state, shown);
    for order in &orders {
        order_row(ui, view_state, shown, order);
        if let Order::Command(unit, CommandKind::Configure(mut values)) = *order
            && view_state.order == Some(*order)
        {
            settings::edit(ui, &mut values);
            view_state.values = Some(values);
            view_state.order = Some(Order::Command(unit, CommandKind::Configure(values)));
        }
    }
    let orders = self::orders(view_state, shown);
    if !orders.iter().any(|order| matches!(order, Order::Command(_, CommandKind::Arm(_)))) {
        ui.label(RichText::new("To arm: choose a track in table or map.").weak().small());
    }
    let chosen = view_state.order.filter(|order| orders.contains(order));
    chosen.into_iter().for_each(|order| arm(ui, view_state, shown, &order, wishes));
}

/// Revocations on offer. One cannot be undone, so it stands apart from everything else, at the column's end and behind
/// a button.
fn revocations(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    if shown.revocable.is_empty() {
        return;
    }
    ui.separator();
    let open = view_state.revoking;
    if able(ui, dead(shown), Button::selectable(open, "Revoke an identity ...")).clicked() {
        view_state.put_down();
        view_state.revoking = !open;
    }
    if !view_state.revoking {
        return;
    }
    for (who, _) in &shown.revocable {
        order_row(ui, view_state, shown, &Order::Revoke(*who));
    }
    let chosen = view_state.order.filter(|order| matches!(order, Order::Revoke(_)));
    chosen.into_iter().for_each(|order| arm(ui, view_state, shown, &order, wishes));
}

/// Second step: images, consequence of the chosen order, the button that arms it, and its interlocks. They stand last:
/// the first that fails is named beside the order, and the button is to be in sight.
fn arm(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, order: &Order, wishes: &mut Vec<Wish>) {
    ui.add_space(4.0);
    images::draw(ui, &mut view_state.images, shown, order);
    ui.add(Label::new(RichText::new(words::consequence(order)).strong()).wrap());
    let text = format!("Arm: {}", words::order(order));
    let locked = shown.unable(order).map(|refusal| refusal.message());
    if wide(ui, locked, 34.0, Button::new(RichText::new(text).size(15.0))) {
        wishes.push(Wish::Act(Act::Prepare(*order)));
    }
    for predicate in shown.interlocks(order) {
        super::why::row(ui, &predicate, (true, false));
    }
}

fn order_row(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, order: &Order) {
    let failing = shown.interlocks(order).into_iter().find(|predicate| !predicate.holds);
    let chosen = view_state.order == Some(*order);
    let text = RichText::new(words::capital(&words::order(order)));
    let text = if failing.is_some() { text.color(Palette::current(ui).weak) } else { text };
    let text = if dead(shown).is_some() { text.strikethrough() } else { text };
    if able(ui, dead(shown), RadioButton::new(chosen, text)).clicked() {
        view_state.order = Some(*order);
    }
    if let Some(failing) = &failing {
        ui.horizontal(|ui| {
            ui.add_space(24.0);
            ui.add(Label::new(RichText::new(format!("not yet: {}", why_not(failing))).small().weak()).truncate());
        });
    }
}

/// Third step: the images, the consequence, the time left, the reason, and the two ways out.
fn confirmation(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, prepared: &Prepared, wishes: &mut Vec<Wish>) {
    let palette = Palette::current(ui);
    countdown(ui, shown, prepared);
    images::draw(ui, &mut view_state.images, shown, &prepared.order);
    ui.add(Label::new(RichText::new(words::consequence(&prepared.order)).size(14.0).color(palette.strong)).wrap());
    let label = ui.label(RichText::new("Reason: it goes into the signed order").weak());
    let edit = TextEdit::singleline(&mut view_state.reason).hint_text("required").char_limit(MAX_REASON);
    let edit = ui.add(edit.desired_width(f32::INFINITY)).labelled_by(label.id);
    // What is seen is what will be signed.
    view_state.reason = Text::<MAX_REASON>::new(&view_state.reason).as_str().to_owned();
    // A person who armed goes on typing.
    if ui.memory(|memory| memory.focused().is_none()) {
        edit.request_focus();
    }
    let ready = !view_state.reason.trim().is_empty();
    let text = RichText::new(format!("CONFIRM: {}   F9", words::order(&prepared.order))).size(15.0).strong();
    let (fill, ink) = if ready { (palette.mark, palette.on_block) } else { (palette.raised, palette.weak) };
    let (dead, missing) = (dead(shown), (!ready).then_some("no reason is given yet"));
    if wide(ui, dead.or(missing), 38.0, Button::new(text.color(ink)).fill(fill).wrap()) {
        wishes.extend(confirm(view_state, prepared));
    }
    if wide(ui, dead, 26.0, Button::new("Disarm   Esc")) {
        withdraw(view_state, wishes);
    }
}

/// Time left of an armed order: a number, and a bar that shrinks.
fn countdown(ui: &mut Ui, shown: &Shown, prepared: &Prepared) {
    let palette = Palette::current(ui);
    let left = prepared.until.since(shown.at);
    let share = left.0 as f32 / prepared.until.since(prepared.since).0.max(1) as f32;
    let text = format!("ARMED: {}, {} left", words::order(&prepared.order), words::left(left));
    ui.add(Label::new(RichText::new(text).strong().color(palette.mark)).wrap());
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 6.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 2.0, palette.raised);
    let bar = egui::Rect::from_min_size(rect.min, vec2(rect.width() * share.clamp(0.0, 1.0), rect.height()));
    ui.painter().rect_filled(bar, 2.0, palette.mark);
}

/// Heading of the rows below.
pub(super) fn heading(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).weak());
}
