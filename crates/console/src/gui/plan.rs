//! Background of the map below the units: contours, grid, scale, geofence, obstacles, route.

use eframe::egui::{Align2, FontId, Painter, Pos2, Rect, Shape, Stroke, vec2};

use super::contour;
use super::map::View;
use super::theme::Palette;
use crate::site::{GroundPoint, Relief, Site, SiteBox};

/// Steps of the grid, metres: the first that is wide enough on screen is drawn.
const STEPS: [f32; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Least width of a grid's step, points.
const LEAST_STEP: f32 = 56.0;

/// Paints the plan of the site, with this legend at its scale, a line each; where something is written on it.
pub(super) fn draw(painter: &Painter, palette: &Palette, site: &Site, view: &View, legend: &[String; 2]) -> Vec<Rect> {
    let step = STEPS.into_iter().find(|step| view.long(*step) >= LEAST_STEP).unwrap_or(STEPS[STEPS.len() - 1]);
    let contours = site.relief.as_ref().and_then(|relief| contours(painter, palette, relief, view));
    let mut written = grid(painter, palette, view, step);
    site.blocks.iter().for_each(|block| paint_block(painter, palette, view, block));
    let fence: Vec<Pos2> = points(&site.fence, view);
    for (at, from) in fence.iter().enumerate() {
        let to = fence[(at + 1) % fence.len()];
        painter.extend(Shape::dashed_line(&[*from, to], Stroke::new(1.5, palette.weak), 10.0, 4.0));
    }
    written.extend(route(painter, palette, site, view));
    scale(painter, palette, view, step, contours, legend);
    written
}

/// Lines of equal height; how far these are apart, where there are any.
fn contours(painter: &Painter, palette: &Palette, relief: &Relief, view: &View) -> Option<f32> {
    let lines = contour::lines(relief)?;
    let stroke = Stroke::new(1.0, palette.line);
    for line in &lines.segments {
        painter.line_segment(line.map(|place| view.position(place)), stroke);
    }
    Some(lines.step)
}

/// A circle of dashes, each about 6 points long.
pub(super) fn dashed_circle(painter: &Painter, center: Pos2, radius: f32, stroke: Stroke) {
    let steps = ((radius * std::f32::consts::TAU / 8.0) as usize).clamp(16, 160);
    let vertex = |step: usize| {
        let (sin, cos) = libm::sincosf(step as f32 / steps as f32 * std::f32::consts::TAU);
        center + vec2(cos, sin) * radius
    };
    let path: Vec<Pos2> = (0..=steps).map(vertex).collect();
    painter.extend(Shape::dashed_line(&path, stroke, 6.0, 4.0));
}

fn points(places: &[GroundPoint], view: &View) -> Vec<Pos2> {
    places.iter().map(|place| view.position(*place)).collect()
}

/// The grid; where its names stand.
fn grid(painter: &Painter, palette: &Palette, view: &View, step: f32) -> Vec<Rect> {
    let mut written = Vec::new();
    let (low, high) = (view.place(view.rect.left_bottom()), view.place(view.rect.right_top()));
    let lines = |axis: usize| ((low[axis] / step).ceil() as i32..=(high[axis] / step).floor() as i32).take(200);
    let stroke = Stroke::new(1.0, palette.faint);
    let font = FontId::monospace(10.0);
    for x in lines(0) {
        let at = view.position([x as f32 * step, 0.0]).x;
        painter.vline(at, view.rect.y_range(), stroke);
        let place = Pos2::new(at, view.rect.top() + 3.0);
        written.push(painter.text(place, Align2::CENTER_TOP, grid_name(x, step), font.clone(), palette.weak));
    }
    for y in lines(1) {
        let at = view.position([0.0, y as f32 * step]).y;
        painter.hline(view.rect.x_range(), at, stroke);
        let place = Pos2::new(view.rect.left() + 4.0, at);
        written.push(painter.text(place, Align2::LEFT_CENTER, grid_name(y, step), font.clone(), palette.weak));
    }
    written
}

fn grid_name(line: i32, step: f32) -> String {
    format!("{:.0}", line as f32 * step)
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

/// The route; where its numbers stand.
fn route(painter: &Painter, palette: &Palette, site: &Site, view: &View) -> Vec<Rect> {
    let points = points(&site.route, view);
    let mut path = points.clone();
    if site.looped {
        path.extend(points.first());
    }
    painter.extend(Shape::dotted_line(&path, palette.weak, 8.0, 1.0));
    let number = |(number, position): (usize, &Pos2)| {
        painter.circle(*position, 3.5, palette.ground, Stroke::new(1.0, palette.weak));
        painter.text(*position + vec2(6.0, 6.0), Align2::LEFT_TOP, number + 1, FontId::proportional(10.0), palette.weak)
    };
    points.iter().enumerate().map(number).collect()
}

fn scale(painter: &Painter, palette: &Palette, view: &View, step: f32, contours: Option<f32>, legend: &[String; 2]) {
    let right = view.rect.right_bottom() + vec2(-12.0, -10.0);
    let left = right - vec2(view.long(step), 0.0);
    let stroke = Stroke::new(1.5, palette.text);
    painter.line_segment([left, right], stroke);
    for end in [left, right] {
        painter.line_segment([end - vec2(0.0, 3.0), end + vec2(0.0, 3.0)], stroke);
    }
    let contours = contours.map_or_else(String::new, |distance| format!(", contours every {distance} m"));
    let [first, second] = legend;
    let lines = [second.clone(), format!("{step:.0} m, north up{contours}; {first}")];
    for (line, up) in lines.into_iter().zip([4.0, 18.0]) {
        painter.text(right - vec2(0.0, up), Align2::RIGHT_BOTTOM, line, FontId::proportional(11.0), palette.text);
    }
}
