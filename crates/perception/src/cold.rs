//! Places where a claimed vehicle was cold: the thermal stage's contradictions, kept for longer than a track keeps
//! them.
//!
//! Heat reaches the skin of a vehicle's mass slowly, and that of a heated cloth at once. A place at which the thermal
//! stage contradicted a vehicle for a second therefore holds no warm vehicle for the next minute, and a heater
//! that is switched on in view does not help a fake. Not detected: a heater that runs for a minute before the unit
//! looks, a fake that moves away, and one that pulses, since one frame of support ends a count. Single frames are left
//! to corroboration.

use wire::sensor::{Class, Modalities, Modality};
use wire::time::{Instant, Span};

use crate::corroborate::{Judgement, Sighting};
use crate::pose::Placement;

/// Most places remembered. Of more, one that is not cold is forgotten first, then the one contradicted longest ago.
const PLACES: usize = 64;
/// Contradictions in a row that make a place cold: a second of frames at 10 Hz.
const ENOUGH: u8 = 10;
/// Longest time between two contradictions in a row: as long as a track shows an opinion.
const ROW: Span = Span::ms(500);
/// Time for which a place is cold after such a row. An engine of 150 kg of iron takes up 68 kJ for each kelvin; an
/// idling one's 5 kW warm it by less than 5 K in a minute, before any of it reaches the skin, and the bound of a
/// vehicle's warmest part is 12 K above the ground of the shipped scenes. Figures of a textbook's order, not of a
/// measurement.
const MEMORY: Span = Span::ms(60_000);
/// Sightings nearer to each other than this are of one place, metres: about the half length of a vehicle.
const SAME_M: f64 = 2.0;

/// A place, and the thermal stage's word on vehicles there.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// East and north, metres.
    at: [f64; 2],
    /// Contradictions in a row, at most [`ENOUGH`].
    row: u8,
    /// Stamp of the last one.
    last: Instant,
    /// Stamp of the last one that made or kept the place cold.
    cold: Option<Instant>,
}

/// Memory of places at which a claimed vehicle was cold.
#[derive(Clone, Debug, Default)]
pub struct Cold {
    places: Vec<Place>,
}

impl Cold {
    /// Notes the thermal stage's word on each claimed vehicle, placed by `ego`, and has it contradict those that are
    /// warm at a cold place. Their support by this frame's warmth stays reported beside the contradiction.
    pub fn judge(&mut self, stamp: Instant, ego: Option<&Placement>, judged: &mut [Judgement]) {
        self.places.retain(|place| stamp.since(place.last) < MEMORY);
        let Some(ego) = ego else { return };
        for judgement in judged.iter_mut() {
            let Some(sighting) = judgement.sighting.as_mut().filter(|s| s.class == Class::Vehicle) else { continue };
            if self.is_cold(stamp, ego.to_world(sighting.place), sighting) {
                sighting.vetoed = sighting.vetoed.with_modality(Modality::Thermal);
                sighting.absent = Modalities::default();
                judgement.vetoed = sighting.vetoed;
            }
        }
    }

    /// Takes the word on one; true if it is warm where it was cold.
    fn is_cold(&mut self, stamp: Instant, position: [f64; 2], sighting: &Sighting) -> bool {
        if sighting.vetoed.contains(Modality::Thermal) {
            self.contradict(stamp, position);
            return false;
        }
        if !sighting.supported.contains(Modality::Thermal) {
            return false;
        }
        let mut cold = false;
        for place in self.places.iter_mut().filter(|place| place.distance(position) < SAME_M) {
            place.row = 0;
            cold |= place.is_cold(stamp);
        }
        cold
    }

    /// Counts a contradiction, once a frame, at the nearest known place.
    fn contradict(&mut self, stamp: Instant, at: [f64; 2]) {
        let near = self.places.iter_mut().filter(|place| place.distance(at) < SAME_M);
        match near.min_by(|a, b| a.distance(at).total_cmp(&b.distance(at))) {
            Some(place) if place.last == stamp => {}
            Some(place) => place.contradict(stamp),
            None => self.remember(stamp, Place { at, row: 1, last: stamp, cold: None }),
        }
    }

    fn remember(&mut self, stamp: Instant, place: Place) {
        if self.places.len() >= PLACES {
            let least = self.places.iter().enumerate().min_by_key(|(_, place)| (place.is_cold(stamp), place.last));
            if let Some(index) = least.map(|(index, _)| index) {
                self.places.swap_remove(index);
            }
        }
        self.places.push(place);
    }
}

impl Place {
    fn distance(&self, place: [f64; 2]) -> f64 {
        (self.at[0] - place[0]).hypot(self.at[1] - place[1])
    }

    fn is_cold(&self, stamp: Instant) -> bool {
        self.cold.is_some_and(|cold| stamp.since(cold) < MEMORY)
    }

    fn contradict(&mut self, stamp: Instant) {
        self.row = if stamp.since(self.last) <= ROW { (self.row + 1).min(ENOUGH) } else { 1 };
        self.last = stamp;
        if self.row == ENOUGH {
            self.cold = Some(stamp);
        }
    }
}

/// True if this frame's warmth supports what the memory of an earlier one contradicts.
pub(crate) fn remembered(supported: Modalities, vetoed: Modalities) -> bool {
    supported.contains(Modality::Thermal) && vetoed.contains(Modality::Thermal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Statement of the thermal stage on a vehicle a given number of metres ahead in frame `k`; true if the memory
    /// contradicts it.
    fn seen(cold: &mut Cold, k: u64, ahead: f64, warm: bool) -> bool {
        let (thermal, none) = (Modalities::default().with_modality(Modality::Thermal), Modalities::default());
        let (supported, vetoed) = if warm { (thermal, none) } else { (none, thermal) };
        let (class, score, place, sigma) = (Class::Vehicle, 900, [ahead, 0.0], 0.3);
        let sighting = Sighting {
            class,
            score,
            place,
            sigma,
            supported,
            vetoed,
            absent: Modalities::default(),
            complete: true,
            bounds: None,
        };
        let mut judged = [Judgement { detection: 0, supported, vetoed, sighting: Some(sighting) }];
        cold.judge(Instant(k * 100_000), Some(&Placement::ORIGIN), &mut judged);
        let after = judged[0].sighting.expect("the sighting");
        assert_eq!((after.supported, after.vetoed), (judged[0].supported, judged[0].vetoed));
        assert!(warm || after.vetoed == thermal, "the frame's own contradiction stays");
        remembered(after.supported, after.vetoed)
    }

    #[test]
    fn warmth_after_a_second_of_cold_is_contradicted_there() {
        let mut cold = Cold::default();
        (0..10).for_each(|k| assert!(!seen(&mut cold, k, 20.0, false)));
        assert!(seen(&mut cold, 10, 20.0, true), "at once");
        assert!(seen(&mut cold, 11, 21.5, true), "and as long as the place is the same one");
        assert!(!seen(&mut cold, 11, 23.0, true), "another place");
        assert!(seen(&mut cold, 608, 20.0, true), "a minute, nearly");
        assert!(!seen(&mut cold, 609, 20.0, true), "a minute after the last contradiction");
    }

    /// A stage misses a true vehicle now and then: that neither makes a place cold nor keeps it so.
    #[test]
    fn single_misses_neither_begin_nor_prolong_a_cold() {
        let mut cold = Cold::default();
        let missed = |cold: &mut Cold, from: u64, often: u64| {
            (from..from + 700).filter(|k| seen(cold, *k, 20.0, k % often == 0)).count()
        };
        assert_eq!(missed(&mut cold, 0, 10), 0, "nine frames of ten are missed");
        (1_000..1_010).for_each(|k| assert!(!seen(&mut cold, k, 20.0, false)));
        let contradicted: Vec<u64> = (1_010..1_700).filter(|k| seen(&mut cold, *k, 20.0, k % 20 != 0)).collect();
        assert_eq!((contradicted.first(), contradicted.last()), (Some(&1_010), Some(&1_608)));
    }

    #[test]
    fn repeated_and_distant_frames_make_no_row() {
        let mut cold = Cold::default();
        (0..9).for_each(|k| (0..2).for_each(|_| assert!(!seen(&mut cold, k, 20.0, false))));
        assert!(!seen(&mut cold, 9, 20.0, true), "nine frames");
        (10..30).for_each(|k| assert!(!seen(&mut cold, 6 * k, 20.0, false)));
        assert!(!seen(&mut cold, 175, 20.0, true), "none within half a second of the one before");
    }

    #[test]
    fn newer_places_do_not_crowd_a_cold_one_out() {
        let mut cold = Cold::default();
        (0..10).for_each(|k| assert!(!seen(&mut cold, k, 20.0, false)));
        (10..500).for_each(|k| assert!(!seen(&mut cold, k, 20.0 + 3.0 * (k as f64 - 8.0), false)));
        assert_eq!(cold.places.len(), PLACES);
        assert!(seen(&mut cold, 501, 20.0, true));
    }
}
