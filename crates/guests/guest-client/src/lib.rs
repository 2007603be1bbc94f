//! Guests of holdsafe in Rust: the loop that answers each line of the protocols `jsonl/1` and `jsonl/2` with one line.
//!
//! A guest implements [`Guest`] and ends its `main` with [`run`]. Standard output belongs to the protocol: notes go to standard error.
//! The messages are left to [`messages`]; [`follower`] is a whole guest. Needs serde and serde_json alone, so that a guest can take the
//! crate without holdsafe.

pub mod follower;
pub mod messages;

use std::error::Error;
use std::fmt;
use std::io::{self, BufRead, Read, Write};
use std::process::ExitCode;

pub use messages::{Disc, Fix, Nearby, Odometry, PROTOCOLS, Position, Reply, Start, Step, Track, Velocity};

use messages::{Request, Response};

/// Longest line in either direction, bytes, its end included.
pub const MAX_LINE: usize = 64 * 1024;

/// Error of a guest's own code.
pub type Own = Box<dyn Error + Send + Sync>;

/// An autonomy program: given the mission once, then asked for a set-point each step.
pub trait Guest {
    /// Takes the mission within `start_ms` of the guest's file.
    ///
    /// # Errors
    /// The guest cannot drive the mission; the process ends.
    fn start(&mut self, start: Start) -> Result<(), Own>;

    /// Set-point of a step, within `step_ms` of the guest's file.
    ///
    /// # Errors
    /// The guest cannot go on; the process ends.
    fn step(&mut self, step: Step) -> Result<Reply, Own>;
}

/// Reason for which [`serve`] ended before its input.
#[derive(Debug)]
pub enum Failure {
    /// A request that is no line of the protocol.
    Request {
        /// Number of the line, from 1.
        line: usize,
        /// Expected and received value, in words.
        why: String,
    },
    /// The guest's own error, or a value of a reply out of its range.
    Own(Own),
    /// The input or output is gone.
    Stream(io::Error),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Request { line, why } => write!(f, "line {line}: {why}"),
            Failure::Own(why) => write!(f, "the guest's own error: {why}"),
            Failure::Stream(why) => write!(f, "standard input or output: {why}"),
        }
    }
}

impl Error for Failure {}

/// Answers each line of `requests` with a line to `answers`, with a guest from `make` for each start, until the input ends.
///
/// # Errors
/// The first failure.
pub fn serve<G: Guest>(
    mut make: impl FnMut() -> G,
    mut requests: impl BufRead,
    mut answers: impl Write,
) -> Result<(), Failure> {
    let mut guest: Option<G> = None;
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        // One byte more than a line may have, so that a longer one is noticed.
        let most = MAX_LINE as u64 + 1;
        let read = requests.by_ref().take(most).read_until(b'\n', &mut line).map_err(Failure::Stream)?;
        if read == 0 {
            break;
        }
        let request = request(&line).map_err(|why| Failure::Request { line: number, why })?;
        let response = match (request, &mut guest) {
            (Request::Start(start), _) => {
                guest.insert(make()).start(start).map_err(Failure::Own)?;
                Response::Ready {}
            }
            (Request::Step(step), Some(guest)) => {
                let number = step.number;
                let reply = guest.step(step).map_err(Failure::Own)?;
                reply.check().map_err(|reason| Failure::Own(reason.into()))?;
                Response::Reply { number, reply: reply.into() }
            }
            (Request::Step(_), None) => {
                return Err(Failure::Request { line: number, why: "`start` expected, got `step`".into() });
            }
        };
        let mut answer = serde_json::to_vec(&response).map_err(|error| Failure::Own(error.into()))?;
        answer.push(b'\n');
        answers.write_all(&answer).and_then(|()| answers.flush()).map_err(Failure::Stream)?;
    }
    Ok(())
}

fn request(line: &[u8]) -> Result<Request, String> {
    if line.len() > MAX_LINE {
        return Err(format!("at most {MAX_LINE} bytes expected, got more"));
    }
    let request = serde_json::from_slice(line).map_err(|error| error.to_string())?;
    match &request {
        Request::Start(start) if !PROTOCOLS.contains(&start.protocol.as_str()) => {
            let got: String = start.protocol.chars().take(40).collect();
            Err(format!("protocol {} expected, got {got}", PROTOCOLS.join(" or ")))
        }
        Request::Start(_) | Request::Step(_) => Ok(request),
    }
}

/// Serves standard input and output, and returns the status to end `main` with: 0 at the end of the input, 1 after the
/// guest's own error, 2 after a request that is no line of the protocol. In the last two cases a line on standard error
/// has the reason.
pub fn run<G: Guest>(make: impl FnMut() -> G) -> ExitCode {
    let failure = match serve(make, io::stdin().lock(), io::stdout().lock()) {
        Ok(()) => return ExitCode::SUCCESS,
        Err(failure) => failure,
    };
    // The process ends either way.
    let _ = writeln!(io::stderr(), "guest-client: {failure}");
    match failure {
        Failure::Request { .. } => ExitCode::from(2),
        Failure::Own(_) | Failure::Stream(_) => ExitCode::FAILURE,
    }
}
