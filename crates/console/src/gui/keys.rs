//! Keys for elements without a control: panning the map, scrolling a list. Both are reached with Tab.
//!
//! The keys that give orders work everywhere and are `command`'s.

use eframe::egui::{EventFilter, Key, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, vec2};

use super::theme::{Palette, ROW};

/// Rows that a page is.
const PAGE: f32 = 8.0;
/// Factor by which one press zooms.
const ZOOM: f32 = 1.25;

/// Keys pressed on a focused map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pressed {
    /// Direction in presses: right and up.
    pub(super) to: Vec2,
    /// Factor to zoom by.
    pub(super) zoom: f32,
    /// True if all is to be seen.
    pub(super) fit: bool,
}

/// Keys on a focused map. The caller draws the map, then its [`frame`] above it.
pub(super) fn on_map(ui: &Ui, map: &Response) -> Option<Pressed> {
    if !map.has_focus() {
        return None;
    }
    hold_focus(ui, map);
    let times = times(ui);
    let to = vec2(times(Key::ArrowRight) - times(Key::ArrowLeft), times(Key::ArrowUp) - times(Key::ArrowDown));
    let steps = times(Key::Plus) + times(Key::Equals) - times(Key::Minus);
    Some(Pressed { to, zoom: libm::powf(ZOOM, steps), fit: times(Key::Home) > 0.0 })
}

/// Lets keys scroll the list that is drawn next in `ui`. The list takes the rest of the room and holds no control.
pub(super) fn scroll_next(ui: &mut Ui, name: &str) {
    let room = ui.available_rect_before_wrap();
    let list = ui.interact(room, ui.scope_id().with("list"), Sense::focusable_noninteractive());
    list.widget_info(|| WidgetInfo::labeled(Role::List, true, name));
    if !list.has_focus() {
        return;
    }
    hold_focus(ui, &list);
    frame(ui, room);
    let times = times(ui);
    let rows = times(Key::ArrowDown) - times(Key::ArrowUp) + PAGE * (times(Key::PageDown) - times(Key::PageUp));
    if rows != 0.0 {
        ui.scroll_with_delta(vec2(0.0, -rows * ROW));
    }
}

/// Arrows are the focused thing's, and Tab leads on.
fn hold_focus(ui: &Ui, response: &Response) {
    let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
}

/// The focus frame.
pub(super) fn frame(ui: &Ui, rect: Rect) {
    ui.painter().rect_stroke(rect.shrink(1.0), 0.0, Stroke::new(1.0, Palette::current(ui).mark), StrokeKind::Inside);
}

fn times(ui: &Ui) -> impl Fn(Key) -> f32 + '_ {
    |key| ui.input(|input| input.num_presses(key)) as f32
}
