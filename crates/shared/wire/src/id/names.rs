//! Names of identities by number: the table, the rule behind its second half, and the search for a name.
//!
//! Numbers 0 to 31 are listed one by one. The numbers above follow a rule, which `docs/reference/telemetry.cddl` states
//! too: unit *n* of 5 to 64 has number 27 + *n*, the observer at its ingress 95 + *n*; of a unit *n* up to 52, the
//! simulation has number 155 + *n* and perception 203 + *n*. So 60 further units fit into the byte that a shared-memory
//! header has for its producer, 48 of them with a body. The table says which names exist; the identities that take part
//! in one run are left to the setup of that run ([`crate::roster`]).

/// Numbers of identities: one byte. Eight of them, 92 to 99, are no identity's, of which the scenario `malformed`
/// claims one.
pub const NODES: usize = 256;
/// The first unit that the rule numbers.
const FIRST_RULED: u8 = 5;
/// The last unit.
const LAST_UNIT: u8 = 64;
/// Number of units that the rule numbers.
const RULED: u8 = LAST_UNIT - FIRST_RULED + 1;
/// Number of [`FIRST_RULED`]; the others follow.
pub(super) const UNITS: u8 = 32;
/// The first number behind the numbers of units.
pub(super) const UNITS_END: u8 = UNITS + RULED;
/// Number of the ingress observer of [`FIRST_RULED`].
pub(super) const GUARDS: u8 = 100;
/// The first number behind the numbers of ingress observers.
pub(super) const GUARDS_END: u8 = GUARDS + RULED;

macro_rules! ruled {
    ([$($unit:literal)*] [$($bodiless:literal)*]) => {
        [
            "unit-a", "unit-b", "unit-c", "unit-d", "sim", "perception", "gateway", "broker", "console", "recorder",
            "relay-telemetry", "relay-command", "insider-b", "operator-1", "operator-2", "campaign", "guard-gateway",
            "guard-unit-a", "guard-unit-b", "guard-unit-c", "perception-c", "sim-c", "insider-command", "guard-broker",
            "insider-operator", "insider-broker", "insider-gateway", "insider-perception", "insider-recorder",
            "observer", "impostor", "host",
            $(concat!("unit-", $unit),)* $(concat!("unit-", $bodiless),)*
            "", "", "", "", "", "", "", "",
            $(concat!("guard-unit-", $unit),)* $(concat!("guard-unit-", $bodiless),)*
            $(concat!("sim-", $unit),)*
            $(concat!("perception-", $unit),)*
        ]
    };
}

/// The names that certificates, scenario files and logs use, by number; empty where there is no identity.
///
/// A name outside the table is refused when parsed, a number outside it when decoded.
#[rustfmt::skip]
pub(super) const NAMES: [&str; NODES] = ruled!(
    [
        5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28
        29 30 31 32 33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52
    ]
    [53 54 55 56 57 58 59 60 61 62 63 64]
);

/// Number of the identity with this name.
pub(super) fn number(name: &str) -> Option<u8> {
    NAMES.iter().position(|known| *known == name).map(|index| index as u8).filter(|number| is_assigned(*number))
}

/// True if an identity has this number.
pub(super) fn is_assigned(number: u8) -> bool {
    !NAMES[usize::from(number)].is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::{self, Malformed};
    use crate::id::NodeId;

    #[test]
    fn numbers_above_31_follow_the_rule() {
        for unit in FIRST_RULED..=LAST_UNIT {
            assert_eq!(NAMES[usize::from(27 + unit)], format!("unit-{unit}"));
            assert_eq!(NAMES[usize::from(95 + unit)], format!("guard-unit-{unit}"));
        }
        for unit in FIRST_RULED..=52 {
            assert_eq!(NAMES[usize::from(155 + unit)], format!("sim-{unit}"));
            assert_eq!(NAMES[usize::from(203 + unit)], format!("perception-{unit}"));
        }
        assert_eq!([UNITS, GUARDS], [27, 95].map(|before| before + FIRST_RULED));
        let unassigned = (0..=u8::MAX).filter(|number| !is_assigned(*number));
        assert_eq!(unassigned.collect::<Vec<_>>(), (UNITS_END..GUARDS).collect::<Vec<_>>());
    }

    #[test]
    fn unassigned_number_is_refused_when_decoded() {
        let decoded = |number: u8| codec::decode::<NodeId>(&codec::encode(&number), 2);
        for number in UNITS_END..GUARDS {
            assert!(matches!(decoded(number), Err(Malformed::Schema { .. })), "{number}");
        }
        assert_eq!(decoded(UNITS_END - 1).map(NodeId::name), Ok("unit-64"));
        assert_eq!(decoded(GUARDS).map(NodeId::name), Ok("guard-unit-5"));
        assert_eq!(NodeId::all().count(), NODES - usize::from(GUARDS - UNITS_END));
    }

    #[test]
    fn each_name_has_one_number() {
        for at in (0..=u8::MAX).filter(|at| is_assigned(*at)) {
            assert_eq!(number(NAMES[usize::from(at)]), Some(at));
        }
    }

    #[test]
    fn a_name_off_the_rule_is_unknown() {
        for name in ["unit-05", "unit-4", "unit-65", "unit-+5", "Unit-5", "unit-5 ", "sim-53", "guard-unit-d", ""] {
            assert_eq!(number(name), None, "{name}");
        }
    }
}
