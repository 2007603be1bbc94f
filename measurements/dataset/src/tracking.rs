//! Quality of tracks over a ride.
//!
//! Per frame the generalised optimal sub-pattern assignment metric (Rahmathullah, García-Fernández, Svensson 2017) with α = 2, p =
//! 2 and c = [`CUT_OFF_M`]: the root of the squared distances of the pairs plus half c² for each object missed and each false
//! track. Identity switches as by CLEAR MOT (Bernardin, Stiefelhagen 2008). Objects that a frame does not show (hidden, beside the
//! image, too small) are neither asked for nor held against a track that coasts on them.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;
use perception::corroborate::{CorroborationLimits, Sighting, corroborate};
use perception::pose::Ego;
use perception::stages::StageClaims;
use perception::tracker::{MAX_TRACKS, Tracker};
use serde::Serialize;
use sim::ride::Shot;
use sim::scene::Scene;
use wire::id::TrackId;
use wire::sensor::{Camera, Class, Modalities};
use wire::time::Span;
use wire::track::Track;

use crate::draw::distance;
use crate::example::counts;

/// Distance from which on an object and a track are not of one another, metres: the bound of property P11.
pub const CUT_OFF_M: f32 = 2.0;
/// Time for which localisation is good.
const FIX: Span = Span::ms(500);

/// Sums over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tracking {
    /// Frames.
    pub frames: u32,
    /// Objects that frames show.
    pub shown: u32,
    /// Number of these with a track.
    pub followed: u32,
    /// Number of these with a track of their class.
    pub named: u32,
    /// False tracks.
    pub stray: u32,
    /// Times that an object came under another track than before.
    pub switches: u32,
    /// Sum of the squared distances of tracks from their objects, square metres.
    pub squares_m2: f64,
    /// Sum of the metric, metres.
    pub gospa_m: f64,
}

impl Tracking {
    /// Both together.
    #[must_use]
    pub fn merged(self, other: &Tracking) -> Self {
        Tracking {
            frames: self.frames + other.frames,
            shown: self.shown + other.shown,
            followed: self.followed + other.followed,
            named: self.named + other.named,
            stray: self.stray + other.stray,
            switches: self.switches + other.switches,
            squares_m2: self.squares_m2 + other.squares_m2,
            gospa_m: self.gospa_m + other.gospa_m,
        }
    }

    /// Mean of the metric over frames, metres.
    pub fn gospa(&self) -> f64 {
        self.gospa_m / f64::from(self.frames.max(1))
    }

    /// Root of the mean square distance of tracks from their objects, metres.
    pub fn error_m(&self) -> f64 {
        (self.squares_m2 / f64::from(self.followed.max(1))).sqrt()
    }
}

/// Perception's way from candidates to tracks, scored on the way.
#[derive(Default)]
pub struct Follower {
    ego: Ego,
    tracker: Tracker<MAX_TRACKS>,
    scorer: Scorer,
}

impl Follower {
    /// Takes one frame's candidates.
    pub fn take(
        &mut self,
        StageClaims { candidates, disputed }: &StageClaims,
        limits: &CorroborationLimits,
        shot: &Shot,
        scene: &Scene,
    ) {
        self.ego.note(&shot.navigation);
        let judged = corroborate(&Camera::GROUND, limits, Modalities::default(), candidates, *disputed);
        let sightings: Vec<Sighting> = judged.iter().filter_map(|j| j.sighting).collect();
        self.tracker.update(shot.frame, shot.stamp, self.ego.pose_at(shot.stamp, FIX).as_ref(), &sightings);
        let shown = |k| shot.shown.labels.iter().any(|l| usize::from(l.object.0) == k && counts(l));
        let objects = scene.objects.iter().zip(&shot.places).enumerate();
        let truth: Vec<Truth> =
            objects.map(|(k, (object, place))| Truth { class: object.class, place: *place, shown: shown(k) }).collect();
        self.scorer.frame(&truth, &self.tracker.tracks());
    }

    /// The sums so far.
    pub fn score(&self) -> Tracking {
        self.scorer.score
    }
}

/// An object as it is at a frame.
struct Truth {
    class: Class,
    place: [f32; 2],
    /// True if the frame shows enough of it.
    shown: bool,
}

#[derive(Default)]
struct Scorer {
    /// The track that each object came under last.
    last: Vec<Option<TrackId>>,
    score: Tracking,
}

impl Scorer {
    fn frame(&mut self, truth: &[Truth], tracks: &[Track]) {
        self.last.resize(truth.len(), None);
        let pairs = pairs(truth, tracks);
        let score = &mut self.score;
        let (shown, mut followed, mut squares) = (truth.iter().filter(|t| t.shown).count() as u32, 0, 0.0);
        for (object, track) in pairs.iter().filter(|(object, _)| truth[*object].shown) {
            let metres = f64::from(distance(truth[*object].place, place(track)));
            squares += metres * metres;
            followed += 1;
            score.named += u32::from(track.class == truth[*object].class);
            let before = self.last[*object].replace(track.id);
            score.switches += u32::from(before.is_some_and(|before| before != track.id));
        }
        let stray = (tracks.len() - pairs.len()) as u32;
        let half = f64::from(CUT_OFF_M * CUT_OFF_M) / 2.0;
        score.frames += 1;
        score.shown += shown;
        score.followed += followed;
        score.stray += stray;
        score.squares_m2 += squares;
        score.gospa_m += (squares + half * f64::from(shown - followed + stray)).sqrt();
    }
}

/// Objects and tracks that are of one another: the assignment with the least sum of squared distances, cut off.
fn pairs<'a>(truth: &[Truth], tracks: &'a [Track]) -> Vec<(usize, &'a Track)> {
    if truth.is_empty() || tracks.is_empty() {
        return Vec::new();
    }
    let squared = |object: usize, track: usize| {
        let metres = distance(truth[object].place, place(&tracks[track])).min(CUT_OFF_M);
        (metres * metres * 1e6) as i64
    };
    // The assignment wants at least as many columns as rows.
    let turned = tracks.len() < truth.len();
    let size = if turned { (tracks.len(), truth.len()) } else { (truth.len(), tracks.len()) };
    let matrix = Matrix::from_fn(
        size.0,
        size.1,
        |(row, column)| if turned { squared(column, row) } else { squared(row, column) },
    );
    let (_, columns) = kuhn_munkres_min(&matrix);
    let pair = |(row, column): (usize, usize)| if turned { (column, &tracks[row]) } else { (row, &tracks[column]) };
    let near = |(object, track): &(usize, &Track)| distance(truth[*object].place, place(track)) < CUT_OFF_M;
    columns.into_iter().enumerate().map(pair).filter(near).collect()
}

fn place(track: &Track) -> [f32; 2] {
    [track.x_mm as f32 / 1000.0, track.y_mm as f32 / 1000.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::id::FrameId;
    use wire::sensor::Class;
    use wire::time::Instant;

    fn track(id: u32, x_mm: i32) -> Track {
        let none = Modalities::default();
        Track {
            id: TrackId(id),
            class: Class::Vehicle,
            x_mm,
            y_mm: 0,
            vx_mm_s: 0,
            vy_mm_s: 0,
            sigma_mm: 100,
            confidence: 900,
            supported: none,
            vetoed: none,
            updated: Instant(0),
            frame: FrameId(1),
            across_px: 0,
        }
    }

    fn truth(places: &[[f32; 2]]) -> Vec<Truth> {
        places.iter().map(|place| Truth { class: Class::Vehicle, place: *place, shown: true }).collect()
    }

    /// No pair is beyond the cut-off.
    #[test]
    fn tracks_pair_with_objects_at_least_cost() {
        let tracks = [track(1, 1_000), track(2, 2_400), track(3, 9_000)];
        let found =
            |places: &[[f32; 2]]| pairs(&truth(places), &tracks).iter().map(|(k, t)| (*k, t.id.0)).collect::<Vec<_>>();
        // Greedy, the first object would take the second track, which is nearer to it, and leave the other with none.
        assert_eq!(found(&[[1.8, 0.0], [3.9, 0.0]]), [(0, 1), (1, 2)]);
        assert_eq!(found(&[[5.0, 0.0]]), []);
        let mut many = found(&[[30.0, 0.0], [9.5, 0.0], [1.0, 0.0], [2.4, 0.0], [40.0, 0.0]]);
        many.sort_unstable();
        assert_eq!(many, [(1, 3), (2, 1), (3, 2)]);
    }

    /// Objects that are not shown do not count.
    #[test]
    fn metric_counts_distance_misses_and_false_tracks() {
        let mut scorer = Scorer::default();
        let gospa = |scorer: &mut Scorer, truth: &[Truth], tracks: &[Track]| {
            let before = scorer.score.gospa_m;
            scorer.frame(truth, tracks);
            scorer.score.gospa_m - before
        };
        let mut truths = truth(&[[0.0, 0.0], [10.0, 0.0]]);
        // One half a metre off, the other missed, a track of nothing: a quarter, and twice half of c squared.
        let seen = gospa(&mut scorer, &truths, &[track(1, 500), track(2, 20_000)]);
        assert!((seen - 4.25f64.sqrt()).abs() < 1e-6, "{seen}");
        // What the frame does not show is not missed, and a track that coasts on it is not of nothing.
        truths[1].shown = false;
        assert!((gospa(&mut scorer, &truths, &[track(1, 500), track(3, 10_300)]) - 0.5).abs() < 1e-6);
        assert_eq!(
            (scorer.score.shown, scorer.score.followed, scorer.score.stray, scorer.score.switches),
            (3, 2, 1, 0)
        );
        // Under another track: a switch, once.
        scorer.frame(&truths, &[track(4, 100)]);
        scorer.frame(&truths, &[track(4, 100)]);
        assert_eq!((scorer.score.switches, scorer.score.named), (1, 4));
    }
}
