//! Painting of things: circles of possible places, extents, symbols, the line of a distance.
//!
//! Fresh is drawn above stale, symbols above circles. Labels are `writing`'s.

use eframe::egui::{Painter, Pos2, Rect, Shape as Drawn, Stroke, StrokeKind, Vec2, vec2};
use wire::event::Freshness;

use super::plan;
use super::things::{Of, Thing, UnitMark};
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
/// Place of a unit's state beside its symbol, points.
pub(super) const STATE: Vec2 = vec2(15.0, -15.0);

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
pub(super) fn state(mark: &UnitMark) -> Option<(Shape, Tone)> {
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
