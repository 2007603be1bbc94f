//! Feeds every core's input journal of a live run back into a fresh core, right after the run: the keys that the cores sign
//! with are still in memory then, and nowhere else.

use std::collections::VecDeque;
use std::io::BufReader;
use std::path::Path;

use link::input_journal::{self, Divergence, ReplayError};
use recording::RunFolder;
use recording::replays::CoreReplay;
use topology::{Member, Topology};
use twin::part::Part;
use twin::part::make::part;
use wire::core::{Core, Input, Output};
use wire::event::wire_hash;
use wire::id::Boot;
use wire::time::Instant;

/// The longest account of one difference, characters.
const MAX_TOLD: usize = 400;

/// Replays every member of `topology` from its input journal in the folder of the run.
pub fn replay(topology: &Topology, run: &RunFolder) -> Vec<CoreReplay> {
    topology.members.iter().map(|member| one(member, run)).collect()
}

fn one(member: &Member, run: &RunFolder) -> CoreReplay {
    let node = member.node();
    match feed(member, &run.input_journal(node, Boot(1))) {
        Ok(done) => CoreReplay { node, inputs: done.inputs, outputs: done.outputs, difference: None },
        Err(why) => CoreReplay { node, inputs: 0, outputs: 0, difference: Some(why) },
    }
}

fn feed(member: &Member, log: &Path) -> Result<input_journal::Replayed, String> {
    let file = link::files::open(log).map_err(|e| e.to_string())?;
    let log = input_journal::Reader::new(BufReader::new(file)).map_err(|e| e.to_string())?;
    let mut core = part(member, log.header().started).map_err(|e| e.to_string())?;
    let early = std::iter::from_fn(|| core.output()).collect();
    let mut woken = Woken { core, early, fed: false };
    input_journal::replay(log, &mut woken).map_err(|e| {
        let told = if let ReplayError::Diverged(differs) = &e { diverged(differs) } else { e.to_string() };
        told.chars().take(MAX_TOLD).collect()
    })
}

/// First difference of core and journal, in words: expected is the journal's, got the core's.
fn diverged(differs: &Divergence) -> String {
    let Divergence { input, index, expected, got } = differs;
    let (expected, got) = (output(expected.as_ref()), output(got.as_ref()));
    format!("differs after input {input}, at output {index}: expected {expected}, got {got}")
}

/// An output in a few words: an audit entry by its place in the chain and its event, anything else by its kind and hash.
fn output(of: Option<&Output>) -> String {
    let Some(output) = of else { return "nothing".to_owned() };
    if let Output::Audit { bytes } = output
        && let Ok(entry) = ground_truth::Entry::decode(bytes)
    {
        let event: String = serde_json::to_string(&entry.event).unwrap_or_default().chars().take(120).collect();
        return format!("entry {} at {} us, {event}", entry.counter, entry.at.0);
    }
    let bytes = minicbor::to_vec(output).unwrap_or_default();
    format!("{} bytes of output with hash {:016x}", bytes.len(), wire_hash(&bytes))
}

/// A core with initial outputs that come out with the first input, as they do in a process.
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
