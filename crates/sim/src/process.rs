//! The process around the core: reads its specification, makes the [`Sim`], and lets `link` drive it.

use std::process::ExitCode;

use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};
use wire::sign::Key;

use crate::{ChannelKeys, Sim, SimConfig};

/// Configuration that a launcher puts into [`ServiceSpec::config`] for a sim.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The sim, as in the twin. The boot is taken from the specification, because a restart raises it.
    pub sim: SimConfig,
    /// Keys of its channels.
    pub keys: ChannelKeys,
    /// Secret key that signs its journal.
    pub journal: [u8; 32],
}

/// Runs the service until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("sim", &why.to_string()),
    }
}

fn make() -> Result<(ServiceSpec, Sim), Box<dyn std::error::Error>> {
    let spec = link::confined::from_stdin("sim")?;
    let config: ProcessConfig = serde_json::from_value(spec.config.clone())?;
    let sim = SimConfig { boot: spec.boot, ..config.sim };
    let core = Sim::new(&sim, config.keys, Some(Key::from_bytes(&config.journal)), spec.started())?;
    Ok((spec, core))
}
