//! Progress of orders with times; and acts that were refused, with the reason.

use eframe::egui::{Align, Color32, Label, Layout, Response, RichText, Ui};

use super::command::heading;
use super::marks::{self, Shape, Tone};
use super::theme::Palette;
use super::words;
use crate::act::{Act, Answer, Order};
use crate::life::{Life, ShownCommand};
use crate::shown::Shown;

/// Commands and answers that are listed.
const LISTED: usize = 6;

/// Both lists, newest first.
pub(super) fn draw(ui: &mut Ui, shown: &Shown) {
    commands(ui, shown);
    answers(ui, shown);
}

fn commands(ui: &mut Ui, shown: &Shown) {
    heading(ui, "Orders, newest first");
    if shown.commands.is_empty() {
        ui.label(RichText::new("none given").weak());
    }
    ui.spacing_mut().item_spacing.y = 1.0;
    ui.spacing_mut().interact_size.y = 16.0;
    for command in shown.commands.iter().rev().take(LISTED) {
        command_rows(ui, shown, command);
        ui.add_space(4.0);
    }
}

fn command_rows(ui: &mut Ui, shown: &Shown, command: &ShownCommand) {
    let palette = Palette::current(ui);
    let (tone, shape) = marks::life(command.life);
    let order = words::capital(&words::order(&Order::Command(command.unit, command.kind)));
    ui.horizontal(|ui| {
        marks::shape(ui, shape, tone, &words::life(command.life, shown.at));
        ui.add(Label::new(RichText::new(order).color(palette.strong)).truncate());
        let text = words::event_time(shown, command.times.requested);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(RichText::new(text).small().weak()));
    });
    let done = match (command.life, command.times.effect) {
        (Life::Executed, Some(effect)) => {
            let within = words::seconds(effect.since(command.times.requested));
            format!("done · effect within {within}")
        }
        (life, _) => words::life(life, shown.at),
    };
    let line = format!("{done} · {}", command.by.words());
    let color = if tone > Tone::Normal { tone.color(palette) } else { palette.weak };
    indented(ui, &line, color).on_hover_text(words::stages(command));
}

fn indented(ui: &mut Ui, text: &str, color: Color32) -> Response {
    let add = |ui: &mut Ui| {
        ui.add_space(20.0);
        ui.add(Label::new(RichText::new(text).small().color(color)).wrap())
    };
    ui.horizontal(add).inner
}

/// Refused acts, with the reason.
fn answers(ui: &mut Ui, shown: &Shown) {
    let refused = |answer: &&Answer| answer.outcome.is_err();
    let last: Vec<&Answer> = shown.answers.iter().rev().filter(refused).take(LISTED).collect();
    if last.is_empty() {
        return;
    }
    heading(ui, "Not done");
    for answer in last {
        let Err(refusal) = answer.outcome else { continue };
        let name = match answer.act {
            Some(Act::Now(order) | Act::Prepare(order) | Act::Confirm(order, _)) => words::order(&order),
            Some(Act::Withdraw) => "disarm".to_owned(),
            Some(Act::Acknowledge(..)) => "acknowledge".to_owned(),
            Some(Act::Shelve(..)) => "shelve".to_owned(),
            Some(Act::Silence) => "silence the sound".to_owned(),
            None => "an act".to_owned(),
        };
        let text = format!("{name}: {}, {}", refusal.message(), words::event_time(shown, answer.at));
        ui.horizontal(|ui| {
            marks::shape(ui, Shape::Diamond, Tone::Caution, "not done");
            ui.add(Label::new(RichText::new(text).color(Palette::current(ui).text)).wrap());
        });
    }
}
