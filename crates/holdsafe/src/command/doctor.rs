//! `holdsafe doctor`: checks the requirements of a run on this host, one line each with its remedy, and measures the
//! host's scheduling latency.

mod scheduling;

use std::path::Path;

use config::platform::Sensors;
use evidence::SCHEMA_VERSION;
use link::loopback::LoopbackAddr;
use live::child::Services;
use live::leftovers::Leftovers;
use live::{hosts, leftovers};
use nix::sys::resource::{Resource, getrlimit};
use nix::sys::statvfs::statvfs;
use perception::corroborate::CorroborationLimits;
use perception::process::MOST_CPU_US;
use perception::stages::Stages;
use runner::failure::{Exit, Failure};
use runner::{Context, Root, out};
use serde::Serialize;
use wire::id::FrameId;
use wire::sensor::{Camera, Frames};
use wire::time::Instant;

use scheduling::Scheduling;

/// Shared memory that a live run takes at most, bytes.
const SHARED_MEMORY: u64 = 64 * 1024 * 1024;
/// Open files that the launcher and its children need.
const OPEN_FILES: u64 = 512;

#[derive(Serialize)]
struct Need {
    need: &'static str,
    /// None where it was measured and is not judged.
    met: Option<bool>,
    found: String,
    remedy: &'static str,
}

#[derive(Serialize)]
struct Told {
    schema_version: u32,
    ready: bool,
    /// The reason for the directory of the scenarios, where there is one: named, checkout or built-in.
    root: Option<&'static str>,
    needs: Vec<Need>,
    scheduling: Scheduling,
}

pub(super) fn run(context: &Context) -> Result<Exit, Failure> {
    let chosen = context.choose_root();
    let root = chosen.as_ref().ok().map(reason);
    let needs = vec![
        files(chosen),
        shared_memory(),
        leftovers(),
        loopback(),
        open_files(),
        scratch(),
        cores(),
        perception(),
        window(),
        services(),
        guests(),
    ];
    let ready = needs.iter().all(|need| need.met != Some(false));
    let scheduling = scheduling::measure();
    if !context.json {
        for need in &needs {
            let mark = match need.met {
                Some(true) => "ok     ",
                Some(false) => "MISSING",
                None => "-      ",
            };
            out::say(format_args!("{mark} {:22} {}", need.need, need.found));
            if need.met == Some(false) {
                out::say(format_args!("        {}", need.remedy));
            }
        }
        out::say(format_args!("{} {:22} {}", scheduling.mark(), "scheduling delay", scheduling.found()));
        if let Some(advice) = scheduling.advice() {
            out::say(format_args!("        {advice}"));
        }
    }
    if context.json {
        out::print_json("doctor", &Told { schema_version: SCHEMA_VERSION, ready, root, needs, scheduling })?;
    }
    Ok(if ready { Exit::Fine } else { Exit::Environment })
}

/// Requirements of a live run that this host does not meet, each with its remedy.
pub(super) fn lacking_for_live() -> Vec<String> {
    let needs = [shared_memory(), loopback(), open_files(), scratch(), services()];
    needs
        .iter()
        .filter(|need| need.met == Some(false))
        .map(|need| format!("{}: {}; {}", need.need, need.found, need.remedy))
        .collect()
}

fn reason(root: &Root) -> &'static str {
    match root {
        Root::Named(_) => "named",
        Root::Checkout(_) => "checkout",
        Root::BuiltIn(_) => "built-in",
    }
}

fn files(chosen: Result<Root, Failure>) -> Need {
    let listed = chosen.and_then(|root| Ok((scenario::shipped(root.path())?, root)));
    let (met, found) = match listed {
        Ok((files, root)) => {
            let found = format!("{} scenarios in {} ({})", files.len(), root.path().display(), reason(&root));
            (!files.is_empty(), found)
        }
        Err(failure) => (false, failure.to_string()),
    };
    let remedy = "run in a checkout, name one with --root DIR, or leave both to the files that are built in";
    Need { need: "scenarios", met: Some(met), found, remedy }
}

fn shared_memory() -> Need {
    let remedy = "a live run needs /dev/shm: mount a tmpfs there, in a container `--shm-size=64m` or more";
    let (met, found) = match statvfs("/dev/shm") {
        Ok(stat) => {
            let free = stat.blocks_available().saturating_mul(stat.fragment_size());
            let writable = writable(Path::new("/dev/shm"));
            let manner = if writable { "writable" } else { "not writable" };
            (writable && free >= SHARED_MEMORY, format!("{} MiB free, {manner}", free >> 20))
        }
        Err(error) => (false, error.to_string()),
    };
    Need { need: "shared memory", met: Some(met), found, remedy }
}

/// Removes the leftovers of runs that were killed together with their janitors.
fn leftovers() -> Need {
    let remedy = "end what is left of those runs, perhaps stopped, and call the doctor again";
    let (met, found) = match leftovers::remove() {
        Ok(Leftovers { removed, held }) => (held == 0, format!("{removed} killed runs swept, {held} still in use")),
        Err(error) => (false, error.to_string()),
    };
    Need { need: "leftovers of killed runs", met: Some(met), found, remedy }
}

/// Only `run --live --console` needs one, so its absence is reported and is no fault.
fn window() -> Need {
    let found = console::process::open::probe().map_or_else(|error| error.to_string(), |()| "can be opened".into());
    Need { need: "window (run --console)", met: Some(true), found, remedy: "" }
}

/// Live runs are possible on any machine, and on some less confined: the level is reported and is no fault.
fn services() -> Need {
    let level = std::env::current_exe().map_err(|error| error.to_string());
    let level = level.and_then(|program| hosts::level(&Services::Own(program)).map_err(|error| error.to_string()));
    let (met, found) = level.map_or_else(|reason| (false, reason), |level| (true, level.to_string()));
    Need {
        need: "confinement of services",
        met: Some(met),
        found,
        remedy: "`run --live --no-confinement` leaves the services all rights of the user",
    }
}

/// Guests run on any machine, and on some less confined: the level is reported and is no fault.
fn guests() -> Need {
    let level = std::env::current_exe()
        .map_err(|error| error.to_string())
        .and_then(|program| confine::best(&program, &confine::as_service()).map_err(|failure| failure.to_string()));
    let (met, found) = level.map_or_else(|reason| (false, reason), |(_, level)| (true, level.to_string()));
    Need {
        need: "confinement of guests",
        met: Some(met),
        found,
        remedy: "no guest can be started: `holdsafe guest check` needs /proc and pipes",
    }
}

fn loopback() -> Need {
    // Each live run has its own address in 127.0.0.0/8.
    let probed = link::loopback::probe(LoopbackAddr::of_run(std::process::id()));
    let (met, found) = probed.map_or_else(|reason| (false, reason), |()| (true, "up".to_owned()));
    Need {
        need: "loopback interface",
        met: Some(met),
        found,
        remedy: "bring it up with all of 127.0.0.0/8: `ip link set lo up`",
    }
}

fn open_files() -> Need {
    let (met, found) = match getrlimit(Resource::RLIMIT_NOFILE) {
        Ok((soft, _)) => (soft >= OPEN_FILES, format!("{soft} allowed")),
        Err(error) => (false, error.to_string()),
    };
    Need { need: "open files", met: Some(met), found, remedy: "raise the limit: `ulimit -n 1024`" }
}

fn scratch() -> Need {
    let dir = std::env::temp_dir();
    let met = writable(&dir);
    Need {
        need: "scratch directory",
        met: Some(met),
        found: dir.display().to_string(),
        remedy: "set TMPDIR to a writable directory",
    }
}

fn cores() -> Need {
    let n = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    Need {
        need: "processor cores",
        met: Some(true),
        found: n.to_string(),
        remedy: "two or more keep live runs on time",
    }
}

/// CPU time of perception for a frame. A live unit has a frame every 100 ms, and other processes beside it.
fn perception() -> Need {
    let (met, found) = match timed() {
        Ok(us) => {
            let found = format!("{:.1} ms of CPU for a frame, at most {} ms", us as f64 / 1e3, MOST_CPU_US / 1000);
            match cfg!(debug_assertions) {
                true => (None, format!("{found}; not judged in a debug build")),
                false => (Some(us <= MOST_CPU_US), found),
            }
        }
        Err(why) => (Some(false), why),
    };
    let remedy = "live runs are late here: take a faster host; the twin is not affected";
    Need { need: "perception", met, found, remedy }
}

/// CPU time of the shipped stages for a frame, microseconds: the least of three.
fn timed() -> Result<u64, String> {
    let sensors = Sensors::GROUND;
    let stages = Stages::shipped(&sensors).map_err(|error| error.to_string())?;
    let Camera { width, height, .. } = sensors.camera;
    let pixels = usize::from(width) * usize::from(height);
    let ranges = usize::from(sensors.lidar.rings) * usize::from(sensors.lidar.azimuths);
    let [rgb, image, lidar] = [3 * pixels, 2 * pixels, 2 * ranges].map(|bytes| vec![0; bytes]);
    let frames = Frames {
        frame: FrameId(1),
        stamp: Instant(0),
        width,
        height,
        rgb: Some(rgb.as_slice().into()),
        depth: Some(image.as_slice().into()),
        thermal: Some(image.as_slice().into()),
        lidar: Some(lidar.as_slice().into()),
    };
    let mut least = u64::MAX;
    for _ in 0..3 {
        let from = link::clock::thread_cpu_us();
        let found = stages.candidates(&frames, CorroborationLimits::default().score).candidates;
        least = least.min(link::clock::thread_cpu_us().saturating_sub(from));
        if found.rgb.is_none() || found.depth.is_none() || found.thermal.is_none() || found.lidar.is_none() {
            return Err("a stage failed on a black frame".to_owned());
        }
    }
    Ok(least)
}

fn writable(dir: &Path) -> bool {
    let path = dir.join(format!("holdsafe-doctor-{}", std::process::id()));
    let made = std::fs::OpenOptions::new().write(true).create_new(true).open(&path).is_ok();
    made && std::fs::remove_file(&path).is_ok()
}
