//! The map from above, north up: the planned site, the units, their tracks, and how far each may have gone since it was
//! seen.
//!
//! Around each thing stands the circle in which it may be by now at the platform's greatest speed: its age times that
//! speed, which the map states. The circle of a lost thing is pale and ends at [`WIDEST_LOST`]: its place is unknown. A
//! lost thing stays at its last place, crossed out. A track is drawn the smaller and paler the less sure its unit is of
//! it. Fresh is drawn above stale, symbols above labels; a label that finds no room is left out, and their number is
//! stated.

use eframe::egui::{
    Button, FontId, Painter, Pos2, Rect, Response, Role, Sense, Stroke, TextWrapMode, Ui, Vec2, WidgetInfo, vec2,
};
use wire::event::Freshness;
use wire::id::{TrackId, UnitId};
use wire::report::ReportedTrack;
use wire::time::Span;

use super::keys;
use super::marks::{self, Shape, Tone};
use super::plan;
use super::theme::Palette;
use super::view_state::ViewState;
use super::words::{metres, seconds};
use crate::shown::{Shown, ShownUnit};
use crate::site::{GroundPoint, Site};

/// The largest circle that is drawn, metres: beyond it the circle says only "anywhere".
const WIDEST: f32 = 60.0;
/// The largest circle of a lost thing, metres: it is drawn to be found, not to hide the rest.
const WIDEST_LOST: f32 = 10.0;
/// Opacity of a circle, and of that of a lost thing.
const CIRCLE: f32 = 0.6;
const CIRCLE_LOST: f32 = 0.25;
/// A track's symbol, points: at no and at full confidence; and the opacity of the first.
const SYMBOLS: [f32; 2] = [6.0, 12.0];
const PALEST: f32 = 0.3;
/// Distance that one press of an arrow moves the map, pixels.
const STEP_PX: f32 = 60.0;
/// Click distance, points.
const REACH: f32 = 14.0;
/// Number of circles beyond which circles of tracks would hide the map: then the chosen track and the units keep
/// theirs.
const MOST_CIRCLES: usize = 40;
/// Scales that can be zoomed to, points a metre.
const SCALES: std::ops::RangeInclusive<f32> = 0.5..=200.0;

/// The visible part of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    /// Middle of the image.
    center: GroundPoint,
    /// Points a metre.
    scale: f32,
}

/// A camera over a pane.
#[derive(Clone, Copy)]
pub(super) struct View {
    camera: Camera,
    pub(super) rect: Rect,
}

impl View {
    /// Position of a place in the pane.
    pub(super) fn position(&self, place: GroundPoint) -> Pos2 {
        let Camera { center, scale } = self.camera;
        self.rect.center() + vec2((place[0] - center[0]) * scale, (center[1] - place[1]) * scale)
    }

    /// Length of a distance in metres, points.
    pub(super) fn long(&self, metres: f32) -> f32 {
        metres * self.camera.scale
    }

    /// The place at a point of the pane.
    pub(super) fn place(&self, position: Pos2) -> GroundPoint {
        let Camera { center, scale } = self.camera;
        let from = position - self.rect.center();
        [center[0] + from.x / scale, center[1] - from.y / scale]
    }
}

/// Position of the buttons from the upper right corner, their spacing, and height of the notes at the bottom, points.
const BUTTONS: Vec2 = vec2(-36.0, 22.0);
const BUTTON: f32 = 24.0;
const NOTES: f32 = 62.0;

/// Something with a place, an age and a name.
struct Thing {
    at: Pos2,
    may_be: f32,
    tone: Tone,
    shape: Shape,
    label: String,
    freshness: Freshness,
    /// Certainty of the unit about a track, 0 to 1.
    sure: f32,
    /// The track, if it is one.
    track: Option<(UnitId, TrackId)>,
    /// Heading, radians counter-clockwise from east, if it is a unit.
    yaw: Option<f32>,
    chosen: bool,
}

/// Draws the map.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, site: &Site, shown: &Shown) {
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
    let all = visible_places(site, shown);
    let mut view = View { camera: view_state.camera.unwrap_or_else(|| fit(&all, rect)), rect };
    if steer(ui, &response, &mut view) {
        view_state.camera = Some(view.camera);
    }
    let pressed = keys::on_map(ui, &response);
    if let Some(pressed) = pressed.filter(|pressed| pressed.to != Vec2::ZERO || pressed.zoom != 1.0) {
        view.camera.center[0] += pressed.to.x * STEP_PX / view.camera.scale;
        view.camera.center[1] += pressed.to.y * STEP_PX / view.camera.scale;
        zoom(&mut view, rect.center(), pressed.zoom);
        view_state.camera = Some(view.camera);
    }
    if response.double_clicked() || pressed.is_some_and(|pressed| pressed.fit) {
        view_state.camera = None;
    }
    let things = things(view_state, shown, &view);
    let painter = ui.painter_at(rect);
    let palette = Palette::current(ui);
    painter.rect_filled(rect, 0.0, palette.ground);
    let legend = [format!("circles at {:.1} m/s", fastest(shown)), LEGEND.to_owned()];
    let written = plan::draw(&painter, palette, site, &view, &legend);
    let (left_out, crowded) = paint(&painter, palette, &things, written);
    if response.clicked()
        && let Some((unit, track)) = response.interact_pointer_pos().and_then(|place| nearest(&things, place))
    {
        view_state.look_at(unit, track);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, description(&things, &view)));
    if left_out > 0 {
        let circles = if crowded { "; circles of the chosen track and of units only" } else { "" };
        let note = format!("labels left out for want of room: {left_out}{circles}");
        let galley = painter.layout_no_wrap(note, FontId::proportional(11.0), palette.weak);
        // Above the scale, which is in the other corner, and over the axis.
        let place = rect.left_bottom() + vec2(8.0, -45.0 - galley.size().y);
        painter.rect_filled(Rect::from_min_size(place, galley.size()).expand(2.0), 0.0, palette.ground);
        painter.galley(place, galley, palette.weak);
    }
    if response.has_focus() {
        keys::frame(ui, rect);
    }
    buttons(ui, view_state, view);
}

/// Legend of circles and symbols.
const LEGEND: &str = "of what is LOST pale, to 10 m at most; symbols: the surer the larger and stronger";

/// Description of the map for screen readers.
fn description(things: &[Thing], view: &View) -> String {
    let tracks = things.iter().filter(|thing| thing.track.is_some()).count();
    let worse = things.iter().filter(|thing| thing.freshness != Freshness::Fresh).count();
    let (units, across, [east, north]) =
        (things.len() - tracks, view.rect.width() / view.camera.scale, view.camera.center);
    format!(
        "MAP {units} units, {tracks} tracks, {worse} not fresh; {across:.0} m across about ({east:.0}, {north:.0}) m; {LEGEND}"
    )
}

fn visible_places(site: &Site, shown: &Shown) -> Vec<GroundPoint> {
    let units = shown.units.iter().map(|unit| place(unit.pose.get().0.x_mm, unit.pose.get().0.y_mm));
    site.fence.iter().chain(&site.route).copied().chain(units).collect()
}

fn place(x_mm: i32, y_mm: i32) -> GroundPoint {
    [metres(x_mm) as f32, metres(y_mm) as f32]
}

/// A camera that sees all of it.
fn fit(places: &[GroundPoint], rect: Rect) -> Camera {
    let span = |axis: usize| {
        let coordinates = || places.iter().map(move |place| place[axis]).filter(|x| x.is_finite());
        (coordinates().fold(f32::INFINITY, f32::min), coordinates().fold(f32::NEG_INFINITY, f32::max))
    };
    let ((left, right), (bottom, top)) = (span(0), span(1));
    if left > right || bottom > top {
        return Camera { center: [0.0, 0.0], scale: 8.0 };
    }
    let (wide, high) = ((right - left).max(10.0), (top - bottom).max(10.0));
    let scale = ((rect.width() - 56.0) / wide).min((rect.height() - 56.0) / high);
    let center = [f32::midpoint(left, right), f32::midpoint(bottom, top)];
    Camera { center, scale: scale.clamp(*SCALES.start(), *SCALES.end()) }
}

/// Pans and zooms; whether that was done.
fn steer(ui: &Ui, response: &Response, view: &mut View) -> bool {
    let drag = response.drag_delta();
    let scale = view.camera.scale;
    view.camera.center[0] -= drag.x / scale;
    view.camera.center[1] += drag.y / scale;
    let (wheel, pointer) = ui.input(|input| (input.smooth_scroll_delta().y, input.pointer.hover_pos()));
    let zoomed = response.hovered() && wheel != 0.0;
    if let (true, Some(pointer)) = (zoomed, pointer) {
        zoom(view, pointer, libm::expf(wheel / 200.0));
    }
    zoomed || drag != Vec2::ZERO
}

/// Zooms about a point of the pane.
fn zoom(view: &mut View, position: Pos2, amount: f32) {
    let before = view.place(position);
    view.camera.scale = (view.camera.scale * amount).clamp(*SCALES.start(), *SCALES.end());
    let after = view.place(position);
    view.camera.center[0] += before[0] - after[0];
    view.camera.center[1] += before[1] - after[1];
}

fn buttons(ui: &mut Ui, view_state: &mut ViewState, mut view: View) {
    let mut corner = view.rect.right_top() + BUTTONS;
    for (sign, says, by) in [("+", "zoom in", 1.25), ("-", "zoom out", 0.8), ("fit", "fit the map", 0.0)] {
        let place = Rect::from_min_size(corner, Vec2::new(30.0, 20.0));
        let button = ui.put(place, Button::new(sign).small().wrap_mode(TextWrapMode::Extend));
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, says));
        corner.y += BUTTON;
        if button.clicked() {
            let middle = view.rect.center();
            zoom(&mut view, middle, if by > 0.0 { by } else { 1.0 });
            view_state.camera = (by > 0.0).then_some(view.camera);
        }
    }
}

/// The platform's greatest speed, m/s.
fn fastest(shown: &Shown) -> f32 {
    shown.bounds.max_speed_mm_s as f32 / 1000.0
}

fn things(view_state: &ViewState, shown: &Shown, view: &View) -> Vec<Thing> {
    let speed = fastest(shown);
    let may_be = |age: Span, freshness: Freshness| {
        let widest = if freshness == Freshness::Lost { WIDEST_LOST } else { WIDEST };
        view.long((age.as_ms() as f32 / 1000.0 * speed).min(widest))
    };
    let mut things = Vec::new();
    for unit in &shown.units {
        let tracks = unit.tracks.iter().map(|track| (track, false));
        let lost = unit.lost.iter().map(|lost| (&lost.track, true));
        for (labelled, dropped) in tracks.chain(lost) {
            let (track, of) = labelled.get();
            let freshness = if dropped { Freshness::Lost } else { of };
            let (tone, shape, word) = marks::track(of, dropped);
            let id = (unit.unit, track.id);
            things.push(Thing {
                at: view.position(place(track.x_mm, track.y_mm)),
                may_be: may_be(labelled.age(), freshness),
                tone,
                shape,
                label: label(&name(unit, track, shown), freshness, word, labelled.age()),
                freshness,
                sure: f32::from(track.confidence.min(1000)) / 1000.0,
                track: Some(id),
                yaw: None,
                chosen: view_state.track == Some(id),
            });
        }
        things.push(unit_thing(view_state, unit, view, may_be(unit.pose.age(), unit.pose.freshness())));
    }
    // The worst first, so that the fresh are painted above them; units above all.
    things.sort_by_key(|thing| (thing.chosen, thing.yaw.is_some(), std::cmp::Reverse(thing.freshness), thing.track));
    things
}

fn unit_thing(view_state: &ViewState, unit: &ShownUnit, view: &View, may_be: f32) -> Thing {
    let (pose, freshness) = unit.pose.get();
    let (tone, _, word) = marks::freshness(freshness);
    Thing {
        at: view.position(place(pose.x_mm, pose.y_mm)),
        may_be,
        tone,
        shape: Shape::Triangle,
        label: label(unit.unit.name(), freshness, word, unit.pose.age()),
        freshness,
        sure: 1.0,
        track: None,
        yaw: Some(f32::from(pose.yaw_mrad) / 1000.0),
        chosen: view_state.unit == unit.unit,
    }
}

/// True if a track is less sure than an arming of its unit asks for.
pub(super) fn unsure(unit: &ShownUnit, track: &ReportedTrack, shown: &Shown) -> bool {
    track.confidence < unit.settings(&shown.bounds).arm_permille
}

/// A track's number and class, and how sure it is where that is too little to arm on.
fn name(unit: &ShownUnit, track: &ReportedTrack, shown: &Shown) -> String {
    let name = format!("{} {}", track.id.0, track.class.name());
    if unsure(unit, track, shown) { format!("{name} {:.2}", f64::from(track.confidence) / 1000.0) } else { name }
}

fn label(name: &str, freshness: Freshness, word: &str, age: Span) -> String {
    if freshness == Freshness::Fresh { name.to_owned() } else { format!("{name} {word} {}", seconds(age)) }
}

/// Paints every thing, without a label over `written` areas. Returns the number of labels without room, and whether
/// circles were left out.
fn paint(painter: &Painter, palette: &Palette, things: &[Thing], written: Vec<Rect>) -> (usize, bool) {
    let wide = |thing: &&Thing| thing.may_be > 8.0;
    let crowded = things.iter().filter(wide).count() > MOST_CIRCLES;
    for thing in things.iter().filter(wide) {
        let color = thing.tone.color(palette);
        if !crowded || thing.chosen || thing.yaw.is_some() {
            let pale = if thing.freshness == Freshness::Lost { CIRCLE_LOST } else { CIRCLE };
            plan::dashed_circle(painter, thing.at, thing.may_be, Stroke::new(1.0, color.gamma_multiply(pale)));
        }
    }
    let left_out = labels(painter, palette, things, written);
    for thing in things {
        let color = thing.tone.color(palette);
        if thing.chosen {
            painter.circle_stroke(thing.at, 12.0, Stroke::new(1.5, palette.mark));
        }
        match thing.yaw {
            Some(yaw) => {
                arrow(painter, thing, yaw, if thing.freshness == Freshness::Fresh { palette.strong } else { color })
            }
            None => {
                let [least, most] = SYMBOLS;
                let strength = PALEST + (1.0 - PALEST) * thing.sure;
                let size = least + (most - least) * thing.sure;
                thing.shape.draw(painter, thing.at, size, color.gamma_multiply(strength));
            }
        }
    }
    (left_out, crowded)
}

/// A unit, pointing where it heads; hollow when its place is not fresh.
fn arrow(painter: &Painter, thing: &Thing, yaw: f32, color: eframe::egui::Color32) {
    let (sin, cos) = libm::sincosf(yaw);
    let corner = |x: f32, y: f32| thing.at + vec2(x * cos - y * sin, -(x * sin + y * cos));
    let corners = vec![corner(11.0, 0.0), corner(-8.0, 7.0), corner(-4.0, 0.0), corner(-8.0, -7.0)];
    let stroke = Stroke::new(1.5, color);
    if thing.freshness == Freshness::Fresh {
        let halves = [vec![corners[0], corners[1], corners[2]], vec![corners[0], corners[2], corners[3]]];
        halves.into_iter().for_each(|half| {
            painter.add(eframe::egui::Shape::convex_polygon(half, color, Stroke::NONE));
        });
    } else {
        painter.add(eframe::egui::Shape::closed_line(corners, stroke));
    }
}

/// Labels from the most to the least important, each at the first of four places that is free of symbols, of other
/// labels and of `written` areas.
fn labels(painter: &Painter, palette: &Palette, things: &[Thing], written: Vec<Rect>) -> usize {
    let inside = painter.clip_rect();
    let size = |thing: &Thing| match (thing.chosen, thing.yaw) {
        (true, _) => 26.0,
        (false, Some(_)) => 20.0,
        (false, None) => 11.0,
    };
    let symbols = things.iter().map(|t| Rect::from_center_size(t.at, Vec2::splat(size(t))));
    let mut rects: Vec<Rect> = symbols.chain(written).collect();
    // What is drawn above: the buttons, the note and the scale.
    rects.push(Rect::from_min_size(inside.right_top() + BUTTONS, vec2(30.0, 3.0 * BUTTON)));
    rects.push(Rect::from_min_max(inside.left_bottom() - vec2(0.0, NOTES), inside.right_bottom()));
    let mut left_out = 0;
    for thing in things.iter().rev().filter(|thing| inside.contains(thing.at)) {
        let color = if thing.tone == Tone::Normal { palette.text } else { thing.tone.color(palette) };
        let galley = painter.layout_no_wrap(thing.label.clone(), FontId::monospace(11.0), color);
        let (w, h) = (galley.size().x, galley.size().y);
        let off = size(thing) / 2.0 + 5.0;
        let places = [vec2(off, -h / 2.0), vec2(-w - off, -h / 2.0), vec2(-w / 2.0, -h - off), vec2(-w / 2.0, off)];
        let mut free = places.iter().map(|offset| Rect::from_min_size(thing.at + *offset, vec2(w, h)));
        match free.find(|rect| inside.contains_rect(*rect) && !rects.iter().any(|other| other.intersects(*rect))) {
            Some(rect) => {
                painter.rect_filled(rect.expand(1.0), 1.0, palette.ground.gamma_multiply(0.8));
                painter.galley(rect.min, galley, color);
                rects.push(rect);
            }
            None => left_out += 1,
        }
    }
    left_out
}

fn nearest(things: &[Thing], place: Pos2) -> Option<(UnitId, TrackId)> {
    let near = things.iter().filter(|thing| thing.track.is_some() && thing.at.distance(place) <= REACH);
    near.min_by(|a, b| a.at.distance(place).total_cmp(&b.at.distance(place))).and_then(|thing| thing.track)
}
