//! Beginning of a scenario's table, and the step that it is a part of.

use scenario::Windowed;
use wire::step::StepName;

/// The earliest beginning, milliseconds of the run, shifted by the phase of the trial.
pub(super) fn start_ms(of: &dyn Windowed, phase_ms: u64) -> u64 {
    (of.at_s().get() * 1000.0) as u64 + phase_ms
}

/// The name of a table's step.
pub(super) fn step_name(of: &dyn Windowed) -> Option<StepName> {
    of.timing().step.and_then(|name| StepName::new(name.as_str()))
}
