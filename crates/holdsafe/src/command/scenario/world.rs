//! `holdsafe scenario world FAMILY --seed N`: a drawn scene, as a scene file. Families and their ranges are in `scenario::world`.

use evidence::SCHEMA_VERSION;
use runner::failure::{Exit, Failure};
use runner::{Context, out, plan};
use scenario::world::{self, Body, Family};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Family to draw from.
    #[arg(value_name = "FAMILY", value_parser = Family::ALL.map(Family::name))]
    family: String,
    /// Platform with a body that the world has room for.
    #[arg(long, value_name = "PLATFORM", default_value = "ground")]
    platform: String,
}

/// A drawn world.
#[derive(Serialize)]
struct Drawn {
    schema_version: u32,
    family: &'static str,
    seed: u64,
    held_out: bool,
    scene: scenario::Scene,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let family = Family::from_name(&args.family).expect("invariant: the parser takes the names of families alone");
    let platform = scenario::load_platform(&plan::platform_of(context, &args.platform)?.file)?;
    family
        .check_for(&platform)
        .map_err(|e| Failure::new(Exit::Usage, format!("{e}; name another family or --platform")))?;
    let scene = world::draw(family, context.seed, &Body::from_platform(&platform))
        .map_err(|unfair| Failure::new(Exit::Usage, format!("{unfair}; name another seed or a smaller platform")))?;
    let (schema_version, seed, held_out) = (SCHEMA_VERSION, context.seed, family.is_held_out());
    if context.json {
        let family = family.name();
        out::print_json("scenario-world", &Drawn { schema_version, family, seed, held_out, scene })?;
    } else {
        let platform = platform.name.as_str();
        out::say(format_args!("# World `{}` of seed {seed}, with room for `{platform}`.", family.name()));
        out::say(format_args!("{}", world::print(&scene).trim_end()));
    }
    Ok(Exit::Fine)
}
