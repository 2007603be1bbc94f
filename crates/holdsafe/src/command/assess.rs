//! `holdsafe assess FILE --map MAP`: the platform's guards over a recording of another vehicle, in the open loop; `--guess` prints a first map.

use std::path::{Path, PathBuf};

use assess::log::{Log, MAX_LOG};
use assess::map::{MAX_MAP, Map};
use assess::{TrackError, guess};
use results::report::{AssessObject, Assessed, assess_table};
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use sha2::{Digest, Sha256};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording: PX4 ULog, or MCAP with JSON or ROS 2's CDR.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The map: which field of the recording is which input, and in which unit.
    #[arg(long, value_name = "MAP", required_unless_present = "guess", conflicts_with = "guess")]
    map: Option<PathBuf>,
    /// A platform file whose bounds the guards take [default: that of `ground`].
    #[arg(long, value_name = "FILE", conflicts_with = "guess")]
    platform: Option<PathBuf>,
    /// Print a first map, made from the names of the recording's topics.
    #[arg(long)]
    guess: bool,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let name = args.file.display().to_string();
    let unusable = |why: &dyn std::fmt::Display| Failure::new(Exit::Usage, format!("{name}: {why}"));
    let bytes = read(&args.file, MAX_LOG)?;
    let log = Log::open(&bytes).map_err(|why| unusable(&why))?;
    let Some(map) = &args.map else {
        let text = guess(&log).map_err(|why| unusable(&why))?;
        out::say(format_args!("{}", text.trim_end()));
        return Ok(Exit::Fine);
    };
    let map = read_map(map)?;
    let platform = match &args.platform {
        Some(file) => file.clone(),
        None => context.root()?.join("platforms/ground.toml"),
    };
    let platform = scenario::load_platform(&platform)?;
    let bounds = platform.bounds.to_bounds();
    let result = assess::assess(&log, &map, &bounds, context.seed).map_err(|why: TrackError| unusable(&why))?;
    let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let platform = platform.name.as_str().to_owned();
    let of = Assessed { file: name, sha256, log: &log, map: &map, platform, seed: context.seed };
    let object = AssessObject::new(of, &result);
    if context.json {
        out::print_json("assess", &object)?;
    } else {
        out::say(format_args!("{}", assess_table(&object).trim_end()));
    }
    Ok(if object.judged_s > 0.0 { Exit::Fine } else { Exit::NoEvidence })
}

fn read_map(file: &Path) -> Result<Map, Failure> {
    let name = file.display().to_string();
    let text = String::from_utf8(read(file, MAX_MAP)?).map_err(|why| {
        Failure::new(Exit::Usage, format!("{name}: no text from byte {} on", why.utf8_error().valid_up_to()))
    })?;
    Ok(Map::parse(&name, &text)?)
}

fn read(file: &Path, most: u64) -> Result<Vec<u8>, Failure> {
    link::files::read(file, most).map_err(|why| Failure::new(Exit::Usage, format!("{}: {why}", file.display())))
}
