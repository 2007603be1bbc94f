//! The process around the core: reads its specification, makes the [`Autonomy`], and lets `link` drive it.

use std::process::ExitCode;

use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};
use wire::setup::Setup;

use crate::{Autonomy, AutonomyConfig};

/// Contents of [`ServiceSpec::config`] for an autonomy.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// Mission and surroundings.
    pub config: AutonomyConfig,
}

/// Runs the service until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("autonomy", &why.to_string()),
    }
}

fn make() -> Result<(ServiceSpec, Autonomy), Box<dyn std::error::Error>> {
    let spec = ServiceSpec::from_stdin()?;
    let ProcessConfig { setup, config } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    let core = Autonomy::new(setup, config, spec.started())?;
    Ok((spec, core))
}
