//! Plots of the chosen unit: each value with its limits over the last minute or the whole run, and its changes of mode
//! on the common axis.
//!
//! A value that fails stands first. The values are `series`'s.

use eframe::egui::{
    Align2, FontId, Label, Rect, RichText, Role, ScrollArea, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotBounds, PlotPoint, PlotPoints, Polygon, VLine};
use wire::event::Freshness;
use wire::mode::Mode;

use super::flight;
use super::keys;
use super::marks;
use super::series::{Series, in_seconds};
use super::theme::{BODY, Palette, SMALL};
use super::view_state::ViewState;
use crate::shown::{Shown, ShownUnit};
use crate::trace::CLOSE;

/// Width of the names, and of the names of the limits, points; in a narrow pane the limits have none.
const COLUMNS: [f32; 2] = [150.0, 78.0];
const NARROW: [f32; 2] = [118.0, 12.0];
/// Width of a pane from which on the limits have names.
const WIDE: f32 = 400.0;
/// Least distance of two times on the axis.
const APART: f32 = 52.0;
/// Least and greatest height of a plot.
const HEIGHTS: [f32; 2] = [64.0, 240.0];
/// Height of the axis, with the names of the events.
const AXIS: f32 = 40.0;
/// Least time that is plotted, seconds.
const SHORTEST: f64 = 10.0;
/// Most changes of mode that have a line.
const MOST_CHANGES: usize = 12;

/// A change of mode: seconds before now, and the mode from then on.
type Change = (f64, Mode);

/// Draws the plots.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    let Some(unit) = shown.unit(view_state.unit) else {
        ui.label(format!("Nothing was received of {}: there is nothing to plot.", view_state.unit));
        return;
    };
    head(ui, view_state, unit);
    flight::draw(ui, unit);
    let track = view_state.track.filter(|(owner, _)| *owner == unit.unit).map(|(_, track)| track);
    let all = Series::of(shown, unit, view_state.plotted, track);
    let whole = view_state.whole_run;
    // A run that has just begun fills the plots too.
    let close = start(shown, unit).clamp(-in_seconds(CLOSE), -SHORTEST);
    let from = if whole { start(shown, unit).min(-SHORTEST) } else { close };
    let changes = changes(shown, unit, whole, from);
    ui.spacing_mut().item_spacing.y = 0.0;
    let room = (ui.available_height() - AXIS).max(HEIGHTS[0]);
    let most = ((room / HEIGHTS[0]).floor() as usize).clamp(1, all.len());
    let height = (room / most as f32).min(HEIGHTS[1]);
    keys::scroll_next(ui, "plots");
    if all.len() <= most {
        all.iter().for_each(|series| row(ui, shown, unit, *series, (from, height, whole), &changes));
        return axis(ui, from, &changes);
    }
    ScrollArea::vertical().max_height(most as f32 * height).auto_shrink([false, false]).show(ui, |ui| {
        all.iter().for_each(|series| row(ui, shown, unit, *series, (from, height, whole), &changes));
    });
    axis(ui, from, &changes);
}

/// The choice of the time, and the plot that a guard was pressed for.
fn head(ui: &mut Ui, view_state: &mut ViewState, unit: &ShownUnit) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut view_state.whole_run, false, "Last 60 s");
        ui.selectable_value(&mut view_state.whole_run, true, "Whole run");
        if let Some(guard) = view_state.plotted {
            let name = crate::wording::guard(unit.state.get().0.suite(), guard);
            if ui.button(format!("{name}  ×")).on_hover_text("Close this plot").clicked() {
                view_state.plotted = None;
            }
        }
        ui.add(Label::new(RichText::new("nothing is drawn where nothing was heard").weak()).truncate());
    });
}

/// Widths of the names and of the names of the limits in a pane of this width.
fn columns(width: f32) -> [f32; 2] {
    if width >= WIDE { COLUMNS } else { NARROW }
}

/// Seconds from the unit's first report to now, negative.
fn start(shown: &Shown, unit: &ShownUnit) -> f64 {
    unit.trace.whole().first().map_or(-1.0, |first| -in_seconds(shown.at.since(first.at)).max(1.0))
}

/// The changes of mode within the plotted time, oldest first.
fn changes(shown: &Shown, unit: &ShownUnit, whole: bool, from: f64) -> Vec<Change> {
    let mut changes = Vec::new();
    let mut last = None;
    let mut look = |sample: &crate::trace::Sample| {
        if last.is_some_and(|mode| mode != sample.mode) {
            changes.push((-in_seconds(shown.at.since(sample.at)), sample.mode));
        }
        last = Some(sample.mode);
    };
    if whole {
        unit.trace.whole().iter().for_each(&mut look)
    } else {
        unit.trace.close().for_each(&mut look)
    }
    changes.retain(|(x, _)| *x >= from);
    let more = changes.len().saturating_sub(MOST_CHANGES);
    changes.split_off(more)
}

/// One plot with its name and value at the left, and the names of its limits at the right.
fn row(
    ui: &mut Ui,
    shown: &Shown,
    unit: &ShownUnit,
    series: Series,
    (from, height, whole): (f64, f32, bool),
    changes: &[Change],
) {
    let palette = *Palette::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let [names, limits] = columns(rect.width());
    let fails = series.fails(unit);
    let known = unit.state.freshness() <= Freshness::Late;
    let now = series.now(shown, unit);
    let value = match (&now, known || series == Series::Age) {
        (Some(now), true) => now.clone(),
        (Some(now), false) => format!("was {now}"),
        (None, _) => "not known".to_owned(),
    };
    let late = series == Series::Age && unit.state.freshness() > Freshness::Late && !unit.is_out_of_contact();
    let ink = match (fails, late, known) {
        (true, ..) => palette.caution,
        (_, true, _) => palette.alarm,
        (.., true) => palette.strong,
        _ => palette.weak,
    };
    if fails || late {
        ui.painter().rect_filled(Rect::from_min_size(rect.min, vec2(3.0, height - 6.0)), 0.0, ink);
    }
    let name = series.name(unit);
    let column = Rect::from_min_size(rect.min + vec2(10.0, 0.0), vec2(names - 16.0, height));
    marks::text_in(ui.painter(), column, Align2::LEFT_TOP, &name, FontId::proportional(BODY), palette.text);
    let galley = marks::fitted(ui.painter(), &value, 17.0, ink, (column.width(), 2));
    marks::bold_galley(ui.painter(), column.min + vec2(0.0, 21.0), galley, ink);
    let bounds = series.bounds(shown, unit);
    let pieces = series.pieces(shown, unit, whole);
    let (low, high) = range(&pieces, &bounds);
    let place = Rect::from_min_max(
        pos2(rect.left() + names, rect.top() + 2.0),
        pos2(rect.right() - limits, rect.bottom() - 6.0),
    );
    let line = if fails || late { ink } else { palette.text };
    let show = |ui: &mut Ui| {
        plot(&format!("{name}{}", unit.unit)).show(ui, |plot| {
            plot.set_plot_bounds(PlotBounds::from_min_max([from, low], [0.0, high]));
            if let Some((since, _)) = changes.last() {
                let corners = vec![[*since, low], [0.0, low], [0.0, high], [*since, high]];
                let band = Polygon::new("since the change", corners).fill_color(palette.raised).stroke(Stroke::NONE);
                plot.polygon(band);
            }
            for (name, at) in &bounds {
                let dashed =
                    HLine::new(name, *at).stroke(Stroke::new(1.0, palette.trail)).style(LineStyle::dashed_loose());
                plot.hline(dashed);
            }
            for (at, mode) in changes {
                let color =
                    if *mode == Mode::HoldSafe || *mode == Mode::Degraded { palette.caution } else { palette.quiet };
                plot.vline(VLine::new("change", *at).stroke(Stroke::new(1.0, color)));
            }
            for piece in pieces {
                plot.line(Line::new(name.clone(), PlotPoints::from(piece)).color(line).width(1.6));
            }
        })
    };
    let drawn = ui.scope_builder(eframe::egui::UiBuilder::new().max_rect(place), show).inner;
    if limits == COLUMNS[1] {
        name_limits(ui, &bounds, &drawn.transform, (place, palette.weak));
    }
    let limits: Vec<&str> = bounds.iter().map(|(name, _)| name.as_str()).collect();
    let text = format!(
        "PLOT {} {name} {value}{}",
        unit.unit,
        if limits.is_empty() { String::new() } else { format!(", {}", limits.join(", ")) }
    );
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &text));
}

/// A plot that is only looked at.
fn plot(name: &str) -> Plot<'static> {
    // Its own least height is more than a row has.
    Plot::new(name.to_owned())
        .min_size(Vec2::splat(8.0))
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show_axes(false)
        .show_x(false)
        .show_y(false)
        .show_grid([true, false])
        .set_margin_fraction(Vec2::ZERO)
        // A row has its own height; a plot that is higher would push the axis out of the pane.
        .min_size(Vec2::ZERO)
        .label_formatter(|_| None)
}

/// Least and greatest plotted value: all that is drawn, the limits and zero where it is near.
fn range(pieces: &[Vec<[f64; 2]>], bounds: &[(String, f64)]) -> (f64, f64) {
    let values = || pieces.iter().flatten().map(|[_, y]| *y).chain(bounds.iter().map(|(_, at)| *at));
    let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    if low > high {
        return (0.0, 1.0);
    }
    let low = if low > 0.0 && low < high / 2.0 { 0.0 } else { low };
    let room = ((high - low) * 0.12).max(0.02);
    (low - room, high + room)
}

/// Names of the limits beside the plot; one that would stand on another is pushed below it.
fn name_limits(
    ui: &Ui,
    bounds: &[(String, f64)],
    transform: &egui_plot::PlotTransform,
    (place, ink): (Rect, eframe::egui::Color32),
) {
    let mut rows: Vec<(f32, &str)> = bounds
        .iter()
        .map(|(name, at)| (transform.position_from_point(&PlotPoint::new(0.0, *at)).y, name.as_str()))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = place.top() - 3.0;
    for (y, name) in rows {
        let y = y.clamp(below + 7.0, (place.bottom() - 4.0).max(below + 7.0));
        ui.painter().text(pos2(place.right() + 6.0, y), Align2::LEFT_CENTER, name, FontId::proportional(SMALL), ink);
        below = y + 7.0;
    }
}

/// The axis below all plots: times, and the changes of mode by name, the newest first where there is no room for all.
fn axis(ui: &mut Ui, from: f64, changes: &[Change]) {
    let palette = Palette::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), AXIS - 6.0), Sense::hover());
    let [names, limits] = columns(rect.width());
    let (left, right) = (rect.left() + names, rect.right() - limits);
    let x = |seconds: f64| right - (right - left) * (seconds / from) as f32;
    let font = FontId::proportional(SMALL);
    let step = step(from, f64::from((right - left) / APART));
    let mut at = 0.0;
    while at >= from {
        let text = if at == 0.0 { "now".to_owned() } else { time(at) };
        ui.painter().text(pos2(x(at), rect.top()), Align2::CENTER_TOP, text, font.clone(), palette.weak);
        at -= step;
    }
    let mut free = f32::INFINITY;
    for (at, mode) in changes.iter().rev() {
        let (tone, shape) = marks::mode(*mode);
        let color = if tone > marks::Tone::Mark { tone.color(palette) } else { palette.text };
        let galley = marks::fitted(ui.painter(), mode.name(), SMALL, color, (f32::INFINITY, 1));
        let middle = pos2(x(*at), rect.top() + 25.0);
        let begin = (middle.x - galley.size().x - 8.0).max(left - names + 12.0);
        if middle.x + 6.0 > free {
            continue;
        }
        shape.draw(ui.painter(), middle, 10.0, color);
        if begin + galley.size().x < free {
            ui.painter().galley(pos2(begin, rect.top() + 17.0), galley, color);
            free = begin - 6.0;
        } else {
            free = middle.x - 10.0;
        }
    }
    let named: Vec<String> = changes.iter().map(|(at, mode)| format!("{} {:.0} s ago", mode.name(), -at)).collect();
    let text = if named.is_empty() { "no change of mode".to_owned() } else { named.join(", ") };
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("AXIS {text}")));
}

/// Distance of two written times, seconds, of which there is room for so many.
fn step(from: f64, most: f64) -> f64 {
    let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0, 7200.0];
    steps.into_iter().find(|step| -from / step <= most.min(6.5)).unwrap_or(-from)
}

/// A time before now.
fn time(seconds: f64) -> String {
    let (before, seconds) = (if seconds < 0.0 { "−" } else { "" }, seconds.abs());
    match seconds {
        s if s >= 600.0 => format!("{before}{:.0} min", s / 60.0),
        s => format!("{before}{s:.0} s"),
    }
}

/// Pressing a guard leads here: the series of a guard that can be plotted.
pub(super) fn can_plot(shown: &Shown, guard: wire::mode::Guard) -> bool {
    wire::measured::Limit::for_guard(guard, &shown.bounds).is_some()
}
