//! Replays every core's input journal of a live run in a new core, right after the run: the signing keys of the cores are in memory until
//! then, and nowhere else.

use std::collections::VecDeque;
use std::io::{self, BufReader};
use std::path::Path;

use link::input_journal::{self, Divergence, JournalError, ReplayError};
use recording::RunFolder;
use recording::replays::CoreReplay;
use topology::{Member, Topology};
use twin::part::Part;
use twin::part::make::{AssemblyError, part};
use wire::core::{Core, Input, Output};
use wire::event::wire_hash;
use wire::id::Boot;
use wire::time::Instant;

/// The longest account of one difference, characters.
const MAX_DIFFERENCE: usize = 400;

/// Reason for which a journal is not replayed.
#[derive(Debug, thiserror::Error)]
enum FeedError {
    #[error(transparent)]
    File(#[from] io::Error),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Core(#[from] AssemblyError),
    #[error("{}", difference(.0))]
    Replay(#[from] ReplayError),
}

/// Replays every member of `topology` from its input journal in the folder of the run.
pub fn replay(topology: &Topology, run: &RunFolder) -> Vec<CoreReplay> {
    topology.members.iter().map(|member| replay_member(member, run)).collect()
}

fn replay_member(member: &Member, run: &RunFolder) -> CoreReplay {
    let node = member.node();
    match feed(member, &run.input_journal(node, Boot(1))) {
        Ok(done) => CoreReplay { node, inputs: done.inputs, outputs: done.outputs, difference: None },
        Err(error) => CoreReplay { node, inputs: 0, outputs: 0, difference: Some(error.to_string()) },
    }
}

fn feed(member: &Member, log: &Path) -> Result<input_journal::Replayed, FeedError> {
    let file = link::files::open(log)?;
    let log = input_journal::Reader::new(BufReader::new(file))?;
    let mut core = part(member, log.header().started)?;
    let early = std::iter::from_fn(|| core.output()).collect();
    let mut woken = Woken { core, early, fed: false };
    Ok(input_journal::replay(log, &mut woken)?)
}

/// The account of a failed replay, within its length.
fn difference(error: &ReplayError) -> String {
    let text = if let ReplayError::Diverged(divergence) = error { diverged(divergence) } else { error.to_string() };
    text.chars().take(MAX_DIFFERENCE).collect()
}

/// First difference of core and journal: expected is the journal's output, got the core's.
fn diverged(divergence: &Divergence) -> String {
    let Divergence { input, index, expected, got } = divergence;
    let (expected, got) = (describe(expected.as_ref()), describe(got.as_ref()));
    format!("differs after input {input}, at output {index}: expected {expected}, got {got}")
}

/// Description of an output: of an audit entry its place in the chain and its event, else length and hash.
fn describe(output: Option<&Output>) -> String {
    let Some(output) = output else { return "nothing".to_owned() };
    if let Output::Audit { bytes } = output
        && let Ok(entry) = ground_truth::Entry::decode(bytes)
    {
        let event: String = serde_json::to_string(&entry.event).unwrap_or_default().chars().take(120).collect();
        return format!("entry {} at {} us, {event}", entry.counter, entry.at.0);
    }
    let bytes = minicbor::to_vec(output).unwrap_or_default();
    format!("{} bytes of output with hash {:016x}", bytes.len(), wire_hash(&bytes))
}

/// A core whose initial outputs come out with the first input, as in a process.
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
