//! A program of the user that proposes the sequences of a search: one line of JSON in each direction a round, on its stdin and stdout. It
//! runs with the rights of the user and inherits stderr.
//!
//! Every answer is bounded in length and time, and each of its sequences is checked. docs/researcher/search.md has the lines.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

use evidence::trial::Outcome;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use oracle::Approaches;
use parallel::progress::Stop;
use recording::checked::on_one_line;
use scenario::{AttackSpace, Range};
use search::{Action, AttackSequence, Lore, Proposer, RunConfig, SearchConfig, SearchError, Unfit};
use serde::{Deserialize, Serialize};

/// Longest line that is read, bytes.
const MAX_LINE: u64 = 1 << 20;
/// Requests that wait for a program which does not read: the first line and the first round wait together.
const MAX_REQUESTS: usize = 2;
/// Time between two looks at a request to stop, while waiting for an answer, and the number of these before an answer is too late: ten minutes.
const LOOK: Duration = Duration::from_millis(100);
const LOOKS: u32 = 6_000;
/// Looks for the end of the program once its input has ended: two seconds.
const LAST_LOOKS: u32 = 20;

/// Reason for which an optimizer does not start.
#[derive(Debug, thiserror::Error)]
pub enum OptimizerError {
    /// The scenario does not run without a sequence.
    #[error(transparent)]
    Nominal(#[from] SearchError),
    /// The program cannot be executed.
    #[error(
        "optimizer {program}: {error}; name a program that can be executed, such as a script that begins with `#!`"
    )]
    Unexecutable {
        /// Path of the program.
        program: String,
        /// Error of the host.
        error: std::io::Error,
    },
    /// It did not take the first line.
    #[error("{0}")]
    Begin(String),
}

/// Fault of a program, for which the search ends.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum Fault {
    #[error("its output ended before the search did{}", exit(*.0))]
    Ended(Option<i32>),
    #[error("none within ten minutes")]
    Late,
    #[error("before its request was read")]
    Early,
    #[error("more than {MAX_LINE} bytes in a line")]
    Long,
    #[error("{0}")]
    Unreadable(String),
    #[error("{got} sequences; 1 to {most} were asked for")]
    Count { most: usize, got: usize },
    #[error("sequence {sequence}: {reason}")]
    Unfit { sequence: usize, reason: Unfit },
    #[error("stopped")]
    Stopped,
}

fn exit(code: Option<i32>) -> String {
    code.map_or_else(String::new, |code| format!(", with exit code {code}"))
}

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

/// A round: the results of the last round, and the most sequences of the next; 0 when no round follows.
#[derive(Serialize)]
struct Round<'a> {
    most: usize,
    results: &'a [SequenceResult],
}

/// The result of a sequence.
#[derive(Serialize)]
struct SequenceResult {
    class: Outcome,
    finding: bool,
    new: bool,
    approaches: Approaches,
}

/// Answer of the program: the sequences of a round.
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

/// A line, or the reason why there is none.
type Line = Result<Vec<u8>, Fault>;

/// A running optimizer.
pub struct Optimizer<'a> {
    name: String,
    space: &'a AttackSpace,
    stop: &'a Stop,
    child: Child,
    /// Lines for its stdin; none once that is closed. A thread writes them, since a program that does not read must not block the search.
    requests: Option<SyncSender<Vec<u8>>>,
    /// Lines of its stdout.
    answers: Receiver<Line>,
    /// Answers asked for so far.
    rounds: u64,
    results: Vec<SequenceResult>,
}

impl<'a> Optimizer<'a> {
    /// Starts the program for a search with `config`.
    ///
    /// # Errors
    /// The program does not start, or does not take the first line.
    pub fn start(
        program: &Path,
        config: &'a SearchConfig,
        run: RunConfig,
        stop: &'a Stop,
    ) -> Result<Self, OptimizerError> {
        let nominal = config.try_sequence(&AttackSequence::default())?;
        let unexecutable = |error| OptimizerError::Unexecutable { program: program.display().to_string(), error };
        // A name without a folder is a file in the current directory, not a program of PATH.
        let mut command = Command::new(std::path::absolute(program).map_err(unexecutable)?);
        // Ctrl-C ends the search, not the program: that ends with its input, or with its group.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).process_group(0);
        let mut child = command.spawn().map_err(unexecutable)?;
        let (requests, answers) = connected(child.stdin.take(), child.stdout.take());
        let (name, space, requests) = (program_name(program), &config.space, Some(requests));
        let mut optimizer = Self { name, space, stop, child, requests, answers, rounds: 0, results: Vec::new() };
        optimizer.begin(run, &nominal.approaches).map_err(|fault| OptimizerError::Begin(optimizer.describe(&fault)))?;
        Ok(optimizer)
    }

    fn begin(&mut self, run: RunConfig, approaches: &Approaches) -> Result<(), Fault> {
        let space = self.space;
        let (first, last) = space.begins();
        let last_of = |action: &scenario::Move| action.ranges().map(Range::last).collect();
        let line = Begin {
            schema_version: 1,
            space: space.name.as_str(),
            seed: run.seed,
            budget: run.budget,
            longest: space.longest.unsigned(),
            begins: [first, last],
            tick_ms: space.tick_ms.unsigned(),
            moves: space
                .moves
                .iter()
                .map(|action| Move { name: action.name.as_str(), last: last_of(action) })
                .collect(),
            approaches,
        };
        self.send(&line)
    }

    /// Sends a line. A line that came out before it is no answer to it.
    fn send(&mut self, line: &impl Serialize) -> Result<(), Fault> {
        let mut line = encoded(line)?;
        if self.answers.try_recv().is_ok() {
            return Err(Fault::Early);
        }
        for _ in 0..LOOKS {
            match self.requests.as_ref().map(|requests| requests.try_send(line)) {
                Some(Err(TrySendError::Full(unsent))) => line = unsent,
                // A program that reads no more is reported when its answer is missing.
                Some(Ok(()) | Err(TrySendError::Disconnected(_))) | None => return Ok(()),
            }
            if self.look()?.is_some() {
                return Err(Fault::Early);
            }
        }
        Err(Fault::Late)
    }

    /// The next line of its output.
    fn answer(&mut self) -> Line {
        for _ in 0..LOOKS {
            if let Some(line) = self.look()? {
                return Ok(line);
            }
        }
        Err(Fault::Late)
    }

    /// A line of its output, if one comes until the next look.
    fn look(&mut self) -> Result<Option<Vec<u8>>, Fault> {
        match self.answers.recv_timeout(LOOK) {
            Ok(line) => line.map(Some),
            Err(RecvTimeoutError::Timeout) if self.stop.is_requested() => Err(Fault::Stopped),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(self.ended()),
        }
    }

    /// Ends the program, if its output has ended and the program has not; one that was ending has its own code.
    fn ended(&mut self) -> Fault {
        Fault::Ended(end(&mut self.child))
    }

    fn round(&mut self, most: usize) -> Result<Vec<AttackSequence>, Fault> {
        let results = std::mem::take(&mut self.results);
        self.send(&Round { most, results: &results })?;
        let line = self.answer()?;
        let answer: Answer = serde_json::from_slice(&line).map_err(|error| Fault::Unreadable(error.to_string()))?;
        let got = answer.sequences.len();
        if got == 0 || got > most {
            return Err(Fault::Count { most, got });
        }
        let sequence = |(sequence, actions): (usize, Vec<Proposed>)| {
            let action =
                |proposed: Proposed| Action { begins: proposed.begins, kind: proposed.r#move, places: proposed.places };
            AttackSequence::checked(self.space, actions.into_iter().map(action).collect())
                .map_err(|reason| Fault::Unfit { sequence, reason })
        };
        answer.sequences.into_iter().enumerate().map(sequence).collect()
    }

    fn describe(&self, fault: &Fault) -> String {
        format!("optimizer {}, answer {}: {}", self.name, self.rounds, on_one_line(&fault.to_string()))
    }
}

/// An object as a line.
fn encoded(object: &impl Serialize) -> Line {
    let mut line = serde_json::to_vec(object).map_err(|error| Fault::Unreadable(error.to_string()))?;
    line.push(b'\n');
    Ok(line)
}

/// Threads between a program and two channels.
fn connected(stdin: Option<ChildStdin>, stdout: Option<ChildStdout>) -> (SyncSender<Vec<u8>>, Receiver<Line>) {
    let (requests, to_write) = sync_channel::<Vec<u8>>(MAX_REQUESTS);
    let (answered, answers) = sync_channel(1);
    if let (Some(mut stdin), Some(stdout)) = (stdin, stdout) {
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
    (requests, answers)
}

/// Ends a program with its process group; gives its exit code if it had ended already. A program that cannot be ended is not waited for.
fn end(child: &mut Child) -> Option<i32> {
    let group = i32::try_from(child.id()).map(Pid::from_raw).ok()?;
    let killed = killpg(group, Signal::SIGKILL).is_ok();
    let status = if killed { child.wait().ok() } else { child.try_wait().ok().flatten() };
    status?.code()
}

impl Proposer for Optimizer<'_> {
    fn propose(&mut self, most: usize) -> Result<Vec<AttackSequence>, SearchError> {
        self.rounds += 1;
        self.round(most).map_err(|fault| SearchError::Proposer { reason: self.describe(&fault) })
    }

    fn take(&mut self, Lore { counted, new, .. }: Lore<'_>) {
        let (class, finding, approaches) = (counted.outcome, counted.cause.is_some(), counted.approaches.clone());
        self.results.push(SequenceResult { class, finding, new, approaches });
    }
}

impl Drop for Optimizer<'_> {
    fn drop(&mut self) {
        let results = std::mem::take(&mut self.results);
        // The last results are optional: a program that does not take them is not waited for.
        if let (Some(requests), Ok(line)) = (self.requests.take(), encoded(&Round { most: 0, results: &results })) {
            let _sent = requests.try_send(line);
        }
        // The program has a moment to end by itself.
        let ended =
            |optimizer: &Self| matches!(optimizer.answers.recv_timeout(LOOK), Err(RecvTimeoutError::Disconnected));
        let _in_time = (0..LAST_LOOKS).any(|_| ended(self));
        let _code = end(&mut self.child);
    }
}

/// Name of the program in a result.
pub fn program_name(program: &Path) -> String {
    program.file_name().unwrap_or(program.as_os_str()).to_string_lossy().into_owned()
}

/// A line without its end; none where the output has ended.
fn read_line(from: &mut impl BufRead) -> Option<Line> {
    let mut line = Vec::new();
    match from.take(MAX_LINE + 1).read_until(b'\n', &mut line) {
        Err(error) => Some(Err(Fault::Unreadable(error.to_string()))),
        Ok(0) => None,
        Ok(_) if line.len() as u64 > MAX_LINE => Some(Err(Fault::Long)),
        Ok(_) => Some(Ok(line)),
    }
}
