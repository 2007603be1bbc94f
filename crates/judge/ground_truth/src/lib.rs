//! The instrument's part of the log: what simulation, adversary, guards and launcher write, and no service of the product.
//!
//! A [`Note`] is ground truth, a fault or an attack as it is injected, an observation at the ingress of a service, or what is done to a
//! process. It is in the same kind of entry as a service's event (`wire::audit`), in a chain of its writer; [`Any`] is either,
//! for those who read a whole log. A service's own events are left to `wire::event`, what any of it means to the oracle.

mod any;
mod guard;
mod injected;
mod note;
mod place;
mod step;
mod stream;

pub use any::{Any, Entry, is_awaited};
pub use guard::GuardVerdict;
pub use injected::{Action, FaultKind, Sensor, Suspension};
pub use note::{ALTERED_EVERY, Note};
pub use place::StreamPlace;
pub use step::{MAX_STEP_NAME, StepName};
pub use stream::{Sight, StreamEffect};
