//! Trials on the real stacks: the guard, the DTLS library and the TLS library between two ends in memory (`link::memory`),
//! and for a passive observer the live broker between two clients (`broker::watched`) or a channel of real shared memory.
//!
//! There is no platform here and so no mode. The question is the promise of the links: no identity passes for another, no
//! record is delivered that was not sent, and none twice, no content can be read, and honest records still get through. The seed draws names, numbers
//! and places; the libraries draw their own keys, so that a seed repeats the actions and not every byte.
//!
//! `handshake`, `records`, `storm` and `observe` (with `words` and `search`) do it, `judge` gives the class.

mod handshake;
mod judge;
mod observe;
mod records;
mod search;
mod storm;
mod words;

use broker::watched::WatchError;
use evidence::trial::Trial;
use link::bus::BusError;
use link::dtls::DtlsError;
use link::pki::PkiError;
use scenario::Scenario;

/// A trial that could not be run.
#[derive(Debug, thiserror::Error)]
pub enum StackError {
    /// Certificates could not be made or used.
    #[error(transparent)]
    Pki(#[from] PkiError),
    /// The stack could not be set up.
    #[error(transparent)]
    Dtls(#[from] DtlsError),
    /// The channel in shared memory could not be used.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The place of a channel in shared memory could not be marked.
    #[error("shared memory: {0}")]
    Place(std::io::Error),
    /// The exchange over the broker failed.
    #[error(transparent)]
    Watch(#[from] WatchError),
    /// The honest association failed, so that there was no target.
    #[error("two honest ends have no association")]
    NoAssociation,
    /// The scenario has not exactly one of the tables that run here.
    #[error("not one cell of a scenario on the real stacks")]
    NotOneCell,
}

/// Runs and judges one trial of one cell.
///
/// # Errors
/// When it could not be run at all.
pub fn trial(cell: &Scenario, seed: u64) -> Result<Trial, StackError> {
    let showing = match (&cell.impostor[..], &cell.downgrade[..], &cell.handle[..], &cell.storm[..], &cell.observe[..])
    {
        ([one], [], [], [], []) => handshake::impostor(one, seed)?,
        ([], [one], [], [], []) => handshake::downgrade(one, seed)?,
        ([], [], [one], [], []) => records::handled(one, seed)?,
        ([], [], [], [one], []) => storm::stormed(one, seed)?,
        ([], [], [], [], [one]) => observe::observed(one, seed)?,
        _ => return Err(StackError::NotOneCell),
    };
    Ok(Trial { knowledge: cell.level(), ..judge::judge(seed, &showing) })
}

#[cfg(test)]
mod tests {
    use super::judge::{Showing, judge};
    use evidence::trial::Outcome;

    fn attacked() -> Showing {
        let mut showing = Showing::new(true);
        showing.did(b"deed");
        showing
    }

    #[test]
    fn a_trial_has_the_first_class_that_matches() {
        let mut showing = attacked();
        assert_eq!(judge(1, &showing).outcome, Outcome::Invalid, "said and not seen at the target");
        showing.saw(b"deed");
        assert_eq!(judge(1, &showing).outcome, Outcome::Undetected);
        showing.refused("foreign");
        assert_eq!(judge(1, &showing).outcome, Outcome::Rejected);
        showing.missed.push("an honest record".to_owned());
        assert_eq!(judge(1, &showing).outcome, Outcome::Late);
        showing.breaches.push("a record that nobody sent".to_owned());
        assert_eq!(judge(1, &showing).outcome, Outcome::Unsafe);
        assert_eq!(judge(1, &Showing::default()).outcome, Outcome::Nominal);
        let mut looked = attacked();
        looked.saw(b"deed");
        looked.in_the_clear.push("a name".to_owned());
        assert_eq!(judge(1, &looked).outcome, Outcome::Undetected, "what cannot be hidden is told");
        looked.read.push("an order".to_owned());
        assert_eq!(judge(1, &looked).outcome, Outcome::Unsafe);
    }

    /// An action done twice is seen twice or has no receipt.
    #[test]
    fn repeated_action_needs_as_many_sights() {
        let mut showing = attacked();
        showing.did(b"deed");
        showing.saw(b"deed");
        let trial = judge(1, &showing);
        assert_eq!((trial.outcome, trial.receipt), (Outcome::Invalid, false));
    }
}
