//! Evidence behind an operator's consent: the report that the display showed, by its hash, and the ordered track's place in it.
//!
//! An arming and its confirmation name one of the unit's newest reports. So neither a report of another unit nor one that was
//! made up can be behind an order, and authority goes to the track where its operator saw it: an identity that passes to
//! another object while the order is under way carries no consent with it. A report's age is left to the nonce in it.

use std::collections::VecDeque;

use sha2::{Digest, Sha256};
use wire::codec::List;
use wire::command::{Intent, ReportHash};
use wire::id::TrackId;
use wire::policy::{Check, Policy, Requirement, Waived};
use wire::refusal::Refusal;

use crate::designation::Designated;

/// Reports remembered: those of 3.2 s, where an order may be 2.5 s old.
const REPORTS: usize = 32;
/// Tracks in a report.
const TRACKS: usize = 8;
/// Furthest that a track may be from where it was shown, millimetres: less than half the space that two vehicles take up.
const SHIFT_MM: u32 = 1_500;

/// A place, millimetres east and north.
pub type Place = (i32, i32);

/// The unit's newest reports, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Reports(VecDeque<(ReportHash, List<(TrackId, Place), TRACKS>)>);

impl Reports {
    /// Remembers a signed report and the places of the tracks in it.
    pub(super) fn note(&mut self, signed: &[u8], places: impl Iterator<Item = (TrackId, Place)>) {
        if self.0.len() == REPORTS {
            self.0.pop_front();
        }
        self.0.push_back((Sha256::digest(signed).into(), places.collect()));
    }

    fn place(&self, report: &ReportHash, track: TrackId) -> Option<Place> {
        let (_, places) = self.0.iter().find(|(hash, _)| hash == report)?;
        places.iter().find(|(id, _)| *id == track).map(|(_, place)| *place)
    }
}

/// Consent of an order's operator to the evidence displayed, where its kind rests on any.
#[derive(Clone, Copy, Debug)]
pub(super) struct Consent {
    /// The track and its place as shown; without it the check was waived, or the kind rests on no track.
    place: Option<(TrackId, Place)>,
    waived: Waived,
}

impl Consent {
    /// Judges the report that an intent names.
    pub(super) fn judge(policy: &Policy, reports: &Reports, claim: &Intent) -> Result<Consent, Refusal> {
        let none = Consent { place: None, waived: Waived::default() };
        let Some(track) = claim.kind.rests_on_display() else { return Ok(none) };
        match policy.check(Check::Shown) {
            Requirement::Waived => Ok(Consent { waived: none.waived.with(Check::Shown), ..none }),
            Requirement::Required => {
                let place = claim.shown.and_then(|report| reports.place(&report, track));
                let place = place.ok_or(Refusal::Shown { kept: REPORTS, track })?;
                Ok(Consent { place: Some((track, place)), ..none })
            }
        }
    }

    /// Checks that were waived.
    pub(super) fn waived(&self) -> Waived {
        self.waived
    }

    /// The designation, if the track is still where it was shown.
    pub(super) fn to<'a>(&self, designated: &'a Designated) -> Result<Consented<'a>, Refusal> {
        let apart = self.place.map_or(0, |(_, shown)| apart_mm(shown, designated.place()));
        if apart > SHIFT_MM {
            return Err(Refusal::Moved { track: designated.track(), limit_mm: SHIFT_MM, got_mm: apart });
        }
        Ok(Consented(designated))
    }
}

/// Proof that the operator of an order saw the designated track where it is.
#[derive(Debug)]
pub struct Consented<'a>(&'a Designated);

impl<'a> Consented<'a> {
    /// The designation consented to.
    pub fn designated(&self) -> &'a Designated {
        self.0
    }
}

/// Distance, rounded down.
fn apart_mm(a: Place, b: Place) -> u32 {
    let square = |a: i32, b: i32| u64::from(a.abs_diff(b)).pow(2);
    (square(a.0, b.0) + square(a.1, b.1)).isqrt().min(u64::from(u32::MAX)) as u32
}
