//! Refusals, by peer, reason and count: the boundary at work, or an attack on it.

use eframe::egui::{Align, Label, Layout, RichText, ScrollArea, Ui};
use egui_extras::{Column, TableBuilder};

use super::keys;
use super::theme::{Palette, ROW};
use super::words;
use crate::shown::Shown;

const HEADS: [(&str, f32); 4] = [("reason", 92.0), ("times", 44.0), ("last", 64.0), ("from", 68.0)];

/// Draws the table.
pub(super) fn draw(ui: &mut Ui, shown: &Shown) {
    if shown.refusals.is_empty() {
        ui.label(RichText::new("Nothing was refused.").weak());
        return;
    }
    ScrollArea::horizontal().auto_shrink([false, false]).show(ui, |ui| table(ui, shown));
}

fn table(ui: &mut Ui, shown: &Shown) {
    let mut refusals: Vec<_> = shown.refusals.iter().collect();
    // What was refused last stands first.
    refusals.sort_by_key(|refused| std::cmp::Reverse(refused.last));
    keys::scroll_next(ui, "list of refusals");
    let mut table = TableBuilder::new(ui).striped(true).auto_shrink([false, false]);
    table = table.cell_layout(Layout::left_to_right(Align::Center));
    for (_, width) in HEADS {
        table = table.column(Column::exact(width).clip(true));
    }
    let table = table.column(Column::remainder().at_least(54.0).clip(true)).header(ROW, |mut header| {
        for name in HEADS.map(|(name, _)| name).into_iter().chain(["refused by"]) {
            header.col(|ui| {
                ui.label(RichText::new(name).weak());
            });
        }
    });
    table.body(|body| {
        body.rows(ROW, refusals.len(), |mut row| {
            let Some(refusal) = refusals.get(row.index()) else { return };
            let cells = [
                refusal.reason.name().to_owned(),
                refusal.n.to_string(),
                words::event_time(shown, refusal.last),
                refusal.peer.map_or("unknown".to_owned(), |peer| peer.to_string()),
                if refusal.here { "console" } else { "gateway" }.to_owned(),
            ];
            for cell in cells {
                row.col(|ui| {
                    let color = Palette::current(ui).text;
                    ui.add(Label::new(RichText::new(cell).monospace().color(color)).truncate());
                });
            }
        });
    });
}
