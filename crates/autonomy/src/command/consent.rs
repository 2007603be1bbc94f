//! Evidence behind an operator's consent: the report that the display showed, by its hash, and the ordered track's
//! place in it.
//!
//! An arming and its confirmation name one of the unit's newest reports, the one on the display when the order was
//! signed. So neither a report of another unit nor one that was made up can be behind an order, and an identity that
//! passes to another object while the order is on its way carries no consent with it. A report's age is left to the
//! nonce in it; the time that a person takes before signing, to the display.

use std::collections::VecDeque;

use sha2::{Digest, Sha256};
use wire::codec::List;
use wire::command::{Intent, ReportHash};
use wire::id::TrackId;
use wire::policy::{Check, Policy, Requirement, Waived};
use wire::refusal::Refusal;
use wire::report::{MAX_TRACKS, REPORTS_KEPT};

use crate::designation::Designated;

/// Furthest that a track may be from where it was shown, millimetres: less than `designation_mm`, and than two vehicles
/// are apart side by side.
const SHIFT_MM: u32 = 1_500;

/// A place, millimetres east and north.
pub type ShownPlace = (i32, i32);

/// The unit's newest reports, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Reports(VecDeque<(ReportHash, List<(TrackId, ShownPlace), MAX_TRACKS>)>);

impl Reports {
    /// Remembers a signed report and the places of the tracks in it.
    pub(super) fn note(&mut self, signed: &[u8], places: impl Iterator<Item = (TrackId, ShownPlace)>) {
        if self.0.len() == REPORTS_KEPT {
            self.0.pop_front();
        }
        self.0.push_back((Sha256::digest(signed).into(), places.collect()));
    }

    fn place(&self, report: &ReportHash, track: TrackId) -> Option<ShownPlace> {
        let (_, places) = self.0.iter().find(|(hash, _)| hash == report)?;
        places.iter().find(|(id, _)| *id == track).map(|(_, place)| *place)
    }
}

/// Consent of an order's operator to the evidence displayed, where its kind rests on any.
#[derive(Clone, Copy, Debug)]
pub(super) struct Consent {
    /// The track's place as shown; without it the check was waived, or the kind rests on no track.
    place: Option<ShownPlace>,
    waived: Waived,
}

impl Consent {
    /// Judges the report that an intent names.
    pub(super) fn judge(policy: &Policy, reports: &Reports, claim: &Intent) -> Result<Consent, Refusal> {
        let none = Consent { place: None, waived: Waived::default() };
        let Some(track) = claim.kind.rests_on_display() else { return Ok(none) };
        match policy.check(Check::Shown) {
            Requirement::Waived => Ok(Consent { waived: Waived::default().with_check(Check::Shown), ..none }),
            Requirement::Required => {
                let place = claim.shown.and_then(|report| reports.place(&report, track));
                let place = place.ok_or(Refusal::Shown { kept: REPORTS_KEPT, track })?;
                Ok(Consent { place: Some(place), ..none })
            }
        }
    }

    /// Checks that were waived.
    pub(super) fn waived(&self) -> Waived {
        self.waived
    }

    /// The designation, if the track is still where it was shown.
    pub(super) fn check_designation<'a>(&self, designated: &'a Designated) -> Result<Consented<'a>, Refusal> {
        let distance_mm = self.place.map_or(0, |shown| apart_mm(shown, designated.place()));
        if distance_mm > SHIFT_MM {
            return Err(Refusal::Moved { track: designated.track(), limit_mm: SHIFT_MM, got_mm: distance_mm });
        }
        Ok(Consented(designated))
    }
}

/// Proof that the operator of an order saw the designated track where it is, unless the check was waived.
#[derive(Debug)]
pub struct Consented<'a>(&'a Designated);

impl<'a> Consented<'a> {
    /// The designation consented to.
    pub fn designated(&self) -> &'a Designated {
        self.0
    }
}

/// Distance, rounded down.
fn apart_mm(a: ShownPlace, b: ShownPlace) -> u32 {
    let square = |a: i32, b: i32| u64::from(a.abs_diff(b)).pow(2);
    square(a.0, b.0).saturating_add(square(a.1, b.1)).isqrt().min(u64::from(u32::MAX)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places are bounded by their type alone.
    #[test]
    fn distance_of_the_furthest_places_is_no_short_one() {
        let (low, high) = ((i32::MIN, i32::MIN), (i32::MAX, i32::MAX));
        assert_eq!(apart_mm(low, high), u32::MAX);
        assert_eq!((apart_mm((0, 0), (3_000, -4_000)), apart_mm(low, low)), (5_000, 0));
    }
}
