//! `holdsafe guest check|compare|board|schema|new`: autonomy programs of others.

mod board;
mod check;
mod compare;
pub(super) mod follower;

use std::io::Write;
use std::path::{Path, PathBuf};

use runner::failure::{Exit, Failure};
use runner::{Context, out};

/// Files of a guest to start from, by name.
type Files = [(&'static str, &'static str); 2];

/// A guest file and a program.
const PLAIN: Files =
    [("guest.toml", include_str!("guest/template.toml")), ("guest.py", include_str!("guest/template.py"))];
/// A guest file for the bridge to ROS 2, and a node.
const ROS2: Files = [("guest.toml", include_str!("guest/ros2.toml")), ("node.py", include_str!("guest/ros2_node.py"))];

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Exercise a guest without a run, and say what it gets wrong.
    Check {
        /// The guest's file.
        #[arg(value_name = "GUEST.TOML")]
        file: PathBuf,
    },
    /// Run guests bare and inside the guards over scenarios, and set the two side by side.
    Compare(compare::Args),
    /// Write, verify, show or run again a leaderboard of guests, whose rows their contributors sign.
    #[command(subcommand)]
    Board(board::Verb),
    /// Print the JSON Schema of guest files and of both directions of the protocol.
    Schema,
    /// Write a guest to start from into a new folder of this name.
    New {
        /// Its name, of a-z, 0-9, - and _.
        name: String,
        /// A ROS 2 node behind the bridge of guests/ros2, in place of a program that speaks the protocol.
        #[arg(long)]
        ros2: bool,
    },
}

pub(super) fn run(context: &Context, verb: &Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::Check { file } => check::run(context, file),
        Verb::Compare(args) => compare::run(context, args),
        Verb::Board(verb) => board::run(context, verb),
        Verb::Schema => {
            let text = serde_json::to_string_pretty(&::guest::jsonl::schema()).map_err(Failure::internal)?;
            out::say(format_args!("{text}"));
            Ok(Exit::Fine)
        }
        Verb::New { name, ros2: false } => new(name, PLAIN, |text| text.to_owned()),
        Verb::New { name, ros2: true } => new_node(context, name),
    }
}

/// A ROS 2 node to start from, which finds the bridge in the clone.
fn new_node(context: &Context, name: &str) -> Result<Exit, Failure> {
    let guests = context.root()?.join("guests");
    let guests = guests.canonicalize().map_err(|e| {
        let message =
            format!("{}: {e}; the bridge to ROS 2 is in a clone of holdsafe: name it by --root", guests.display());
        Failure::new(Exit::Environment, message)
    })?;
    let path = |folder: &str| guests.join(folder).to_string_lossy().into_owned();
    let (ros2, bus) = (path("ros2"), path("bus"));
    let written = new(name, ROS2, |text| text.replace("ROS2", &ros2).replace("BUS", &bus))?;
    if !guests.join("ros2/.venv").exists() {
        link::note!("the bridge has no ROS 2 yet: make -C {ros2} installs it there");
    }
    Ok(written)
}

/// Writes `files` into a new folder, each text as `fill` makes it.
fn new(name: &str, files: Files, fill: impl Fn(&str) -> String) -> Result<Exit, Failure> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '_');
    if !(1..=wire::guest::MAX_NAME).contains(&name.len()) || !name.chars().all(plain) {
        let message = format!("`{name}` is no name of a guest: 1 to {} of a-z, 0-9, - and _", wire::guest::MAX_NAME);
        return Err(Failure::new(Exit::Usage, message));
    }
    let folder = Path::new(name);
    std::fs::create_dir(folder)
        .map_err(|e| Failure::new(Exit::Usage, format!("{name}: {e}; choose another name or remove the folder")))?;
    for (file, text) in files {
        let path = folder.join(file);
        std::fs::File::create_new(&path)?.write_all(fill(text).replace("NAME", name).as_bytes())?;
        out::say(format_args!("{}", path.display()));
    }
    Ok(Exit::Fine)
}
