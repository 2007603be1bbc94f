//! The heads that YOLO exporters write, by their shape: boxes by middle and sides in pixels of the model's image, and a
//! score for each class.
//!
//! - *v8*: `[1, 4 + C, N]`, each number of all N boxes together; the score is the class's.
//! - *v5*: `[1, N, 5 + C]`, each box with all its numbers; its fifth, how likely anything is there, multiplies the
//!   class's.
//!
//! The model's author states which of the C classes the platform uses; the others are ignored.

use serde::{Deserialize, Serialize};
use wire::codec::List;
use wire::sensor::{Class, Detection};

use crate::boxes::{Candidate, best};
use crate::letterbox::Letterbox;

/// Most boxes of a head: as of a v5 head for 640 × 640 pixels.
pub const MAX_BOXES: usize = 25_200;
/// Most classes that a model may know.
pub const MAX_CLASSES: usize = 256;

/// Order of a head's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// `[1, 4 + C, N]`.
    V8,
    /// `[1, N, 5 + C]`.
    V5,
}

/// A head of this kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Yolo {
    /// Order of its numbers.
    pub layout: Layout,
    /// The platform's class for each of the model's; `None` is ignored.
    pub classes: Vec<Option<Class>>,
}

impl Yolo {
    /// Numbers for each box.
    fn channels(&self) -> usize {
        self.first_class() + self.classes.len()
    }

    fn first_class(&self) -> usize {
        match self.layout {
            Layout::V8 => 4,
            Layout::V5 => 5,
        }
    }

    /// The shape that the head has to have, in words.
    pub(crate) fn wanted(&self) -> String {
        let (channels, classes) = (self.channels(), self.classes.len());
        match self.layout {
            Layout::V8 => format!("[1, {channels}, N] of {classes} classes, N at most {MAX_BOXES}"),
            Layout::V5 => format!("[1, N, {channels}] of {classes} classes, N at most {MAX_BOXES}"),
        }
    }

    /// Number of boxes in an output of this shape; `None` where it is another head's.
    pub(crate) fn boxes(&self, shape: &[i64]) -> Option<usize> {
        let channels = self.channels() as i64;
        let boxes = match (self.layout, shape) {
            (Layout::V8, [1, c, n]) | (Layout::V5, [1, n, c]) if *c == channels => *n,
            (Layout::V8 | Layout::V5, _) => return None,
        };
        let known = (1..=MAX_CLASSES).contains(&self.classes.len());
        usize::try_from(boxes).ok().filter(|n| known && (1..=MAX_BOXES).contains(n))
    }

    /// Detections of at least `least` permille, best first, without doubles.
    pub(crate) fn decode(&self, raw: &[f32], boxes: usize, letterbox: &Letterbox, least: u16) -> List<Detection, 32> {
        let least = f32::from(least) / 1000.0;
        best((0..boxes).filter_map(|row| self.candidate(raw, boxes, row, letterbox, least)).collect())
    }

    /// A box that is certain enough and means something. One number that is not finite takes its box with it.
    fn candidate(&self, raw: &[f32], boxes: usize, row: usize, letterbox: &Letterbox, least: f32) -> Option<Candidate> {
        let at = |channel: usize| {
            let place = match self.layout {
                Layout::V8 => channel * boxes + row,
                Layout::V5 => row * self.channels() + channel,
            };
            raw.get(place).copied().filter(|value| value.is_finite())
        };
        let object = match self.layout {
            Layout::V8 => 1.0,
            Layout::V5 => at(4)?,
        };
        let (mut best, mut most) = (0, at(self.first_class())?);
        for index in 1..self.classes.len() {
            let value = at(self.first_class() + index)?;
            if value > most {
                (best, most) = (index, value);
            }
        }
        let score = object * most;
        let class = self.classes[best].filter(|_| score >= least)?;
        let edges = letterbox.undo([at(0)?, at(1)?, at(2)?, at(3)?]);
        Some(Candidate { class, score, edges })
    }
}

#[cfg(test)]
mod tests {
    use wire::sensor::PixelBox;

    use super::*;

    const CLASSES: [Option<Class>; 3] = [Some(Class::Person), None, Some(Class::Vehicle)];

    fn head(layout: Layout) -> Yolo {
        Yolo { layout, classes: CLASSES.to_vec() }
    }

    /// The output of a head for these boxes: place, how likely anything is there, classes.
    fn output(layout: Layout, boxes: &[([f32; 4], f32, [f32; 3])]) -> Vec<f32> {
        let rows: Vec<Vec<f32>> = boxes
            .iter()
            .map(|(place, object, classes)| match layout {
                Layout::V8 => [&place[..], &classes.map(|c| c * object)].concat(),
                Layout::V5 => [&place[..], &[*object], classes].concat(),
            })
            .collect();
        match layout {
            Layout::V8 => (0..7).flat_map(|k| rows.iter().map(move |row| row[k])).collect(),
            Layout::V5 => rows.concat(),
        }
    }

    fn decoded(layout: Layout, boxes: &[([f32; 4], f32, [f32; 3])]) -> Vec<Detection> {
        let letterbox = Letterbox::new(320, 320).unwrap();
        head(layout).decode(&output(layout, boxes), boxes.len(), &letterbox, 350).to_vec()
    }

    #[test]
    fn both_layouts_give_the_same_boxes() {
        for layout in [Layout::V8, Layout::V5] {
            let found = decoded(
                layout,
                &[
                    ([160.0, 160.0, 40.0, 20.0], 0.75, [0.1, 0.2, 1.0]),
                    // An equal object, less certain.
                    ([162.0, 161.0, 40.0, 20.0], 0.75, [0.1, 0.2, 0.8]),
                    // An ignored class, and one that is not certain enough.
                    ([80.0, 160.0, 40.0, 20.0], 1.0, [0.4, 0.9, 0.5]),
                    ([240.0, 160.0, 40.0, 20.0], 0.5, [0.6, 0.0, 0.0]),
                ],
            );
            // Twice the camera's size, and 40 rows of grey above it.
            let bounds = PixelBox { x0: 70, y0: 55, x1: 90, y1: 65 };
            assert_eq!(found, [Detection { class: Class::Vehicle, score: 750, bounds }], "{layout:?}");
        }
    }

    #[test]
    fn number_not_finite_drops_its_box_only() {
        for layout in [Layout::V8, Layout::V5] {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let good = ([160.0, 160.0, 40.0, 20.0], 0.9, [0.9, 0.0, 0.0]);
                let hurt = [
                    ([bad, 100.0, 40.0, 20.0], 0.9, [0.0, 0.0, 0.9]),
                    ([100.0, 100.0, bad, 20.0], 0.9, [0.0, 0.0, 0.9]),
                    ([100.0, 100.0, 40.0, 20.0], bad, [0.0, 0.0, 0.9]),
                    ([100.0, 100.0, 40.0, 20.0], 0.9, [bad, 0.0, 0.9]),
                    good,
                ];
                let found = decoded(layout, &hurt);
                assert_eq!(found.iter().map(|d| d.class).collect::<Vec<_>>(), [Class::Person], "{layout:?} {bad}");
            }
        }
    }

    /// Boxes beyond the image, inside out, or without end.
    #[test]
    fn hostile_boxes_show_no_pixel_outside_the_image() {
        let everywhere = [f32::MAX, f32::MIN, 1e9, -1e9, -40.0, 0.0];
        for (x, w) in everywhere.iter().flat_map(|x| everywhere.map(|w| (*x, w))) {
            for found in decoded(Layout::V5, &[([x, x, w, w], 1.0, [1.0, 0.0, 0.0])]) {
                assert!(found.bounds.x0 < found.bounds.x1 && found.bounds.x1 <= 160, "{found:?}");
                assert!(found.bounds.y0 < found.bounds.y1 && found.bounds.y1 <= 120, "{found:?}");
            }
        }
    }

    #[test]
    fn output_of_another_shape_is_refused() {
        assert_eq!(head(Layout::V8).boxes(&[1, 7, 2100]), Some(2100));
        assert_eq!(head(Layout::V5).boxes(&[1, 2100, 8]), Some(2100));
        for shape in [&[1, 7, 0][..], &[1, 7, -1], &[1, 7, 25_201], &[2, 7, 9], &[1, 8, 9], &[1, 7], &[1, 1, 7, 9]] {
            assert_eq!(head(Layout::V8).boxes(shape), None, "{shape:?}");
        }
        let many = Yolo { layout: Layout::V8, classes: vec![None; MAX_CLASSES + 1] };
        assert_eq!(many.boxes(&[1, 4 + MAX_CLASSES as i64 + 1, 9]), None);
    }
}
