//! The process around the core: reads its specification, makes the role that it names, and lets `link` drive it.

use std::process::ExitCode;

use config::setup::Setup;
use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};

use crate::{Adversary, AdversaryConfig};

/// Contents of [`ServiceSpec::config`] for an adversary.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// Role and plan.
    pub config: AdversaryConfig,
}

/// Runs the adversary until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("adversary", &why.to_string()),
    }
}

fn make() -> Result<(ServiceSpec, Adversary), Box<dyn std::error::Error>> {
    let spec = link::confined::from_stdin("adversary")?;
    let ProcessConfig { setup, config } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    let core = Adversary::new(setup, config, spec.started())?;
    Ok((spec, core))
}
