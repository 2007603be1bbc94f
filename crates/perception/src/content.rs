//! Test for new sensor content: a stamp says when a reading was handed on, the content when it was taken.
//!
//! A live sensor's noise never repeats. Each modality's content is therefore compared, by a short hash, with the
//! content of earlier frames: rendered, the plane byte for byte; unrendered, the stage's candidates with the number
//! that represents the noise of their plane. [`REPEATS`] frames in a row that all repeat content from the same number
//! of frames ago are no chance, and no fresh product:
//!
//! - one frame ago: the sensor is *stuck*. Its product is valid again with the first new content.
//! - more: old content is *played back*. No stuck sensor does that, and a source that played old content once can play
//!   later content as late and as unseen; so the modality is not valid again in this boot.
//!
//! Not detected: content later than [`REACH`] frames, and a lag built up behind gaps, each too short to count as a
//! loss. Against these only the other modalities are left (`corroborate`).

use std::collections::VecDeque;

use wire::bearing::{Bearings, Direction};
use wire::codec;
use wire::event::wire_hash;
use wire::sensor::{Candidates, Frames, Modality};
use wire::track::StageProduct;

/// Number of equal frames in a row that counts as repetition: the smallest number whose content is older than a product
/// may be (300 ms at 10 Hz). Content accepted before that number is reached would have been accepted with its true
/// stamp too.
///
/// A false alarm takes as many chance repetitions in a row, all at one distance in frames. Rendered, the noise of every
/// pixel would have to repeat; unrendered, the number of 32 bits that represents the noise.
pub const REPEATS: u8 = 4;
/// Number of these frames that have to show something. An attitude sensor whose object is hidden shows nothing now and
/// then, and a delayed one shows that delayed too. One empty frame in four makes a false alarm less likely, since the
/// frame has to be empty at the same distance.
const TELLING: u8 = REPEATS - 1;
/// Number of past frames against which content is compared: 3.2 s.
pub const REACH: usize = 32;

/// Fingerprint of one frame's contents, by [`Modality`]; `None` without usable content.
pub type Prints = [Option<u64>; 4];

/// Prints of a rendered frame: each plane as it came.
pub fn of_frames(frames: &Frames<'_>) -> Prints {
    [frames.rgb, frames.depth, frames.thermal, frames.lidar].map(|plane| plane.map(|bytes| wire_hash(bytes)))
}

/// Prints of an unrendered frame: each list as it came, with the noise of the plane that it represents. Without that,
/// all empty lists are equal and carry no information.
pub fn of_candidates(candidates: &Candidates) -> Prints {
    let Candidates { rgb, depth, thermal, lidar, grain, .. } = candidates;
    let shows = |is_empty: bool| grain.is_some() || !is_empty;
    let lists = [
        rgb.as_ref().filter(|list| shows(list.is_empty())).map(codec::encode),
        depth.as_ref().filter(|list| shows(list.is_empty())).map(codec::encode),
        thermal.as_ref().filter(|list| shows(list.is_empty())).map(codec::encode),
        lidar.as_ref().filter(|list| shows(list.is_empty())).map(codec::encode),
    ];
    let mut prints = [None; 4];
    for ((print, list), grain) in prints.iter_mut().zip(lists).zip(grain.unwrap_or_default()) {
        *print = list.map(|list| wire_hash(&[&list[..], &grain.to_be_bytes()].concat()));
    }
    prints
}

/// Prints of attitude sensors: each reading as it came. One that sees its object hidden carries no information.
pub fn of_bearings(bearings: &Bearings) -> Prints {
    let shown =
        |direction: Option<Direction>| direction.filter(|d| *d != Direction::default()).map(|d| codec::encode(&d));
    let readings = [
        bearings.stars.map(|attitude| codec::encode(&attitude)),
        shown(bearings.sun),
        shown(bearings.horizon),
        shown(bearings.field),
    ];
    readings.map(|reading| reading.map(|bytes| wire_hash(&bytes)))
}

/// A modality that began to repeat itself, and the product that its content is really of.
pub type Repetition = (Modality, StageProduct);

/// The contents of the newest frames, of every modality.
#[derive(Clone, Debug, Default)]
pub struct Contents([Memory; 4]);

impl Contents {
    /// Takes the contents of a frame. Gives the modalities that repeat themselves from this frame on.
    pub fn note(&mut self, product: StageProduct, prints: &Prints) -> Vec<Repetition> {
        let begin = |m: Modality| Some((m, self.0[m as usize].note(product, prints[m as usize])?));
        Modality::ALL.into_iter().filter_map(begin).collect()
    }

    /// True if the present content of `modality` is not new.
    pub fn repeats(&self, modality: Modality) -> bool {
        self.0[modality as usize].state != State::Live
    }
}

/// Assessment of a modality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Live,
    Stuck,
    PlayedBack,
}

/// A content, if there was one to use, and the product that showed it first.
#[derive(Clone, Copy, Debug)]
struct Shown {
    print: Option<u64>,
    first: StageProduct,
}

/// Contents of one modality.
#[derive(Clone, Debug, Default)]
struct Memory {
    /// Contents shown, newest first, at most [`REACH`].
    shown: VecDeque<Shown>,
    /// Runs of repetitions by distance in frames, less one: number of frames in a row that repeat the one so far back,
    /// and how many of them show something.
    runs: [(u8, u8); REACH],
    state: State,
}

impl Memory {
    fn note(&mut self, product: StageProduct, print: Option<u64>) -> Option<StageProduct> {
        let same = |shown: &&Shown| print.is_some() && shown.print == print;
        let first = self.shown.iter().find(same).map_or(product, |shown| shown.first);
        for (lag, run) in self.runs.iter_mut().enumerate() {
            *run = match (print, self.shown.get(lag).map(|shown| shown.print)) {
                (Some(now), Some(Some(back))) if now == back => (run.0.saturating_add(1), run.1.saturating_add(1)),
                // A frame without content, like the frame so far back, neither counts as a repetition nor ends a run.
                (None, Some(None)) => (run.0.saturating_add(1), run.1),
                (Some(_) | None, _) => (0, 0),
            };
        }
        let lag = self.runs.iter().position(|run| run.0 >= REPEATS && run.1 >= TELLING);
        let shown_first = lag.and_then(|lag| self.shown.get(lag)).map(|shown| shown.first);
        self.shown.push_front(Shown { print, first });
        self.shown.truncate(REACH);
        let before = self.state;
        self.state = match (before, lag) {
            (State::PlayedBack, _) | (State::Live | State::Stuck, Some(1..)) => State::PlayedBack,
            (State::Live | State::Stuck, Some(0)) => State::Stuck,
            (State::Live | State::Stuck, None) => State::Live,
        };
        shown_first.filter(|_| before == State::Live && self.state != State::Live)
    }
}

#[cfg(test)]
mod tests {
    use wire::codec::List;
    use wire::id::FrameId;
    use wire::sensor::ProductMode;
    use wire::time::Instant;

    use super::*;

    /// Frames in which a modality with these contents repeats itself, and the reported repetitions.
    fn repeats_reported(contents: impl IntoIterator<Item = u64>) -> (Vec<u64>, Vec<(u64, u64)>) {
        let (mut memory, mut repeats, mut begins) = (Contents::default(), Vec::new(), Vec::new());
        for (frame, print) in (1..).zip(contents) {
            let product = StageProduct { frame: FrameId(frame), stamp: Instant(frame * 100_000) };
            let begun = memory.note(product, &[None, None, Some(print).filter(|p| *p > 0), None]);
            begins.extend(begun.iter().map(|(_, first)| (frame, first.frame.0)));
            repeats.extend(memory.repeats(Modality::Thermal).then_some(frame));
        }
        (repeats, begins)
    }

    /// A stuck sensor is as old as its content, and counts again with new content.
    #[test]
    fn stuck_sensor_is_reported_once_and_recovers() {
        assert_eq!(repeats_reported([1, 2, 3, 3, 3, 3, 3, 3, 4, 5]), (vec![7, 8], vec![(7, 3)]));
        assert_eq!(
            repeats_reported([1, 2, 3, 3, 3, 3, 4, 5, 5, 5, 5, 5]),
            (vec![12], vec![(12, 8)]),
            "three repetitions are none"
        );
    }

    #[test]
    fn played_back_content_does_not_count_again() {
        let late = (1..=10).chain(5..=20);
        assert_eq!(repeats_reported(late), ((14..=26).collect(), vec![(14, 8)]));
        let looped = (1..=20).chain((0..30).map(|n| 16 + n % 5));
        assert_eq!(repeats_reported(looped).1, [(24, 19)]);
    }

    /// Repetitions out of reach do not count either.
    #[test]
    fn scattered_or_empty_repetitions_do_not_count() {
        assert!(repeats_reported([0; 50]).0.is_empty());
        assert!(
            repeats_reported((0..200).map(|n| if n % 3 == 0 { 7 } else { 100 + n })).0.is_empty(),
            "one in three is the same"
        );
        assert!(repeats_reported((1..=33).chain(1..=33)).0.is_empty(), "33 frames back");
        assert_eq!(repeats_reported((1..=32).chain(1..=32)).1, [(36, 4)]);
    }

    /// A camera with nothing in view that freezes shows the same noise.
    #[test]
    fn empty_lists_are_as_old_as_their_planes_noise() {
        let shows_nothing = |grain: Option<[u32; 4]>| Candidates {
            frame: FrameId(1),
            stamp: Instant(100_000),
            mode: ProductMode::Live,
            rgb: Some(List::default()),
            depth: None,
            thermal: Some(List::default()),
            lidar: Some(List::default()),
            grain,
        };
        let prints = |grain| of_candidates(&shows_nothing(grain));
        assert_eq!(prints(None), [None; 4]);
        let [one, same, other] = [[1, 2, 3, 4], [1, 2, 3, 4], [5, 6, 3, 8]].map(|grain| prints(Some(grain)));
        assert_eq!(one, same);
        assert!(one[0].is_some() && one[1].is_none(), "a stage that gave no product shows nothing");
        assert_eq!([0, 2, 3].map(|modality| one[modality] == other[modality]), [false, true, false]);
    }

    #[test]
    fn an_empty_picture_among_late_ones_hides_nothing() {
        assert_eq!(repeats_reported([1, 2, 3, 4, 5, 0, 7, 8, 5, 0, 7, 8]).1, [(12, 8)]);
        assert_eq!(repeats_reported([1, 2, 3, 4, 5, 6, 7, 0, 5, 6, 7, 0]).1, [(12, 8)], "the empty one last");
        assert_eq!(repeats_reported([1, 2, 3, 4, 5, 0, 0, 8, 5, 0, 0, 8]).1, [], "two of four tell too little");
    }
}
