//! `--scenario NAME.toml`: the file that a scenario out of a recording is written to. Its text is made by the process that parses.

use std::fs::{self, OpenOptions};
use std::path::Path;
use std::process::Stdio;

use runner::failure::{Exit, Failure};
use runner::{Context, out};
use scenario::{Name, Platform};
use sim::sensor::localisation::SIGMA_MM;

use super::confined::Scene;

/// The scenario that this file is to have, on this platform.
pub(super) fn requested_scene(context: &Context, file: &Path, platform: &Platform) -> Result<Scene, Failure> {
    let wrong = |reason: &str| Failure::new(Exit::Usage, format!("{}: {reason}", file.display()));
    let stem = file.file_stem().filter(|_| file.extension().is_some_and(|end| end == "toml"));
    let stem = stem.and_then(|stem| stem.to_str()).ok_or_else(|| wrong("a scenario's file is NAME.toml"))?;
    let name = Name::new(stem).map_err(wrong)?.as_str().to_owned();
    // A scenario names its platform, which is then looked for among those below the root.
    let known = context.root()?.join("platforms").join(format!("{}.toml", platform.name.as_str()));
    if !known.is_file() {
        return Err(wrong(&format!("a scenario names its platform: copy its file to {}", known.display())));
    }
    let least_speed_m_s = platform.fixed_wing.as_ref().map_or(0.0, |wing| wing.min_speed_m_s.get());
    Ok(Scene { name, least_speed_m_s, twin_sigma_m: f64::from(SIGMA_MM) / 1000.0 })
}

/// Has a new file written; without a good end nothing is left of it.
pub(super) fn write(file: &Path, make: impl FnOnce(Stdio) -> Result<Exit, Failure>) -> Result<Exit, Failure> {
    let created = OpenOptions::new().write(true).create_new(true).open(file).map_err(|error| {
        Failure::new(Exit::Usage, format!("{}: {error}; choose another name or remove the file", file.display()))
    })?;
    let made = make(Stdio::from(created));
    match &made {
        Ok(Exit::Fine) => out::say(format_args!("{}", file.display())),
        Ok(_) | Err(_) => fs::remove_file(file)?,
    }
    made
}
