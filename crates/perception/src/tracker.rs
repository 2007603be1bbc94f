//! Tracks from sightings: constant-velocity Kalman filters in the world frame and optimal assignment in a gate.
//!
//! `adskalman` filters, `pathfinding` assigns; this file decides associations, the start of belief in a track, and its
//! end. A track is shown only after three supported updates within five frames, its identity is never used again, and
//! confidence grows with supported score alone: a vetoed sighting moves a track and costs confidence.

use adskalman::{CovarianceUpdateMethod, ObservationModel, StateAndCovariance, TransitionModelLinearNoControl};
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Matrix4x2, U2, U4, Vector2, Vector4};
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;
use wire::codec::List;
use wire::id::{FrameId, TrackId};
use wire::sensor::{Class, Modalities, Modality, PixelBox};
use wire::time::{Instant, Span};
use wire::track::Track;

use crate::corroborate::Sighting;
use crate::pose::Placement;

/// Most tracks, tentative ones included.
pub const MAX_TRACKS: usize = 16;
/// A track ends after this long without an update.
const LIFE: Span = Span::ms(1000);
/// Frames with opinions that a track shows: the track limit of 500 ms at 10 Hz.
const OPINIONS: usize = 5;
/// Number of these that makes a supporting modality: one noisy frame withdraws no support.
const SUPPORTS: usize = 1;
/// Number of these that makes a veto: most of them.
const VETOES: usize = 3;
/// Number of these that makes a veto where a modality merely shows no object: all but one. A stage misses a frame more
/// often than it errs, and the track limit is as long.
const ABSENCES: usize = 4;
/// Updates that make a tentative track a track, within the last five frames.
const CONFIRMATIONS: u32 = 3;
const CONFIRMATION_FRAMES: u8 = 0b1_1111;
/// Squared Mahalanobis distance that 1 in 1000 true pairs exceed, two degrees of freedom; thousandths.
const GATE: i64 = 13_816;
/// Cost of a sighting of another class in the assignment; thousandths.
const OTHER_CLASS: i64 = 4_000;
const IMPOSSIBLE: i64 = 1_000_000_000;
/// Deviation of an object's acceleration on each axis, m/s².
const ACCELERATION: f64 = 1.2;
/// Deviation of a new track's velocity on each axis, m/s.
const FIRST_VELOCITY: f64 = 1.5;

/// An object under observation, believed or not.
#[derive(Clone, Debug)]
struct Hypothesis {
    id: TrackId,
    state: StateAndCovariance<f64, U4>,
    /// Frames in which an uncontradicted sighting updated the track, one bit each, the newest lowest.
    history: u8,
    confirmed: bool,
    confidence: u16,
    votes: [u32; 4],
    /// Opinions in the newest frames, newest first.
    opinions: [Opinion; OPINIONS],
    updated: Instant,
    frame: FrameId,
    /// Place of the newest sighting in the image.
    bounds: Option<PixelBox>,
}

/// The statement of one frame on a track.
#[derive(Clone, Copy, Debug, Default)]
struct Opinion {
    supported: Modalities,
    /// Modalities that speak against it, by another object or by none.
    vetoed: Modalities,
    /// Modalities that speak against it by showing no object.
    absent: Modalities,
}

impl Opinion {
    /// Opinion of a sighting that claims the class `own_class`, or another one. Another class is colour's word against
    /// the track; the words of other modalities on that claim are not on the track.
    fn from_sighting(sighting: &Sighting, own_class: Option<Class>) -> Self {
        let Sighting { supported, vetoed, absent, .. } = *sighting;
        if own_class.is_none_or(|own_class| own_class == sighting.class) {
            return Opinion { supported, vetoed, absent };
        }
        let places = [Modality::Depth, Modality::Lidar].into_iter().filter(|place| supported.contains(*place));
        Opinion {
            supported: places.fold(Modalities::default(), Modalities::with_modality),
            vetoed: Modalities::default().with_modality(Modality::Rgb),
            absent: Modalities::default(),
        }
    }
}

/// The tracker, of at most a given number of tracks.
#[derive(Clone, Debug, Default)]
pub struct Tracker<const MOST: usize> {
    tracks: Vec<Hypothesis>,
    last: u32,
    at: Option<Instant>,
}

impl<const MOST: usize> Tracker<MOST> {
    /// Takes the sightings of one frame, placed by `ego`. Without `ego` no sighting can be placed and tracks only age.
    pub fn update(&mut self, frame: FrameId, stamp: Instant, ego: Option<&Placement>, sightings: &[Sighting]) {
        self.predict(stamp);
        let placed: Vec<Placed> = ego.map_or(Vec::new(), |ego| sightings.iter().map(|s| Placed::new(s, ego)).collect());
        let assigned = self.assign(&placed);
        for (track, sighting) in self.tracks.iter_mut().zip(&assigned) {
            match sighting.map(|index| &placed[index]) {
                Some(placed) => track.take(placed, frame, stamp),
                None => track.miss(),
            }
        }
        self.tracks.retain(|t| stamp.since(t.updated) < LIFE);
        for (index, placed) in placed.iter().enumerate().filter(|(_, p)| p.sighting.is_uncontradicted()) {
            // A second sighting within the gate of a track begins none: two tracks of one object would share its
            // sightings.
            let known = assigned.contains(&Some(index)) || self.tracks.iter().any(|t| t.distance(placed) <= GATE);
            if !known && self.tracks.len() < MOST {
                self.last += 1;
                self.tracks.push(Hypothesis::new(TrackId(self.last), placed, frame, stamp));
            }
        }
    }

    /// The tracks that are believed, oldest first.
    pub fn tracks(&self) -> List<Track, MOST> {
        self.tracks.iter().filter(|t| t.confirmed).map(Hypothesis::track).collect()
    }

    /// The believed vehicles that a frame updated, with their places in its images, oldest first.
    pub fn vehicles_in(&self, frame: FrameId) -> impl Iterator<Item = (TrackId, PixelBox)> + '_ {
        let seen =
            move |track: &&Hypothesis| track.confirmed && track.frame == frame && track.class() == Class::Vehicle;
        self.tracks.iter().filter(seen).filter_map(|track| Some((track.id, track.bounds?)))
    }

    fn predict(&mut self, stamp: Instant) {
        let seconds = self.at.map_or(0.0, |time| stamp.since(time).0 as f64 / 1e6).min(LIFE.0 as f64 / 1e6);
        self.at = Some(stamp);
        if seconds > 0.0 && !self.tracks.is_empty() {
            let motion = Motion::new(seconds);
            for track in &mut self.tracks {
                track.state = motion.predict(&track.state);
            }
        }
    }

    /// Index of the sighting of each track. Each track may also take a dummy at the price of the gate.
    fn assign(&self, placed: &[Placed]) -> Vec<Option<usize>> {
        let (rows, real) = (self.tracks.len(), placed.len());
        if rows == 0 || real == 0 {
            return vec![None; rows];
        }
        let cost = |(row, column): (usize, usize)| match placed.get(column) {
            Some(p) => self.tracks[row].cost(p),
            None => GATE + OTHER_CLASS,
        };
        let matrix = Matrix::from_fn(rows, real + rows, cost);
        let (_, columns) = kuhn_munkres_min(&matrix);
        let inside = |(row, column): (usize, usize)| {
            placed.get(column).filter(|p| self.tracks[row].distance(p) <= GATE).map(|_| column)
        };
        columns.into_iter().enumerate().map(inside).collect()
    }
}

/// A sighting in the world frame.
struct Placed {
    sighting: Sighting,
    at: Vector2<f64>,
    /// Mode of observation.
    seen: Seen,
}

impl Placed {
    fn new(sighting: &Sighting, ego: &Placement) -> Self {
        let [east, north] = ego.to_world(sighting.place);
        let variance = sighting.sigma * sighting.sigma + ego.sigma * ego.sigma;
        Placed { sighting: *sighting, at: Vector2::new(east, north), seen: Seen::new(variance) }
    }
}

impl Hypothesis {
    fn new(id: TrackId, placed: &Placed, frame: FrameId, stamp: Instant) -> Self {
        let (place, velocity) = (placed.seen.noise[(0, 0)], FIRST_VELOCITY * FIRST_VELOCITY);
        let covariance = Matrix4::from_diagonal(&Vector4::new(place, place, velocity, velocity));
        let mut track = Hypothesis {
            id,
            state: StateAndCovariance::new(Vector4::new(placed.at.x, placed.at.y, 0.0, 0.0), covariance),
            history: 0,
            confirmed: false,
            confidence: 0,
            votes: [0; 4],
            opinions: Default::default(),
            updated: stamp,
            frame,
            bounds: None,
        };
        track.learn(&placed.sighting);
        track
    }

    fn take(&mut self, placed: &Placed, frame: FrameId, stamp: Instant) {
        let updated = placed.seen.update(&self.state, &placed.at, CovarianceUpdateMethod::JosephForm);
        let Ok(state) = updated else { return self.miss() };
        self.state = state;
        (self.updated, self.frame) = (stamp, frame);
        self.learn(&placed.sighting);
    }

    fn learn(&mut self, sighting: &Sighting) {
        self.hear(Opinion::from_sighting(sighting, self.confirmed.then(|| self.class())));
        self.bounds = sighting.bounds;
        self.history <<= 1;
        if !sighting.is_uncontradicted() {
            // A contradicted frame costs more than a missed one (a 24th): with `designation_keep` these shares decide
            // how long a designation lasts (docs/reference/bounds.md).
            self.confidence -= self.confidence / 8;
            return;
        }
        self.history |= 1;
        self.confirmed |= (self.history & CONFIRMATION_FRAMES).count_ones() >= CONFIRMATIONS;
        let target = i32::from(evidence(sighting));
        self.confidence =
            (i32::from(self.confidence) + (target - i32::from(self.confidence)) / 4).clamp(0, 1000) as u16;
        for vote in &mut self.votes {
            *vote -= *vote / 16;
        }
        self.votes[sighting.class as usize] += u32::from(sighting.score);
    }

    fn hear(&mut self, opinion: Opinion) {
        self.opinions.rotate_right(1);
        self.opinions[0] = opinion;
    }

    /// Modalities for which `is` holds in at least `least` of the newest opinions.
    fn held(&self, least: usize, is: impl Fn(&Opinion, Modality) -> bool) -> Modalities {
        let holds = |m: &Modality| self.opinions.iter().filter(|opinion| is(opinion, *m)).count() >= least;
        Modality::ALL.into_iter().filter(holds).fold(Modalities::default(), Modalities::with_modality)
    }

    /// Modalities that speak against the track: by another object, or over more frames by none.
    fn contradicting(&self) -> Modalities {
        let shown = self.held(VETOES, |opinion, m| opinion.vetoed.contains(m) && !opinion.absent.contains(m));
        let any = self.held(ABSENCES, |opinion, m| opinion.vetoed.contains(m));
        Modality::ALL
            .into_iter()
            .filter(|m| shown.contains(*m) || any.contains(*m))
            .fold(Modalities::default(), Modalities::with_modality)
    }

    fn miss(&mut self) {
        self.hear(Opinion::default());
        self.history <<= 1;
        self.confidence -= self.confidence / 24;
    }

    /// Squared Mahalanobis distance, thousandths.
    fn distance(&self, placed: &Placed) -> i64 {
        // What is observed is the place, the first two of the state: multiplying by the observation matrix only picks
        // them.
        let innovation = placed.at - self.state.state().fixed_rows::<2>(0);
        let spread = self.state.covariance().fixed_view::<2, 2>(0, 0) + placed.seen.noise;
        let Some(inverse) = spread.try_inverse() else { return IMPOSSIBLE };
        let squared = (innovation.transpose() * inverse * innovation)[(0, 0)];
        if squared.is_finite() { (squared * 1000.0).clamp(0.0, IMPOSSIBLE as f64) as i64 } else { IMPOSSIBLE }
    }

    fn cost(&self, placed: &Placed) -> i64 {
        let distance = self.distance(placed);
        if distance > GATE {
            return IMPOSSIBLE;
        }
        distance + if placed.sighting.class == self.class() { 0 } else { OTHER_CLASS }
    }

    /// The class with the most votes; the first in wire order among equals.
    fn class(&self) -> Class {
        let most = self.votes.iter().copied().max().unwrap_or(0);
        let first = Class::ALL.into_iter().find(|c| self.votes[*c as usize] == most);
        first.unwrap_or(Class::Obstacle)
    }

    fn track(&self) -> Track {
        let (state, covariance) = (self.state.state(), self.state.covariance());
        let millimetres = |metres: f64| (metres * 1000.0).clamp(-2e9, 2e9) as i32;
        let variance = 0.5 * (covariance[(0, 0)] + covariance[(1, 1)]);
        Track {
            id: self.id,
            class: self.class(),
            x_mm: millimetres(state[0]),
            y_mm: millimetres(state[1]),
            vx_mm_s: millimetres(state[2]),
            vy_mm_s: millimetres(state[3]),
            sigma_mm: (variance.max(0.0).sqrt() * 1000.0).min(65_535.0) as u16,
            confidence: self.confidence,
            supported: self.held(SUPPORTS, |opinion, m| opinion.supported.contains(m)),
            vetoed: self.contradicting(),
            updated: self.updated,
            frame: self.frame,
            across_px: self.bounds.map_or(0, across_px),
        }
    }
}

/// Pixels across the smaller side.
fn across_px(bounds: PixelBox) -> u16 {
    bounds.x1.saturating_sub(bounds.x0).min(bounds.y1.saturating_sub(bounds.y0))
}

/// Evidence of an unvetoed sighting: its score, reduced for absent modalities.
fn evidence(sighting: &Sighting) -> u16 {
    let share = match (sighting.complete, sighting.supported.count()) {
        (true, 4..) => 10,
        (true, _) => 9,
        (false, _) => 6,
    };
    sighting.score.min(1000) / 10 * share
}

/// Constant velocity with white acceleration over one step.
struct Motion {
    f: Matrix4<f64>,
    f_t: Matrix4<f64>,
    q: Matrix4<f64>,
}

impl Motion {
    fn new(dt: f64) -> Self {
        let mut f = Matrix4::identity();
        (f[(0, 2)], f[(1, 3)]) = (dt, dt);
        let variance = ACCELERATION * ACCELERATION;
        let (dt2, dt3, dt4) = (dt * dt, dt * dt * dt, dt * dt * dt * dt);
        let mut q = Matrix4::zeros();
        for axis in 0..2 {
            q[(axis, axis)] = variance * dt4 / 4.0;
            q[(axis, axis + 2)] = variance * dt3 / 2.0;
            q[(axis + 2, axis)] = variance * dt3 / 2.0;
            q[(axis + 2, axis + 2)] = variance * dt2;
        }
        Motion { f, f_t: f.transpose(), q }
    }
}

impl TransitionModelLinearNoControl<f64, U4> for Motion {
    fn F(&self) -> &Matrix4<f64> {
        &self.f
    }

    fn FT(&self) -> &Matrix4<f64> {
        &self.f_t
    }

    fn Q(&self) -> &Matrix4<f64> {
        &self.q
    }
}

/// Position is observed with the same deviation on both axes.
struct Seen {
    place: Matrix2x4<f64>,
    place_t: Matrix4x2<f64>,
    noise: Matrix2<f64>,
}

impl Seen {
    fn new(variance: f64) -> Self {
        let place = Matrix2x4::identity();
        Seen { place, place_t: place.transpose(), noise: Matrix2::from_diagonal_element(variance) }
    }
}

impl ObservationModel<f64, U4, U2> for Seen {
    fn H(&self) -> &Matrix2x4<f64> {
        &self.place
    }

    fn HT(&self) -> &Matrix4x2<f64> {
        &self.place_t
    }

    fn R(&self) -> &Matrix2<f64> {
        &self.noise
    }
}
