//! Objects that are made to look like another class: the receipt of the disguise, and whether perception saw through it.
//!
//! The scene is the attack, so its actor is the sim, which logs the place of each object and the print on it. The second
//! witness is perception: it doubts a detection of the painted class where the object stands, or follows a track of that class
//! there; of an object printed on or seen through a perturbed image, which need not look like another class for that, a track of any class
//! will do. Without either no stage looked, and the trial shows no result.

use std::collections::BTreeSet;
use std::ops::Range;

use evidence::{Evidence, Micros, Planned, Witnessed};
use ground_truth::{Any, FaultKind, Note};
use wire::event::Event;
use wire::id::{FrameId, NodeId, ObjectId};
use wire::sensor::{Camera, Class};

use super::window::Window;

/// Distance of a track from its object, at most, millimetres: half of the longest object, and perception's own error.
const NEAR_MM: f64 = 3_500.0;
/// Angle of a detection from its object's middle, at most, milliradians: part of it may be hidden or out of view.
const TOWARDS_MRAD: f64 = 250.0;

/// Time at which perception first took the object for the class of the paint that it bears, or doubted that it is one.
pub(crate) fn paint_seen_at(evidence: &Evidence, object: ObjectId, class: Class, window: Window) -> Option<Micros> {
    let sightings = sightings(evidence, object).filter(|s| s.class == class).map(|s| s.at);
    sightings.filter(|seen_at| window.contains(*seen_at)).min()
}

/// Time at which perception first reacted to an object with a print, of which it received an image by hash: it followed
/// the object, or doubted its true class or the class aimed at.
pub(crate) fn print_seen_at(evidence: &Evidence, object: ObjectId, aim: Class, window: Window) -> Option<Micros> {
    let names_print = |w: &Witnessed| {
        w.entry.node == evidence.under.sim && w.entry.event == Any::Instrument(Note::Printed { object })
    };
    let since = evidence.entries.iter().find(|w| names_print(w))?.at;
    // The scene's own entry is the claim: without the image at perception the print has one witness.
    if !altered_image_given(evidence, since..Micros::MAX) {
        return None;
    }
    look_times(evidence, object, aim).filter(|seen_at| *seen_at >= since && window.contains(*seen_at)).min()
}

/// Time at which a perturbation began of which perception was given an image, by its hash, and that looked at an object of another class than
/// the one aimed at before it ended: an object that is followed already gives no new entry.
pub(crate) fn perturbed_at(evidence: &Evidence, aim: Class, window: Window) -> Option<Micros> {
    let mut turned = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Fault { kind: FaultKind::Perturbation, active, .. })
            if w.entry.node == evidence.under.sim =>
        {
            Some((w.at, active))
        }
        _ => None,
    });
    let since = turned.find(|(turned_at, active)| *active && window.contains(*turned_at))?.0;
    let until = turned.find(|(_, active)| !active).map_or(Micros::MAX, |(turned_at, _)| turned_at);
    let mut seen = objects_not_of(evidence, aim).into_iter().flat_map(|object| look_times(evidence, object, aim));
    (altered_image_given(evidence, since..until) && seen.any(|seen_at| seen_at < until)).then_some(since)
}

/// True if perception received an image, byte for byte, that the sim logged as altered within this span.
fn altered_image_given(evidence: &Evidence, altered_span: Range<Micros>) -> bool {
    let perceived: BTreeSet<_> = pictures(evidence, evidence.under.perception).map(|(_, picture)| picture).collect();
    pictures(evidence, evidence.under.sim)
        .any(|(pictured_at, picture)| altered_span.contains(&pictured_at) && perceived.contains(&picture))
}

/// Colour images that a node logs: time, frame, and hash.
fn pictures(evidence: &Evidence, node: NodeId) -> impl Iterator<Item = (Micros, (FrameId, u64))> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Service(Event::Pictured { frame, hash }) if w.entry.node == node => Some((w.at, (frame, hash))),
        _ => None,
    })
}

/// Times at which perception followed an object, or doubted its true class or the class aimed at.
fn look_times(evidence: &Evidence, object: ObjectId, aim: Class) -> impl Iterator<Item = Micros> {
    let true_class = object_classes(evidence).find_map(|(other, class)| (other == object).then_some(class));
    let looked = move |s: &ObjectSighting| !s.doubted || s.class == aim || Some(s.class) == true_class;
    sightings(evidence, object).filter(looked).map(|s| s.at)
}

/// Objects that are not of this class.
fn objects_not_of(evidence: &Evidence, aim: Class) -> BTreeSet<ObjectId> {
    object_classes(evidence).filter(|(_, class)| *class != aim).map(|(object, _)| object).collect()
}

/// Classes of objects, by the sim.
fn object_classes(evidence: &Evidence) -> impl Iterator<Item = (ObjectId, Class)> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Object { object, class, .. }) => Some((object, class)),
        _ => None,
    })
}

/// True if perception saw through a disguise at or after `zero`: it doubted it, or followed the printed object as a class
/// other than the one that the print or the perturbation aims at.
pub(crate) fn seen_through(evidence: &Evidence, zero: Micros) -> bool {
    evidence.planned.iter().any(|plan| match plan.what {
        Planned::Disguise(object, class) => {
            sightings(evidence, object).any(|s| s.at >= zero && s.class == class && s.doubted)
        }
        Planned::Print(object, aim) => not_deceived(evidence, object, aim, zero),
        Planned::Perturbation(aim) => {
            objects_not_of(evidence, aim).into_iter().any(|object| not_deceived(evidence, object, aim, zero))
        }
        _ => false,
    })
}

fn not_deceived(evidence: &Evidence, object: ObjectId, aim: Class, zero: Micros) -> bool {
    sightings(evidence, object).any(|s| s.at >= zero && s.doubted == (s.class == aim))
}

/// Statement of perception about the place of an object.
struct ObjectSighting {
    at: Micros,
    class: Class,
    /// True if it doubted that it is of that class, or followed it as one.
    doubted: bool,
}

fn sightings(evidence: &Evidence, object: ObjectId) -> impl Iterator<Item = ObjectSighting> {
    let (mut place, mut unit) = (None, None);
    evidence.entries.iter().filter_map(move |w| {
        let event = match w.entry.event {
            Any::Instrument(Note::Object { object: other, x_mm, y_mm, .. }) if other == object => {
                place = Some((f64::from(x_mm), f64::from(y_mm)));
                return None;
            }
            Any::Instrument(Note::Truth { unit: other, x_mm, y_mm, yaw_mrad, .. }) if other == evidence.under.unit => {
                unit = Some((f64::from(x_mm), f64::from(y_mm), f64::from(yaw_mrad)));
                return None;
            }
            _ if w.entry.node != evidence.under.perception => return None,
            event => event,
        };
        let (east, north) = place?;
        match event {
            Any::Service(Event::Followed { class, x_mm, y_mm, .. }) => {
                let near = libm::hypot(f64::from(x_mm) - east, f64::from(y_mm) - north) <= NEAR_MM;
                near.then_some(ObjectSighting { at: w.at, class, doubted: false })
            }
            Any::Service(Event::Doubted { class, bearing_mrad, .. }) => {
                let deviation = wrapped(f64::from(bearing_mrad) - bearing(&evidence.camera, unit?, (east, north)));
                (deviation.abs() <= TOWARDS_MRAD).then_some(ObjectSighting { at: w.at, class, doubted: true })
            }
            _ => None,
        }
    })
}

/// Bearing of a place from the unit's camera, milliradians to the left.
fn bearing(camera: &Camera, (x, y, yaw_mrad): (f64, f64, f64), (east, north): (f64, f64)) -> f64 {
    let (sin, cos) = libm::sincos(yaw_mrad / 1000.0);
    let forward = f64::from(camera.forward_m) * 1000.0;
    libm::atan2(north - y - forward * sin, east - x - forward * cos) * 1000.0 - yaw_mrad
}

fn wrapped(mrad: f64) -> f64 {
    let turn = core::f64::consts::TAU * 1000.0;
    mrad - turn * libm::round(mrad / turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bearing_counts_from_camera_and_heading() {
        let ahead = f64::from(Camera::GROUND.forward_m) * 1000.0;
        let quarter = core::f64::consts::FRAC_PI_2 * 1000.0;
        let seen = |unit, place, mrad: f64| {
            let got = wrapped(bearing(&Camera::GROUND, unit, place));
            assert!((got - mrad).abs() < 0.01, "{got} where {mrad} is due");
        };
        // Abreast of the camera, to the left of a unit that looks east, north, and from elsewhere.
        seen((0.0, 0.0, 0.0), (ahead, 5000.0), quarter);
        seen((0.0, 0.0, quarter), (-5000.0, ahead), quarter);
        seen((3000.0, -2000.0, 0.0), (3000.0 + ahead, -7000.0), -quarter);
        // More than half a turn to one side is less to the other.
        for (turned, mrad) in [(5.0, 1.0), (-3.0, 1.0), (3.0, -1.0)] {
            assert!((wrapped(turned * quarter) - mrad * quarter).abs() < 0.01, "{turned} quarters");
        }
    }
}
