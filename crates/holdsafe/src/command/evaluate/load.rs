//! Live runs side by side: as many as this host carries, by the time that one of them takes in the twin.

use evidence::trial::Trial;
use results::mode::Mode;
use runner::failure::Failure;
use runner::plan::Planned;
use runner::trial_store::TrialStore;
use runner::{Context, batch};

use super::parts::Part;

/// The scenario that is measured where it is among those to run: no loss in it ends a mission early.
const SCENARIO: &str = "nominal";
/// CPU time of a live run, as a multiple of that of the same rendered run in the twin. Measured on two cores: 2.4, in a quick build and in an
/// optimised one. The difference is processes, cryptography, and the replay of every core.
const LIVE_TO_TWIN: f64 = 2.4;
/// Part of the cores that live runs may take: above it services wait for each other, and the host spoils runs.
const USABLE: f64 = 0.75;

/// Live runs side by side on a given number of cores: 1 at the least, and where none is missing; at most one for each core.
///
/// # Errors
/// When the measured trial cannot run.
pub(super) fn measure_jobs(
    context: &Context,
    parts: &[Part],
    shelf: &TrialStore,
    cores: usize,
) -> Result<usize, Failure> {
    let mut missing: Vec<&Planned> = Vec::new();
    for planned in parts.iter().flat_map(|part| &part.live) {
        if shelf.shelf(Mode::Live, planned)?.get(context.seed).is_none() {
            missing.push(planned);
        }
    }
    let is_usual = |planned: &&&Planned| planned.variation.scenario.name.as_str() == SCENARIO;
    let Some(one) = missing.iter().find(is_usual).or_else(|| missing.first()) else { return Ok(1) };
    let trial = batch::trial(Mode::Twin, one, &one.setup, context.seed, &context.stop)?;
    Ok(jobs_for(&trial, cores))
}

fn jobs_for(trial: &Trial, cores: usize) -> usize {
    let share = LIVE_TO_TWIN * trial.cpu_seconds / trial.sim_seconds.max(1.0);
    let carried = USABLE * cores as f64 / share.max(0.01);
    (carried as usize).clamp(1, cores.clamp(1, batch::MAX_JOBS))
}

#[cfg(test)]
mod tests {
    use evidence::trial::Outcome;

    use super::*;

    #[test]
    fn slower_hosts_run_fewer_side_by_side() {
        let taking = |cpu_seconds| Trial { cpu_seconds, sim_seconds: 10.0, ..Trial::example(1, Outcome::Nominal) };
        assert_eq!(jobs_for(&taking(2.5), 2), 2);
        assert_eq!(jobs_for(&taking(5.0), 2), 1);
        assert_eq!(jobs_for(&taking(5.0), 8), 5);
        assert_eq!((jobs_for(&taking(90.0), 2), jobs_for(&taking(0.0), 2)), (1, 2));
    }
}
