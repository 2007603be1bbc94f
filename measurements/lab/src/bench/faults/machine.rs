//! Faults of the machine around a service: its clock, its descriptors, its memory. And the count of things of ours on the machine.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use link::bus::sweep::SHARED_MEMORY;
use live::child::Services;
use live::{LiveError, Options};
use runner::Context;
use runner::error::EngineError;
use runner::failure::Failure;
use runner::plan::{self, PlanOptions};
use sandbox::host::SHARED_KIB;
use scenario::{Confinement, Hosts};
use wire::person::Role;

use crate::report::{Attempts, Left};

/// The services that a script can stand before.
const SERVICES: [&str; 10] =
    ["sim", "perception", "autonomy", "gateway", "broker", "console", "recorder", "adversary", "host", "janitor"];
/// Folders in which the library that shifts clocks is looked for.
const LIBRARIES: [&str; 3] =
    ["/usr/lib/x86_64-linux-gnu/faketime", "/usr/lib/aarch64-linux-gnu/faketime", "/usr/lib64/faketime"];
/// Shifts of the wall clock.
const SHIFTS: [&str; 6] = ["-1s", "+1s", "-1h", "+1h", "-10y", "+10y"];
/// Sizes of shared memory, KiB, from none to enough.
const SHARED: [u64; 5] = [16, 256, 1024, 4096, 16384];
/// Seconds after its start at which a service's clock steps, where it does not start with the shift: in the middle of the mission.
const STEPS_AFTER_S: u32 = 6;

/// A fault of the machine around one service or all.
pub(super) struct Around {
    pub(super) fault: &'static str,
    pub(super) what: String,
    /// Its need, in words, where the machine lacks it.
    pub(super) needs: &'static str,
    /// The service; all without one.
    service: Option<&'static str>,
    /// Lines of a shell before the service starts; none where the machine lacks something.
    before: Option<String>,
    /// Shared memory of each host, KiB.
    shared_kib: u64,
}

impl Around {
    /// Every fault.
    pub(super) fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for service in ["gateway", "autonomy", "broker"] {
            for shift in SHIFTS {
                for steps in [false, true] {
                    let manner = if steps { "steps to" } else { "is at" };
                    let before = faketime().map(|library| clock(&library, shift, steps));
                    let (what, needs) =
                        (format!("wall clock of {service} {manner} {shift}"), "faketime is not installed");
                    all.push(Self { fault: "F3", what, needs, service: Some(service), before, shared_kib: SHARED_KIB });
                }
            }
        }
        for shared_kib in SHARED {
            let (what, before) = (format!("{shared_kib} KiB of shared memory for each host"), Some(String::new()));
            all.push(Self { fault: "F11", what, needs: "", service: None, before, shared_kib });
        }
        for service in SERVICES.into_iter().filter(|service| !["host", "janitor"].contains(service)) {
            for (what, limit) in [("64 descriptors", "ulimit -n 64"), ("64 MiB of address space", "ulimit -v 65536")] {
                let (what, before) = (format!("{what} for {service}"), Some(limit.to_owned()));
                all.push(Self {
                    fault: "F12",
                    what,
                    needs: "",
                    service: Some(service),
                    before,
                    shared_kib: SHARED_KIB,
                });
            }
        }
        all
    }

    /// Live runs of the null attack with this fault; none where the machine lacks something.
    pub(super) fn attempts(&self, context: &Context, runs: u64, retries: u32) -> Result<Option<Attempts>, Failure> {
        let Some(before) = &self.before else { return Ok(None) };
        let program = std::env::current_exe()?;
        let folder = scripts(&program, self.service, before)?;
        let scenario = scenario::load(&plan::file_of(context, "nominal")?)?;
        let wanted = PlanOptions { rendered: true, where_trained: true, ..PlanOptions::default() };
        let planned = plan::of_scenario(context, &scenario, &wanted)?;
        let Some(one) = planned.first() else { return Ok(None) };
        let mut attempts = Attempts::default();
        for seed in (context.seed..).take(runs as usize) {
            let mut left = retries;
            loop {
                let options = Options {
                    keep: None,
                    services: Services::Folder(folder.path.clone()),
                    stop: &context.stop,
                    show: &mut |_| {},
                    window: false,
                    role: Role::default(),
                    acts: Vec::new(),
                    confinement: Confinement::Best,
                    hosts: Hosts::Loopback,
                    shared_kib: self.shared_kib,
                };
                match live::trial::run_live(&one.variation.scenario, &one.setup, seed, options) {
                    Ok(run) if run.stopped => return Err(EngineError::Stopped.into()),
                    Ok(run) if run.spoilt.is_some() && left > 0 => left -= 1,
                    Ok(run) => {
                        let level = one.variation.scenario.level();
                        attempts.trials.push(oracle::judged::trial(seed, level, &run.evidence, &run.verdict));
                        break;
                    }
                    Err(LiveError::Stopped) => return Err(EngineError::Stopped.into()),
                    Err(error) => {
                        link::note!("{}: {error}", self.what);
                        attempts.refused += 1;
                        break;
                    }
                }
            }
        }
        Ok(Some(attempts))
    }
}

/// A folder of scripts, removed with this.
struct Folder {
    path: PathBuf,
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _gone = fs::remove_dir_all(&self.path);
    }
}

/// Scripts that start `program` as each service, with `before` ahead of one service or of all.
fn scripts(program: &Path, service: Option<&str>, before: &str) -> std::io::Result<Folder> {
    let path = std::env::temp_dir().join(format!("lab-faults-{}", std::process::id()));
    fs::create_dir_all(&path)?;
    let folder = Folder { path };
    for name in SERVICES {
        let here = service.is_none_or(|service| service == name);
        let before = if here { before } else { "" };
        let script = folder.path.join(format!("holdsafe-{name}"));
        fs::write(&script, format!("#!/bin/sh\n{before}\nexec '{}' service {name} \"$@\"\n", program.display()))?;
        fs::set_permissions(&script, fs::Permissions::from_mode(0o700))?;
    }
    Ok(folder)
}

fn faketime() -> Option<PathBuf> {
    LIBRARIES.iter().map(|folder| Path::new(folder).join("libfaketime.so.1")).find(|library| library.is_file())
}

fn clock(library: &Path, shift: &str, steps: bool) -> String {
    let after = if steps { format!("export FAKETIME_START_AFTER_SECONDS={STEPS_AFTER_S}\n") } else { String::new() };
    let library = library.display();
    format!("export LD_PRELOAD='{library}' FAKETIME='{shift}' FAKETIME_DONT_FAKE_MONOTONIC=1\n{after}")
}

/// Things of ours on the machine now, besides this process.
pub(super) fn left() -> Result<Left, Failure> {
    let own_path = fs::read_link("/proc/self/exe")?;
    let network = |process: &Path| fs::read_link(process.join("ns/net")).ok();
    let machine = network(Path::new("/proc/self"));
    let mut left = Left::default();
    let mut namespaces = BTreeSet::new();
    for entry in fs::read_dir("/proc")?.filter_map(Result::ok) {
        let process = entry.path();
        let number = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok());
        if number.is_none_or(|number| number == std::process::id()) {
            continue;
        }
        let ours = fs::read_link(process.join("exe")).is_ok_and(|program| program == own_path);
        if ours && is_service(&process) {
            left.processes += 1;
            namespaces.extend(network(&process).filter(|network| Some(network) != machine.as_ref()));
        }
    }
    left.namespaces = namespaces.len();
    left.segments = count(Path::new(SHARED_MEMORY), "hs_")?;
    left.folders = count(&std::env::temp_dir(), "holdsafe-")?;
    Ok(left)
}

fn is_service(process: &Path) -> bool {
    let words = fs::read(process.join("cmdline")).unwrap_or_default();
    words.split(|byte| *byte == 0).nth(1) == Some(b"service")
}

fn count(folder: &Path, start: &str) -> std::io::Result<usize> {
    let named = |entry: &fs::DirEntry| entry.file_name().to_str().is_some_and(|name| name.starts_with(start));
    Ok(fs::read_dir(folder)?.filter_map(Result::ok).filter(named).count())
}
