//! The recorder: receives audit frames, writes the recording, and says how far it is sealed.

use std::process::ExitCode;

use link::spec::ServiceSpec;
use wire::audit::Recorder;
use wire::core::Topic;
use wire::setup::{NoChannel, Setup};

fn main() -> ExitCode {
    match recorder() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => {
            eprintln!("holdsafe-recorder: {why}");
            ExitCode::from(2)
        }
    }
}

fn recorder() -> Result<(ServiceSpec, Recorder), Box<dyn std::error::Error>> {
    let spec = ServiceSpec::from_stdin()?;
    let setup: Setup = spec.config()?;
    let seals = setup.channels.iter().find(|c| c.topic == Topic::Seals).ok_or(NoChannel(Topic::Seals))?;
    let core = Recorder::new(setup.boot, setup.key(), seals.key.clone(), spec.started());
    Ok((spec, core))
}
