//! `holdsafe assess FILE --map MAP`: the platform's guards over a recording of another vehicle, in the open loop; `--guess` prints a first map,
//! `--scenario NAME.toml` writes a scenario that drives its route in the closed loop.
//!
//! A recording comes from strangers, so a process without a right to any file, network or program parses it ([`confined`]).
//! This one opens the files and hands them over.

pub(super) mod confined;
mod files;
mod scene;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use assess::Terms;
use assess::map::MAX_MAP;
use runner::Context;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};

use confined::Request;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording: PX4 ULog, MCAP with JSON or ROS 2's CDR, or MAVLink's .tlog, be it packed by zstd; or a bag's folder; or the files of a split bag in
    /// order.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// The map: which field of the recording is which input, and in which unit.
    #[arg(long, value_name = "MAP", required_unless_present = "guess", conflicts_with = "guess")]
    map: Option<PathBuf>,
    /// A platform file with the bounds and limits that the guards take [default: that of `ground`].
    #[arg(long, value_name = "FILE", conflicts_with = "guess")]
    platform: Option<PathBuf>,
    /// Print a first map, made from the names of the recording's topics.
    #[arg(long)]
    guess: bool,
    /// Write a scenario with the recording's route, speed and noise, to continue in the closed loop.
    #[arg(long, value_name = "NAME.toml", conflicts_with = "guess")]
    scenario: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let recording = files::read(&args.files)?;
    let judged = match &args.map {
        None => None,
        Some(map) => {
            let platform = match &args.platform {
                Some(file) => file.clone(),
                None => context.root()?.join("platforms/ground.toml"),
            };
            let text = read_text(map)?;
            let platform = scenario::load_platform(&platform)?;
            let terms = Terms { bounds: platform.bounds.to_bounds(), limits: platform.limits() };
            let map = (map.display().to_string(), text);
            let scene =
                args.scenario.as_deref().map(|file| scene::requested_scene(context, file, &platform)).transpose()?;
            Some(confined::Judged { map, platform: platform.name.as_str().to_owned(), terms, scene })
        }
    };
    let file = args.files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(" ");
    let files = recording.iter().map(|(name, bytes)| (name.clone(), bytes.len() as u64)).collect();
    // With a scenario the output is its file, where a failure as JSON would be lost.
    let json = context.json && args.scenario.is_none();
    let request = Request { file, judged, seed: context.seed, json, files };
    match &args.scenario {
        Some(file) => scene::write(file, |to| confine(context, &request, &recording, to)),
        None => confine(context, &request, &recording, Stdio::inherit()),
    }
    .inspect(|exit| close(context, args, *exit))
}

/// The last lines: the files read or written, and its route in the closed loop. A first map has none, it is a file.
fn close(context: &Context, args: &Args, exit: Exit) {
    let Some(map) = &args.map else { return };
    let map = map.to_string_lossy();
    let files: Vec<_> = args.files.iter().map(|file| file.to_string_lossy()).collect();
    let platform = args.platform.as_ref().map(|file| file.to_string_lossy().into_owned());
    let assess = |more: &[&str]| {
        let mut words = vec!["assess"];
        words.extend(files.iter().map(AsRef::as_ref).chain(more.iter().copied()));
        words.extend(platform.iter().flat_map(|file| ["--platform", file.as_str()]));
        context.command(words)
    };
    let (text, next) = match (&args.scenario, exit) {
        (Some(file), Exit::Fine) => {
            let file = file.to_string_lossy();
            let next = [context.command(["scenario", "check", &file]), context.command(["run", &file])];
            ("a scenario of its route is written", next)
        }
        (None, Exit::Fine) => {
            let scene = assess(&["--map", &map, "--scenario", "driven.toml"]);
            ("judged in the open loop", [scene, assess(&["--map", &map, "--json"])])
        }
        (None, Exit::NoEvidence) => ("nothing was judged", [assess(&["--guess"]), assess(&["--map", &map, "--json"])]),
        // A recording or a map that cannot be used has its reason on stderr.
        (_, _) => return,
    };
    Closing::new(context).part(text).print(next);
}

/// Starts this program again as the one that parses, which writes the result to `to`; gives its exit code.
fn confine(context: &Context, request: &Request, recording: &[files::Named], to: Stdio) -> Result<Exit, Failure> {
    let program = std::env::current_exe().map_err(Failure::internal)?;
    let mut line = serde_json::to_vec(request).map_err(Failure::internal)?;
    line.push(b'\n');
    let mut command = Command::new(program);
    let screen = ["NO_COLOR", "TERM", "COLUMNS"].map(|name| std::env::var_os(name).map(|value| (name, value)));
    command
        .args(["service", confined::NAME])
        .env_clear()
        .envs(screen.into_iter().flatten())
        .stdin(Stdio::piped())
        .stdout(to);
    let mut child = command.spawn().map_err(Failure::internal)?;
    if let Some(mut pipe) = child.stdin.take() {
        // A parser that ends before it has read everything breaks the pipe: its status has the reason.
        let _unread =
            pipe.write_all(&line).and_then(|()| recording.iter().try_for_each(|(_, bytes)| pipe.write_all(bytes)));
    }
    let status = child.wait().map_err(Failure::internal)?;
    if context.stop.is_requested() {
        return Err(Failure::new(Exit::Interrupted, "interrupted"));
    }
    status.code().and_then(|code| Exit::from_code(u8::try_from(code).ok()?)).ok_or_else(|| {
        let ended = format!("{}: it ended the process that parses it ({status}); please report it", request.file);
        Failure::new(Exit::Usage, ended)
    })
}

fn read_text(file: &Path) -> Result<String, Failure> {
    String::from_utf8(read(file, MAX_MAP)?).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        Failure::new(Exit::Usage, format!("{}: no text from byte {valid} on", file.display()))
    })
}

fn read(file: &Path, most: u64) -> Result<Vec<u8>, Failure> {
    link::files::read(file, most).map_err(|error| Failure::new(Exit::Usage, format!("{}: {error}", file.display())))
}
