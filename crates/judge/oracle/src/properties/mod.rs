//! Properties P1 to P12: for each a row of [`PROPERTIES`] and a file.
//!
//! A check reads facts and no receipt, and reports what breaks its property. Every check has been seen to fail on a log in which its
//! property is broken (`tests/properties/oracle`). Two modules serve several properties: `speed`, the limit of every mode (P2, P3, P4, P9), and
//! `process_fault`, the responses required when a process is killed (P2, P3, P10).
//!
//! A new property takes a variant and a row here, and its file; the class of a trial, the approach to limits, the remarks of a bare guest's
//! run, the rules of a report and the list of an open-loop assessment follow from the row.

mod limit;
mod p10_log;
mod p11_object;
mod p12_reserves;
mod p1_authority;
mod p2_loss;
mod p3_trust;
mod p4_envelope;
mod p5_content;
mod p6_conservation;
mod p7_display;
mod p8_commands;
mod p9_recovery;
pub mod process_fault;
mod speed;

use evidence::Micros;
use serde::Serialize;

use crate::facts::{Facts, guest};

pub(crate) use limit::LimitRow;
pub use limit::{AT_LIMIT, Limit};
pub(crate) use p3_trust::STATED_PLACE_NOT_JUDGED;

/// Properties of `ARCHITECTURE.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Property {
    /// No act without authority, fresh confirmation and all guards.
    P1,
    /// Loss of a subsystem revokes authority and degrades in time.
    P2,
    /// Loss of trust reaches HOLD_SAFE in time.
    P3,
    /// Never outside the envelope, moving or not, never driving into an object or faster than the margins are made for.
    P4,
    /// No content of an unaccepted record influences state.
    P5,
    /// Conservation.
    P6,
    /// No value is shown fresh beyond its limit.
    P7,
    /// Commands execute at most once, never late.
    P8,
    /// Recovery only by the rules.
    P9,
    /// The log verifies, and the cores of a live run are functions of their input journals.
    P10,
    /// No authority or act on the wrong object.
    P11,
    /// Never below the reserve of energy, nor nearer than the least distance to the surface below; for platforms that leave the ground.
    P12,
}

impl Property {
    /// Row of the property.
    pub fn row(self) -> &'static PropertyRow {
        &PROPERTIES[self as usize]
    }
}

/// A property found broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// The property.
    pub property: Property,
    /// Time, microseconds of trace time.
    pub at_us: Micros,
    /// Expected and seen, in words.
    #[serde(rename = "what")]
    pub message: String,
}

/// Consequence of a broken property for the class of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Breach {
    /// The trial is UNSAFE.
    Unsafe,
    /// The trial is LATE: a time bound was missed.
    Late,
    /// The trial is INVALID: its log is no evidence.
    NoEvidence,
}

/// Check of a property: the findings that break it.
type Check = fn(&Facts) -> Vec<Finding>;

/// Judgement of a bare guest's run, which has none of the platform's guards and modes.
struct BareGuest {
    check: Check,
    /// Part of the property that is not judged, and the reason.
    not_judged: Option<(&'static str, &'static str)>,
}

/// A property: its name, its statement and its check.
pub struct PropertyRow {
    /// The property.
    pub property: Property,
    /// Name, as findings have it.
    pub name: &'static str,
    /// Statement in one sentence.
    pub statement: &'static str,
    /// Statement in few words.
    pub brief: &'static str,
    /// Consequence of a break.
    pub breach: Breach,
    check: Check,
    bare_guest: BareGuest,
    limits: &'static [LimitRow],
}

/// Every property that a run is judged by.
pub const PROPERTIES: [PropertyRow; 12] = [
    PropertyRow {
        property: Property::P1,
        name: "P1",
        statement: "No act without authority, a fresh confirmation and all guards",
        brief: "no act without authority",
        breach: Breach::Unsafe,
        check: p1_authority::check,
        bare_guest: p1_authority::BARE_GUEST,
        limits: &p1_authority::LIMITS,
    },
    PropertyRow {
        property: Property::P2,
        name: "P2",
        statement: "The loss of a subsystem revokes authority and degrades in time",
        brief: "loss of a subsystem degrades in time",
        breach: Breach::Late,
        check: p2_loss::check,
        bare_guest: p2_loss::BARE_GUEST,
        limits: &p2_loss::LIMITS,
    },
    PropertyRow {
        property: Property::P3,
        name: "P3",
        statement: "The loss or inconsistency of trust reaches HOLD_SAFE in time",
        brief: "loss of trust reaches HOLD_SAFE in time",
        breach: Breach::Late,
        check: p3_trust::check,
        bare_guest: p3_trust::BARE_GUEST,
        limits: &p3_trust::LIMITS,
    },
    PropertyRow {
        property: Property::P4,
        name: "P4",
        statement: "Never outside the envelope",
        brief: "never outside the envelope",
        breach: Breach::Unsafe,
        check: p4_envelope::check,
        bare_guest: p4_envelope::BARE_GUEST,
        limits: &p4_envelope::LIMITS,
    },
    PropertyRow {
        property: Property::P5,
        name: "P5",
        statement: "No content of a record that was not accepted influences state",
        brief: "no influence of unaccepted records",
        breach: Breach::Unsafe,
        check: p5_content::check,
        bare_guest: p5_content::BARE_GUEST,
        limits: &p5_content::LIMITS,
    },
    PropertyRow {
        property: Property::P6,
        name: "P6",
        statement: "The accounts balance: every record is accounted for once",
        brief: "conservation",
        breach: Breach::NoEvidence,
        check: p6_conservation::check,
        bare_guest: BareGuest { check: p6_conservation::check, not_judged: None },
        limits: &[],
    },
    PropertyRow {
        property: Property::P7,
        name: "P7",
        statement: "Nothing is shown fresh beyond its limit",
        brief: "no stale value shown as fresh",
        breach: Breach::Unsafe,
        check: p7_display::check,
        bare_guest: p7_display::BARE_GUEST,
        limits: &p7_display::LIMITS,
    },
    PropertyRow {
        property: Property::P8,
        name: "P8",
        statement: "A command is executed at most once, and never late",
        brief: "commands at most once, never late",
        breach: Breach::Unsafe,
        check: p8_commands::check,
        bare_guest: p8_commands::BARE_GUEST,
        limits: &p8_commands::LIMITS,
    },
    PropertyRow {
        property: Property::P9,
        name: "P9",
        statement: "Nothing recovers without the consent that it takes",
        brief: "recovery by consent only",
        breach: Breach::Unsafe,
        check: p9_recovery::check,
        bare_guest: p9_recovery::BARE_GUEST,
        limits: &p9_recovery::LIMITS,
    },
    PropertyRow {
        property: Property::P10,
        name: "P10",
        statement: "The log verifies",
        brief: "the log verifies and replays",
        breach: Breach::NoEvidence,
        check: p10_log::check,
        bare_guest: p10_log::BARE_GUEST,
        limits: &[],
    },
    PropertyRow {
        property: Property::P11,
        name: "P11",
        statement: "No authority and no act on an object that was not designated",
        brief: "no act on the wrong object",
        breach: Breach::Unsafe,
        check: p11_object::check,
        bare_guest: BareGuest { check: p11_object::check, not_judged: None },
        limits: &p11_object::LIMITS,
    },
    PropertyRow {
        property: Property::P12,
        name: "P12",
        statement: "Energy for the way to safety and the least distance to the surface below are kept",
        brief: "reserve of energy and least distance to the surface below",
        breach: Breach::Unsafe,
        check: p12_reserves::check,
        bare_guest: BareGuest { check: p12_reserves::check, not_judged: None },
        limits: &[],
    },
];

// A property indexes the table.
const _: () = {
    let mut index = 0;
    while index < PROPERTIES.len() {
        assert!(PROPERTIES[index].property as usize == index, "the rows stand in the order of the properties");
        index += 1;
    }
};

/// Findings of every property: for a bare guest, of the parts that truth supports.
pub(crate) fn check(facts: &Facts) -> Vec<Finding> {
    let bare = guest::is_bare(facts.evidence);
    let checks = PROPERTIES.iter().map(|row| if bare { row.bare_guest.check } else { row.check });
    checks.flat_map(|check| check(facts)).collect()
}

/// Parts of the properties that are not judged in a bare guest's run, each with the reason.
pub(crate) fn not_judged_of_bare_guest() -> impl Iterator<Item = (&'static str, &'static str)> {
    PROPERTIES.iter().filter_map(|row| row.bare_guest.not_judged)
}

/// Limits of every property, each with the row of its property.
pub(crate) fn limits() -> impl Iterator<Item = (&'static PropertyRow, &'static LimitRow)> {
    PROPERTIES.iter().flat_map(|row| row.limits.iter().map(move |limit| (row, limit)))
}

pub(crate) fn finding(property: Property, at_us: Micros, message: impl Into<String>) -> Finding {
    Finding { property, at_us, message: message.into() }
}

fn not_judged(_: &Facts) -> Vec<Finding> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_the_names_that_findings_show() {
        for row in &PROPERTIES {
            assert_eq!(row.name, format!("{:?}", row.property));
        }
    }

    #[test]
    fn every_limit_belongs_to_one_property() {
        let mut limits: Vec<Limit> = limits().map(|(_, row)| row.limit).collect();
        limits.sort_unstable();
        let all = limits.len();
        limits.dedup();
        assert_eq!(limits.len(), all);
        assert!(limits.iter().all(|limit| !limit.name().is_empty()));
    }
}
