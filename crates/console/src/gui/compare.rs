//! Two recordings side by side, at the same time of their runs: of each the banner, the map and the plots.
//!
//! Both are only looked at, so no command column stands beside them.

use eframe::egui::{Frame, Margin, RichText, Ui, UiBuilder, pos2};
use wire::id::UnitId;

use super::theme::{Palette, SMALL};
use super::view_state::ViewState;
use super::{banner, map, plots};
use crate::shown::Shown;
use crate::site::Site;
use crate::source::Beside;

/// Share of a half's height below its banner that the map takes.
const MAP: f32 = 0.52;
/// Between the halves, points.
const GAP: f32 = 6.0;

/// State of the second half.
#[derive(Debug)]
pub(super) struct Half {
    view_state: ViewState,
}

impl Half {
    /// The half of a recording that shows `unit` first.
    pub(super) fn new(unit: UnitId) -> Self {
        Self { view_state: ViewState::new(unit) }
    }
}

/// Draws both halves.
pub(super) fn draw(ui: &mut Ui, own: (&mut ViewState, &Site, &Shown), half: &mut Half, beside: &Beside) {
    let (view_state, site, shown) = own;
    let whole = ui.available_rect_before_wrap();
    let middle = whole.center().x;
    let left = whole.with_max_x(middle - GAP / 2.0);
    let right = whole.with_min_x(middle + GAP / 2.0);
    half.view_state.choose(view_state.unit);
    half.view_state.whole_run = view_state.whole_run;
    half.view_state.plotted = view_state.plotted;
    let mut one =
        |place: eframe::egui::Rect, name: &str, (view_state, site, shown): (&mut ViewState, &Site, &Shown)| {
            let builder = UiBuilder::new().max_rect(place).id_salt(name);
            ui.scope_builder(builder, |ui| side(ui, name, view_state, site, shown));
        };
    one(left, &beside.own, (view_state, site, shown));
    one(right, &beside.name, (&mut half.view_state, &beside.site, &beside.shown));
}

/// One half.
fn side(ui: &mut Ui, name: &str, view_state: &mut ViewState, site: &Site, shown: &Shown) {
    let palette = *Palette::current(ui);
    Frame::new().fill(palette.pane).inner_margin(Margin::symmetric(8, 6)).show(ui, |ui| {
        ui.label(RichText::new(super::words::tame_to(name, 80)).size(SMALL).color(palette.weak));
        banner::draw(ui, view_state, shown);
    });
    let rest = ui.available_rect_before_wrap();
    let border = rest.top() + rest.height() * MAP;
    let above = rest.with_max_y(border - GAP / 2.0);
    let below = eframe::egui::Rect::from_min_max(pos2(rest.left(), border + GAP / 2.0), rest.max);
    ui.scope_builder(UiBuilder::new().max_rect(above).id_salt("map"), |ui| map::draw(ui, view_state, site, shown));
    ui.scope_builder(UiBuilder::new().max_rect(below).id_salt("plots"), |ui| {
        Frame::new()
            .fill(palette.pane)
            .inner_margin(Margin::symmetric(8, 6))
            .show(ui, |ui| plots::draw(ui, view_state, shown));
    });
}
