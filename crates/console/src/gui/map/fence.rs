//! The fence: the distance to it, and the line inside of it before which a unit comes to a stop.
//!
//! The line lies as far inside as the operator's margin and the stopping distance from the unit's greatest speed. The
//! reaction before the brakes is the judges' (`docs/reference/bounds.md`), for a report does not state the unit's own.
//! Drawing is left to `plan` and `dimension`.

use wire::bounds::Bounds;
use wire::settings::Settings;

use crate::site::GroundPoint;

/// Time of a navigation period and of a step of the plant, milliseconds, beside the control period.
const READING_AND_PLANT_MS: u64 = 100;
/// Most points of the line.
const MAX_DOTS: f32 = 2000.0;
/// Slack of a distance that is compared with itself, metres.
const SLACK: f32 = 1e-3;

/// The place of the fence that is nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nearest {
    /// Place on the fence.
    pub(super) on: GroundPoint,
    /// Distance to it, metres; negative outside.
    pub(super) metres: f32,
}

/// The place of the fence nearest to `place`; none of a fence with less than three corners.
pub(super) fn nearest(fence: &[GroundPoint], place: GroundPoint) -> Option<Nearest> {
    if fence.len() < 3 {
        return None;
    }
    let (mut on, mut least, mut inside) = ([0.0; 2], f32::INFINITY, false);
    for (at, a) in fence.iter().enumerate() {
        let b = fence[(at + 1) % fence.len()];
        let point = on_segment(place, *a, b);
        let far = distance(place, point);
        if far < least {
            (on, least) = (point, far);
        }
        let crosses = (a[1] > place[1]) != (b[1] > place[1])
            && place[0] < a[0] + (place[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        inside ^= crosses;
    }
    least.is_finite().then_some(Nearest { on, metres: if inside { least } else { -least } })
}

/// Distance from the fence at which a unit at its greatest speed begins to be stopped, metres.
pub(super) fn stops_within(settings: &Settings, bounds: &Bounds) -> f32 {
    let speed = f64::from(settings.speed_mm_s.min(bounds.max_speed_mm_s.try_into().unwrap_or(u16::MAX)));
    let reaction = (READING_AND_PLANT_MS + bounds.control_period_ms) as f64 / 1000.0;
    let way = speed * reaction + speed * speed / (2.0 * f64::from(bounds.braking_mm_s2.max(1)));
    ((f64::from(settings.margin_mm) + way) / 1000.0) as f32
}

/// Points about `apart` metres from each other on the line that lies `inside` metres within the fence.
pub(super) fn line_within(fence: &[GroundPoint], inside: f32, apart: f32) -> Vec<GroundPoint> {
    let edges = || fence.iter().enumerate().map(|(at, a)| (*a, fence[(at + 1) % fence.len()]));
    let around: f32 = edges().map(|(a, b)| distance(a, b)).sum();
    let apart = apart.max(around / MAX_DOTS);
    let mut dots = Vec::new();
    for (a, b) in edges().filter(|_| apart > 0.0 && apart.is_finite()) {
        let long = distance(a, b);
        let steps = (long / apart) as usize;
        let normal = [(a[1] - b[1]) / long * inside, (b[0] - a[0]) / long * inside];
        for step in 0..=steps {
            let share = step as f32 * apart / long;
            for side in [1.0, -1.0] {
                let dot: GroundPoint = core::array::from_fn(|k| a[k] + (b[k] - a[k]) * share + side * normal[k]);
                if nearest(fence, dot).is_some_and(|nearest| nearest.metres >= inside - SLACK) {
                    dots.push(dot);
                }
            }
        }
    }
    dots
}

fn on_segment(place: GroundPoint, a: GroundPoint, b: GroundPoint) -> GroundPoint {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let squared = dx * dx + dy * dy;
    let share = if squared > 0.0 { ((place[0] - a[0]) * dx + (place[1] - a[1]) * dy) / squared } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    [a[0] + dx * share, a[1] + dy * share]
}

fn distance(a: GroundPoint, b: GroundPoint) -> f32 {
    libm::hypotf(a[0] - b[0], a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    const YARD: [GroundPoint; 4] = [[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]];
    /// A yard with a corner taken out of it.
    const BENT: [GroundPoint; 6] = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [10.0, 10.0], [10.0, 20.0], [0.0, 20.0]];

    #[test]
    fn distance_is_that_to_the_nearest_edge() {
        let cases =
            [([15.0, -20.0], 20.0, [15.0, -40.0]), ([38.0, 1.0], 2.0, [40.0, 1.0]), ([0.0, 43.0], -3.0, [0.0, 40.0])];
        for (place, metres, on) in cases {
            assert_eq!(nearest(&YARD, place), Some(Nearest { on, metres }), "{place:?}");
        }
        let corner = nearest(&YARD, [43.0, 44.0]).unwrap();
        assert_eq!((corner.on, corner.metres), ([40.0, 40.0], -5.0));
        assert_eq!(nearest(&BENT, [9.0, 9.0]).map(|nearest| nearest.metres), Some(libm::hypotf(1.0, 1.0)));
        assert_eq!(nearest(&BENT, [12.0, 12.0]).map(|nearest| nearest.metres), Some(-2.0));
        assert_eq!(nearest(&YARD[..2], [0.0, 0.0]), None);
    }

    #[test]
    fn stopping_line_keeps_margin_and_braking_way() {
        // 1 m of margin, 0.15 s at 3 m/s, and 1.5 m of braking at 3 m/s².
        let inside = stops_within(&Settings::from_bounds(&Bounds::GROUND), &Bounds::GROUND);
        assert!((inside - 2.95).abs() < 1e-5, "{inside}");
        for fence in [&YARD[..], &BENT] {
            let dots = line_within(fence, inside, 0.5);
            assert!(dots.len() > 40, "{}", dots.len());
            for dot in dots {
                let metres = nearest(fence, dot).unwrap().metres;
                assert!((metres - inside).abs() < 0.01, "{dot:?}: {metres}");
            }
        }
    }

    #[test]
    fn a_fence_too_small_or_unfit_has_no_line() {
        assert_eq!(line_within(&BENT, 30.0, 0.5), Vec::<GroundPoint>::new());
        assert_eq!(line_within(&[[0.0, 0.0]; 4], 1.0, 0.5), Vec::<GroundPoint>::new());
        assert_eq!(line_within(&[], 1.0, 0.5), Vec::<GroundPoint>::new());
        assert!(line_within(&YARD, 3.0, 1e-6).len() < 5000, "it is bounded");
    }
}
