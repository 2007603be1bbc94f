//! Ground truth of a run: the entries that simulation, adversary, guards and launcher write into the log, and the patterns and limits of
//! faults that a scene can have. No service of the product knows it.
//!
//! A [`Note`] is ground truth, a fault or an attack as it is injected, an observation at the ingress of a service, or what is done to a
//! process. It is in the same kind of entry as a service's event (`wire::audit`), in a chain of its writer; [`Any`] is either,
//! for those who read a whole log. A service's own events are left to `wire::event`, what any of it means to the oracle.

mod any;
mod bus_attack;
mod guard;
mod injected;
mod note;
pub mod perturbation;
mod place;
pub mod print;
mod step;
mod stream;

pub use any::{Any, Entry, is_awaited};
pub use bus_attack::BusAttack;
pub use guard::GuardVerdict;
pub use injected::{Action, FaultKind, MAX_CHAFF, MAX_SKEW, MAX_STRENGTH, Sensor, Suspension};
pub use note::{ALTERED_EVERY, Note};
pub use place::StreamPlace;
pub use step::{MAX_STEP_NAME, StepName};
pub use stream::{Sight, StreamEffect};
