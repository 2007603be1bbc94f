//! The safety strip: state, cause, start, authority and age of each unit.
//!
//! It stands outside of the tiles, so that no layout hides it. One line for the run and its links, one for each unit.
//! It gives a figure's meaning for the operator; the figure itself is in the tooltip.

use eframe::egui::{Align, Label, Layout, Response, RichText, Role, Ui, WidgetInfo, vec2};
use wire::event::Freshness;
use wire::id::UnitId;
use wire::time::Instant;

use super::marks::{self, Shape, Tone};
use super::theme::Palette;
use super::view_state::ViewState;
use super::words::{self, seconds};
use crate::age::Labelled;
use crate::aloft;
use crate::shown::{Shown, ShownLink, ShownUnit, State};
use crate::skew::Rate;

/// Height of a unit's line, points.
const LINE: f32 = 28.0;
/// Widths of a unit's cells, points: name, state, since, cause, authority, age, way, motion.
const CELLS: [f32; 8] = [76.0, 236.0, 84.0, 196.0, 196.0, 136.0, 150.0, 170.0];

/// Width of a link, points.
const LINK: f32 = 320.0;

/// The strip; a click on a unit's name chooses it.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    ui.spacing_mut().item_spacing.y = 2.0;
    run(ui, shown);
    for unit in &shown.units {
        line(ui, |ui| {
            name(ui, view_state, unit.unit);
            unit_cells(ui, shown.at, unit);
        });
        aloft_line(ui, unit);
    }
    for unit in &shown.silent {
        line(ui, |ui| {
            name(ui, view_state, *unit);
            let text = format!("STATE {} nothing received", unit.name());
            marks::chip(ui, CELLS[1], (Tone::Alarm, Shape::Cross), "NOTHING RECEIVED", false, &text);
        });
    }
}

fn line(ui: &mut Ui, content: impl FnOnce(&mut Ui)) {
    ui.allocate_ui_with_layout(vec2(ui.available_width(), LINE), Layout::left_to_right(Align::Center), content);
}

fn name(ui: &mut Ui, view_state: &mut ViewState, unit: UnitId) {
    let chosen = view_state.unit == unit;
    let button = ui.add_sized([CELLS[0], 22.0], eframe::egui::Button::selectable(chosen, unit.name()));
    if button.clicked() {
        view_state.choose(unit);
    }
}

fn unit_cells(ui: &mut Ui, time: Instant, unit: &ShownUnit) {
    state(ui, unit);
    let (state, freshness) = unit.state.get();
    let cause = state.cause();
    if freshness == Freshness::Fresh {
        cell(ui, CELLS[2], RichText::new(format!("for {}", seconds(time.since(unit.since)))).monospace());
        cell(ui, CELLS[3], RichText::new(format!("cause {cause}")));
    } else {
        // For how long it was so, nobody here knows.
        cell(ui, CELLS[2], RichText::new(""));
        cell(ui, CELLS[3], RichText::new(format!("cause was {cause}")).weak());
    }
    authority(ui, unit);
    let (tone, shape, word) = marks::freshness(freshness);
    let age = seconds(unit.state.age());
    marks::chip(
        ui,
        CELLS[5],
        (tone, shape),
        &format!("{age} {word}"),
        false,
        &format!("AGE {} {age} {word}", unit.unit),
    );
    way(ui, unit);
    let moves = format!("{}, route {} %", aloft::speed(state.speed_mm_s), state.progress / 10);
    cell(
        ui,
        CELLS[7],
        if freshness == Freshness::Fresh { RichText::new(moves) } else { RichText::new(format!("was {moves}")).weak() },
    );
}

/// Height, attitude, sunlight, battery and contact, of a unit that reports them.
fn aloft_line(ui: &mut Ui, unit: &ShownUnit) {
    let (state, freshness) = unit.state.get();
    let (motion, contact) = (aloft::motion(state), aloft::contact(state, unit.state.age()));
    if motion.is_empty() && contact.is_none() {
        return;
    }
    line(ui, |ui| {
        cell(ui, CELLS[0], RichText::new(""));
        for word in motion {
            let fresh = freshness == Freshness::Fresh;
            let text = if fresh { RichText::new(word) } else { RichText::new(format!("was {word}")).weak() };
            cell(ui, CELLS[7], text);
        }
        if let Some(contact) = contact {
            cell(ui, CELLS[7], RichText::new(contact));
        }
    });
}

fn state(ui: &mut Ui, unit: &ShownUnit) {
    let (state, freshness) = unit.state.get();
    let (tone, shape) = marks::mode(state.mode);
    let (stale, _, word) = marks::freshness(freshness);
    let mode = state.mode.name();
    // Only what is fresh is said as what is so.
    if freshness == Freshness::Fresh {
        let filled = tone > Tone::Normal;
        marks::chip(ui, CELLS[1], (tone, shape), mode, filled, &format!("STATE {} {mode}", unit.unit));
    } else {
        let text = format!("STATE {} last known {mode}, {word}", unit.unit);
        marks::chip(ui, CELLS[1], (stale, Shape::Cross), &format!("was {mode} · {word}"), false, &text);
    }
}

fn authority(ui: &mut Ui, unit: &ShownUnit) {
    let (text, tone, shape) = authority_words(&unit.state);
    marks::chip(ui, CELLS[4], (tone, shape), &text, tone == Tone::Mark, &format!("AUTHORITY {} {text}", unit.unit));
}

fn authority_words(state: &Labelled<State>) -> (String, Tone, Shape) {
    let held = |state: &State| state.authority.map(|held| (held.track.0, words::left(held.left)));
    match (state.fresh(), held(state.get().0)) {
        (Some(_), Some((track, left))) => (format!("track {track}, {left} left"), Tone::Mark, Shape::Triangle),
        (Some(_), None) => ("no authority".to_owned(), Tone::Normal, Shape::Ring),
        (None, Some((track, _))) => (format!("unknown; was track {track}"), Tone::Alarm, Shape::Cross),
        (None, None) => ("unknown; was none".to_owned(), Tone::Caution, Shape::Cross),
    }
}

/// Peer of the session that brought the report, and its checks on the way.
fn way(ui: &mut Ui, unit: &ShownUnit) {
    let (tone, words) = words::origin(unit.origin);
    let palette = Palette::current(ui);
    cell(ui, CELLS[6], RichText::new(format!("origin {words}")).color(tone.color(palette)));
}

/// Marks of the whole picture, and the links.
fn run(ui: &mut Ui, shown: &Shown) {
    // More links than fit beside each other stand on a second line.
    ui.horizontal_wrapped(|ui| {
        marks::chip(ui, 112.0, (Tone::Mark, Shape::Ring), "SIMULATION", false, "MARK SIMULATION");
        if shown.marks.replay {
            marks::chip(ui, 232.0, (Tone::Advice, Shape::Square), "REPLAY · nothing here is now", true, "MARK REPLAY");
        }
        if let Some(policy) = &shown.marks.ablation {
            let text = format!("ABLATION {}", words::tame(policy));
            marks::chip(ui, 232.0, (Tone::Caution, Shape::Diamond), &text, true, &format!("MARK {text}"));
        }
        if let Some(wait) = shown.marks.host_wait {
            let text = format!("HOST BUSY {} ms", wait.0 / 1000);
            marks::chip(ui, 232.0, (Tone::Caution, Shape::Diamond), &text, true, &format!("MARK {text}"));
        }
        for link in &shown.links {
            let clock = shown.units.iter().find(|unit| unit.unit.peer() == link.peer).and_then(|unit| unit.clock);
            link_chip(ui, shown, link, clock);
        }
        for (peer, times) in &shown.losses {
            let text = format!("{peer} lost its command session {times}x");
            marks::chip(ui, 290.0, (Tone::Alarm, Shape::Cross), &text, false, &format!("LOSS {text}"));
        }
        let operator = format!("{} · {}", shown.operator, shown.role.name());
        cell(ui, 150.0, RichText::new(operator).weak());
    });
}

/// A link as the gateway's last word has it, which ages; when something last came through it, which is as much out of
/// normal as a report of that age; and whether the clock at its other end keeps step, without which no age is to be
/// relied on.
fn link_chip(ui: &mut Ui, shown: &Shown, link: &ShownLink, clock: Option<Rate>) {
    let (open, freshness) = link.open.get();
    let heard = link.heard.map_or("no report yet".to_owned(), |age| format!("report {} ago", seconds(age)));
    let keeps = clock.map_or("clock not known yet", Rate::consequence);
    let runs = clock.is_some_and(Rate::exceeds_drift);
    let (sign, text) = match (open, freshness) {
        (true, Freshness::Fresh | Freshness::Late) if runs => {
            ((Tone::Caution, Shape::Diamond), format!("{} up, {heard}, {keeps}", link.peer))
        }
        (true, Freshness::Fresh | Freshness::Late) => {
            let (tone, shape, word) =
                marks::freshness(link.heard.map_or(Freshness::Lost, |age| shown.limits.label(age)));
            let after = match (link.heard, tone) {
                (None, _) => String::new(),
                (Some(_), Tone::Normal) => format!(", {keeps}"),
                (Some(_), _) => format!(", {word}"),
            };
            ((tone, shape), format!("{} up, {heard}{after}", link.peer))
        }
        (true, Freshness::Stale | Freshness::Lost) => {
            ((Tone::Caution, Shape::Diamond), format!("{} was up, {heard}", link.peer))
        }
        (false, _) => ((Tone::Alarm, Shape::Cross), format!("{} DOWN, {heard}", link.peer)),
    };
    let chip = marks::chip(ui, LINK, sign, &text, false, &format!("LINK {text}"));
    chip.on_hover_text(words::clock(clock));
}

fn cell(ui: &mut Ui, width: f32, text: RichText) -> Response {
    let line = text.text().to_owned();
    let left = Layout::left_to_right(Align::Center);
    let add = |ui: &mut Ui| {
        ui.set_min_width(width);
        ui.add(Label::new(text).truncate())
    };
    let response = ui.allocate_ui_with_layout(vec2(width, 22.0), left, add).inner;
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &line));
    response
}
