//! The context bar, above all else: marks of the whole picture, the links, the person here, the time.
//!
//! A normal value is said once, in grey; a link or a clock that is not is named.

use eframe::egui::{Align, FontId, Label, Layout, RichText, Role, Ui, WidgetInfo};
use wire::event::Freshness;

use super::marks::{self, Shape, Tone};
use super::theme::{BODY, Palette};
use super::words;
use crate::banner::clock;
use crate::shown::{Shown, ShownLink};
use crate::skew::Rate;

/// Draws the bar.
pub(super) fn draw(ui: &mut Ui, shown: &Shown) {
    ui.horizontal(|ui| {
        mark(ui, (Tone::Mark, Shape::Ring), "SIMULATION", false);
        if shown.marks.replay {
            mark(ui, (Tone::Advice, Shape::Square), "REPLAY · nothing here is now", true);
        }
        if shown.marks.ablation.is_some() {
            mark(
                ui,
                (Tone::Caution, Shape::Diamond),
                &format!("ABLATION · {}", words::tame_to(&shown.marks.waived, 96)),
                true,
            );
        }
        if let Some(wait) = shown.marks.host_wait {
            mark(ui, (Tone::Caution, Shape::Diamond), &format!("HOST BUSY {} ms", wait.0 / 1000), true);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let time = RichText::new(clock(shown.at.since(shown.epoch()))).monospace().size(BODY);
            ui.label(time.color(Palette::current(ui).strong));
            let operator = format!("{} · {}", shown.operator, shown.role.name());
            ui.add(Label::new(RichText::new(operator).weak()).truncate());
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                links(ui, shown);
                losses(ui, shown);
                clocks(ui, shown);
            });
        });
    });
}

/// A mark of the picture as a whole, as wide as its words.
fn mark(ui: &mut Ui, sign: (Tone, Shape), text: &str, filled: bool) {
    let wide =
        ui.painter().layout_no_wrap(text.to_owned(), FontId::proportional(BODY), sign.0.color(Palette::current(ui)));
    let most = (ui.available_width() * 0.6).max(120.0);
    let width = (wide.size().x + 34.0).min(most);
    marks::chip(ui, width, sign, text, filled, &format!("MARK {text}")).on_hover_text(text);
}

/// A shape and words. A text that does not fit ends in an ellipsis and is whole in its name.
fn said(ui: &mut Ui, (tone, shape): (Tone, Shape), text: &str, name: &str, hover: &str) {
    if ui.available_width() < 60.0 {
        return;
    }
    marks::shape(ui, shape, tone, "");
    let color = if tone > Tone::Normal { tone.color(Palette::current(ui)) } else { Palette::current(ui).text };
    let response = ui.add(Label::new(RichText::new(text).color(color)).truncate());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, name));
    if !hover.is_empty() {
        response.on_hover_text(hover);
    }
    ui.add_space(8.0);
}

/// Every link in one sentence where all are as they should be; else those that are not, by name.
fn links(ui: &mut Ui, shown: &Shown) {
    let judged: Vec<_> = shown.links.iter().map(|link| (link, link_sign(shown, link))).collect();
    let oldest = judged.iter().filter(|(_, (tone, ..))| *tone == Tone::Normal).filter_map(|(link, _)| link.heard).max();
    let well = judged.iter().filter(|(_, (tone, ..))| *tone == Tone::Normal).count();
    let name: Vec<String> = judged.iter().map(|(link, (.., words))| format!("LINK {} {words}", link.peer)).collect();
    let name = name.join("; ");
    if shown.links.is_empty() {
        return said(ui, (Tone::Weak, Shape::Ring), "no link is known", "LINK none is known", "");
    }
    for (link, (tone, shape, words)) in judged.iter().filter(|(_, (tone, ..))| *tone != Tone::Normal).take(2) {
        let text = format!("{} {words}", link.peer);
        said(ui, (*tone, *shape), &text, &format!("LINK {text}"), "");
    }
    let age = oldest.map_or(String::new(), |age| format!(", oldest report {}", words::at_most(age)));
    let text = format!("{well} of {} links up{age}", judged.len());
    said(ui, (Tone::Normal, Shape::Disc), &text, &name, &name);
}

/// Sign of a link, and words for it: as the gateway's last word has it, which ages, and by when something last came
/// through it.
fn link_sign(shown: &Shown, link: &ShownLink) -> (Tone, Shape, String) {
    let (open, freshness) = link.open.get();
    let unit = shown.units.iter().find(|unit| unit.unit.peer() == link.peer);
    if unit.is_some_and(crate::shown::ShownUnit::is_out_of_contact) {
        return (Tone::Weak, Shape::Ring, "silent as planned".to_owned());
    }
    let heard = link.heard.map_or("no report yet".to_owned(), |age| format!("report {} ago", words::seconds(age)));
    match (open, freshness) {
        (true, Freshness::Fresh | Freshness::Late) => {
            let (tone, shape, _) = marks::freshness(link.heard.map_or(Freshness::Late, |age| shown.limits.label(age)));
            (tone, shape, format!("up, {heard}"))
        }
        (true, Freshness::Stale | Freshness::Lost) => (Tone::Caution, Shape::Diamond, format!("was up, {heard}")),
        (false, _) => (Tone::Alarm, Shape::Cross, format!("silent, {heard}")),
    }
}

/// Sessions that were cut or taken at the broker.
fn losses(ui: &mut Ui, shown: &Shown) {
    for (peer, times) in shown.losses.iter().take(2) {
        let text = format!("{peer} lost its command session, {times} times");
        said(ui, (Tone::Alarm, Shape::Cross), &text, &format!("LOSS {text}"), "");
    }
}

/// Clocks, without which no age is to be relied on: a word for all that keep step, a name for one that does not.
fn clocks(ui: &mut Ui, shown: &Shown) {
    let known: Vec<_> = shown.units.iter().filter_map(|unit| Some((unit.unit, unit.clock?))).collect();
    let hover: Vec<String> =
        known.iter().map(|(unit, rate)| format!("{unit}: {}", words::clock(Some(*rate)))).collect();
    let hover = hover.join("\n");
    for (unit, _) in known.iter().filter(|(_, rate)| rate.exceeds_drift()) {
        let text = format!("clock of {unit} runs away");
        said(ui, (Tone::Caution, Shape::Diamond), &text, &format!("CLOCK {text}"), &hover);
    }
    let in_step = known.iter().filter(|(_, rate)| !Rate::exceeds_drift(*rate)).count();
    if in_step > 0 && in_step == known.len() {
        said(ui, (Tone::Normal, Shape::Disc), "clocks in step", "CLOCK in step", &hover);
    }
}
