//! The independent judge of a trial.
//!
//! It reads only the instrument plane's events: no predicate of the boundary, of autonomy or of the
//! gateway is used. A service's actions are judged from witnesses outside it as far as there are any: set-points as the plant
//! holds them and acts as it received them, true pose and speed, the relay's and the guards' own logs, the pictures of the display.
//! The unit's mode, its authority and its executions are its own word, held against these. `ARCHITECTURE.md`
//! gives the witness of each property, and the parts for which there is the unit's word alone.
//!
//! | folder or module | part | reads |
//! |---|---|---|
//! | `facts` | the statements of the logs, sorted and joined; nothing is judged | |
//! | `receipts` | did the injection provably arrive, or which obstacle kept it from arriving | `facts` |
//! | `properties` | P1 to P12, a file or folder each, in the table [`PROPERTIES`] | `facts` |
//! | `mission` | the mission that the scenario presumes, against the one that took place | `facts` |
//! | `outcome`, `verdict` | the one class of a trial; the verdict | all |
//! | `approach` | the approach to each limit; no verdict | `properties` |
//! | `judged` | the verdict as a row of reports | `facts` |

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod approach;
mod facts;
pub mod judged;
mod mission;
mod outcome;
mod properties;
mod receipts;
mod verdict;

use evidence::Evidence;

use facts::Facts;

pub use approach::{Approaches, approaches};
pub use facts::peers;
pub use outcome::stalled;
pub use properties::{AT_LIMIT, Breach, Finding, Limit, PROPERTIES, Property, PropertyRow, process_fault};
pub use verdict::Verdict;

/// Judges a trial.
pub fn judge(evidence: &Evidence) -> Verdict {
    let facts = Facts::new(evidence);
    let receipts = receipts::find(&facts);
    let mut findings = properties::check(&facts);
    findings.sort_by_key(|f| (f.at_us, f.property));
    outcome::verdict(&facts, &receipts, findings)
}
