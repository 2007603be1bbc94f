//! System calls that a guest is refused, with the reason for each. A refused call fails with EPERM; the guest goes on.

use std::collections::BTreeMap;

use nix::libc;
use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    TargetArch, apply_filter,
};

/// Rights over other processes: their memory, their registers, their descriptors.
const OTHERS: [i64; 6] = [
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_process_madvise,
    libc::SYS_pidfd_getfd,
    libc::SYS_kcmp,
];
/// Another view of the files than the one that the warden made, and files by handle around it.
const FILES: [i64; 15] = [
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_pivot_root,
    libc::SYS_chroot,
    libc::SYS_move_mount,
    libc::SYS_open_tree,
    libc::SYS_mount_setattr,
    libc::SYS_fsopen,
    libc::SYS_fsconfig,
    libc::SYS_fsmount,
    libc::SYS_fspick,
    libc::SYS_name_to_handle_at,
    libc::SYS_open_by_handle_at,
    libc::SYS_fanotify_init,
    libc::SYS_quotactl,
];
/// Namespaces of its own, in which a guest would have rights again.
const NAMESPACES: [i64; 2] = [libc::SYS_setns, libc::SYS_unshare];
/// Parts of the kernel that are large, rarely needed and often the way out.
const KERNEL: [i64; 14] = [
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_userfaultfd,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    libc::SYS_keyctl,
    libc::SYS_add_key,
    libc::SYS_request_key,
    libc::SYS_kexec_load,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_syslog,
];
/// The machine's state, which no program of autonomy sets.
const MACHINE: [i64; 11] = [
    libc::SYS_reboot,
    libc::SYS_swapon,
    libc::SYS_swapoff,
    libc::SYS_acct,
    libc::SYS_settimeofday,
    libc::SYS_clock_settime,
    libc::SYS_clock_adjtime,
    libc::SYS_adjtimex,
    libc::SYS_sethostname,
    libc::SYS_setdomainname,
    libc::SYS_vhangup,
];
/// Ports of the processor, and a second way to load a kernel.
#[cfg(target_arch = "x86_64")]
const PROCESSOR: [i64; 3] = [libc::SYS_iopl, libc::SYS_ioperm, libc::SYS_kexec_file_load];
#[cfg(not(target_arch = "x86_64"))]
const PROCESSOR: [i64; 0] = [];
/// The second numbering of calls on x86-64, in which every call of the first has this bit set; `ptrace` and `kexec_load` have others.
#[cfg(target_arch = "x86_64")]
const SECOND: Option<(i64, [i64; 2])> = Some((0x4000_0000, [521, 528]));
#[cfg(not(target_arch = "x86_64"))]
const SECOND: Option<(i64, [i64; 2])> = None;

/// Applies the filter to this process and all that it starts. `network` is true in a network namespace, in which sockets reach no other.
pub(super) fn apply(network: bool) -> Result<(), Error> {
    apply_filter(&program(rules(network)?, libc::EPERM)?)?;
    // The flags of clone3 lie in memory, where no filter sees them. A C library that gets ENOSYS takes clone.
    apply_filter(&program(numbered(BTreeMap::from([(libc::SYS_clone3, Vec::new())])), libc::ENOSYS)?)
}

fn program(rules: BTreeMap<i64, Vec<SeccompRule>>, errno: i32) -> Result<BpfProgram, Error> {
    let arch = TargetArch::try_from(std::env::consts::ARCH)?;
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, SeccompAction::Errno(errno as u32), arch)?;
    Ok(BpfProgram::try_from(filter)?)
}

fn rules(network: bool) -> Result<BTreeMap<i64, Vec<SeccompRule>>, Error> {
    let always = [&OTHERS[..], &FILES, &NAMESPACES, &KERNEL, &MACHINE, &PROCESSOR].concat();
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> = always.into_iter().map(|call| (call, Vec::new())).collect();
    rules.insert(libc::SYS_clone, namespaces()?);
    rules.insert(libc::SYS_socket, if network { vec![families()?] } else { Vec::new() });
    Ok(numbered(rules))
}

/// The rules for both numberings.
fn numbered(mut rules: BTreeMap<i64, Vec<SeccompRule>>) -> BTreeMap<i64, Vec<SeccompRule>> {
    if let Some((bit, others)) = SECOND {
        let again: Vec<_> = rules.iter().map(|(call, rules)| (call | bit, rules.clone())).collect();
        rules.extend(again);
        if rules.contains_key(&libc::SYS_ptrace) {
            rules.extend(others.map(|call| (call | bit, Vec::new())));
        }
    }
    rules
}

/// Any flag of `clone` that asks for a namespace.
fn namespaces() -> Result<Vec<SeccompRule>, Error> {
    let flags = [
        libc::CLONE_NEWUSER,
        libc::CLONE_NEWNS,
        libc::CLONE_NEWPID,
        libc::CLONE_NEWNET,
        libc::CLONE_NEWIPC,
        libc::CLONE_NEWUTS,
        libc::CLONE_NEWCGROUP,
    ];
    let rule = |flag: i32| {
        let flag = flag as u64;
        let set = SeccompCondition::new(0, SeccompCmpArgLen::Qword, SeccompCmpOp::MaskedEq(flag), flag)?;
        Ok(SeccompRule::new(vec![set])?)
    };
    flags.into_iter().map(rule).collect()
}

/// Any family of sockets but IPv4, which is that of the loopback interface. A local socket would reach whatever listens in the file
/// system, which no namespace hides; a pair of them (`socketpair`) reaches nobody else.
fn families() -> Result<SeccompRule, Error> {
    let family = libc::AF_INET as u64;
    let not = SeccompCondition::new(0, SeccompCmpArgLen::Dword, SeccompCmpOp::Ne, family)?;
    Ok(SeccompRule::new(vec![not])?)
}
