//! Reasons for tracks, and for their absence: perception's reports to the audit, once each.
//!
//! A doubt is reported when most of the newest frames hold it, so that one noisy frame is none, and again only after it
//! has been gone. A followed object is reported when its track is first believed and when its class changes.

use wire::codec::List;
use wire::event::Event;
use wire::id::TrackId;
use wire::sensor::{Camera, Candidates, Class, Detection, Modalities};
use wire::track::Track;

use crate::cold::remembered;
use crate::corroborate::Judgement;
use crate::tracker::MAX_TRACKS;

/// Most doubts that are held at a time; more are not reported.
const MOST: usize = 16;
/// Frames that are looked back on (the track limit of 500 ms at 10 Hz), and of those, how many have to hold a doubt.
const FRAMES: u8 = 0b1_1111;
const ENOUGH: u32 = 3;
/// A doubt in the next frame within this bearing is the same one, milliradians.
const SAME_MRAD: i16 = 120;

/// A detection that others contradict.
#[derive(Clone, Copy, Debug)]
struct Doubt {
    class: Class,
    vetoed: Modalities,
    /// True if the contradiction is of earlier frames ([`crate::cold`]).
    remembered: bool,
    bearing_mrad: i16,
    /// Frames with the doubt, one bit each, the newest lowest.
    history: u8,
    told: bool,
}

/// Reported reasons, and candidates for a report.
#[derive(Clone, Debug, Default)]
pub struct Reasons {
    doubts: Vec<Doubt>,
    followed: List<(TrackId, Class), MAX_TRACKS>,
}

impl Reasons {
    /// Takes a frame's judgements and the tracks that are believed after it; returns the reports due.
    pub fn note(
        &mut self,
        camera: &Camera,
        candidates: &Candidates,
        judged: &[Judgement],
        tracks: &[Track],
    ) -> impl Iterator<Item = Event> + use<> {
        self.doubts.iter_mut().for_each(|d| d.history <<= 1);
        let mut events = Vec::new();
        let detections = candidates.rgb.as_deref().unwrap_or_default();
        for judgement in judged.iter().filter(|j| j.vetoed != Modalities::default()) {
            let Some(detection) = detections.get(usize::from(judgement.detection)) else { continue };
            let Some(doubt) = self.doubt(camera, detection, judgement) else { continue };
            if !doubt.told && (doubt.history & FRAMES).count_ones() >= ENOUGH {
                doubt.told = true;
                let Doubt { class, vetoed, bearing_mrad, .. } = *doubt;
                let supported = judgement.supported;
                events.push(Event::Doubted { frame: candidates.frame, class, bearing_mrad, supported, vetoed });
            }
        }
        self.doubts.retain(|d| d.history & FRAMES != 0);
        let fresh = tracks.iter().filter(|t| !self.followed.contains(&(t.id, t.class)));
        events.extend(fresh.map(|t| Event::Followed { track: t.id, class: t.class, x_mm: t.x_mm, y_mm: t.y_mm }));
        self.followed = tracks.iter().map(|t| (t.id, t.class)).collect();
        events.into_iter()
    }

    /// The doubt that this detection goes on with, or a new one while there is room.
    fn doubt(&mut self, camera: &Camera, detection: &Detection, judgement: &Judgement) -> Option<&mut Doubt> {
        let (class, bearing_mrad) = (detection.class, bearing(camera, detection));
        let vetoed = judgement.vetoed;
        let remembered = remembered(judgement.supported, vetoed);
        let same = |d: &Doubt| {
            let difference = (i32::from(d.bearing_mrad) - i32::from(bearing_mrad)).abs();
            (d.class, d.vetoed, d.remembered) == (class, vetoed, remembered) && difference <= i32::from(SAME_MRAD)
        };
        let index = match self.doubts.iter().position(same) {
            Some(at) => at,
            None if self.doubts.len() < MOST => {
                self.doubts.push(Doubt { class, vetoed, remembered, bearing_mrad, history: 0, told: false });
                self.doubts.len() - 1
            }
            None => return None,
        };
        let doubt = self.doubts.get_mut(index)?;
        (doubt.bearing_mrad, doubt.history) = (bearing_mrad, doubt.history | 1);
        Some(doubt)
    }
}

/// Bearing of a box's middle, to the left of the optical axis.
fn bearing(camera: &Camera, detection: &Detection) -> i16 {
    let column = 0.5 * (f32::from(detection.bounds.x0) + f32::from(detection.bounds.x1));
    let left = (f32::from(camera.width) / 2.0 - column) / camera.focal_px;
    (libm::atanf(left) * 1000.0) as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::id::FrameId;
    use wire::sensor::{Modality, PixelBox, ProductMode};
    use wire::time::Instant;

    fn track(class: Class) -> Track {
        let updated = Instant(1);
        let (supported, vetoed) = (Modalities::default(), Modalities::default());
        let (x_mm, y_mm, vx_mm_s, vy_mm_s, sigma_mm, confidence) = (8_000, -3_000, 0, 0, 300, 900);
        let (id, frame) = (TrackId(7), FrameId(1));
        let across_px = 0;
        Track {
            id,
            class,
            x_mm,
            y_mm,
            vx_mm_s,
            vy_mm_s,
            sigma_mm,
            confidence,
            supported,
            vetoed,
            updated,
            frame,
            across_px,
        }
    }

    fn frame(n: u64, x0: u16) -> Candidates {
        let bounds = PixelBox { x0, y0: 40, x1: x0 + 20, y1: 60 };
        let rgb = Some([Detection { class: Class::Vehicle, score: 900, bounds }].into_iter().collect());
        let (frame, stamp, mode) = (FrameId(n), Instant(n), ProductMode::Live);
        Candidates { frame, stamp, mode, rgb, depth: None, thermal: None, lidar: None, grain: None }
    }

    fn cold() -> Judgement {
        let (supported, vetoed) = (Modalities::default(), Modalities::default().with_modality(Modality::Thermal));
        Judgement { detection: 0, supported, vetoed, sighting: None }
    }

    #[test]
    fn lasting_doubt_is_reported_once_per_period() {
        let mut reasons = Reasons::default();
        let mut reported = Vec::new();
        for n in 0..30 {
            let judged = if (10..20).contains(&n) { vec![] } else { vec![cold()] };
            let events = reasons.note(&Camera::GROUND, &frame(n, 60 + n as u16), &judged, &[]);
            reported.extend(events.map(|e| (n, e)));
        }
        let frames: Vec<u64> = reported.iter().map(|(n, _)| *n).collect();
        assert_eq!(frames, [2, 22], "{reported:?}");
        assert!(
            matches!(reported[0].1, Event::Doubted { bearing_mrad: 90..=110, class: Class::Vehicle, .. }),
            "{reported:?}"
        );
    }

    #[test]
    fn doubt_in_a_tenth_of_frames_is_unreported() {
        let mut reasons = Reasons::default();
        for n in 0..100 {
            let judged = if n % 10 == 0 { vec![cold()] } else { vec![] };
            assert_eq!(reasons.note(&Camera::GROUND, &frame(n, 60), &judged, &[]).count(), 0);
        }
    }

    #[test]
    fn track_is_reported_at_belief_and_class_change() {
        let mut reasons = Reasons::default();
        let mut follow = |class| reasons.note(&Camera::GROUND, &frame(1, 60), &[], &[track(class)]).count();
        let counts: Vec<usize> = [Class::Decoy, Class::Decoy, Class::Vehicle].map(&mut follow).to_vec();
        assert_eq!(counts, [1, 0, 1]);
    }
}
