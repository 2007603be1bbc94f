//! Limits of a guest's process by number.

use super::error::StartError;
use guest::file::Limits;
use rustix::process::{Resource, Rlimit, geteuid, setrlimit};
use rustix::system::uname;
use rustix::thread::set_no_new_privs;

/// Largest file that a guest can write, bytes. Only temporary folders in memory take any.
const FILE: u64 = 64 << 20;
/// First kernel that counts a namespace's processes apart from all others of the user.
const COUNTS_APART: (u32, u32) = (5, 14);

/// Sets the limits, for this process and those that it starts; gives the reasons where the kernel does not hold one.
pub(super) fn set(limits: &Limits, namespaces: bool) -> Result<Vec<String>, StartError> {
    set_no_new_privs(true).map_err(StartError::of_step("no_new_privs"))?;
    let mut texts = Vec::new();
    let mut all = vec![
        (Resource::Core, 0),
        (Resource::Fsize, FILE),
        (Resource::Cpu, limits.cpu_s),
        (Resource::Nofile, limits.files),
        (Resource::As, limits.memory_mib << 20),
    ];
    let root = geteuid().is_root();
    if namespaces && !root && kernel() >= COUNTS_APART {
        // Entry and warden count too.
        all.insert(0, (Resource::Nproc, limits.processes + 2));
    } else if !(namespaces && root) {
        texts.push("no limit on processes: the kernel would count all of the user, or none".into());
    }
    for (resource, most) in all {
        let limit = Rlimit { current: Some(most), maximum: Some(most) };
        setrlimit(resource, limit).map_err(|error| StartError::Limit { resource, most, error: error.into() })?;
    }
    Ok(texts)
}

/// The first two numbers of the kernel's release.
pub(super) fn kernel() -> (u32, u32) {
    let release = uname().release().to_string_lossy().into_owned();
    let mut numbers = release.split(|c: char| !c.is_ascii_digit()).filter_map(|number| number.parse().ok());
    (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0))
}
