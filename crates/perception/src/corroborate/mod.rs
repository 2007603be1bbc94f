//! Cross-modal corroboration: which colour detections the other modalities support, and which they contradict.
//!
//! A detection alone is no proof. [`corroborate`] gives a [`Sighting`] only where at least two modalities besides
//! colour speak for the object: depth and LiDAR that agree on its place, or one of them with warmth when the other
//! stage gave no product. A modality that contradicts is in `vetoed`, and a vetoed sighting earns no confidence.
//! [`geometry`] judges place and size, [`thermal`] temperature; consequences of a sighting are the tracker's.

pub mod geometry;
pub mod thermal;

use wire::codec::List;
use wire::sensor::{Camera, Candidates, Class, Modalities, Modality, PixelBox};

use self::geometry::{Depth, DetectionPlace, Spatial};
use self::thermal::Warmth;
use crate::fused::Disputed;

/// Limits of corroboration.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CorroborationLimits {
    /// Detections below this score are passed over, permille.
    pub score: u16,
    /// Depth and LiDAR may disagree by this much at no distance, metres.
    pub agreement_m: f32,
    /// Further disagreement allowed for each metre of distance, metres.
    pub agreement_per_m: f32,
}

impl Default for CorroborationLimits {
    fn default() -> Self {
        CorroborationLimits { score: 500, agreement_m: 1.0, agreement_per_m: 0.06 }
    }
}

/// A detection that has a place in the world, with the modalities' verdicts on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Class that the detector gave.
    pub class: Class,
    /// Score of the detection, permille.
    pub score: u16,
    /// Place of its middle: metres forward and metres left in the body frame.
    pub place: [f64; 2],
    /// Standard deviation of the place on each axis, metres.
    pub sigma: f64,
    /// Modalities that speak for it.
    pub supported: Modalities,
    /// Modalities that speak against it.
    pub vetoed: Modalities,
    /// Modalities among these that show no object there, and no other either: a stage that misses a frame looks the
    /// same.
    pub absent: Modalities,
    /// True if everything that its class lets one expect was seen; false without a thermal product for a warm class.
    pub complete: bool,
    /// Place in the image; none without one.
    pub bounds: Option<PixelBox>,
}

impl Sighting {
    /// True if no modality contradicts it.
    pub fn is_uncontradicted(&self) -> bool {
        self.vetoed == Modalities::default()
    }
}

/// The modalities' verdicts on one detection, placed or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Index of the detection in the frame.
    pub detection: u8,
    /// Modalities that speak for the detection.
    pub supported: Modalities,
    /// Modalities that speak against it.
    pub vetoed: Modalities,
    /// The sighting, if there is spatial agreement and enough support.
    pub sighting: Option<Sighting>,
}

/// Judges every detection of a frame, in the order of the detections. One that is `disputed` between the networks is
/// vetoed by colour. Objections of `unheard` modalities are passed over: their contradictions count as support.
pub fn corroborate(
    camera: &Camera,
    limits: &CorroborationLimits,
    unheard: Modalities,
    candidates: &Candidates,
    disputed: Disputed,
) -> List<Judgement, 32> {
    let Some(detections) = &candidates.rgb else { return List::default() };
    let judged = detections.iter().enumerate().filter(|(_, d)| d.score >= limits.score);
    judged.map(|(index, _)| judge(camera, limits, unheard, candidates, (index, disputed.contains(index)))).collect()
}

fn judge(
    camera: &Camera,
    limits: &CorroborationLimits,
    unheard: Modalities,
    candidates: &Candidates,
    (index, disputed): (usize, bool),
) -> Judgement {
    let Some(detection) = candidates.rgb.as_ref().and_then(|r| r.get(index)) else {
        let none = Modalities::default();
        return Judgement { detection: index as u8, supported: none, vetoed: none, sighting: None };
    };
    let depth = candidates.depth.as_ref().map(|samples| {
        let sample = samples.iter().find(|s| usize::from(s.detection) == index);
        sample.map(|s| Depth { metres: f64::from(s.median_mm) / 1000.0 })
    });
    let mut spatial = geometry::judge(camera, limits, detection, depth, candidates.lidar.as_deref());
    spatial.pass_over(unheard);
    let mut warmth = thermal::judge(detection, candidates.thermal.as_deref());
    // A waived thermal check counts as support, as in `Spatial::pass_over` for depth and LiDAR.
    if matches!(warmth, Warmth::Contradicts | Warmth::Absent) && unheard.contains(Modality::Thermal) {
        warmth = Warmth::Fits;
    }
    let (supported, vetoed) = sets(disputed, &spatial, warmth);
    let thermal = Modalities::default().with_modality(Modality::Thermal);
    let sighting =
        spatial.place.filter(|_| enough(&spatial, warmth)).map(|DetectionPlace { middle, sigma }| Sighting {
            class: detection.class,
            score: detection.score,
            place: middle,
            sigma,
            supported,
            vetoed,
            absent: if warmth == Warmth::Absent { thermal } else { Modalities::default() },
            complete: warmth != Warmth::Unknown,
            bounds: Some(detection.bounds),
        });
    Judgement { detection: index as u8, supported, vetoed, sighting }
}

/// True if two modalities besides colour support the object: depth and LiDAR, or, where one of the two stages is
/// silent, the other and warmth.
fn enough(spatial: &Spatial, warmth: Warmth) -> bool {
    match (spatial.depth, spatial.lidar) {
        (Some(true), Some(true)) => true,
        (Some(true), None) | (None, Some(true)) => warmth == Warmth::Fits,
        (Some(_) | None, Some(_) | None) => false,
    }
}

fn sets(disputed: bool, spatial: &Spatial, warmth: Warmth) -> (Modalities, Modalities) {
    let colour = Modalities::default().with_modality(Modality::Rgb);
    let (mut supported, mut vetoed) =
        if disputed { (Modalities::default(), colour) } else { (colour, Modalities::default()) };
    for (modality, verdict) in [(Modality::Depth, spatial.depth), (Modality::Lidar, spatial.lidar)] {
        if verdict == Some(true) {
            supported = supported.with_modality(modality);
        }
    }
    for modality in [Modality::Depth, Modality::Lidar].into_iter().filter(|m| spatial.vetoed.contains(*m)) {
        vetoed = vetoed.with_modality(modality);
    }
    match warmth {
        Warmth::Fits => supported = supported.with_modality(Modality::Thermal),
        Warmth::Contradicts | Warmth::Absent => vetoed = vetoed.with_modality(Modality::Thermal),
        Warmth::Unknown | Warmth::Neutral => {}
    }
    (supported, vetoed)
}
