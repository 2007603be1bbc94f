//! The visible part of the world, and how it moves: dragging, wheel, keys, fitting, following.
//!
//! North is up at every scale. Drawing is left to the other parts of the map.

use eframe::egui::{Pos2, Rect, Response, Ui, Vec2, vec2};

use crate::gui::keys::{self, Pressed};
use crate::gui::view_state::ViewState;
use crate::site::GroundPoint;

/// Distance that one press of an arrow moves the map, points.
const STEP: f32 = 60.0;
/// Scales that can be zoomed to, points a metre.
const SCALES: std::ops::RangeInclusive<f32> = 0.5..=200.0;
/// Room around fitted places, points, and the least extent that is fitted, metres.
const AROUND: f32 = 48.0;
const LEAST: f32 = 10.0;
/// Share of the map at each side that a followed unit keeps out of.
const SIDE: f32 = 0.2;

/// The visible part of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::gui) struct Camera {
    /// Middle of the map.
    pub(super) center: GroundPoint,
    /// Points a metre.
    pub(super) scale: f32,
}

impl Camera {
    /// A camera that sees all of these places.
    pub(super) fn over(places: &[GroundPoint], rect: Rect) -> Self {
        let span = |axis: usize| {
            let coordinates = || places.iter().map(move |place| place[axis]).filter(|x| x.is_finite());
            (coordinates().fold(f32::INFINITY, f32::min), coordinates().fold(f32::NEG_INFINITY, f32::max))
        };
        let ((left, right), (bottom, top)) = (span(0), span(1));
        if left > right || bottom > top {
            return Self { center: [0.0, 0.0], scale: 8.0 };
        }
        let (wide, high) = ((right - left).max(LEAST), (top - bottom).max(LEAST));
        let scale = ((rect.width() - AROUND) / wide).min((rect.height() - AROUND) / high);
        let center = [f32::midpoint(left, right), f32::midpoint(bottom, top)];
        Self { center, scale: scale.clamp(*SCALES.start(), *SCALES.end()) }
    }
}

/// A camera over the area of the data.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) camera: Camera,
    pub(super) rect: Rect,
}

impl View {
    /// Position of a place in the window.
    pub(super) fn position(&self, place: GroundPoint) -> Pos2 {
        let Camera { center, scale } = self.camera;
        self.rect.center() + vec2((place[0] - center[0]) * scale, (center[1] - place[1]) * scale)
    }

    /// Positions of places.
    pub(super) fn positions(&self, places: &[GroundPoint]) -> Vec<Pos2> {
        places.iter().map(|place| self.position(*place)).collect()
    }

    /// Length of a distance in metres, points.
    pub(super) fn long(&self, metres: f32) -> f32 {
        metres * self.camera.scale
    }

    /// The place at a point of the window.
    pub(super) fn place(&self, position: Pos2) -> GroundPoint {
        let Camera { center, scale } = self.camera;
        let from = position - self.rect.center();
        [center[0] + from.x / scale, center[1] - from.y / scale]
    }

    /// Moves the camera by so many points, right and down.
    fn pan(&mut self, by: Vec2) {
        self.camera.center[0] += by.x / self.camera.scale;
        self.camera.center[1] -= by.y / self.camera.scale;
    }

    /// Zooms about a point of the window.
    pub(super) fn zoom(&mut self, about: Pos2, by: f32) {
        let before = self.place(about);
        self.camera.scale = (self.camera.scale * by).clamp(*SCALES.start(), *SCALES.end());
        let after = self.place(about);
        self.camera.center[0] += before[0] - after[0];
        self.camera.center[1] += before[1] - after[1];
    }

    /// Moves no further than brings the place away from the sides.
    fn keep(&mut self, place: GroundPoint) {
        let at = self.position(place);
        let inner = self.rect.shrink2(self.rect.size() * SIDE);
        if at.is_finite() && inner.is_positive() {
            self.pan(at - at.clamp(inner.min, inner.max));
        }
    }
}

/// The view of this frame: as it was, moved by hand, and after the chosen unit at `followed`. A hand on the map ends
/// the following; fitting begins it again.
pub(super) fn steer(
    ui: &Ui,
    response: &Response,
    view_state: &mut ViewState,
    fitted: Camera,
    followed: Option<GroundPoint>,
) -> View {
    let mut view = View { camera: view_state.camera.unwrap_or(fitted), rect: response.rect };
    let pressed = keys::on_map(ui, response);
    if response.double_clicked() || pressed.is_some_and(|pressed| pressed.fit) {
        fit(view_state);
        view.camera = fitted;
    } else {
        by_hand(ui, response, pressed, view_state, &mut view);
    }
    if let Some(place) = followed.filter(|_| view_state.follow) {
        view.keep(place);
    }
    view
}

/// Shows the whole site again, and follows.
pub(super) fn fit(view_state: &mut ViewState) {
    (view_state.camera, view_state.follow) = (None, true);
}

fn by_hand(ui: &Ui, response: &Response, pressed: Option<Pressed>, view_state: &mut ViewState, view: &mut View) {
    let arrows = pressed.map_or(Vec2::ZERO, |pressed| vec2(pressed.to.x, -pressed.to.y) * STEP);
    let moved = arrows - response.drag_delta();
    let (wheel, pointer) = ui.input(|input| (input.smooth_scroll_delta().y, input.pointer.hover_pos()));
    let wheeled = pointer.filter(|_| response.hovered() && wheel != 0.0);
    let zoomed = pressed.map_or(1.0, |pressed| pressed.zoom);
    view.pan(moved);
    view.zoom(view.rect.center(), zoomed);
    if let Some(pointer) = wheeled {
        view.zoom(pointer, libm::expf(wheel / 200.0));
    }
    if moved != Vec2::ZERO {
        view_state.follow = false;
    }
    if moved != Vec2::ZERO || zoomed != 1.0 || wheeled.is_some() {
        view_state.camera = Some(view.camera);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        let rect = Rect::from_min_size(Pos2::new(40.0, 10.0), vec2(600.0, 400.0));
        View { camera: Camera::over(&[[-40.0, -40.0], [40.0, 40.0]], rect), rect }
    }

    #[test]
    fn a_fitted_map_shows_every_place() {
        let view = view();
        for place in [[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0]] {
            assert!(view.rect.contains(view.position(place)), "{place:?}");
            let [x, y] = view.place(view.position(place));
            assert!((x - place[0]).abs() < 1e-3 && (y - place[1]).abs() < 1e-3);
        }
        let empty = Camera::over(&[[f32::NAN, 0.0]], view.rect);
        assert_eq!(empty, Camera { center: [0.0, 0.0], scale: 8.0 });
    }

    #[test]
    fn a_followed_place_never_leaves_the_map() {
        let mut view = view();
        let before = view.camera;
        view.keep([0.0, 0.0]);
        assert_eq!(view.camera, before, "it is in view already");
        for place in [[500.0, -30.0], [-4000.0, 9000.0], [0.0, 38.0]] {
            view.keep(place);
            assert!(view.rect.shrink2(view.rect.size() * (SIDE - 0.01)).contains(view.position(place)), "{place:?}");
        }
        view.keep([f32::INFINITY, 0.0]);
        assert!(view.camera.center.iter().all(|x| x.is_finite()));
    }
}
