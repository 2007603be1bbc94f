//! First stage: its own namespaces, an identity in them, a loopback interface, and the warden as the first process.

use std::io;
use std::process::Command;

use nix::sched::CloneFlags;
use rustix::thread::{CapabilitySet, capabilities, configure_capability_in_ambient_set, set_capabilities};
use sandbox::namespaces;

use super::{PLAIN, WARDEN, close_others, let_go, null};

/// Rights in the new namespaces that the warden needs until it gives them up: to mount, and to give up.
const RIGHTS: [CapabilitySet; 2] = [CapabilitySet::SYS_ADMIN, CapabilitySet::SETPCAP];

pub(super) fn main(arguments: &mut Vec<String>) -> Result<(), String> {
    close_others().map_err(|error| format!("open descriptors cannot be listed: {error}"))?;
    let refused = if arguments.iter().any(|word| word == PLAIN) { Some("not wanted".into()) } else { enter()? };
    arguments.extend([WARDEN.to_owned(), refused.unwrap_or_default()]);
    let null = null().map_err(|error| format!("/dev/null: {error}"))?;
    // This path starts the running program even where its file has been replaced.
    let warden = Command::new("/proc/self/exe").args(arguments.iter()).spawn();
    let mut warden = warden.map_err(|error| format!("the warden cannot be started: {error}"))?;
    let_go(&null).map_err(|error| error.to_string())?;
    warden.wait().map_err(|error| error.to_string())?;
    Ok(())
}

/// Takes namespaces; the reason where the kernel refuses them.
fn enter() -> Result<Option<String>, String> {
    let flags = CloneFlags::CLONE_NEWNS
        | CloneFlags::CLONE_NEWPID
        | CloneFlags::CLONE_NEWNET
        | CloneFlags::CLONE_NEWIPC
        | CloneFlags::CLONE_NEWUTS;
    if let Some(refused) = namespaces::take(flags)? {
        return Ok(Some(refused));
    }
    hand_down().map_err(|error| format!("rights for the warden: {error}"))?;
    namespaces::loopback().map_err(|reason| format!("loopback interface: {reason}"))?;
    Ok(None)
}

/// Lets the warden's program start with [`RIGHTS`]: a user other than root would lose them.
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
