//! A guest in a live run: its *attendant* is a separate process, on the real clock.
//!
//! The process of the unit's autonomy starts the attendant before it is confined, and has a socket to it and no other right over it. The
//! attendant starts the guest's program, which a confined service could not, and forwards requests and answers. It ends with its socket,
//! and the guest with it. The meaning of requests and answers is left to the crate `guest`.

use std::error::Error;
use std::io::{self, Read};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;
use std::time::Duration;

use guest::{Failure, Guest, Program, Session};
use link::drive::Attendant;
use link::framed;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use wire::codec;
use wire::guest::{Fault, MAX_ANSWER, MAX_REQUEST};

/// Name of the attendant among the services.
pub(super) const ATTENDANT: &str = "attendant";

/// Longest guest that is carried, bytes: its file has at most 64 words and 64 values of 4 KiB, and escapes make six bytes of one.
const MAX_CARRIED: usize = 4 << 20;

/// Time limit for the attendant to end its guest.
const ENDING: Duration = Duration::from_secs(10);

/// A guest as the specification of a process carries it.
#[derive(Debug, Serialize, Deserialize)]
struct Carried {
    program: Program,
    folder: PathBuf,
    /// The run's own folder, which has the true events and so is hidden from the guest.
    hidden: PathBuf,
}

/// The guest in the specification of the unit's autonomy.
pub(super) fn carry(guest: &Guest, run: &Path) -> Value {
    let program = Program::clone(&guest.program);
    let hidden = std::path::absolute(run).unwrap_or_else(|_| run.to_owned());
    serde_json::json!(Carried { folder: program.folder.clone(), program, hidden })
}

/// Starts the attendant of a guest that was carried here. Call it before the calling process is confined.
pub(super) fn attend(carried: Value) -> Result<Attendant, Box<dyn Error>> {
    let (near, far) = UnixStream::pair()?;
    // A separate process group: an interrupt from the keyboard ends the run through the launcher.
    Command::new(std::env::current_exe()?)
        .args(["service", ATTENDANT])
        .stdin(OwnedFd::from(far))
        .stdout(Stdio::null())
        .process_group(0)
        .spawn()?;
    let mut attendant = Socket(near);
    framed::write(&mut attendant.0, &serde_json::to_vec(&carried)?)?;
    Ok(Box::new(move |request| {
        let answer = framed::write(&mut attendant.0, request).and_then(|()| framed::read(&mut attendant.0, MAX_ANSWER));
        let reason = match answer {
            Ok(Some(answer)) => return answer,
            Ok(None) => "the attendant of the guest has ended".to_owned(),
            Err(error) => format!("the attendant of the guest: {error}"),
        };
        codec::encode(&Failure::new(Fault::Unavailable, reason).answer())
    }))
}

/// The end of a socket to an attendant.
struct Socket(UnixStream);

impl Drop for Socket {
    /// Returns when the attendant has ended, and the guest with it, or after [`ENDING`].
    fn drop(&mut self) {
        let closed = self.0.shutdown(std::net::Shutdown::Write).and_then(|()| self.0.set_read_timeout(Some(ENDING)));
        if closed.is_ok() {
            let _ended = self.0.read(&mut [0]);
        }
    }
}

/// The attendant's process: reads its guest from the socket that is its standard input, then answers each request there.
pub(super) fn main() -> ExitCode {
    match serve() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => link::drive::refuse(ATTENDANT, &error.to_string()),
    }
}

fn serve() -> Result<(), Box<dyn Error>> {
    let mut socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    let Some(carried) = framed::read(&mut socket, MAX_CARRIED)? else { return Ok(()) };
    let Carried { program, folder, hidden } = serde_json::from_slice(&carried)?;
    let helper = std::env::current_exe()?;
    let (arguments, _) = confine::best(&helper, &confine::as_service())?;
    let launcher = confine::launcher(helper, arguments, Some(hidden));
    let mut session = Session::new(Arc::new(Program { folder, ..program }), launcher);
    while let Some(request) = framed::read(&mut socket, MAX_REQUEST)? {
        framed::write(&mut socket, &session.answer(&request))?;
    }
    Ok(())
}
