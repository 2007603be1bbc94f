//! Feeds every core's mouth log of a live run back into a fresh core, right after the run: the keys that the cores sign
//! with are still in memory then, and nowhere else.

use std::collections::VecDeque;
use std::io::BufReader;
use std::path::Path;

use link::mouth;
use serde::{Deserialize, Serialize};
use wire::core::{Core, Input, Output};
use wire::id::NodeId;
use wire::time::Instant;

use crate::cast::{Cast, Member};
use crate::twin::assemble::part;
use crate::twin::part::Part;

/// What came of one core.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CoreReplay {
    /// Which.
    pub node: NodeId,
    /// Inputs fed.
    pub inputs: u64,
    /// Outputs compared and found equal.
    pub outputs: u64,
    /// Why the replay is not whole, where it is not.
    pub difference: Option<String>,
}

/// Replays every member of `cast` from the logs below `run_dir`.
pub fn replay(cast: &Cast, run_dir: &Path) -> Vec<CoreReplay> {
    cast.members.iter().map(|member| one(member, run_dir)).collect()
}

fn one(member: &Member, run_dir: &Path) -> CoreReplay {
    let node = member.node();
    match feed(member, &run_dir.join("mouth").join(format!("{node}.cbor"))) {
        Ok(done) => CoreReplay { node, inputs: done.inputs, outputs: done.outputs, difference: None },
        Err(why) => CoreReplay { node, inputs: 0, outputs: 0, difference: Some(why) },
    }
}

fn feed(member: &Member, log: &Path) -> Result<mouth::Replayed, String> {
    let file = link::files::open(log).map_err(|e| e.to_string())?;
    let log = mouth::Reader::new(BufReader::new(file)).map_err(|e| e.to_string())?;
    let mut core = part(member, log.header().started).map_err(|e| e.to_string())?;
    let early = std::iter::from_fn(|| core.output()).collect();
    let mut woken = Woken { core, early, fed: false };
    mouth::replay(log, &mut woken).map_err(|e| e.to_string().chars().take(400).collect())
}

/// A core whose first words, said when it was made, come out with the first input, as they do in a process.
struct Woken {
    core: Part,
    early: VecDeque<Output>,
    fed: bool,
}

impl Core for Woken {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.fed = true;
        self.core.handle(now, input);
    }

    fn deadline(&self) -> Option<Instant> {
        self.core.deadline()
    }

    fn output(&mut self) -> Option<Output> {
        if !self.fed {
            return None;
        }
        self.early.pop_front().or_else(|| self.core.output())
    }
}
