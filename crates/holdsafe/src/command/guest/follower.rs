//! The built-in guest as a service of this program: `runner::guest_options` names it, `confine` starts it inside a guest's confinement.

use std::io::{stdin, stdout};

use guest_client::follower::Follower;
use guest_client::{Failure, serve};
use runner::failure::Exit;

/// Answers the protocol on standard input and output until the input ends.
pub(crate) fn main() -> Exit {
    let Err(failure) = serve(Follower::default, stdin().lock(), stdout().lock()) else { return Exit::Fine };
    link::note!("follower: {failure}");
    match failure {
        Failure::Request { .. } => Exit::Usage,
        Failure::Own(_) | Failure::Stream(_) => Exit::Internal,
    }
}
