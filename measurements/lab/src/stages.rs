//! Duration of each stage, from input journals: from the input that made one core speak until the next core is fed its
//! message. The same bytes are looked for in both journals, so that live and twin are measured by one rule.
//!
//! A stage so holds the core's own time, the links, and the wake-up of the reader. The sources of the twin's delays are
//! `twin::delay`'s.

use std::collections::BTreeMap;
use std::io::BufReader;
use std::path::Path;

use link::clock::HostClock;
use link::input_journal::{self, Entry};
use serde::Serialize;
use topology::Topology;
use twin::{Twin, clock};
use wire::core::{Input, Output, Topic};
use wire::event::wire_hash;
use wire::id::{Boot, NodeId};

/// Transport of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Way {
    /// Shared memory.
    Bus(Topic),
    /// A record of a secure session.
    Session,
    /// A publication on the command plane.
    Command,
}

impl Way {
    fn name(self) -> &'static str {
        match self {
            Way::Bus(topic) => topic.name(),
            Way::Session => "session",
            Way::Command => "command",
        }
    }
}

/// Sender, receiver and transport.
pub type Stage = (NodeId, NodeId, Way);

/// Delays by stage, microseconds, sorted.
#[derive(Clone, Debug, Default)]
pub struct Delays(BTreeMap<Stage, Vec<u64>>);

/// One message in an input journal, in or out.
struct Word {
    at: u64,
    node: NodeId,
    said: bool,
    way: Way,
    hash: u64,
}

/// Quantiles of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quantiles {
    /// Number of messages.
    pub n: usize,
    /// 5th percentile, microseconds.
    pub p5_us: u64,
    /// Median.
    pub p50_us: u64,
    /// 95th percentile.
    pub p95_us: u64,
}

/// A stage live and in the twin.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Sender.
    pub from: String,
    /// Receiver.
    pub to: String,
    /// Transport.
    pub way: &'static str,
    /// Live.
    pub live: Quantiles,
    /// Quantiles in the twin.
    pub twin: Quantiles,
    /// Twin minus live, median, microseconds.
    pub gap_p50_us: i64,
    /// Twin minus live, 95th percentile.
    pub gap_p95_us: i64,
}

impl Delays {
    /// Takes in the input journals of a live run.
    ///
    /// # Errors
    /// A journal that cannot be read.
    pub fn take_live(&mut self, topology: &Topology, run_dir: &Path) -> Result<(), String> {
        let mut words = Vec::new();
        for member in &topology.members {
            let node = member.node();
            let draw = topology.clocks[member.host as usize];
            let clock = HostClock { zero_us: draw.zero_us, drift_ppm: draw.drift_ppm as i32 };
            let file = link::files::input_journal(run_dir, node, Boot(1));
            let log = link::files::open(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            let log =
                input_journal::Reader::new(BufReader::new(log)).map_err(|e| format!("{}: {e}", file.display()))?;
            let mut at = 0;
            for entry in log {
                match entry.map_err(|e| format!("{}: {e}", file.display()))? {
                    Entry::Input { now, input } => {
                        at = clock.trace_at(now);
                        words.extend(heard(at, node, &input));
                    }
                    Entry::Output(output) => words.extend(spoken_word(at, node, &output)),
                    // A journal is read here before it is thinned.
                    Entry::LeftOut { .. } => {}
                }
            }
        }
        self.take(words);
        Ok(())
    }

    /// Takes in the journals of a twin that kept them.
    pub fn take_twin(&mut self, topology: &Topology, twin: &Twin) {
        let mut words = Vec::new();
        for (node, entries) in twin.nodes().iter().zip(twin.journals().unwrap_or_default()) {
            let clock = clock::HostClock::from(topology.clocks[usize::from(node.host)]);
            for entry in entries {
                let at = clock.true_time(entry.now);
                words.extend(heard(at, node.id, &entry.input));
                words.extend(entry.outputs.iter().filter_map(|output| spoken_word(at, node.id, output)));
            }
        }
        self.take(words);
    }

    fn take(&mut self, words: Vec<Word>) {
        let mut spoken: BTreeMap<(Way, u64), (NodeId, u64)> = BTreeMap::new();
        for word in words.iter().filter(|w| w.said) {
            spoken.entry((word.way, word.hash)).or_insert((word.node, word.at));
        }
        for word in words.iter().filter(|w| !w.said) {
            let Some((from, at)) = spoken.get(&(word.way, word.hash)) else { continue };
            if word.at >= *at {
                self.0.entry((*from, word.node, word.way)).or_default().push(word.at - at);
            }
        }
        self.0.values_mut().for_each(|delays| delays.sort_unstable());
    }

    /// Both side by side, every stage that either has.
    pub fn compare(live: &Delays, twin: &Delays) -> Vec<Row> {
        let mut stages: Vec<Stage> = live.0.keys().chain(twin.0.keys()).copied().collect();
        stages.sort_unstable();
        stages.dedup();
        let row = |stage: Stage| {
            let (live, twin) = (live.quantiles(stage), twin.quantiles(stage));
            Row {
                from: stage.0.to_string(),
                to: stage.1.to_string(),
                way: stage.2.name(),
                live,
                twin,
                gap_p50_us: twin.p50_us as i64 - live.p50_us as i64,
                gap_p95_us: twin.p95_us as i64 - live.p95_us as i64,
            }
        };
        stages.into_iter().map(row).collect()
    }

    fn quantiles(&self, stage: Stage) -> Quantiles {
        let Some(sorted) = self.0.get(&stage) else { return Quantiles::default() };
        let of = |percent: usize| sorted[((sorted.len() * percent).div_ceil(100)).clamp(1, sorted.len()) - 1];
        Quantiles { n: sorted.len(), p5_us: of(5), p50_us: of(50), p95_us: of(95) }
    }
}

fn heard(at: u64, node: NodeId, input: &Input) -> Option<Word> {
    let (way, bytes) = match input {
        Input::Bus { topic, bytes } => (Way::Bus(*topic), bytes),
        Input::Record { bytes, .. } => (Way::Session, bytes),
        Input::Published { bytes, .. } => (Way::Command, bytes),
        Input::Timeout
        | Input::Opened { .. }
        | Input::Closed { .. }
        | Input::Datagram { .. }
        | Input::Stream { .. }
        | Input::Audit { .. }
        | Input::Quiesce
        | Input::Finish
        | Input::SessionLost
        | Input::Guest { .. }
        | Input::Act { .. }
        | Input::HostWait { .. }
        | Input::Cue { .. } => return None,
    };
    Some(Word { at, node, said: false, way, hash: wire_hash(bytes) })
}

fn spoken_word(at: u64, node: NodeId, output: &Output) -> Option<Word> {
    let (way, bytes) = match output {
        Output::Bus { topic, bytes } => (Way::Bus(*topic), bytes),
        Output::Record { bytes, .. } => (Way::Session, bytes),
        Output::Publish { bytes, .. } => (Way::Command, bytes),
        Output::Datagram { .. }
        | Output::Stream { .. }
        | Output::Reset { .. }
        | Output::Close { .. }
        | Output::Join
        | Output::Leave
        | Output::Audit { .. }
        | Output::Stranger { .. }
        | Output::Guest { .. }
        | Output::Text { .. } => return None,
    };
    Some(Word { at, node, said: true, way, hash: wire_hash(bytes) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time from the input that made one core speak to the same bytes at the next.
    #[test]
    fn stage_lasts_from_cause_to_next_input() {
        let word = |at, node, said, hash| Word { at, node, said, way: Way::Session, hash };
        let (unit, gateway) = (NodeId::UNIT_A, NodeId::GATEWAY);
        let mut delays = Delays::default();
        delays.take(vec![
            word(100, unit, true, 7),
            word(350, gateway, false, 7),
            word(400, unit, true, 8),
            word(500, gateway, false, 9),
        ]);
        let rows = Delays::compare(&delays, &Delays::default());
        assert_eq!(rows.len(), 1);
        assert_eq!((rows[0].live.n, rows[0].live.p50_us, rows[0].gap_p50_us), (1, 250, -250));
    }
}
