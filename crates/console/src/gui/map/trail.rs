//! The way that a unit has come, by its reports of the last minute: ten seconds thick, then thinner.
//!
//! No line is drawn across a gap in reports. The samples are `trace`'s.

use eframe::egui::{Painter, Pos2, Shape, Stroke};
use wire::time::Span;

use super::camera::View;
use crate::gui::theme::Palette;
use crate::shown::{Shown, ShownUnit};
use crate::trace::CLOSE;

/// Ages at which the trail becomes thinner, seconds; its widths, points, of the chosen unit.
const AGES: [u64; 3] = [10, 20, 60];
const WIDTHS: [f32; 3] = [4.0, 2.4, 1.4];
/// Width of the trail of another unit, points, and its length, seconds.
const OTHER: f32 = 1.2;
const OTHER_S: u64 = 20;
/// Least distance of two drawn points, and of a tick from another and from the unit, points.
const APART: f32 = 2.0;
const TICKS: f32 = 26.0;

/// One piece of equal age and without a gap.
#[derive(Clone, Debug, PartialEq)]
struct Piece {
    /// Index of its age in [`AGES`].
    band: usize,
    points: Vec<Pos2>,
}

/// A trail on the screen.
#[derive(Clone, Debug, Default)]
pub(super) struct Trail {
    pieces: Vec<Piece>,
    /// Places at whole tens of seconds, with their age in seconds.
    pub(super) ticks: Vec<(Pos2, u64)>,
    chosen: bool,
}

impl Trail {
    /// The trail of a unit.
    pub(super) fn new(unit: &ShownUnit, shown: &Shown, view: &View, chosen: bool) -> Self {
        let samples = unit.trace.close().map(|sample| {
            let place = super::place(sample.pose.x_mm, sample.pose.y_mm);
            (shown.at.since(sample.at), view.position(place))
        });
        let longest = if chosen { CLOSE } else { Span::s(OTHER_S) };
        let mut trail = from_samples(samples.filter(|(age, _)| *age <= longest), shown.limits.late);
        trail.chosen = chosen;
        if !chosen {
            trail.ticks.clear();
        }
        trail
    }

    /// The lines of it, for labels to keep off.
    pub(super) fn paths(&self) -> impl Iterator<Item = &[Pos2]> {
        self.pieces.iter().map(|piece| piece.points.as_slice())
    }

    /// Paints it, the oldest first.
    pub(super) fn draw(&self, painter: &Painter, palette: &Palette) {
        for Piece { band, points } in &self.pieces {
            let (width, color) = match (self.chosen, band) {
                (true, 0) => (WIDTHS[0], palette.text),
                (true, band) => (WIDTHS[*band], palette.trail),
                (false, _) => (OTHER, palette.quiet),
            };
            painter.add(Shape::line(points.clone(), Stroke::new(width, color)));
        }
        for (at, _) in &self.ticks {
            painter.circle(*at, 3.0, palette.trail, Stroke::new(1.0, palette.ground));
        }
    }
}

/// The trail through samples with their ages, oldest first; apart where more than `gap` lies between two.
fn from_samples(samples: impl Iterator<Item = (Span, Pos2)>, gap: Span) -> Trail {
    let mut trail = Trail::default();
    let mut last: Option<(Span, Pos2)> = None;
    for (age, at) in samples {
        let band = AGES.iter().position(|limit| age <= Span::s(*limit)).unwrap_or(AGES.len() - 1);
        let joined = last.filter(|(before, _)| before.0.saturating_sub(age.0) <= gap.0);
        match (joined, trail.pieces.last_mut()) {
            (Some(_), Some(piece)) if piece.band == band => {
                if piece.points.last().is_none_or(|point| point.distance(at) >= APART) {
                    piece.points.push(at);
                }
            }
            (Some((_, from)), Some(_)) => trail.pieces.push(Piece { band, points: vec![from, at] }),
            _ => trail.pieces.push(Piece { band, points: vec![at] }),
        }
        if let Some((before, from)) = joined {
            tick(&mut trail.ticks, (before, from), (age, at));
        }
        last = Some((age, at));
    }
    if let (Some((_, at)), Some(piece)) = (last, trail.pieces.last_mut()) {
        piece.points.push(at);
        let spaced = |ticks: &[(Pos2, u64)], nth: usize| {
            let apart = |other: &(Pos2, u64)| other.0.distance(ticks[nth].0) >= TICKS;
            ticks[nth].0.distance(at) >= TICKS && ticks[nth + 1..].iter().all(apart)
        };
        // The newer of two ticks stays, for it says more of the present.
        let ticks = std::mem::take(&mut trail.ticks);
        trail.ticks = (0..ticks.len()).filter(|nth| spaced(&ticks, *nth)).map(|nth| ticks[nth]).collect();
    }
    trail.pieces.retain(|piece| piece.points.len() > 1);
    trail
}

/// Adds the tick that lies between two samples, if one does.
fn tick(ticks: &mut Vec<(Pos2, u64)>, (before, from): (Span, Pos2), (age, at): (Span, Pos2)) {
    const EVERY: Span = Span::s(10);
    let nth = before.0 / EVERY.0;
    if nth > age.0 / EVERY.0 && before > age {
        let share = (before.0 - nth * EVERY.0) as f32 / (before.0 - age.0) as f32;
        ticks.push((from + (at - from) * share, nth * 10));
    }
}

/// Text of a tick.
pub(super) fn ago(seconds: u64) -> String {
    format!("−{seconds} s")
}

/// Half of the side of a tick's mark, points.
pub(super) const TICK: f32 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit that went right by 10 points a second, of which the last sample is as old as said.
    fn went(ages_ms: impl Iterator<Item = u64>) -> Trail {
        let samples = ages_ms.map(|ms| (Span::ms(ms), Pos2::new(1000.0 - ms as f32 / 100.0, 0.0)));
        from_samples(samples, Span::ms(500))
    }

    #[test]
    fn a_trail_is_thick_for_ten_seconds() {
        let trail = went((0..=600).rev().map(|n| n * 100));
        let bands: Vec<usize> = trail.pieces.iter().map(|piece| piece.band).collect();
        assert_eq!(bands, [2, 1, 0]);
        let thick = &trail.pieces[2].points;
        assert!((thick[thick.len() - 1].x - thick[0].x - 101.0).abs() < 0.1, "{thick:?}");
        assert_eq!(trail.ticks.iter().map(|(_, s)| *s).collect::<Vec<_>>(), [60, 50, 40, 30, 20, 10]);
        assert!((trail.ticks[5].0.x - 900.0).abs() < 0.1);
    }

    #[test]
    fn nothing_is_drawn_where_nothing_was_heard() {
        let heard = (0..=200).rev().map(|n| n * 100).filter(|ms| !(3_000..=7_000).contains(ms));
        let trail = went(heard);
        for pair in trail.paths().flat_map(|path| path.windows(2)) {
            assert!(pair[1].x - pair[0].x <= 6.0, "{pair:?}");
        }
        assert!(trail.pieces.len() >= 3);
    }

    #[test]
    fn a_unit_that_stands_has_no_ticks() {
        let trail = from_samples((0..=600).rev().map(|n| (Span::ms(n * 100), Pos2::new(5.0, 5.0))), Span::ms(500));
        assert!(trail.ticks.is_empty());
    }
}
