//! One type over the roles, for those who run an adversary without caring which.

use config::setup::Setup;
use wire::core::{Core, Input, Output};
use wire::time::Instant;

use crate::insider::{InsiderBroker, InsiderGateway, InsiderOperator, InsiderTeammate, Rogue, SessionThief};
use crate::plan::{AdversaryConfig, PlanError};
use crate::relay::{DatagramRelay, StreamRelay};

/// Reason that an adversary could not be made.
pub type AdversaryError = PlanError;

/// An adversary in one of its roles.
#[derive(Clone, Debug)]
pub enum Adversary {
    /// The relay in the telemetry path.
    DatagramRelay(Box<DatagramRelay>),
    /// The relay in the command path.
    StreamRelay(Box<StreamRelay>),
    /// The holder of teammate B's credentials.
    InsiderTeammate(Box<InsiderTeammate>),
    /// The holder of a signing key that is not its own.
    InsiderOperator(Box<InsiderOperator>),
    /// The holder of the broker's credentials.
    InsiderBroker(Box<InsiderBroker>),
    /// The holder of the gateway's keys.
    InsiderGateway(Box<InsiderGateway>),
    /// On a host's shared memory, in another's name.
    Rogue(Box<Rogue>),
    /// The holder of a copy of another's certificate.
    SessionThief(Box<SessionThief>),
}

impl Adversary {
    /// The role that `config` names, from `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: AdversaryConfig, now: Instant) -> Result<Self, AdversaryError> {
        Ok(match config {
            AdversaryConfig::DatagramRelay(plan) => {
                Adversary::DatagramRelay(Box::new(DatagramRelay::new(setup, plan, now)?))
            }
            AdversaryConfig::StreamRelay(plan) => Adversary::StreamRelay(Box::new(StreamRelay::new(setup, plan, now)?)),
            AdversaryConfig::InsiderTeammate(plan) => {
                Adversary::InsiderTeammate(Box::new(InsiderTeammate::new(setup, plan, now)?))
            }
            AdversaryConfig::InsiderBroker(plan) => {
                Adversary::InsiderBroker(Box::new(InsiderBroker::new(setup, plan, now)?))
            }
            AdversaryConfig::InsiderGateway(plan) => {
                Adversary::InsiderGateway(Box::new(InsiderGateway::new(setup, plan, now)?))
            }
            AdversaryConfig::InsiderOperator(plan) => {
                Adversary::InsiderOperator(Box::new(InsiderOperator::new(setup, plan, now)?))
            }
            AdversaryConfig::Rogue(plan) => Adversary::Rogue(Box::new(Rogue::new(setup, plan, now)?)),
            AdversaryConfig::SessionThief(plan) => {
                Adversary::SessionThief(Box::new(SessionThief::new(&setup, &plan, now)?))
            }
        })
    }

    /// Draws its random choices from `seed` from now on.
    pub fn reseed(&mut self, seed: u64) {
        match self {
            Adversary::DatagramRelay(core) => core.reseed(seed),
            Adversary::StreamRelay(core) => core.reseed(seed),
            Adversary::InsiderTeammate(core) => core.reseed(seed),
            // These leave nothing to chance.
            Adversary::InsiderOperator(_)
            | Adversary::InsiderBroker(_)
            | Adversary::InsiderGateway(_)
            | Adversary::Rogue(_)
            | Adversary::SessionThief(_) => {}
        }
    }

    fn core(&self) -> &dyn Core {
        match self {
            Adversary::DatagramRelay(core) => core.as_ref(),
            Adversary::StreamRelay(core) => core.as_ref(),
            Adversary::InsiderTeammate(core) => core.as_ref(),
            Adversary::InsiderOperator(core) => core.as_ref(),
            Adversary::InsiderBroker(core) => core.as_ref(),
            Adversary::InsiderGateway(core) => core.as_ref(),
            Adversary::Rogue(core) => core.as_ref(),
            Adversary::SessionThief(core) => core.as_ref(),
        }
    }

    fn core_mut(&mut self) -> &mut dyn Core {
        match self {
            Adversary::DatagramRelay(core) => core.as_mut(),
            Adversary::StreamRelay(core) => core.as_mut(),
            Adversary::InsiderTeammate(core) => core.as_mut(),
            Adversary::InsiderOperator(core) => core.as_mut(),
            Adversary::InsiderBroker(core) => core.as_mut(),
            Adversary::InsiderGateway(core) => core.as_mut(),
            Adversary::Rogue(core) => core.as_mut(),
            Adversary::SessionThief(core) => core.as_mut(),
        }
    }
}

impl Core for Adversary {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.core_mut().handle(now, input);
    }

    fn deadline(&self) -> Option<Instant> {
        self.core().deadline()
    }

    fn output(&mut self) -> Option<Output> {
        self.core_mut().output()
    }
}
