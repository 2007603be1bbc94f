//! The follower as its own program, to start a guest of your own from: its logic is [`guest_client::follower`].

use std::process::ExitCode;

use guest_client::follower::Follower;
use guest_client::run;

fn main() -> ExitCode {
    run(Follower::default)
}
