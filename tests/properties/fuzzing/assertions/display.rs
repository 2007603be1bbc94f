//! The display of the unit under test, against the unit's true state.

use wire::id::{Boot, NodeId, RecordId, Sequence};

use super::super::witness::Shown;
use super::{Assertion, Facts, none, trial};

pub(super) const ALL: &[Assertion] = &[
    Assertion {
        name: "what_is_shown_of_the_unit_never_goes_back",
        holds: |facts| {
            let mut pairs = facts.witness.shown.windows(2);
            let back = pairs.find(|pair| pair[1].report < pair[0].report);
            none(back.map(|pair| format!("{} at {:.0} ms after {}", pair[1].report, pair[1].at_ms, pair[0].report)))
        },
        examples: || (showing([(1, false), (2, false)], &[]), showing([(2, false), (1, false)], &[])),
        carried_by: None,
    },
    Assertion {
        name: "authority_is_shown_as_fresh_only_where_it_was_held_lately",
        // A hung console goes on showing its last picture: row A36.
        holds: |facts| if facts.deeds.any(&["console-hangs"]) { Ok(()) } else { none(feigned(facts)) },
        examples: || (showing([(1, false), (2, true)], &[(1_900.0, true)]), showing([(1, false), (2, true)], &[])),
        carried_by: None,
    },
];

/// A picture with authority of a unit that held none in the time for which something may be shown after it ended.
fn feigned(facts: &Facts) -> Option<String> {
    let held = |from: f64, to: f64| {
        let before = facts.witness.authority.iter().take_while(|(time, _)| *time <= from).last();
        let mut in_window =
            facts.witness.authority.iter().filter(|(time, gained)| *gained && *time > from && *time <= to);
        before.is_some_and(|(_, gained)| *gained) || in_window.next().is_some()
    };
    let mut pictures = facts.witness.shown.iter().filter(|shown| shown.fresh && shown.authority);
    let false_one = pictures.find(|shown| !held(shown.at_ms - facts.limits.shown, shown.at_ms));
    false_one.map(|shown| format!("authority is shown at {:.0} ms by {}", shown.at_ms, shown.report))
}

/// A trial in which the display shows these reports, with authority or not, one a second, and the unit gains it and loses it.
fn showing(reports: [(u64, bool); 2], authority: &[(f64, bool)]) -> Facts {
    let mut facts = trial("display", &["again"]);
    facts.witness.authority = authority.to_vec();
    let shown = |(i, (sequence, authority)): (u32, (u64, bool))| Shown {
        at_ms: f64::from(i) * 1_000.0,
        fresh: true,
        authority,
        report: RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(sequence) },
    };
    facts.witness.shown = (1..).zip(reports).map(shown).collect();
    facts
}
