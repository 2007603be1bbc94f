//! Namespaces of a process's own, in which its user keeps the same number, and a loopback interface that is up.

use std::fs;
use std::io;

use nix::sched::{CloneFlags, unshare};
use rustix::net::{AddressFamily, RecvFlags, SendFlags, SocketFlags, SocketType, recv, send, socket_with};
use rustix::process::{getgid, getuid};

/// Takes `flags`, a user namespace among them; the reason where the kernel refuses that.
///
/// # Errors
/// The kernel gave the namespaces, and refuses their use: without rights in them, as under AppArmor's rules.
pub fn take(flags: CloneFlags) -> Result<Option<String>, String> {
    let (user, group) = (getuid().as_raw(), getgid().as_raw());
    if let Err(why) = unshare(flags | CloneFlags::CLONE_NEWUSER) {
        return Ok(Some(why.desc().to_owned()));
    }
    let map = |file: &str, line: String| fs::write(file, line).map_err(|why| format!("{file}: {why}"));
    map("/proc/self/setgroups", "deny".into())?;
    map("/proc/self/uid_map", format!("{user} {user} 1"))?;
    map("/proc/self/gid_map", format!("{group} {group} 1"))?;
    Ok(None)
}

/// Sets the namespace's loopback interface up, by a message of the protocol NETLINK_ROUTE, number 0 (RTM_NEWLINK of rtnetlink(7)).
///
/// # Errors
/// The kernel's.
pub fn loopback() -> io::Result<()> {
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
