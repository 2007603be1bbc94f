//! P1 to P11 (P12 is of platforms that leave the ground, which are not fuzzed), by the oracle's verdict; but P10's finding that there was no evidence: of a broker that ended, that no HOLD was
//! given after. P6 finds the accounts whole, and no attack sequence may break that.

use super::{Assertion, Facts, none, trial};

macro_rules! unbroken {
    ($($name:ident $id:literal),* $(,)?) => {
        [$(Assertion {
            name: stringify!($name),
            holds: |facts| finding(facts, $id),
            examples: || (Facts::default(), broken($id)),
            carried_by: None,
        }),*]
    };
}

pub(super) const ALL: &[Assertion] = &{
    let [a, b, c, d, e, f, g, h, i] = unbroken![
        p1_no_act_without_authority "P1",
        p2_loss_degrades_in_time "P2",
        p3_lost_trust_holds_in_time "P3",
        p4_inside_the_fence "P4",
        p5_nothing_unaccepted_has_an_effect "P5",
        p6_every_account_balances "P6",
        p8_orders_once_and_never_late "P8",
        p9_recovery_by_the_rules_only "P9",
        p11_never_the_wrong_object "P11",
    ];
    let shown = Assertion {
        // A hung console goes on showing its last picture: row A36 of the catalogue, listed there as open.
        name: "p7_nothing_old_is_shown_as_fresh_by_a_console_that_runs",
        holds: |facts| if facts.deeds.any(&["console-hangs"]) { Ok(()) } else { finding(facts, "P7") },
        examples: || (trial("processes", &["sim-hangs"]), broken("P7")),
        carried_by: None,
    };
    [a, b, c, d, e, f, g, h, i, shown]
};

#[test]
fn every_property_of_the_judge_is_asserted() {
    // P10 is a lack of evidence, and P12 a platform's that leaves the ground.
    for row in oracle::PROPERTIES.iter().filter(|row| !["P10", "P12"].contains(&row.name)) {
        let name = format!("{}_", row.name.to_lowercase());
        assert!(ALL.iter().any(|assertion| assertion.name.starts_with(&name)), "no assertion about {}", row.name);
    }
}

fn finding(facts: &Facts, property: &str) -> Result<(), String> {
    none(facts.findings.iter().find(|finding| finding.split(' ').next() == Some(property)).cloned())
}

fn broken(property: &str) -> Facts {
    Facts { findings: vec![format!("{property} at 1 ms: x")], ..Facts::default() }
}
