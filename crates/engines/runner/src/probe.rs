//! Test of a guest for repeatability, at the start of every measurement with one.

use results::mode::Mode;

use super::engine;
use super::failure::Failure;
use super::plan::Planned;

/// Runs the first trial of a plan with a guest twice in the twin. Two different logs are a watermark on all of it.
///
/// # Errors
/// The trial cannot begin.
pub fn probe<'a>(planned: impl IntoIterator<Item = &'a mut Planned>, seed: u64) -> Result<(), Failure> {
    let mut planned: Vec<&mut Planned> = planned.into_iter().filter(|one| one.setup.guest.is_some()).collect();
    let Some(first) = planned.first().filter(|first| first.mode() == Mode::Twin) else { return Ok(()) };
    let log = || {
        let stop = &first.setup.stop;
        engine::trial(Mode::Twin, &first.variation.scenario, &first.setup, seed, stop).map(|trial| trial.log_hash)
    };
    if log()? != log()? {
        planned.iter_mut().filter_map(|one| one.setup.guest.as_mut()).for_each(|guest| guest.repeatable = false);
    }
    Ok(())
}
