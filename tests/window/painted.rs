//! Everything that the last frame painted, in order, as far as it is seen. Judging it is left to `layout` and
//! `looks`.

use eframe::egui::Rect;
use eframe::egui::epaint::text::PlacedRow;
use eframe::egui::epaint::{ClippedShape, Shape};

use crate::window::Seated;

/// Greatest distance of two paintings of one strong text, points: the face has no bold one.
const TWICE: f32 = 1.0;

/// Ink that the edge of a cell may take, points: a line below a text is a little wider than it.
const EDGE: f32 = 2.0;

/// A shape with the rectangle that it is seen in.
pub(crate) type Clipped = (Rect, Shape);

/// A text as it is seen.
#[derive(Clone, Debug)]
pub(crate) struct Text {
    pub(crate) words: String,
    /// Bounds of its ink, as far as they are seen, and those of each of its rows.
    pub(crate) ink: Rect,
    pub(crate) rows: Vec<Rect>,
    /// The smallest size in it, points.
    pub(crate) size: f32,
    /// True if it ends in an ellipsis.
    pub(crate) cut: bool,
    /// True if the edge of its pane cuts it at the left or right.
    pub(crate) beyond: bool,
    /// Its number among all shapes.
    pub(crate) nth: usize,
}

/// Every shape, one after the other as painted.
pub(crate) fn shapes(seated: &Seated) -> Vec<Clipped> {
    let mut all = Vec::new();
    seated.output().shapes.iter().for_each(|ClippedShape { clip_rect, shape, .. }| flat(shape, *clip_rect, &mut all));
    all
}

fn flat(shape: &Shape, clip: Rect, into: &mut Vec<Clipped>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| flat(shape, clip, into)),
        Shape::Noop => {}
        shape => into.push((clip, shape.clone())),
    }
}

/// The texts among shapes. One that is painted twice is one text.
pub(crate) fn texts(shapes: &[Clipped]) -> Vec<Text> {
    let mut all: Vec<Text> = Vec::new();
    for (nth, (clip, shape)) in shapes.iter().enumerate() {
        let Shape::Text(text) = shape else { continue };
        let galley = &text.galley;
        let whole = galley.mesh_bounds.translate(text.pos.to_vec2());
        let ink = whole.intersect(*clip);
        if galley.text().trim().is_empty() || !ink.is_positive() {
            continue;
        }
        let at = |row: &PlacedRow| row.row.visuals.mesh_bounds.translate(text.pos.to_vec2() + row.pos.to_vec2());
        let rows = galley.rows.iter().map(|row| at(row).intersect(*clip)).filter(Rect::is_positive).collect();
        let size = galley.job.sections.iter().map(|section| section.format.font_id.size).fold(f32::INFINITY, f32::min);
        let this = Text {
            words: galley.text().to_owned(),
            ink,
            rows,
            size,
            cut: galley.elided,
            beyond: whole.width() > ink.width() + EDGE,
            nth,
        };
        let again = |other: &&mut Text| {
            let twice = other.words == this.words && (other.ink.size() - this.ink.size()).length() <= TWICE;
            twice && other.ink.center().distance(this.ink.center()) <= TWICE
        };
        match all.iter_mut().rev().find(again) {
            Some(other) => other.ink = other.ink.union(this.ink),
            None => all.push(this),
        }
    }
    all
}

/// Area that a shape takes at most, for shapes with a colour of their own.
pub(crate) fn bounds((clip, shape): &Clipped) -> Rect {
    shape.visual_bounding_rect().intersect(*clip)
}
