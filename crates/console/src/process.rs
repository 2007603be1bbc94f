//! The process around the core: reads its specification, makes the [`Console`], and lets `link` drive it; with a
//! window, on its own thread, for windows want the main one.

pub mod open;
pub mod player;
pub mod replay;
pub mod window;

use std::process::ExitCode;

use config::setup::Setup;
use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};

use crate::site::Site;
use crate::{Console, ConsoleConfig};

/// Configuration that a launcher puts into [`ServiceSpec::config`] for a console.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// The console's own configuration.
    pub config: ConsoleConfig,
    /// The site that the window draws; absent: no window.
    #[serde(default)]
    pub window: Option<Site>,
}

/// Runs the service until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core, Some(site))) => window::run(spec, core, site),
        Ok((spec, core, None)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("console", &why.to_string()),
    }
}

fn make() -> Result<(ServiceSpec, Console, Option<Site>), Box<dyn std::error::Error>> {
    let spec = link::confined::from_stdin("console")?;
    let ProcessConfig { setup, config, window } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    let core = Console::new(setup, config, spec.started())?;
    Ok((spec, core, window))
}
