//! The recorder's process: receives audit frames, writes the recording, and publishes seals over it.

use std::process::ExitCode;

use config::setup::{Channel, NoChannel};
use ground_truth::Any;
use nix::sys::signal::{SigSet, Signal};
use serde::Deserialize;
use wire::audit::Recorder;
use wire::core::Topic;
use wire::id::Boot;
use wire::sign::Key;
use wire::sign::Secret;

use crate::spec::ServiceSpec;

/// Parts of a `config::setup::Setup` that the recorder needs; policy and bounds are left out.
#[derive(Deserialize)]
struct RecorderSetup {
    boot: Boot,
    secret: Secret,
    channels: Vec<Channel>,
}

/// Runs the recorder until its launcher ends it.
pub fn main() -> ExitCode {
    // Before any thread starts: a thread inherits the signal mask of its creator.
    survive_limits();
    match recorder() {
        Ok((spec, core)) => crate::drive::run(spec, Box::new(core)),
        Err(error) => crate::drive::refuse("recorder", &error.to_string()),
    }
}

/// Blocks the signal of a write beyond a limit on the size of files: the write fails like any other, and the process lives on.
fn survive_limits() {
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGXFSZ);
    if let Err(error) = signals.thread_block() {
        tracing::warn!(%error, "a file that grows beyond a limit ends the recorder");
    }
}

fn recorder() -> Result<(ServiceSpec, Recorder<Any>), Box<dyn std::error::Error>> {
    let spec = crate::confined::from_stdin("recorder")?;
    let setup: RecorderSetup = spec.config()?;
    let seals = setup.channels.iter().find(|c| c.topic == Topic::Seals).ok_or(NoChannel(Topic::Seals))?;
    let key = Key::from_bytes(&setup.secret.0);
    let core = Recorder::new(setup.boot, key, seals.key.clone(), spec.started());
    Ok((spec, core))
}
