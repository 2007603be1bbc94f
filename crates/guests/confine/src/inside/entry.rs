//! First stage: its own namespaces, an identity in them, a loopback interface, and the warden as the first process.

use std::io;
use std::process::Command;

use nix::sched::CloneFlags;
use rustix::thread::{CapabilitySet, capabilities, configure_capability_in_ambient_set, set_capabilities};
use sandbox::namespaces;

use super::error::StartError;
use super::{PLAIN, WARDEN, close_others, let_go, null};

/// Capabilities that the warden needs in the new namespaces until it drops them: to mount, and to drop capabilities.
const RIGHTS: [CapabilitySet; 2] = [CapabilitySet::SYS_ADMIN, CapabilitySet::SETPCAP];

pub(super) fn main(arguments: &mut Vec<String>) -> Result<(), StartError> {
    close_others().map_err(StartError::of_step("open descriptors cannot be listed"))?;
    let refused = if arguments.iter().any(|word| word == PLAIN) { Some("not wanted".into()) } else { enter()? };
    arguments.extend([WARDEN.to_owned(), refused.unwrap_or_default()]);
    let null = null().map_err(StartError::of_step("/dev/null"))?;
    // This path starts the running program even where its file has been replaced.
    let warden = Command::new("/proc/self/exe").args(arguments.iter()).spawn();
    let mut warden = warden.map_err(StartError::of_step("the warden cannot be started"))?;
    let_go(&null)?;
    warden.wait()?;
    Ok(())
}

/// Enters new namespaces; the reason where the kernel refuses them.
fn enter() -> Result<Option<String>, StartError> {
    let flags = CloneFlags::CLONE_NEWNS
        | CloneFlags::CLONE_NEWPID
        | CloneFlags::CLONE_NEWNET
        | CloneFlags::CLONE_NEWIPC
        | CloneFlags::CLONE_NEWUTS;
    if let Some(refused) = namespaces::take(flags)? {
        return Ok(Some(refused));
    }
    hand_down().map_err(StartError::of_step("rights for the warden"))?;
    namespaces::loopback().map_err(StartError::Loopback)?;
    Ok(None)
}

/// Keeps [`RIGHTS`] across the start of the warden: a user other than root would lose them at `execve`.
fn hand_down() -> io::Result<()> {
    let mut sets = capabilities(None)?;
    for right in RIGHTS {
        sets.inheritable |= right;
    }
    set_capabilities(None, sets)?;
    for right in RIGHTS {
        configure_capability_in_ambient_set(right, true)?;
    }
    Ok(())
}
