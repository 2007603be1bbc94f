//! Whether a guest repeats itself: every measurement with one begins here.

use results::mode::Mode;

use super::engine;
use super::failure::Failure;
use super::plan::Planned;

/// Runs the first trial of a plan with a guest twice in the twin. Two different logs are a watermark on all that follows.
///
/// # Errors
/// The trial cannot begin.
pub fn probe(planned: &mut [Planned], seed: u64) -> Result<(), Failure> {
    let Some(first) = planned.first().filter(|first| first.setup.guest.is_some() && first.mode() == Mode::Twin) else {
        return Ok(());
    };
    let log = || {
        let stop = &first.setup.stop;
        engine::trial(Mode::Twin, &first.variation.scenario, &first.setup, seed, stop).map(|trial| trial.log_hash)
    };
    if log()? != log()? {
        planned.iter_mut().filter_map(|one| one.setup.guest.as_mut()).for_each(|guest| guest.repeatable = false);
    }
    Ok(())
}
