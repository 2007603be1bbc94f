//! The values of an order to configure: initially those in force, each within its range.
//!
//! The unit judges their combination: it reports it in its answer.

use std::ops::RangeInclusive;

use eframe::egui::{DragValue, Grid, RichText, Ui};
use wire::settings::{RANGES, Settings};

/// Name and unit of each value; all are held in thousandths.
const FIELDS: [(&str, &str); 4] =
    [("Speed, at most", " m/s"), ("Margin to the fence", " m"), ("Confidence to arm", ""), ("Confidence to keep", "")];
/// Change of a value per point of dragging.
const PER_POINT: f64 = 0.005;

/// A row for each value.
pub(super) fn edit(ui: &mut Ui, settings: &mut Settings) {
    let Settings { speed_mm_s, margin_mm, arm_permille, keep_permille } = settings;
    let values = [speed_mm_s, margin_mm, arm_permille, keep_permille];
    Grid::new("settings").num_columns(2).show(ui, |ui| {
        for ((field, range), value) in FIELDS.iter().zip(&RANGES).zip(values) {
            row(ui, field, range, value);
        }
    });
}

fn row(ui: &mut Ui, (name, suffix): &(&str, &str), range: &RangeInclusive<u16>, value: &mut u16) {
    let whole = |thousandths: u16| f64::from(thousandths) / 1000.0;
    let mut shown = whole(*value);
    let label = ui.label(RichText::new(*name).weak());
    let drag = DragValue::new(&mut shown).range(whole(*range.start())..=whole(*range.end())).speed(PER_POINT);
    ui.add(drag.min_decimals(1).max_decimals(3).suffix(*suffix)).labelled_by(label.id);
    ui.end_row();
    *value = (shown * 1000.0).round() as u16;
}
