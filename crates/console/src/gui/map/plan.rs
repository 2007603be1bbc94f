//! Background of the map below the units: contours, grid, obstacles, fence, the line before it, route and progress.
//!
//! The numbers of the axes and the scale stand outside of the data, in `legend`.

use eframe::egui::{Color32, Painter, Pos2, Shape, Stroke};
use wire::id::UnitId;

use super::camera::View;
use super::{contour, fence};
use crate::gui::theme::Palette;
use crate::gui::view_state::ViewState;
use crate::shown::Shown;
use crate::site::{Relief, Site, SiteBox};

/// Steps of the grid, metres: the first that is wide enough on screen is drawn.
const STEPS: [f32; 9] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
/// Least width of a grid's step, points.
const LEAST_STEP: f32 = 56.0;
/// Most lines of the grid in each direction.
const MAX_LINES: usize = 200;
/// Opacity of contours.
const CONTOURS: f32 = 0.4;
/// Distance of the dots of the line before the fence, points.
const DOTS: f32 = 6.0;

/// Dashes of the ground track, points, and seconds between two arrows on it.
const TRACK: [f32; 2] = [12.0, 5.0];
const ARROWS: usize = 3;

/// The unit with the mission that the site shows: the launcher hands over that of the unit under test.
const PLANNED: UnitId = UnitId::A;

/// Step of the grid at a scale, metres.
pub(super) fn step(view: &View) -> f32 {
    STEPS.into_iter().find(|step| view.long(*step) >= LEAST_STEP).unwrap_or(STEPS[STEPS.len() - 1])
}

/// The largest of the grid's steps that is at most `points` long, metres.
pub(super) fn below(view: &View, points: f32) -> f32 {
    STEPS.into_iter().rev().find(|step| view.long(*step) <= points).unwrap_or(STEPS[0])
}

/// Numbers of the grid's lines along an axis, in steps.
pub(super) fn lines(view: &View, axis: usize, step: f32) -> impl Iterator<Item = i32> {
    let (low, high) = (view.place(view.rect.left_bottom()), view.place(view.rect.right_top()));
    ((low[axis] / step).ceil() as i32..=(high[axis] / step).floor() as i32).take(MAX_LINES)
}

/// Paints the plan of the site; distance between two contours in metres, where there are any.
pub(super) fn draw(
    painter: &Painter,
    palette: &Palette,
    site: &Site,
    shown: &Shown,
    view_state: &ViewState,
    view: &View,
) -> Option<f32> {
    let stroke = Stroke::new(1.0, palette.faint);
    let step = step(view);
    lines(view, 0, step).for_each(|x| {
        painter.vline(view.position([x as f32 * step, 0.0]).x, view.rect.y_range(), stroke);
    });
    lines(view, 1, step).for_each(|y| {
        painter.hline(view.rect.x_range(), view.position([0.0, y as f32 * step]).y, stroke);
    });
    let contours = site.relief.as_ref().and_then(|relief| contours(painter, palette, relief, view));
    site.blocks.iter().for_each(|block| paint_block(painter, palette, view, block));
    paint_fence(painter, palette, site, shown, view_state, view);
    ground_track(painter, palette, site, view);
    route(painter, palette, site, shown, view);
    contours
}

/// The way of the point below a satellite, by its planned orbit, with arrows where it leads.
fn ground_track(painter: &Painter, palette: &Palette, site: &Site, view: &View) {
    let way = view.positions(&site.below);
    let stroke = Stroke::new(1.4, palette.quiet);
    painter.extend(Shape::dashed_line(&way, stroke, TRACK[0], TRACK[1]));
    let inside = way.windows(2).filter(|ends| view.rect.contains(ends[0]));
    for ends in inside.step_by(ARROWS) {
        let along = (ends[1] - ends[0]).normalized() * 9.0;
        let tip = ends[0];
        for side in [along.rot90(), -along.rot90()] {
            painter.line_segment([tip, tip - along + side * 0.6], stroke);
        }
    }
}

/// The fence, the route and the ground track as lines, for labels to keep off.
pub(super) fn paths(site: &Site, view: &View) -> [Vec<Pos2>; 3] {
    let mut paths = [&site.fence, &site.route, &site.below].map(|places| view.positions(places));
    for (path, closed) in paths.iter_mut().zip([true, site.looped, false]) {
        path.extend(path.first().copied().filter(|_| closed));
    }
    paths
}

/// Lines of equal height; how far these are apart, where there are any.
fn contours(painter: &Painter, palette: &Palette, relief: &Relief, view: &View) -> Option<f32> {
    let lines = contour::lines(relief)?;
    let stroke = Stroke::new(1.0, palette.line.gamma_multiply(CONTOURS));
    for line in &lines.segments {
        painter.line_segment(line.map(|place| view.position(place)), stroke);
    }
    Some(lines.step)
}

fn paint_fence(painter: &Painter, palette: &Palette, site: &Site, shown: &Shown, view_state: &ViewState, view: &View) {
    let [path, ..] = paths(site, view);
    painter.extend(Shape::dashed_line(&path, Stroke::new(2.0, palette.text), 10.0, 6.0));
    let inside = fence::stops_within(&view_state.in_force(shown), &shown.bounds);
    for dot in fence::line_within(&site.fence, inside, DOTS / view.camera.scale) {
        let at = view.position(dot);
        if view.rect.contains(at) {
            painter.circle_filled(at, 1.0, palette.quiet);
        }
    }
}

/// A circle of dashes, each about 6 points long.
pub(super) fn dashed_circle(painter: &Painter, center: Pos2, radius: f32, stroke: Stroke) {
    let steps = ((radius * std::f32::consts::TAU / 8.0) as usize).clamp(16, 160);
    let vertex = |step: usize| {
        let (sin, cos) = libm::sincosf(step as f32 / steps as f32 * std::f32::consts::TAU);
        center + eframe::egui::vec2(cos, sin) * radius
    };
    let path: Vec<Pos2> = (0..=steps).map(vertex).collect();
    painter.extend(Shape::dashed_line(&path, stroke, 6.0, 4.0));
}

fn paint_block(painter: &Painter, palette: &Palette, view: &View, block: &SiteBox) {
    let (sin, cos) = libm::sincosf(block.yaw);
    let corner = |x: f32, y: f32| {
        let (x, y) = (x * block.half[0], y * block.half[1]);
        view.position([block.at[0] + x * cos - y * sin, block.at[1] + x * sin + y * cos])
    };
    let corners = vec![corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
    painter.add(Shape::convex_polygon(corners, palette.raised, Stroke::new(1.0, palette.line)));
}

/// Way points that the unit with this mission has reached, of how many; none if it is not heard or has none.
pub(super) fn reached(site: &Site, shown: &Shown) -> Option<(usize, usize)> {
    let all = site.route.len();
    let progress = usize::from(shown.unit(PLANNED)?.state.get().0.progress.min(1000));
    // A report states the share of way points in whole permille, rounded down.
    (all > 0).then(|| (((progress * all + all) / 1000).min(all), all))
}

/// The route: way points reached are filled, those to come are rings.
fn route(painter: &Painter, palette: &Palette, site: &Site, shown: &Shown, view: &View) {
    let [_, path, _] = paths(site, view);
    painter.add(Shape::line(path, Stroke::new(1.4, palette.quiet)));
    let reached = reached(site, shown).map_or(0, |(reached, _)| reached);
    for (number, at) in view.positions(&site.route).into_iter().enumerate() {
        let fill: Color32 = if number < reached { palette.quiet } else { palette.ground };
        painter.circle(at, 3.5, fill, Stroke::new(1.4, palette.quiet));
    }
}
