//! Writing of labels: units first, then the distance to the fence, the chosen track, the others, the ticks of the trail.
//!
//! The words are `words`', the places are found by `labels`.

use std::collections::BTreeMap;
use std::sync::Arc;

use eframe::egui::{Color32, FontId, Galley, Painter, Pos2, Rect, Stroke, Vec2, vec2};
use wire::id::{TrackId, UnitId};

use super::labels::{Obstacles, Placed, Reach, Side, Wanted};
use super::paint::{Dimension, STATE, state};
use super::things::{Of, Thing};
use super::trail::{self, Trail};
use crate::gui::marks::Tone;
use crate::gui::theme::Palette;

/// Sizes of text, points.
const BASE: f32 = 15.0;
const SMALL: f32 = 13.0;
/// Distance of the two paintings of a strong text: egui's face has no bold one.
const BOLD: f32 = 0.55;
/// Places on the line of a distance beside which its label is tried.
const SHARES: [f32; 5] = [0.5, 0.65, 0.35, 0.8, 0.2];

/// Side of the label of each unit, and of each track of one, in the last frame.
pub(in crate::gui) type Sides = BTreeMap<(UnitId, Option<TrackId>), Side>;

/// Labels that found no room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub(super) units: usize,
    pub(super) tracks: usize,
}

/// A label as laid out: its lines, and how strong the first is.
struct Laid {
    wanted: Wanted,
    lines: Vec<Arc<Galley>>,
    strong: bool,
}

/// A frame's labels.
pub(super) struct Writing<'f> {
    pub(super) painter: &'f Painter,
    pub(super) palette: &'f Palette,
    pub(super) obstacles: Obstacles,
    /// Sides of the frame before.
    pub(super) last: Sides,
}

impl Writing<'_> {
    /// Writes every label that finds room. Returns the sides of this frame.
    pub(super) fn write(
        mut self,
        things: &[Thing],
        dimension: Option<&Dimension>,
        trails: &[Trail],
    ) -> (Sides, LeftOut) {
        self.keep_off(things);
        let (mut sides, mut left_out) = (Sides::new(), LeftOut::default());
        let area = self.obstacles.area;
        let labelled = |thing: &&Thing| area.contains(thing.at) && (!thing.is_passed() || thing.chosen);
        let (units, tracks): (Vec<_>, Vec<_>) = things.iter().rev().filter(labelled).partition(|thing| thing.is_unit());
        // Beside its line the distance reads best, so it goes first where that is possible.
        let unplaced = dimension.filter(|dimension| !self.write_beside(dimension));
        for thing in units {
            left_out.units += usize::from(!self.write_thing(thing, &mut sides));
        }
        if let Some(dimension) = unplaced {
            self.put(&self.measure(dimension, None));
        }
        for thing in tracks {
            left_out.tracks += usize::from(!self.write_thing(thing, &mut sides));
        }
        trails.iter().flat_map(|trail| &trail.ticks).for_each(|(at, seconds)| self.write_tick(*at, *seconds));
        (sides, left_out)
    }

    /// Adds the areas of symbols. Passed objects are lines, which a label lies on where there is no other place.
    fn keep_off(&mut self, things: &[Thing]) {
        let square = |center: Pos2, half: f32| Rect::from_center_size(center, Vec2::splat(2.0 * half));
        let Obstacles { area, .. } = self.obstacles;
        for thing in things.iter().filter(|thing| square(thing.at, thing.outer()).intersects(area)) {
            let symbol = square(thing.at, thing.half());
            match thing.of {
                Of::Track { .. } if thing.chosen => self.obstacles.units.push(symbol),
                Of::Track { passed: true, .. } => self.obstacles.add_path(&[symbol.min, symbol.max]),
                Of::Track { passed: false, .. } => self.obstacles.tracks.push(symbol),
                Of::Unit(mark) => {
                    self.obstacles.units.push(symbol);
                    self.obstacles.units.extend(state(&mark).map(|_| square(thing.at + STATE, 7.0)));
                    if mark.ahead.length() > thing.half() {
                        self.obstacles.add_path(&[thing.at, thing.at + mark.ahead]);
                    }
                }
            }
        }
    }

    fn write_thing(&mut self, thing: &Thing, sides: &mut Sides) -> bool {
        let laid = self.lay(thing);
        let placed = self.put(&laid);
        sides.extend(placed.map(|side| (thing.key(), side)));
        placed.is_some()
    }

    fn write_beside(&mut self, dimension: &Dimension) -> bool {
        SHARES.into_iter().any(|share| self.put(&self.measure(dimension, Some(share))).is_some())
    }

    fn write_tick(&mut self, at: Pos2, seconds: u64) {
        let galley = self.galley(&trail::ago(seconds), SMALL, self.palette.weak);
        let wanted = Wanted { at, half: trail::TICK, sizes: vec![galley.size()], reach: Reach::Beside, last: None };
        self.put(&Laid { wanted, lines: vec![galley], strong: false });
    }

    fn galley(&self, text: &str, size: f32, color: Color32) -> Arc<Galley> {
        self.painter.layout_no_wrap(text.to_owned(), FontId::proportional(size), color)
    }

    fn lay(&self, thing: &Thing) -> Laid {
        let palette = self.palette;
        let normal = if thing.is_unit() || thing.chosen { palette.strong } else { palette.text };
        let first = if thing.tone == Tone::Normal { normal } else { thing.tone.color(palette) };
        let second = if thing.is_unit() { palette.text } else { palette.weak };
        let mut lines = vec![self.galley(&thing.label.first, BASE, first)];
        if !thing.label.second.is_empty() {
            lines.push(self.galley(&thing.label.second, BASE, second));
        }
        let reach = if thing.is_unit() || thing.chosen { Reach::Further } else { Reach::Usual };
        let sizes = lines.iter().map(|line| line.size() + vec2(BOLD, 0.0)).collect();
        let last = self.last.get(&thing.key()).copied();
        Laid {
            wanted: Wanted { at: thing.at, half: thing.outer(), sizes, reach, last },
            lines,
            strong: thing.is_unit(),
        }
    }

    /// The label of a distance, beside a place on its line, or anywhere.
    fn measure(&self, dimension: &Dimension, beside: Option<f32>) -> Laid {
        let normal = dimension.tone == Tone::Normal;
        let color = if normal { self.palette.strong } else { dimension.tone.color(self.palette) };
        let galley = self.galley(&dimension.text, BASE, color);
        let at = dimension.ends[0].lerp(dimension.ends[1], beside.unwrap_or(0.5));
        let reach = if beside.is_some() { Reach::Beside } else { Reach::Further };
        let wanted = Wanted { at, half: 3.0, sizes: vec![galley.size()], reach, last: None };
        Laid { wanted, lines: vec![galley], strong: false }
    }

    /// Paints a label where it finds room.
    fn put(&mut self, laid: &Laid) -> Option<Side> {
        let placed: Placed = self.obstacles.place(&laid.wanted)?;
        let (painter, palette) = (self.painter, self.palette);
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
        Some(placed.side)
    }
}
