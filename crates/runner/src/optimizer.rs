//! A program of the user's that proposes the sequences of a search: one line of JSON each way a round, on its stdin and stdout. It runs
//! with the user's rights, and its stderr is the user's.
//!
//! Every answer is bounded in length and time, and each of its sequences is checked. docs/researcher/search.md has the lines.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::time::Duration;

use evidence::trial::Outcome;
use oracle::Approaches;
use parallel::progress::Stop;
use scenario::{AttackSpace, Range};
use search::{Action, AttackSequence, Lore, Proposer, RunConfig, SearchConfig};
use serde::{Deserialize, Serialize};

/// Longest line that is read, bytes.
const MAX_LINE: u64 = 1 << 20;
/// Time between two looks at a request to stop, while waiting for an answer, and the number of these before an answer is too late: ten minutes.
const LOOK: Duration = Duration::from_millis(100);
const LOOKS: u32 = 6_000;
/// Looks for its end, once its input has ended: two seconds.
const LAST_LOOKS: u32 = 20;

/// The first line.
#[derive(Serialize)]
struct Begin<'a> {
    schema_version: u32,
    space: &'a str,
    seed: u64,
    budget: u64,
    /// Most actions in a sequence.
    longest: u64,
    /// First and last tick at which an action begins.
    begins: [u32; 2],
    tick_ms: u64,
    moves: Vec<Move<'a>>,
    /// Approach of the run without an attack to each limit, in millionths of the way.
    approaches: &'a Approaches,
}

/// An action type, with the last place of each of its numbers.
#[derive(Serialize)]
struct Move<'a> {
    name: &'a str,
    last: Vec<u32>,
}

/// A round: the results of the last one, and the most sequences of the next.
#[derive(Serialize)]
struct Round<'a> {
    most: usize,
    results: &'a [Told],
}

/// The result of a sequence.
#[derive(Serialize)]
struct Told {
    class: Outcome,
    finding: bool,
    new: bool,
    approaches: Approaches,
}

/// Its answer: the sequences of a round.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    sequences: Vec<Vec<Proposed>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Proposed {
    r#move: usize,
    begins: u32,
    places: Vec<u32>,
}

/// A running optimizer.
pub struct Optimizer<'a> {
    name: String,
    space: &'a AttackSpace,
    stop: &'a Stop,
    child: Child,
    /// To its stdin; none once that is closed. A thread writes, since a program that does not read must not stop us.
    requests: Option<Sender<Vec<u8>>>,
    /// From its stdout.
    answers: Receiver<Result<Vec<u8>, String>>,
    /// Answers so far.
    rounds: u64,
    results: Vec<Told>,
}

impl<'a> Optimizer<'a> {
    /// Starts the program for a search with `config`.
    ///
    /// # Errors
    /// Why it does not start, in words.
    pub fn start(program: &Path, config: &'a SearchConfig, run: RunConfig, stop: &'a Stop) -> Result<Self, String> {
        let name = name(program);
        let refused = |why: std::io::Error| {
            format!(
                "optimizer {}: {why}; name a program that can be executed, such as a script with `#!`",
                program.display()
            )
        };
        let file = program.canonicalize().map_err(refused)?;
        let mut command = Command::new(file);
        // Ctrl-C is ours: the program ends with its input.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).process_group(0);
        let mut child = command.spawn().map_err(refused)?;
        let (requests, to_write) = channel::<Vec<u8>>();
        let (answered, answers) = sync_channel(1);
        if let (Some(mut stdin), Some(stdout)) = (child.stdin.take(), child.stdout.take()) {
            std::thread::spawn(move || to_write.iter().all(|line| stdin.write_all(&line).is_ok()));
            std::thread::spawn(move || {
                let mut stdout = BufReader::new(stdout);
                while let Some(line) = read_line(&mut stdout) {
                    if answered.send(line).is_err() {
                        return;
                    }
                }
            });
        }
        let requests = Some(requests);
        let mut own =
            Self { name, space: &config.space, stop, child, requests, answers, rounds: 0, results: Vec::new() };
        let nominal = config.try_sequence(&AttackSequence::default())?;
        own.begin(run, &nominal.approaches)?;
        Ok(own)
    }

    fn begin(&mut self, run: RunConfig, approaches: &Approaches) -> Result<(), String> {
        let space = self.space;
        let (first, last) = space.begins();
        let last_of = |of: &scenario::Move| of.ranges().map(Range::last).collect();
        let line = Begin {
            schema_version: 1,
            space: space.name.as_str(),
            seed: run.seed,
            budget: run.budget,
            longest: space.longest.unsigned(),
            begins: [first, last],
            tick_ms: space.tick_ms.unsigned(),
            moves: space.moves.iter().map(|of| Move { name: of.name.as_str(), last: last_of(of) }).collect(),
            approaches,
        };
        self.send(serde_json::to_vec(&line))
    }

    fn send(&self, line: serde_json::Result<Vec<u8>>) -> Result<(), String> {
        let mut line = line.map_err(|why| self.fault(&why.to_string()))?;
        line.push(b'\n');
        let sent = self.requests.as_ref().is_some_and(|requests| requests.send(line).is_ok());
        if sent { Ok(()) } else { Err(self.fault("it closed its input")) }
    }

    /// The next line of its output.
    fn answer(&mut self) -> Result<Vec<u8>, String> {
        for _ in 0..LOOKS {
            if self.stop.asked() {
                return Err("stopped".to_owned());
            }
            match self.answers.recv_timeout(LOOK) {
                Ok(line) => return line.map_err(|why| self.fault(&why)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let status = self.child.try_wait().ok().flatten().map_or_else(String::new, |s| format!(" ({s})"));
                    return Err(self.fault(&format!("its output ended{status} before the search did")));
                }
            }
        }
        Err(self.fault("no answer within ten minutes"))
    }

    fn parsed(&self, line: &[u8], most: usize) -> Result<Vec<AttackSequence>, String> {
        let answer: Answer = serde_json::from_slice(line).map_err(|why| self.fault(&why.to_string()))?;
        let got = answer.sequences.len();
        if got == 0 || got > most {
            return Err(self.fault(&format!("{got} sequences; 1 to {most} were asked for")));
        }
        let sequence = |(i, actions): (usize, Vec<Proposed>)| {
            let action = |of: Proposed| Action { begins: of.begins, kind: of.r#move, places: of.places };
            AttackSequence::checked(self.space, actions.into_iter().map(action).collect())
                .map_err(|why| self.fault(&format!("sequence {i}: {why}")))
        };
        answer.sequences.into_iter().enumerate().map(sequence).collect()
    }

    fn fault(&self, why: &str) -> String {
        format!("optimizer {}, answer {}: {why}", self.name, self.rounds)
    }
}

impl Proposer for Optimizer<'_> {
    fn propose(&mut self, most: usize) -> Result<Vec<AttackSequence>, String> {
        self.rounds += 1;
        let line = serde_json::to_vec(&Round { most, results: &self.results });
        self.results.clear();
        self.send(line)?;
        let line = self.answer()?;
        self.parsed(&line, most)
    }

    fn take(&mut self, Lore { counted, new, .. }: Lore<'_>) {
        let (class, finding, approaches) = (counted.outcome, counted.cause.is_some(), counted.approaches.clone());
        self.results.push(Told { class, finding, new, approaches });
    }
}

impl Drop for Optimizer<'_> {
    fn drop(&mut self) {
        self.requests = None;
        // It is given a moment to end by itself.
        let ended = |own: &Self| matches!(own.answers.recv_timeout(LOOK), Err(RecvTimeoutError::Disconnected));
        let _in_time = (0..LAST_LOOKS).any(|_| ended(self));
        // One that has ended cannot be killed; one that has only closed its output must not be waited for.
        let _killed = self.child.kill();
        let _status = self.child.wait();
    }
}

/// Name of the program in a result.
pub fn name(program: &Path) -> String {
    program.file_name().unwrap_or(program.as_os_str()).to_string_lossy().into_owned()
}

/// A line without its end; none where the output has ended.
fn read_line(from: &mut impl BufRead) -> Option<Result<Vec<u8>, String>> {
    let mut line = Vec::new();
    match from.take(MAX_LINE + 1).read_until(b'\n', &mut line) {
        Err(why) => Some(Err(why.to_string())),
        Ok(0) => None,
        Ok(_) if line.len() as u64 > MAX_LINE => Some(Err(format!("a line of more than {MAX_LINE} bytes"))),
        Ok(_) => Some(Ok(line)),
    }
}
