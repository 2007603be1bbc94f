//! Painting of things and of their labels: circles of possible places, extents, trails, symbols, distances.
//!
//! Fresh is drawn above stale, symbols above circles, labels above both. Where a label stands is `labels`' to find.

use std::sync::Arc;

use eframe::egui::{Color32, FontId, Galley, Painter, Pos2, Rect, Shape as Drawn, Stroke, StrokeKind, Vec2, vec2};
use wire::event::Freshness;

use super::labels::{Obstacles, Placed, Reach, Wanted};
use super::plan;
use super::things::{Of, Thing, UnitMark};
use super::trail::{self, Trail};
use crate::banner::Sign;
use crate::gui::marks::{Shape, Tone};
use crate::gui::theme::Palette;

/// Opacity of a circle, and of that of a lost thing.
const CIRCLE: f32 = 0.6;
const CIRCLE_LOST: f32 = 0.25;
/// A track's symbol, points: at no and at full confidence; and the opacity of the first.
const SYMBOLS: [f32; 2] = [6.0, 12.0];
const PALEST: f32 = 0.3;
/// Mark of an object that its unit no longer reports, points.
const PASSED: f32 = 9.0;
/// Opacity of an extent.
pub(super) const EXTENT: f32 = 0.22;
/// Number of circles beyond which circles of tracks would hide the map: then the chosen track and the units keep
/// theirs.
const MOST_CIRCLES: usize = 40;
/// Sizes of text, points.
const BASE: f32 = 15.0;
const SMALL: f32 = 13.0;
/// Distance of the two paintings of a strong text: egui's face has no bold one.
const BOLD: f32 = 0.55;
/// Place of a unit's state beside its symbol, points.
const STATE: Vec2 = vec2(15.0, -15.0);

/// Places on the line of a distance beside which its label is tried.
const SHARES: [f32; 5] = [0.5, 0.65, 0.35, 0.8, 0.2];

/// The distance of the chosen unit to the fence.
pub(super) struct Dimension {
    /// The unit and the nearest place of the fence.
    pub(super) ends: [Pos2; 2],
    /// The distance in words.
    pub(super) text: String,
    /// Its tone, which is weak where the place is old.
    pub(super) tone: Tone,
}

/// Draws circles, extents and symbols; true if circles were left out.
pub(super) fn things(painter: &Painter, palette: &Palette, things: &[Thing]) -> bool {
    let wide = |thing: &&Thing| thing.may_be > 8.0;
    let crowded = things.iter().filter(wide).count() > MOST_CIRCLES;
    for thing in things.iter().filter(wide).filter(|thing| !crowded || thing.chosen || thing.is_unit()) {
        let pale = if thing.freshness == Freshness::Lost { CIRCLE_LOST } else { CIRCLE };
        let color = thing.tone.color(palette).gamma_multiply(pale);
        plan::dashed_circle(painter, thing.at, thing.may_be, Stroke::new(1.0, color));
    }
    for thing in things {
        if let Of::Track { half, .. } = thing.of
            && thing.freshness < Freshness::Lost
            && half > thing.half()
        {
            let fill = palette.trail.gamma_multiply(EXTENT * (PALEST + (1.0 - PALEST) * thing.sure));
            painter.circle(thing.at, half, fill, Stroke::new(1.0, palette.quiet));
        }
    }
    things.iter().for_each(|thing| symbol(painter, palette, thing));
    crowded
}

fn symbol(painter: &Painter, palette: &Palette, thing: &Thing) {
    let color = thing.tone.color(palette);
    let chosen = Stroke::new(2.0, palette.mark);
    match thing.of {
        Of::Unit(mark) => {
            if thing.chosen {
                painter.circle_stroke(thing.at, thing.half() - 1.0, chosen);
            }
            unit(painter, palette, thing, mark);
        }
        Of::Track { .. } => {
            let [least, most] = SYMBOLS;
            let strength = PALEST + (1.0 - PALEST) * thing.sure;
            let size = least + (most - least) * thing.sure;
            match thing.is_passed() {
                true => thing.shape.draw(painter, thing.at, PASSED, palette.quiet),
                false => thing.shape.draw(painter, thing.at, size, color.gamma_multiply(strength)),
            }
            if thing.chosen {
                let square = Rect::from_center_size(thing.at, Vec2::splat(2.0 * thing.half() - 4.0));
                painter.rect_stroke(square, 0.0, chosen, StrokeKind::Inside);
            }
        }
    }
}

/// A unit, pointing where it heads, with the way ahead of it and its state; hollow when its place is not fresh.
fn unit(painter: &Painter, palette: &Palette, thing: &Thing, mark: UnitMark) {
    let color = if thing.tone == Tone::Normal { palette.strong } else { thing.tone.color(palette) };
    let (sin, cos) = libm::sincosf(mark.yaw);
    let corner = |x: f32, y: f32| thing.at + vec2(x * cos - y * sin, -(x * sin + y * cos));
    let corners = vec![corner(11.0, 0.0), corner(-8.0, 7.0), corner(-4.0, 0.0), corner(-8.0, -7.0)];
    if mark.ahead.length() > 1.0 {
        painter.line_segment([thing.at, thing.at + mark.ahead], Stroke::new(2.0, color));
    }
    if thing.freshness == Freshness::Fresh {
        for half in [[0, 1, 2], [0, 2, 3]] {
            let half = half.map(|nth: usize| corners[nth]).to_vec();
            painter.add(Drawn::convex_polygon(half, color, Stroke::NONE));
        }
    } else {
        painter.add(Drawn::closed_line(corners, Stroke::new(2.0, color)));
    }
    if let Some((shape, tone)) = state(&mark) {
        shape.draw(painter, thing.at + STATE, 12.0, tone.color(palette));
    }
}

/// Sign of a unit's state beside its symbol; none where it is as it should be.
fn state(mark: &UnitMark) -> Option<(Shape, Tone)> {
    match mark.sign {
        Sign::Lost => Some((Shape::Cross, Tone::Alarm)),
        Sign::Held => Some((Shape::Square, Tone::Caution)),
        Sign::Caution => Some((Shape::Diamond, Tone::Caution)),
        Sign::Normal | Sign::Quiet | Sign::Past if mark.doubted => Some((Shape::Diamond, Tone::Caution)),
        Sign::Authority => Some((Shape::Triangle, Tone::Mark)),
        Sign::Normal | Sign::Quiet | Sign::Past => None,
    }
}

/// Draws the line of a distance, with a bar at the fence.
pub(super) fn dimension(painter: &Painter, palette: &Palette, dimension: &Dimension) {
    let stroke = Stroke::new(1.5, dimension.tone.color(palette));
    let [from, to] = dimension.ends;
    painter.line_segment([from, to], stroke);
    let along = (to - from).normalized() * 6.0;
    painter.line_segment([to + along.rot90(), to - along.rot90()], stroke);
}

/// A label as laid out: its lines, and how strong the first is.
struct Laid {
    wanted: Wanted,
    lines: Vec<Arc<Galley>>,
    strong: bool,
}

/// Draws every label that finds room. Units come first, then the distance, the chosen track, the others, and the ticks
/// of the trail. Returns the numbers of labels of units and of tracks that were left out.
pub(super) fn labels(
    painter: &Painter,
    palette: &Palette,
    things: &[Thing],
    dimension: Option<&Dimension>,
    trails: &[Trail],
    obstacles: &mut Obstacles,
) -> [usize; 2] {
    solid(things, obstacles);
    let mut left_out = [0, 0];
    let inside = |thing: &&Thing| painter.clip_rect().contains(thing.at);
    let mut put = |laid: Laid| match obstacles.place(&laid.wanted) {
        Some(placed) => {
            paint_label(painter, palette, &laid, &placed);
            true
        }
        None => false,
    };
    // Beside its line the distance reads best, so it goes first where that is possible.
    let beside = |dimension: &&Dimension| {
        SHARES.into_iter().all(|share| !put(measure(painter, palette, dimension, Some(share))))
    };
    let unplaced = dimension.filter(beside);
    for thing in things.iter().rev().filter(|thing| thing.is_unit()).filter(inside) {
        left_out[0] += usize::from(!put(laid(painter, palette, thing)));
    }
    if let Some(dimension) = unplaced {
        put(measure(painter, palette, dimension, None));
    }
    let tracks = things.iter().rev().filter(|thing| !thing.is_unit() && (!thing.is_passed() || thing.chosen));
    for thing in tracks.filter(inside) {
        left_out[1] += usize::from(!put(laid(painter, palette, thing)));
    }
    for (at, seconds) in trails.iter().flat_map(|trail| trail.ticks.iter()) {
        let galley = painter.layout_no_wrap(trail::ago(*seconds), FontId::proportional(SMALL), palette.weak);
        let wanted = Wanted { at: *at, half: trail::TICK, sizes: vec![galley.size()], reach: Reach::Beside };
        put(Laid { wanted, lines: vec![galley], strong: false });
    }
    left_out
}

/// The areas of symbols. Passed objects are lines, which a label lies on where there is no other place.
fn solid(things: &[Thing], obstacles: &mut Obstacles) {
    let area = obstacles.area;
    let square = |center: Pos2, half: f32| Rect::from_center_size(center, Vec2::splat(2.0 * half));
    for thing in things.iter().filter(|thing| square(thing.at, thing.outer()).intersects(area)) {
        match thing.of {
            Of::Track { passed: true, .. } if !thing.chosen => {
                let corner = Vec2::splat(thing.half());
                obstacles.add_path(&[thing.at - corner, thing.at + corner]);
            }
            Of::Track { .. } if thing.chosen => obstacles.solid.push(square(thing.at, thing.half())),
            Of::Track { .. } => obstacles.tracks.push(square(thing.at, thing.half())),
            Of::Unit(mark) => {
                obstacles.solid.push(square(thing.at, thing.half()));
                obstacles.solid.extend(state(&mark).map(|_| square(thing.at + STATE, 7.0)));
                if mark.ahead.length() > thing.half() {
                    obstacles.add_path(&[thing.at, thing.at + mark.ahead]);
                }
            }
        }
    }
}

fn laid(painter: &Painter, palette: &Palette, thing: &Thing) -> Laid {
    let normal = if thing.is_unit() || thing.chosen { palette.strong } else { palette.text };
    let first = if thing.tone == Tone::Normal { normal } else { thing.tone.color(palette) };
    let second = if thing.is_unit() { palette.text } else { palette.weak };
    let lay = |text: &str, color: Color32| painter.layout_no_wrap(text.to_owned(), FontId::proportional(BASE), color);
    let mut lines = vec![lay(&thing.label.first, first)];
    if !thing.label.second.is_empty() {
        lines.push(lay(&thing.label.second, second));
    }
    let reach = if thing.is_unit() || thing.chosen { Reach::Further } else { Reach::Usual };
    let sizes = lines.iter().map(|line| line.size() + vec2(BOLD, 0.0)).collect();
    Laid { wanted: Wanted { at: thing.at, half: thing.outer(), sizes, reach }, lines, strong: thing.is_unit() }
}

/// The label of a distance, beside a place on its line, or anywhere.
fn measure(painter: &Painter, palette: &Palette, dimension: &Dimension, beside: Option<f32>) -> Laid {
    let color = if dimension.tone == Tone::Normal { palette.strong } else { dimension.tone.color(palette) };
    let galley = painter.layout_no_wrap(dimension.text.clone(), FontId::proportional(BASE), color);
    let at = dimension.ends[0].lerp(dimension.ends[1], beside.unwrap_or(0.5));
    let reach = if beside.is_some() { Reach::Beside } else { Reach::Further };
    let wanted = Wanted { at, half: 3.0, sizes: vec![galley.size()], reach };
    Laid { wanted, lines: vec![galley], strong: false }
}

fn paint_label(painter: &Painter, palette: &Palette, laid: &Laid, placed: &Placed) {
    if let Some(leader) = placed.leader {
        painter.line_segment(leader, Stroke::new(1.0, palette.quiet));
    }
    painter.rect_filled(placed.rect.expand2(vec2(2.0, 0.0)), 1.0, palette.ground.gamma_multiply(0.85));
    let mut at = placed.rect.min;
    for (nth, line) in laid.lines.iter().take(placed.lines).enumerate() {
        let color = line.job.sections.first().map_or(palette.text, |section| section.format.color);
        painter.galley(at, line.clone(), color);
        if laid.strong && nth == 0 {
            painter.galley(at + vec2(BOLD, 0.0), line.clone(), color);
        }
        at.y += line.size().y;
    }
}
