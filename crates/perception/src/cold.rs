//! Places where a claimed vehicle was cold: the thermal stage's contradictions, kept for longer than a track keeps them.
//!
//! Heat takes time to reach the skin of a vehicle's mass, and little to reach that of a heated cloth. So a place at which the thermal stage
//! contradicted a vehicle for a second holds no warm vehicle within the next minute, and a heater that is switched on in view
//! earns a fake nothing. A heater that is on before the platform comes is beyond this memory, as is a fake that moves away. Judges
//! nothing in a single frame: that is corroboration's.

use wire::sensor::{Class, Modality};
use wire::time::{Instant, Span};

use crate::corroborate::{Judgement, Sighting};
use crate::pose::Placement;

/// Most places remembered; of more, the one contradicted longest ago is forgotten.
const PLACES: usize = 16;
/// Contradictions without support between them that make a place cold: a second of frames at 10 Hz.
const ENOUGH: u8 = 10;
/// Time after the last contradiction for which a place stays cold. An engine of 150 kg iron takes up 70 kJ for each kelvin; of the
/// 5 kW of an idling one's heat that is at most 4 K in a minute, before any of it has reached the skin, and a vehicle shows 12 K or
/// more above the ground of the shipped scenes. Figures of a textbook's order, not of a measurement.
const MEMORY: Span = Span::ms(60_000);
/// Sightings nearer to each other than this are of one place, metres.
const SAME_M: f64 = 2.0;

/// A place, and the thermal stage's word on vehicles there.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// East and north, metres.
    at: [f64; 2],
    /// Contradictions since the last support, at most [`ENOUGH`], and at that for good.
    contradictions: u8,
    /// Stamp of the last one.
    last: Instant,
}

/// The memory.
#[derive(Clone, Debug, Default)]
pub struct Cold {
    places: Vec<Place>,
}

impl Cold {
    /// Notes the thermal stage's word on each claimed vehicle, placed by `ego`, and has it contradict those that are warm at a
    /// cold place.
    pub fn judge(&mut self, stamp: Instant, ego: Option<&Placement>, judged: &mut [Judgement]) {
        self.places.retain(|place| stamp.since(place.last) < MEMORY);
        let Some(ego) = ego else { return };
        for judgement in judged.iter_mut() {
            let Some(sighting) = judgement.sighting.as_mut().filter(|s| s.class == Class::Vehicle) else { continue };
            if self.is_cold(stamp, ego.to_world(sighting.place), sighting) {
                sighting.supported = sighting.supported.without(Modality::Thermal);
                sighting.vetoed = sighting.vetoed.with(Modality::Thermal);
                (judgement.supported, judgement.vetoed) = (sighting.supported, sighting.vetoed);
            }
        }
    }

    /// Takes the word on one; true if it is warm where it was cold.
    fn is_cold(&mut self, stamp: Instant, at: [f64; 2], sighting: &Sighting) -> bool {
        let known = self.places.iter_mut().find(|place| (place.at[0] - at[0]).hypot(place.at[1] - at[1]) < SAME_M);
        if sighting.vetoed.has(Modality::Thermal) {
            match known {
                Some(place) => {
                    (place.contradictions, place.last) = ((place.contradictions + 1).min(ENOUGH), stamp);
                }
                None => self.remember(Place { at, contradictions: 1, last: stamp }),
            }
            return false;
        }
        let Some(place) = known.filter(|_| sighting.supported.has(Modality::Thermal)) else { return false };
        let cold = place.contradictions >= ENOUGH;
        if !cold {
            place.contradictions = 0;
        }
        cold
    }

    fn remember(&mut self, place: Place) {
        if self.places.len() >= PLACES {
            let oldest = self.places.iter().enumerate().min_by_key(|(_, place)| place.last).map(|(index, _)| index);
            oldest.map(|index| self.places.swap_remove(index));
        }
        self.places.push(place);
    }
}

#[cfg(test)]
mod tests {
    use wire::sensor::Modalities;

    use super::*;

    /// Word of the thermal stage on a vehicle so many metres ahead in frame `k`; true if it is contradicted afterwards.
    fn seen(cold: &mut Cold, k: u64, ahead: f64, warm: bool) -> bool {
        let (thermal, none) = (Modalities::default().with(Modality::Thermal), Modalities::default());
        let (supported, vetoed) = if warm { (thermal, none) } else { (none, thermal) };
        let (class, score, place, sigma) = (Class::Vehicle, 900, [ahead, 0.0], 0.3);
        let sighting = Sighting { class, score, place, sigma, supported, vetoed, complete: true, bounds: None };
        let mut judged = [Judgement { detection: 0, supported, vetoed, sighting: Some(sighting) }];
        cold.judge(Instant(k * 100_000), Some(&Placement::ORIGIN), &mut judged);
        let after = judged[0].sighting.expect("the sighting");
        assert_eq!((after.supported, after.vetoed), (judged[0].supported, judged[0].vetoed));
        after.vetoed.has(Modality::Thermal)
    }

    #[test]
    fn warmth_after_a_second_of_cold_is_contradicted_there() {
        let mut cold = Cold::default();
        (0..10).for_each(|k| assert!(seen(&mut cold, k, 20.0, false)));
        assert!(seen(&mut cold, 11, 20.0, true), "at once");
        assert!(seen(&mut cold, 12, 21.5, true), "and as long as the place is the same one");
        assert!(!seen(&mut cold, 12, 23.0, true), "another place");
        assert!(seen(&mut cold, 600, 20.0, true), "59 s later");
        assert!(!seen(&mut cold, 609, 20.0, true), "a minute after the last contradiction");
    }

    #[test]
    fn single_misses_of_the_stage_make_no_place_cold() {
        let mut cold = Cold::default();
        for k in 0..100 {
            assert_eq!(seen(&mut cold, k, 20.0, k % 10 == 9), k % 10 != 9, "nine of ten are missed: frame {k}");
        }
    }

    #[test]
    fn memory_is_bounded_and_forgets_the_oldest() {
        let mut cold = Cold::default();
        (0..1_000).for_each(|k| {
            seen(&mut cold, k, 20.0 + 3.0 * (k / 10) as f64, false);
        });
        assert_eq!(cold.places.len(), PLACES);
        assert!(seen(&mut cold, 1_000, 20.0 + 3.0 * 99.0, true) && !seen(&mut cold, 1_000, 20.0, true));
    }
}
