//! Namespaces of a process's own, in which its user keeps the same number, and a loopback interface that is up.

use std::fs;

use nix::sched::{CloneFlags, unshare};
use rustix::process::{getgid, getuid};

use crate::error::StepError;
use crate::wire;

/// Takes `flags`, a user namespace among them; the reason where the kernel refuses that.
///
/// # Errors
/// The kernel gave the namespaces, and refuses their use: without rights in them, as under AppArmor's rules.
pub fn take(flags: CloneFlags) -> Result<Option<String>, StepError> {
    let (user, group) = (getuid().as_raw(), getgid().as_raw());
    if let Err(error) = unshare(flags | CloneFlags::CLONE_NEWUSER) {
        return Ok(Some(error.desc().to_owned()));
    }
    let map =
        |file: &str, line: String| fs::write(file, line).map_err(|error| StepError::Path { path: file.into(), error });
    map("/proc/self/setgroups", "deny".into())?;
    map("/proc/self/uid_map", format!("{user} {user} 1"))?;
    map("/proc/self/gid_map", format!("{group} {group} 1"))?;
    Ok(None)
}

/// Sets the namespace's loopback interface up.
///
/// # Errors
/// The kernel's.
pub fn loopback() -> Result<(), StepError> {
    wire::loopback()
}
