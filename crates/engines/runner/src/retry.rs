//! Repetition of a live trial that the host spoilt, as often as `--retries` allows.
//!
//! Only a trial that is INVALID by a stall of the host alone is repeated (`live::trial`), with the same seed. Each such
//! attempt is reported on stderr, counted in the trial that replaces it, and its recordings stay in its folder.

use std::fs;
use std::path::Path;

use super::failure::Failure;
use super::out;
use evidence::trial::Trial;
use live::OVERSLEPT_US;
use scenario::Setup;

/// Attempts of one trial that may be repeated, at most.
pub const MAX_RETRIES: u32 = 10;

/// Prefix of the folder of a spoilt attempt's recordings, before its number.
pub(crate) const SPOILT: &str = "spoilt-";

/// `--retries`, for commands that run live.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Retries {
    /// Repeat a live trial up to N times when a stall of the host alone makes it INVALID; each time is counted and printed.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_RETRIES)))]
    pub retries: u32,
}

/// Runs a trial, and repeats it while the host spoils it and `setup` allows.
pub fn retried(
    setup: &Setup,
    seed: u64,
    mut attempt: impl FnMut() -> Result<Trial, Failure>,
) -> Result<Trial, Failure> {
    let mut spoilt = Vec::new();
    loop {
        let mut trial = attempt()?;
        let Some(ms) = trial.host_stall_ms.filter(|_| spoilt.len() < setup.retries as usize) else {
            trial.host_spoilt_ms = spoilt;
            return Ok(trial);
        };
        spoilt.push(ms);
        if let Some(directory) = &setup.run_dir {
            put_aside(directory, spoilt.len())?;
        }
        out::note(format_args!(
            "seed {seed}: the host overslept, or kept a service waiting for a core, by {ms:.0} ms, at most {} ms are allowed; repeated, {} of at most {}",
            OVERSLEPT_US / 1000,
            spoilt.len(),
            setup.retries
        ));
    }
}

/// Moves the records of an attempt in `directory` into a separate folder there.
fn put_aside(directory: &Path, number: usize) -> Result<(), Failure> {
    let left: Vec<_> = fs::read_dir(directory)?.collect::<Result<_, _>>()?;
    let into = directory.join(format!("{SPOILT}{number}"));
    fs::create_dir(&into)?;
    for entry in left.into_iter().filter(|entry| !entry.file_name().to_string_lossy().starts_with(SPOILT)) {
        fs::rename(entry.path(), into.join(entry.file_name()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use evidence::trial::Outcome;
    use scenario::Setup;

    /// Runs attempts with these stalls; gives the trial and the number of attempts.
    fn attempts(stalls: &[Option<f64>], setup: &Setup) -> (Trial, usize) {
        let mut made = 0;
        let trial_with = |stall: Option<f64>| {
            let outcome = if stall.is_some() { Outcome::Invalid } else { Outcome::HoldSafe };
            Trial { host_stall_ms: stall, ..Trial::example(7, outcome) }
        };
        let trial = retried(setup, 7, || {
            made += 1;
            if let Some(directory) = &setup.run_dir {
                fs::write(directory.join("events.jsonl"), made.to_string())?;
            }
            Ok(trial_with(stalls[made - 1]))
        });
        (trial.unwrap(), made)
    }

    fn setup(retries: u32) -> Setup {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let scenario = scenario::load(&root.join("scenarios/control/nominal.toml")).unwrap();
        Setup { retries, ..Setup::load(&root, &scenario, None, true).unwrap() }
    }

    #[test]
    fn only_spoilt_trials_are_repeated_as_allowed() {
        let (trial, made) = attempts(&[Some(312.0), None], &setup(2));
        assert_eq!((trial.outcome, trial.host_spoilt_ms, made), (Outcome::HoldSafe, vec![312.0], 2));
        let (trial, made) = attempts(&[Some(312.0)], &setup(0));
        assert_eq!((trial.outcome, trial.host_spoilt_ms.len(), made), (Outcome::Invalid, 0, 1));
        let (trial, made) = attempts(&[Some(312.0), Some(140.0), Some(101.0)], &setup(2));
        assert_eq!((trial.host_spoilt_ms, trial.host_stall_ms, made), (vec![312.0, 140.0], Some(101.0), 3));
        assert_eq!(attempts(&[None], &setup(2)).1, 1);
    }

    #[test]
    fn the_recordings_of_a_spoilt_attempt_stay() {
        let folder = tempfile::tempdir().unwrap();
        let setup = Setup { run_dir: Some(folder.path().to_owned()), ..setup(2) };
        attempts(&[Some(312.0), Some(140.0), None], &setup);
        let read = |path: &str| fs::read_to_string(folder.path().join(path)).unwrap();
        assert_eq!(["spoilt-1/events.jsonl", "spoilt-2/events.jsonl", "events.jsonl"].map(read), ["1", "2", "3"]);
    }
}
