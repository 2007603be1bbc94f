//! First stage: namespaces of its own, an identity in them, a loopback interface, and the warden as the first process.

use std::fs;
use std::io;
use std::process::Command;

use nix::sched::{CloneFlags, unshare};
use rustix::net::{AddressFamily, RecvFlags, SendFlags, SocketFlags, SocketType, recv, send, socket_with};
use rustix::process::{getgid, getuid};
use rustix::thread::{CapabilitySet, capabilities, configure_capability_in_ambient_set, set_capabilities};

use super::{PLAIN, WARDEN, close_others, let_go, null};

/// Rights in the new namespaces that the warden needs until it gives them up: to mount, and to give up.
const RIGHTS: [CapabilitySet; 2] = [CapabilitySet::SYS_ADMIN, CapabilitySet::SETPCAP];

pub(super) fn main(arguments: &mut Vec<String>) -> Result<(), String> {
    close_others().map_err(|why| format!("open descriptors cannot be listed: {why}"))?;
    let refused = if arguments.iter().any(|word| word == PLAIN) { Some("not wanted".into()) } else { enter()? };
    arguments.extend([WARDEN.to_owned(), refused.unwrap_or_default()]);
    let null = null().map_err(|why| format!("/dev/null: {why}"))?;
    // By this path, the program is the running one even where its file has been replaced.
    let warden = Command::new("/proc/self/exe").args(arguments.iter()).spawn();
    let mut warden = warden.map_err(|why| format!("the warden cannot be started: {why}"))?;
    let_go(&null).map_err(|why| why.to_string())?;
    warden.wait().map_err(|why| why.to_string())?;
    Ok(())
}

/// Takes namespaces; the reason where the kernel refuses them.
fn enter() -> Result<Option<String>, String> {
    let (user, group) = (getuid().as_raw(), getgid().as_raw());
    let flags = CloneFlags::CLONE_NEWUSER
        | CloneFlags::CLONE_NEWNS
        | CloneFlags::CLONE_NEWPID
        | CloneFlags::CLONE_NEWNET
        | CloneFlags::CLONE_NEWIPC
        | CloneFlags::CLONE_NEWUTS;
    if let Err(why) = unshare(flags) {
        return Ok(Some(why.desc().to_owned()));
    }
    // The guest keeps its user's number, and has the rights of no other.
    let map = |file: &str, line: String| fs::write(file, line).map_err(|why| format!("{file}: {why}"));
    map("/proc/self/setgroups", "deny".into())?;
    map("/proc/self/uid_map", format!("{user} {user} 1"))?;
    map("/proc/self/gid_map", format!("{group} {group} 1"))?;
    hand_down().map_err(|why| format!("rights for the warden: {why}"))?;
    loopback().map_err(|why| format!("loopback interface: {why}"))?;
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

/// Sets the namespace's loopback interface up, by a message of the protocol NETLINK_ROUTE, number 0 (RTM_NEWLINK of rtnetlink(7)).
fn loopback() -> io::Result<()> {
    const NEW_LINK: u16 = 16;
    const REQUEST_ACK: u16 = 1 | 4;
    const UP: u32 = 1;
    const FIRST: u32 = 1;
    let mut message = Vec::with_capacity(32);
    message.extend(32_u32.to_ne_bytes());
    message.extend(NEW_LINK.to_ne_bytes());
    message.extend(REQUEST_ACK.to_ne_bytes());
    message.extend([0; 8]);
    message.extend([0; 4]);
    message.extend(FIRST.to_ne_bytes());
    message.extend(UP.to_ne_bytes());
    message.extend(UP.to_ne_bytes());
    let socket = socket_with(AddressFamily::NETLINK, SocketType::RAW, SocketFlags::CLOEXEC, None)?;
    send(&socket, &message, SendFlags::empty())?;
    let mut answer = [0; 64];
    let (got, _) = recv(&socket, &mut answer, RecvFlags::empty())?;
    // An acknowledgement is an error message (header of 16 bytes) with the number 0.
    let code = answer[..got].get(16..20).and_then(|code| code.try_into().ok()).map(i32::from_ne_bytes);
    match code {
        Some(0) => Ok(()),
        Some(code) => Err(io::Error::from_raw_os_error(-code)),
        None => Err(io::ErrorKind::UnexpectedEof.into()),
    }
}
