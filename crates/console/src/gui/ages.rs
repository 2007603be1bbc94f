//! Age of each unit's own state over the last minute, with the limits of its labels.

use eframe::egui::{Align2, Color32, Label, RichText, Role, Stroke, Ui, WidgetInfo};
use egui_plot::{GridMark, HLine, Line, LineStyle, Plot, PlotPoints, Text};
use wire::time::Span;

use super::theme::Palette;
use super::view_state::{PLOTTED, ViewState};
use super::words::{self, seconds};
use crate::shown::Shown;

/// Ages between the places of two names.
const APART: usize = 90;

/// The plot, and above it how fast each clock runs: ages rest on that.
pub(super) fn draw(ui: &mut Ui, view_state: &ViewState, shown: &Shown) {
    for unit in &shown.units {
        let text = format!("{}: {}", unit.unit, words::clock(unit.clock));
        ui.add(Label::new(RichText::new(text).small().weak()).truncate());
    }
    let palette = *Palette::current(ui);
    let lost = in_seconds(shown.limits.stale);
    let fresh = in_seconds(shown.limits.fresh);
    let back = in_seconds(PLOTTED);
    let plot = Plot::new("ages")
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show_background(false)
        .grid_color(palette.line)
        .x_axis_formatter(|mark: GridMark, _: &_| format!("{:.0} s", mark.value))
        .y_axis_formatter(|mark: GridMark, _: &_| format!("{:.1} s", mark.value))
        .include_x(-back)
        .include_x(0.0)
        .include_y(0.0)
        .include_y(lost * 1.2)
        .label_formatter(|_| None);
    let response = plot.show(ui, |plot| {
        for (name, at, color) in [("LATE above", fresh, palette.advice), ("LOST above", lost, palette.alarm)] {
            plot.hline(HLine::new(name, at).stroke(Stroke::new(1.0, color)).style(LineStyle::dashed_loose()));
            plot.text(name_at(name, [-back, at], Align2::LEFT_BOTTOM, color));
        }
        for (at, (unit, ages)) in view_state.ages.iter().enumerate() {
            let points = ages.iter().map(|(then, age)| [-in_seconds(shown.at.since(*then)), in_seconds(*age)]);
            // What has no bound is beyond every scale.
            let points: PlotPoints<'_> = points.map(|[x, y]| [x, y.min(back)]).collect();
            let styles =
                [LineStyle::Solid, LineStyle::dashed_loose(), LineStyle::dashed_dense(), LineStyle::dotted_loose()];
            // Each name at another place, for ages are often alike.
            if let Some((then, age)) = ages.iter().rev().nth(at * APART).or(ages.front()) {
                let bar = [-in_seconds(shown.at.since(*then)), in_seconds(*age).min(back)];
                plot.text(name_at(unit.name(), bar, Align2::RIGHT_BOTTOM, palette.strong));
            }
            let line = Line::new(unit.name(), points).color(palette.text).width(1.5).style(styles[at % styles.len()]);
            plot.line(line);
        }
    });
    response.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, description(shown)));
}

/// A name beside its line, in place of a legend.
fn name_at(name: &str, place: [f64; 2], anchor: Align2, color: Color32) -> Text {
    Text::new(name, place.into(), RichText::new(name).size(11.0).color(color)).anchor(anchor)
}

/// Description of the plot for screen readers.
fn description(shown: &Shown) -> String {
    let ages = shown.units.iter().map(|unit| format!("{} {}", unit.unit, seconds(unit.state.age())));
    format!("AGES {}", ages.collect::<Vec<_>>().join(", "))
}

fn in_seconds(span: Span) -> f64 {
    span.as_ms() / 1000.0
}
