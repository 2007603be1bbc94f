//! The independent judge of a trial.
//!
//! It reads only the instrument plane's events: no predicate of the boundary, of autonomy or of the
//! gateway is used. A service's actions are judged from witnesses outside it as far as there are any: set-points as the plant
//! holds them and acts as it received them, true pose and speed, the relay's and the guards' own logs, the pictures of the display.
//! The unit's mode, its authority and its executions are its own word, held against these. `ARCHITECTURE.md`
//! gives the witness of each property, and the parts for which there is the unit's word alone.
//!
//! | module | part |
//! |---|---|
//! | `timeline` | the events by subject |
//! | `window` | the time of a planned action |
//! | `receipt` | did the fault provably arrive: `datagram`, `stream`, `planes`, `view`, `delivery`, `life`, `disguise`, one kind of injection each |
//! | `masked`, `arrived` | the obstacle that kept an injection from arriving; the facts then established |
//! | `conservation` | the sums of the accounts (P6) |
//! | `properties` | P1 to P12 |
//! | `guards` | P1: the facts that others than the unit know of its guards |
//! | `motion`, `speed`, `effect` | the true motion of the plant; the speed of every mode; the effects of executions |
//! | `link` | P3 on the telemetry link |
//! | `content`, `display` | P5; P7 |
//! | `place` | the place at which the unit takes itself to be |
//! | `takeover` | sessions at the broker that another took |
//! | `stale` | the age of accepted records |
//! | `orders` | the values that a unit was set to, and a rogue's orders |
//! | `process_fault` | the responses owed when a process is killed |
//! | `outcome` | the one class |
//! | `mission` | the mission that the scenario presumes |
//! | `progress` | the progress along the route |
//! | `guest` | runs of guests: what truth supports |
//! | `approach` | the approach to each limit; no verdict |

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod approach;
mod facts;
pub mod judged;
mod mission;
mod outcome;
mod properties;
mod receipts;

use evidence::process_fault::Response;
use evidence::{Evidence, Finding, Micros, Property, Verdict};
use wire::bounds::Bounds;

use facts::{contact, guest, link, motion, place, progress, sensor_fault as arrived, timeline};
use properties::p1_authority::guards;
use properties::p7_display::{age as stale, picture as display, sessions as takeover};
use properties::p8_commands::effect;
use properties::{p5_content as content, p6_conservation as conservation, speed};
use receipts as receipt;
use receipts::{broker as planes, feed as view, process_fault as life, rogue as orders};
use receipts::{datagram, delivery, disguise, masked, stream, window};

use arrived::Receipt;

pub use approach::{AT_LIMIT, Approaches, Limit, approaches};
pub use facts::peers;
pub use outcome::stalled;
pub use properties::process_fault;
pub use timeline::Timeline;

/// Time that one trip through the live host may add between an event and its trace time, and between a command leaving the
/// operator and reaching the unit.
const SLACK: Micros = 50_000;

/// A navigation period and a step of the plant with its actuators, milliseconds: the simulation's, on every platform.
const READING_AND_PLANT_MS: u64 = 100;

/// Time from a decision to the brakes, milliseconds, whatever allowance the unit's own fence guard makes for it
/// (`docs/reference/bounds.md`).
fn reaction_ms(bounds: &Bounds) -> u64 {
    READING_AND_PLANT_MS + bounds.control_period_ms
}

/// Judges a trial.
pub fn judge(evidence: &Evidence) -> Verdict {
    let timeline = Timeline::of(evidence);
    let receipt = receipt::find(evidence);
    let (mut findings, responses) = if guest::is_bare(evidence) {
        (of_bare_guest(evidence, &timeline), Vec::new())
    } else {
        of_platform(evidence, &timeline, &receipt)
    };
    findings.sort_by_key(|f| (f.at_us, f.property));
    Verdict { responses, guest: guest::row(evidence), ..outcome::verdict(evidence, &timeline, receipt, findings) }
}

fn of_platform(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> (Vec<Finding>, Vec<Response>) {
    let mut findings = properties::check(evidence, line, receipt);
    findings.extend(conservation::check(evidence));
    findings.extend(orders::check(evidence));
    findings.extend(takeover::check(evidence));
    findings.extend(place::check(evidence, line));
    findings.extend(stale::check(evidence, receipt));
    let (responses, owed) = process_fault::judge(evidence, line);
    findings.extend(owed);
    (findings, responses)
}

fn of_bare_guest(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let mut findings = properties::of_bare_guest(evidence, line);
    findings.extend(conservation::check(evidence));
    findings.extend(guest::astray(evidence, line));
    findings
}

fn finding(property: Property, at_us: Micros, what: impl Into<String>) -> Finding {
    Finding { property, at_us, what: what.into() }
}
