//! A modelled host: a process that makes namespaces for the services of one machine, and keeps them until its launcher ends.
//!
//! Services join them by the process's number ([`crate::Rights::host`]). They have their own network with loopback alone; shared
//! memory and temporary files of their own, of a bounded size, which the kernel removes with the last process. The first host makes
//! a user namespace, in which its user keeps the same number and gains no right outside; the others join that.

use std::ffi::CString;
use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use nix::sched::{CloneFlags, unshare};
use rustix::mount::{MountFlags, MountPropagationFlags, mount, mount_change};
use rustix::process::{DumpableBehavior, Signal, set_dumpable_behavior, set_parent_process_death_signal};
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};
use serde::{Deserialize, Serialize};

use crate::error::StepError;
use crate::namespaces;
use crate::wire::{self, Station};

/// Longest specification, bytes.
const MAX_SPEC: u64 = 16 * 1024;
/// Shared memory of a host, KiB: many times that of the channels of one vehicle with rendered frames.
pub const SHARED_KIB: u64 = 512 << 10;
/// Sockets and node files of a bus.
const FILES: &std::ffi::CStr = c"size=16m,nr_inodes=16k,mode=700";

/// Specification of a host.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HostSpec {
    /// Another host, for its user namespace.
    #[serde(default)]
    pub beside: Option<u32>,
    /// True if the network is that of the host beside.
    #[serde(default)]
    pub shares_network: bool,
    /// Number of the router on the wire, if this is the router.
    #[serde(default)]
    pub router: Option<u8>,
    /// The other hosts, if this is the router of their wire.
    #[serde(default)]
    pub stations: Vec<Station>,
    /// Shared memory, KiB.
    pub shared_kib: u64,
    /// Folders that are empty in memory here: the roots of its bus.
    pub memory: Vec<PathBuf>,
}

/// Makes the host that standard input names in a line of JSON, prints `ready` or `refused` with the reason, and ends with its input.
pub fn main() -> ExitCode {
    let mut line = String::new();
    let mut input = io::stdin().lock();
    let read = Read::take(&mut input, MAX_SPEC).read_line(&mut line).map_err(StepError::from);
    let made = read.and_then(|_| Ok(serde_json::from_str(&line)?)).and_then(|spec| make(&spec));
    let (word, value, code) = match made {
        Ok(()) => ("ready", serde_json::json!({ "pid": std::process::id() }), ExitCode::SUCCESS),
        Err(error) => ("refused", serde_json::json!(error.to_string()), ExitCode::from(2)),
    };
    // The end of a launcher also ends the input, and so this process.
    let _unread = writeln!(io::stdout(), "{word} {value}");
    if code == ExitCode::SUCCESS {
        let _ended = io::copy(&mut input, &mut io::sink());
    }
    code
}

fn make(spec: &HostSpec) -> Result<(), StepError> {
    let rest = CloneFlags::CLONE_NEWNS | CloneFlags::CLONE_NEWIPC | CloneFlags::CLONE_NEWUTS;
    let network = if spec.shares_network { CloneFlags::empty() } else { CloneFlags::CLONE_NEWNET };
    match spec.beside {
        None => {
            if let Some(reason) = namespaces::take(rest | network)? {
                return Err(StepError::UserNamespaces { reason });
            }
        }
        Some(beside) => {
            join(beside, "user", LinkNameSpaceType::User)?;
            if spec.shares_network {
                join(beside, "net", LinkNameSpaceType::Network)?;
            }
            unshare(rest | network).map_err(|error| StepError::Namespaces { step: "namespaces", error })?;
        }
    }
    if !spec.shares_network {
        wire::without_ipv6();
        namespaces::loopback().map_err(StepError::in_part("loopback interface"))?;
    }
    if let Some(router) = spec.router {
        wire::connect(router, &spec.stations).map_err(StepError::in_part("wire between hosts"))?;
    }
    let step = StepError::of_step::<rustix::io::Errno>;
    mount_change("/", MountPropagationFlags::PRIVATE | MountPropagationFlags::REC).map_err(step("mounts"))?;
    let flags = MountFlags::NOSUID | MountFlags::NODEV | MountFlags::NOEXEC;
    let shared = CString::new(format!("size={}k,nr_inodes=16k,mode=1777", spec.shared_kib))?;
    mount("tmpfs", "/dev/shm", "tmpfs", flags, shared.as_c_str()).map_err(step("shared memory"))?;
    for folder in &spec.memory {
        mount("tmpfs", folder, "tmpfs", flags, FILES).map_err(step("folder of the bus"))?;
    }
    // The change of user namespace cleared both. Services find this process's namespaces in `/proc`, which needs it to
    // be dumpable.
    set_dumpable_behavior(DumpableBehavior::Dumpable).map_err(step("process"))?;
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(step("process"))
}

fn join(process: u32, name: &str, kind: LinkNameSpaceType) -> Result<(), StepError> {
    let path = PathBuf::from(format!("/proc/{process}/ns/{name}"));
    let refused = |error: io::Error| StepError::Path { path: path.clone(), error };
    let file = std::fs::File::open(&path).map_err(refused)?;
    move_into_link_name_space(std::os::fd::AsFd::as_fd(&file), Some(kind)).map_err(|error| refused(error.into()))
}
