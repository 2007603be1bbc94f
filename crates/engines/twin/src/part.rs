//! The cores that a twin can hold: exactly the live services', behind their common verbs, by themselves or along
//! with a run that is known.

pub mod baseline;
pub mod make;

use adversary::Adversary;
use autonomy::Autonomy;
use console::Console;
use gateway::Gateway;
use ground_truth::Any;
use perception::Perception;
use sim::Sim;
use wire::audit::Recorder;
use wire::core::{Core, Input, Output};
use wire::id::WorldId;
use wire::time::Instant;

use baseline::Following;

/// The core of one process.
pub enum Part {
    /// World, plant and sensors of one unit.
    Sim(Box<Sim>),
    /// Perception of one unit.
    Perception {
        /// The core.
        core: Box<Perception>,
        /// True if it works on frames.
        rendered: bool,
    },
    /// A unit's autonomy.
    Autonomy(Box<Autonomy>),
    /// The gateway.
    Gateway(Box<Gateway>),
    /// The console with its scripted operator.
    Console(Box<Console>),
    /// The recorder.
    Recorder(Box<Recorder<Any>>),
    /// An adversary in any of its roles.
    Adversary(Adversary),
    /// Any of these, along with a baseline while it is fed the same.
    Following(Box<Following>),
}

impl Part {
    /// Copy of the part for a forked world. Of the cores only autonomy and perception know their world; only autonomy's
    /// state forbids a clone, since a clone of its authority would be valid in two worlds.
    #[must_use]
    pub fn fork(&self, world: WorldId) -> Part {
        match self {
            Part::Sim(core) => Part::Sim(core.clone()),
            Part::Perception { core, rendered } => {
                Part::Perception { core: Box::new(core.fork(world)), rendered: *rendered }
            }
            Part::Autonomy(core) => Part::Autonomy(Box::new(core.fork(world))),
            Part::Gateway(core) => Part::Gateway(core.clone()),
            Part::Console(core) => Part::Console(core.clone()),
            Part::Recorder(core) => Part::Recorder(core.clone()),
            Part::Adversary(core) => Part::Adversary(core.clone()),
            Part::Following(along) => Part::Following(Box::new(along.fork(world))),
        }
    }

    /// Has the part make its random draws from `seed` from now on; a sim where noise is `varied`.
    pub fn reseed(&mut self, seed: u64, varied: bool) {
        match self {
            Part::Sim(core) if varied => core.reseed(seed),
            Part::Adversary(core) => core.reseed(seed),
            Part::Following(along) => along.leave_for_good().reseed(seed, varied),
            // Autonomy and gateway draw nonces, in which no outcome lies; the others nothing.
            Part::Sim(_)
            | Part::Perception { .. }
            | Part::Autonomy(_)
            | Part::Gateway(_)
            | Part::Console(_)
            | Part::Recorder(_) => {}
        }
    }

    fn core(&self) -> &dyn Core {
        match self {
            Part::Sim(core) => core.as_ref(),
            Part::Perception { core, .. } => core.as_ref(),
            Part::Autonomy(core) => core.as_ref(),
            Part::Gateway(core) => core.as_ref(),
            Part::Console(core) => core.as_ref(),
            Part::Recorder(core) => core.as_ref(),
            Part::Adversary(core) => core,
            Part::Following(along) => along.as_ref(),
        }
    }

    /// The core, to be fed.
    pub fn core_mut(&mut self) -> &mut dyn Core {
        match self {
            Part::Sim(core) => core.as_mut(),
            Part::Perception { core, .. } => core.as_mut(),
            Part::Autonomy(core) => core.as_mut(),
            Part::Gateway(core) => core.as_mut(),
            Part::Console(core) => core.as_mut(),
            Part::Recorder(core) => core.as_mut(),
            Part::Adversary(core) => core,
            Part::Following(along) => along.as_mut(),
        }
    }
}

impl Core for Part {
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
