//! The process around the core: reads its specification, makes the [`Gateway`], and lets `link` drive it.

use std::process::ExitCode;

use config::setup::Setup;
use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};

use crate::{Gateway, GatewayConfig};

/// Contents of [`ServiceSpec::config`] for a gateway.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// The gateway's own configuration.
    pub config: GatewayConfig,
}

/// Runs the service until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("gateway", &why.to_string()),
    }
}

fn make() -> Result<(ServiceSpec, Gateway), Box<dyn std::error::Error>> {
    let spec = link::confined::from_stdin("gateway")?;
    let ProcessConfig { setup, config } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    let core = Gateway::new(setup, config, spec.started())?;
    Ok((spec, core))
}
