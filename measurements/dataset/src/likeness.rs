//! Output of the stages on a rendered frame, compared with the noise model's in their place.
//!
//! For each visible object: found or missed, and where; by range, and by partial cover. For each frame: false detections. For
//! each ride: the length of series of misses, for one miss that lasts costs a track and ten that are scattered do not.

use perception::corroborate::CorroborationLimits;
use serde::Serialize;
use sim::Label;
use sim::ride::Shot;
use sim::scene::{Object, Scene};
use wire::sensor::{Candidates, Class, Cluster, PixelBox};

use crate::draw::distance;
use crate::example::counts;

/// Upper ends of the ranges that are distinguished, metres along the optical axis; the last is open.
pub const RANGES_M: [f32; 3] = [8.0, 13.0, 18.0];
/// A box is of an object from this share of shared over united area on.
const SAME: f32 = 0.3;
/// A box is a false detection when it shares less than this with each object's box.
const NOTHING: f32 = 0.05;
/// A cluster is of an object within this distance of its outline, metres.
const NEAR_M: f32 = 0.8;
/// Permitted deviation of the noise model, committed before it was fitted: shares found and shares under their class,
/// by this much either way, where at least [`LEAST_ASKED`] were asked for.
const SHARE: f64 = 0.05;
const LEAST_ASKED: u32 = 100;
/// False detections, per frame.
const STRAY: f64 = 0.02;
/// Lengths of rows of misses, and distances: by this factor either way.
const FACTOR: f64 = 1.5;
/// Mean score, 0 to 1.
const SCORE: f64 = 0.05;
/// Warmer than the ground by this, an object is one that the thermal stage is asked for, kelvin.
const WARM_K: f32 = 8.0;

/// A stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Colour detections.
    Colour,
    /// Warm regions.
    Thermal,
    /// LiDAR clusters.
    Lidar,
}

impl Stage {
    /// Every one.
    pub const ALL: [Stage; 3] = [Stage::Colour, Stage::Thermal, Stage::Lidar];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Colour => "colour",
            Stage::Thermal => "thermal",
            Stage::Lidar => "LiDAR",
        }
    }
}

/// Asked and found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Found {
    /// Objects that frames show.
    pub asked: u32,
    /// Number of these that were found.
    pub found: u32,
    /// Number of these found under their own class, or as warm as their class is; of LiDAR all.
    pub named: u32,
}

impl Found {
    /// Share found.
    pub fn share(self) -> Option<f64> {
        (self.asked > 0).then(|| f64::from(self.found) / f64::from(self.asked))
    }

    /// Share of those found under their class.
    pub fn named(self) -> f64 {
        f64::from(self.named) / f64::from(self.found.max(1))
    }

    fn add(&mut self, sight: Option<&Sight>) {
        self.asked += 1;
        self.found += u32::from(sight.is_some());
        self.named += u32::from(sight.is_some_and(|s| s.named));
    }
}

/// Output of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Given {
    /// Counts by range, of unobstructed objects.
    pub whole: [Found; RANGES_M.len() + 1],
    /// Counts of partly covered objects, at any range.
    pub partly: Found,
    /// Frames.
    pub frames: u32,
    /// False detections.
    pub stray: u32,
    /// Misses in a row, and how many rows of them there were.
    pub missed: u32,
    /// Rows of misses.
    pub bursts: u32,
    /// Sum of squared distances: of boxes' middles in pixels, of clusters' in metres.
    pub squares: f64,
    /// Sum of the scores of found objects, permille.
    pub scores: u64,
}

impl Given {
    /// Mean length of a row of misses, frames.
    pub fn burst(&self) -> f64 {
        f64::from(self.missed) / f64::from(self.bursts.max(1))
    }

    /// Counts of all objects, covered or not, asked and found.
    pub fn all(&self) -> Found {
        let sum = |a: Found, b: &Found| Found {
            asked: a.asked + b.asked,
            found: a.found + b.found,
            named: a.named + b.named,
        };
        self.whole.iter().fold(self.partly, sum)
    }

    /// Root of the mean squared distance of found objects: pixels, or metres of LiDAR.
    pub fn error(&self) -> f64 {
        (self.squares / f64::from(self.all().found.max(1))).sqrt()
    }

    /// False detections per frame.
    pub fn strays(&self) -> f64 {
        f64::from(self.stray) / f64::from(self.frames.max(1))
    }

    /// Mean score of found objects, 0 to 1.
    pub fn score(&self) -> f64 {
        self.scores as f64 / 1000.0 / f64::from(self.all().found.max(1))
    }
}

/// The three stages on one way, over a number of rides.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Likeness {
    /// Counts in the order of [`Stage::ALL`].
    pub stages: [Given; 3],
    /// Per stage and object of this ride: whether the frame before asked and missed.
    #[serde(skip)]
    missing: [Vec<bool>; 3],
}

/// Deviations of the noise model's findings from a stage's beyond the tolerances.
pub fn departures(rendered: &Given, stand_in: &Given) -> Vec<String> {
    let mut all = Vec::new();
    let mut share = |name: String, a: Option<f64>, b: Option<f64>, least: f64| {
        if let (Some(a), Some(b)) = (a, b)
            && (a - b).abs() > least
        {
            all.push(format!("{name}: {b:.3} for {a:.3}"));
        }
    };
    let bins = rendered.whole.iter().zip(&stand_in.whole).enumerate().map(|(k, (a, b))| (bin(k), a, b));
    let bins = bins.chain([("hidden in part".to_owned(), &rendered.partly, &stand_in.partly)]);
    for (what, a, b) in bins.filter(|(_, a, _)| a.asked >= LEAST_ASKED) {
        share(what, a.share(), b.share(), SHARE);
    }
    share("under its class".to_owned(), Some(rendered.all().named()), Some(stand_in.all().named()), SHARE);
    share("of nothing, a frame".to_owned(), Some(rendered.strays()), Some(stand_in.strays()), STRAY);
    share("score".to_owned(), Some(rendered.score()), Some(stand_in.score()), SCORE);
    let mut factor = |name: &str, a: f64, b: f64| {
        if a > 0.0 && b > 0.0 && !(1.0 / FACTOR..=FACTOR).contains(&(b / a)) {
            all.push(format!("{name}: {b:.2} for {a:.2}"));
        }
    };
    factor("misses in a row", rendered.burst(), stand_in.burst());
    factor("off", rendered.error(), stand_in.error());
    all
}

/// A range in words.
pub fn bin(place: usize) -> String {
    match RANGES_M.get(place) {
        Some(end) => format!("to {end} m"),
        None => format!("beyond {} m", RANGES_M[RANGES_M.len() - 1]),
    }
}

/// A stage's finding of an object.
struct Sight {
    distance: f64,
    named: bool,
    score: u16,
}

impl Likeness {
    /// A new ride begins.
    pub fn begin(&mut self, objects: usize) {
        self.missing = core::array::from_fn(|_| vec![false; objects]);
    }

    /// Takes one frame's candidates.
    pub fn take(&mut self, candidates: &Candidates, limits: &CorroborationLimits, shot: &Shot, scene: &Scene) {
        for (k, stage) in Stage::ALL.into_iter().enumerate() {
            let (given, missing) = (&mut self.stages[k], &mut self.missing[k]);
            given.frames += 1;
            given.stray += stray(stage, candidates, limits, shot, scene);
            for label in shot.shown.labels.iter().filter(|l| counts(l)) {
                let index = usize::from(label.object.0);
                let object = &scene.objects[index];
                if stage == Stage::Thermal && !warm(object, scene) {
                    continue;
                }
                let sight = sight(stage, candidates, limits, label, (object, body(shot, shot.places[index])));
                let metres = label.range_mm as f32 / 1000.0;
                let place = RANGES_M.iter().position(|end| metres < *end).unwrap_or(RANGES_M.len());
                let row = if shot.hidden[index] { &mut given.partly } else { &mut given.whole[place] };
                row.add(sight.as_ref());
                let missed = sight.is_none();
                given.missed += u32::from(missed);
                given.bursts += u32::from(missed && !missing[index]);
                missing[index] = missed;
                if let Some(sight) = sight {
                    given.squares += sight.distance * sight.distance;
                    given.scores += u64::from(sight.score);
                }
            }
        }
    }
}

/// The best that a stage has of an object.
fn sight(
    stage: Stage,
    candidates: &Candidates,
    limits: &CorroborationLimits,
    label: &Label,
    (object, place): (&Object, [f32; 2]),
) -> Option<Sight> {
    let of_box = |bounds: &PixelBox, named, score| {
        (label.bounds.shared(bounds), Sight { distance: middles(&label.bounds, bounds), named, score })
    };
    let best = |all: Vec<(f32, Sight)>| {
        all.into_iter().filter(|(shared, _)| *shared >= SAME).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, sight)| sight)
    };
    match stage {
        Stage::Colour => {
            let found = candidates.rgb.iter().flat_map(|found| found.iter()).filter(|d| d.score >= limits.score);
            best(found.map(|d| of_box(&d.bounds, d.class == object.class, d.score)).collect())
        }
        Stage::Thermal => {
            let found = candidates.thermal.iter().flat_map(|found| found.iter());
            best(found.map(|b| of_box(&b.bounds, b.class == object.class, b.score)).collect())
        }
        Stage::Lidar => {
            let found = candidates.lidar.iter().flat_map(|found| found.iter());
            let distances = found.map(|c| distance(middle(c), place));
            let nearest = distances.min_by(f32::total_cmp).filter(|metres| *metres <= reach(object));
            nearest.map(|metres| Sight { distance: f64::from(metres), named: true, score: 0 })
        }
    }
}

/// Number of a stage's false detections.
fn stray(stage: Stage, candidates: &Candidates, limits: &CorroborationLimits, shot: &Shot, scene: &Scene) -> u32 {
    let of_none = |bounds: &PixelBox| shot.boxes.iter().flatten().all(|b| b.shared(bounds) < NOTHING);
    let far = |cluster: &&Cluster| {
        let clear =
            |(object, place): (&Object, &[f32; 2])| distance(middle(cluster), body(shot, *place)) > reach(object);
        scene.objects.iter().zip(&shot.places).all(clear)
    };
    let count = match stage {
        Stage::Colour => {
            let found = candidates.rgb.iter().flat_map(|found| found.iter());
            found.filter(|d| d.score >= limits.score && of_none(&d.bounds)).count()
        }
        Stage::Thermal => {
            candidates.thermal.iter().flat_map(|found| found.iter()).filter(|b| of_none(&b.bounds)).count()
        }
        Stage::Lidar => candidates.lidar.iter().flat_map(|found| found.iter()).filter(far).count(),
    };
    count as u32
}

/// True if the thermal stage is asked for it.
fn warm(object: &Object, scene: &Scene) -> bool {
    matches!(object.class, Class::Vehicle | Class::Person) && object.kelvin - scene.ground.kelvin >= WARM_K
}

/// Distance from its middle, metres.
fn reach(object: &Object) -> f32 {
    0.5 * object.size[0].max(object.size[1]) + NEAR_M
}

fn middle(cluster: &Cluster) -> [f32; 2] {
    [cluster.x_mm as f32 / 1000.0, cluster.y_mm as f32 / 1000.0]
}

/// A place in the world in the unit's body frame: metres forward, metres left.
fn body(shot: &Shot, [east, north]: [f32; 2]) -> [f32; 2] {
    let (sin, cos) = libm::sincosf(shot.pose.heading);
    let (dx, dy) = (east - shot.pose.east, north - shot.pose.north);
    [cos * dx + sin * dy, cos * dy - sin * dx]
}

/// Between the middles of two boxes, pixels.
fn middles(a: &PixelBox, b: &PixelBox) -> f64 {
    let middle = |b: &PixelBox| [f64::from(b.x0 + b.x1) / 2.0, f64::from(b.y0 + b.y1) / 2.0];
    let ([ax, ay], [bx, amount]) = (middle(a), middle(b));
    (ax - bx).hypot(ay - amount)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// It finds more, strays more, or misses for longer than is allowed.
    #[test]
    fn stand_in_departures_are_detected() {
        let found = |asked, found| Found { asked, found, named: found - found / 10 };
        let given = |far: u32, stray, missed| Given {
            whole: [found(200, 190), found(200, 180), found(50, 10), found(200, far)],
            frames: 100,
            stray,
            missed,
            bursts: 10,
            ..Given::default()
        };
        assert_eq!(departures(&given(140, 2, 60), &given(149, 3, 50)), Vec::<String>::new());
        let texts = departures(&given(140, 2, 60), &given(180, 9, 30));
        let what: Vec<&str> = texts.iter().filter_map(|t| t.split(':').next()).collect();
        assert_eq!(what, ["beyond 18 m", "of nothing, a frame", "misses in a row"]);
    }
}
