//! Average precision: separation of right from wrong detections by a detector's scores.
//!
//! A detection is right at an intersection over union of 0.5 with an object of its class that no better detection has
//! taken (PASCAL VOC, COCO). A detection of an object that is too small to be asked for is neither right nor wrong.
//! Average precision is the area under the precision envelope over all recalls (VOC since 2010); the mean is over classes
//! that occur. Its interval is the bootstrap's over frames (Efron 1979), because objects of a frame are not independent.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use sim::Label;
use wire::sensor::{Class, Detection};

use crate::example::counts;

/// Intersection over union from which a detection is of an object.
pub const SAME: f32 = 0.5;
/// Shared with an object that is too small to be asked for, from which a detection is let pass.
const SMALL: f32 = 0.1;
/// Draws of the bootstrap.
const DRAWS: usize = 200;

/// A detection that was judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Class that it gives.
    pub class: Class,
    /// Its score, permille.
    pub score: u16,
    /// True if it is of an object of that class.
    pub right: bool,
}

/// Objects asked for in a frame, and its detections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Objects of each class.
    pub objects: [u32; 4],
    /// Detections, best first.
    pub judged: Vec<Judged>,
}

/// Judges the detections of one frame.
pub fn judge(labels: &[Label], detections: &[Detection]) -> Outcome {
    let mut best: Vec<&Detection> = detections.iter().collect();
    best.sort_by_key(|d| core::cmp::Reverse(d.score));
    let mut outcome = Outcome::default();
    let mut open: Vec<&Label> = labels.iter().filter(|l| counts(l)).collect();
    open.iter().for_each(|l| outcome.objects[l.class as usize] += 1);
    for detection in best {
        let fits = |l: &Label| l.class == detection.class && l.bounds.shared(&detection.bounds) >= SAME;
        let place = |l: &&Label| l.bounds.shared(&detection.bounds);
        let taken = open.iter().enumerate().filter(|(_, l)| fits(l)).max_by(|a, b| place(a.1).total_cmp(&place(b.1)));
        let right = match taken.map(|(k, _)| k) {
            Some(k) => {
                open.swap_remove(k);
                true
            }
            None if labels.iter().any(|l| !counts(l) && l.bounds.shared(&detection.bounds) > SMALL) => continue,
            None => false,
        };
        outcome.judged.push(Judged { class: detection.class, score: detection.score, right });
    }
    outcome
}

/// Average precision of each class that occurs.
pub fn by_class(outcomes: &[&Outcome]) -> [Option<f64>; 4] {
    Class::ALL.map(|class| {
        let objects: u32 = outcomes.iter().map(|o| o.objects[class as usize]).sum();
        let mut judged: Vec<Judged> =
            outcomes.iter().flat_map(|o| o.judged.iter().filter(|j| j.class == class)).copied().collect();
        judged.sort_by_key(|j| core::cmp::Reverse(j.score));
        (objects > 0).then(|| area(&judged, objects))
    })
}

/// Mean of the average precisions.
pub fn mean(outcomes: &[&Outcome]) -> f64 {
    let classes: Vec<f64> = by_class(outcomes).into_iter().flatten().collect();
    classes.iter().sum::<f64>() / classes.len().max(1) as f64
}

/// The middle 95 % of the mean over frames drawn again.
pub fn interval(outcomes: &[Outcome]) -> [f64; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(outcomes.len() as u64);
    let mut means: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let drawn: Vec<&Outcome> =
                outcomes.iter().map(|_| &outcomes[rng.next_u64() as usize % outcomes.len()]).collect();
            mean(&drawn)
        })
        .collect();
    means.sort_by(f64::total_cmp);
    let at = |share: f64| means.get((share * DRAWS as f64) as usize).copied().unwrap_or_default();
    [at(0.025), at(0.975)]
}

/// Area under the precision envelope; `judged` best first.
fn area(judged: &[Judged], objects: u32) -> f64 {
    let (mut right, mut points) = (0u32, Vec::with_capacity(judged.len()));
    for (k, one) in judged.iter().enumerate() {
        right += u32::from(one.right);
        points.push((f64::from(right) / f64::from(objects), f64::from(right) / (k + 1) as f64));
    }
    let (mut best, mut total) = (0.0f64, 0.0);
    for k in (0..points.len()).rev() {
        best = best.max(points[k].1);
        let before = if k == 0 { 0.0 } else { points[k - 1].0 };
        total += (points[k].0 - before) * best;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::id::ObjectId;
    use wire::sensor::PixelBox;

    fn bounds(x0: u16) -> PixelBox {
        PixelBox { x0, y0: 10, x1: x0 + 10, y1: 20 }
    }

    fn label(object: u16, class: Class, x0: u16) -> Label {
        Label { object: ObjectId(object), class, bounds: bounds(x0), pixels: 100, range_mm: 5_000 }
    }

    fn detection(class: Class, score: u16, x0: u16) -> Detection {
        Detection { class, score, bounds: bounds(x0) }
    }

    /// The second box on it is wrong.
    #[test]
    fn object_is_found_once() {
        let labels = [label(0, Class::Person, 10), label(1, Class::Person, 60)];
        let found = [
            detection(Class::Person, 900, 10),
            detection(Class::Person, 800, 11),
            detection(Class::Person, 700, 60),
            detection(Class::Decoy, 600, 60),
        ];
        let outcome = judge(&labels, &found);
        assert_eq!(outcome.judged.iter().map(|j| j.right).collect::<Vec<_>>(), [true, false, true, false]);
        // Recall 0.5 at precision 1, recall 1 at precision 2/3.
        let persons = by_class(&[&outcome])[Class::Person as usize].unwrap();
        assert!((persons - (0.5 + 0.5 * 2.0 / 3.0)).abs() < 1e-9, "{persons}");
        assert_eq!(by_class(&[&outcome])[Class::Vehicle as usize], None);
    }

    #[test]
    fn too_small_object_is_neither_hit_nor_miss() {
        let mut small = label(0, Class::Person, 10);
        small.pixels = 3;
        let outcome = judge(&[small], &[detection(Class::Person, 900, 10)]);
        assert_eq!((outcome.objects, outcome.judged.len()), ([0; 4], 0));
    }

    #[test]
    fn the_interval_of_equal_frames_is_their_mean() {
        let outcome = judge(&[label(0, Class::Person, 10)], &[detection(Class::Person, 900, 10)]);
        let [low, high] = interval(&vec![outcome; 30]);
        assert!((low - 1.0).abs() < 1e-9 && (high - 1.0).abs() < 1e-9, "{low} to {high}");
    }
}
