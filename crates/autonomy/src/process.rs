//! The process around the core: reads its specification, makes the [`Autonomy`], and lets `link` drive it.

use std::error::Error;
use std::process::ExitCode;

use config::setup::Setup;
use link::drive::Attendant;
use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{Autonomy, AutonomyConfig};

/// Contents of [`ServiceSpec::config`] for an autonomy.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// Mission and surroundings.
    pub config: AutonomyConfig,
    /// The guest's program, for the one who can start it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guest: Option<Value>,
}

/// Runs the service until its launcher ends it. It can hold no guest.
pub fn main() -> ExitCode {
    main_with(|_| Err("this program starts no guests".into()))
}

/// Runs the service until its launcher ends it; `attend` starts the guest that the specification carries.
pub fn main_with(attend: impl FnOnce(Value) -> Result<Attendant, Box<dyn Error>>) -> ExitCode {
    match make(attend) {
        Ok((spec, core, attendant)) => link::drive::run_attended(spec, Box::new(core), attendant),
        Err(why) => link::drive::refuse("autonomy", &why.to_string()),
    }
}

type Made = (ServiceSpec, Autonomy, Option<Attendant>);

fn make(attend: impl FnOnce(Value) -> Result<Attendant, Box<dyn Error>>) -> Result<Made, Box<dyn Error>> {
    let spec = ServiceSpec::from_stdin()?;
    let ProcessConfig { setup, config, guest } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    // The guest is a program, and has its own confinement.
    let attendant = guest.map(attend).transpose()?;
    let spec = link::confined::confine(spec, "autonomy")?;
    let core = Autonomy::new(setup, config, spec.started())?;
    Ok((spec, core, attendant))
}
