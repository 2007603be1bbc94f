//! The recorder's process: receives audit frames, writes the recording, and says how far it is sealed.

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

/// Parts of a `config::setup::Setup` that the recorder needs; it has no use for policy or bounds.
#[derive(Deserialize)]
struct Making {
    boot: Boot,
    secret: Secret,
    channels: Vec<Channel>,
}

/// Runs the recorder until its launcher ends it.
pub fn main() -> ExitCode {
    survive_limits();
    match recorder() {
        Ok((spec, core)) => crate::drive::run(spec, Box::new(core)),
        Err(why) => crate::drive::refuse("recorder", &why.to_string()),
    }
}

/// A write beyond a limit on the size of files fails like any other, instead of ending the process by its signal.
fn survive_limits() {
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGXFSZ);
    if let Err(error) = signals.thread_block() {
        tracing::warn!(%error, "a file that grows beyond a limit ends the recorder");
    }
}

fn recorder() -> Result<(ServiceSpec, Recorder<Any>), Box<dyn std::error::Error>> {
    let spec = crate::confined::from_stdin("recorder")?;
    let making: Making = spec.config()?;
    let seals = making.channels.iter().find(|c| c.topic == Topic::Seals).ok_or(NoChannel(Topic::Seals))?;
    let key = Key::from_bytes(&making.secret.0);
    let core = Recorder::new(making.boot, key, seals.key.clone(), spec.started());
    Ok((spec, core))
}
