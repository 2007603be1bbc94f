//! The objects and tables of `lab`: measurements that only the authors run.

mod agreement;
mod faults;
mod growth;
mod kill;
mod liveness;
mod mavlink;
mod minima;
mod transitions;
mod worth;

pub use agreement::{AgreementObject, SequenceRow, StratumRow, agreement_table};
pub use faults::{Attempts, FaultRow, Left, fault_table, survived};
pub use growth::{Fit, Grown, Growth, GrowthRow, growth_table};
pub use kill::{KillRow, Times, kill_table};
pub use liveness::{LivenessObject, LivenessRow, liveness_svg, liveness_table};
pub use mavlink::{MavlinkObject, MavlinkRow, Party, mavlink_table};
pub use minima::{MinimaObject, MinimaRow, minima_table};
pub use transitions::{TransitionCell, TransitionRow, transition_table};
pub use worth::{StrategyRow, WeaknessRow, WorthObject, worth_table};
