//! System calls: those that a service makes, and those that end it.
//!
//! A call outside of both lists fails with EPERM. Numbers of calls and of flags come from Linux's `uapi` headers.

use std::collections::BTreeMap;

use nix::libc;
use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    TargetArch, apply_filter,
};

use crate::numbering::in_both;
use crate::table::{Network, ServiceRights};

/// Rights over other processes: their memory, their registers, their descriptors.
pub const OTHERS: [i64; 6] = [
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_process_madvise,
    libc::SYS_pidfd_getfd,
    libc::SYS_kcmp,
];
/// Changes to the view of the files, and files by handle, which bypass it.
pub const FILES: [i64; 15] = [
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
/// New namespaces, in which a process would regain capabilities.
pub const NAMESPACES: [i64; 2] = [libc::SYS_setns, libc::SYS_unshare];
/// Parts of the kernel that are large, rarely needed, and often the target of an escape.
pub const KERNEL: [i64; 14] = [
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
/// The machine's state.
pub const MACHINE: [i64; 11] = [
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
pub const PROCESSOR: [i64; 3] = [libc::SYS_iopl, libc::SYS_ioperm, libc::SYS_kexec_file_load];
/// Ports of the processor; an architecture other than x86-64 has none.
#[cfg(not(target_arch = "x86_64"))]
pub const PROCESSOR: [i64; 0] = [];
/// Replacement of the process's program.
const PROGRAMS: [i64; 2] = [libc::SYS_execve, libc::SYS_execveat];

/// Memory, threads, time and the process itself.
const SELF: [i64; 45] = [
    libc::SYS_brk,
    libc::SYS_mmap,
    libc::SYS_munmap,
    libc::SYS_mprotect,
    libc::SYS_mremap,
    libc::SYS_madvise,
    libc::SYS_mlock,
    libc::SYS_munlock,
    libc::SYS_futex,
    libc::SYS_membarrier,
    libc::SYS_rseq,
    libc::SYS_set_robust_list,
    libc::SYS_set_tid_address,
    libc::SYS_sched_yield,
    libc::SYS_sched_getaffinity,
    libc::SYS_getcpu,
    libc::SYS_exit,
    libc::SYS_exit_group,
    libc::SYS_rt_sigaction,
    libc::SYS_rt_sigprocmask,
    libc::SYS_rt_sigreturn,
    libc::SYS_sigaltstack,
    libc::SYS_restart_syscall,
    libc::SYS_getpid,
    libc::SYS_gettid,
    libc::SYS_getppid,
    libc::SYS_getuid,
    libc::SYS_geteuid,
    libc::SYS_getgid,
    libc::SYS_getegid,
    libc::SYS_getrusage,
    libc::SYS_getrandom,
    libc::SYS_uname,
    libc::SYS_sysinfo,
    libc::SYS_nanosleep,
    libc::SYS_clock_nanosleep,
    libc::SYS_clock_gettime,
    libc::SYS_clock_getres,
    libc::SYS_gettimeofday,
    libc::SYS_timerfd_create,
    libc::SYS_timerfd_settime,
    libc::SYS_eventfd2,
    libc::SYS_epoll_create1,
    libc::SYS_epoll_ctl,
    libc::SYS_epoll_pwait,
];
/// Open files and folders, of those that `view` and `ruleset` leave.
const OPEN_FILES: [i64; 36] = [
    libc::SYS_read,
    libc::SYS_write,
    libc::SYS_readv,
    libc::SYS_writev,
    libc::SYS_pread64,
    libc::SYS_pwrite64,
    libc::SYS_close,
    libc::SYS_lseek,
    libc::SYS_dup,
    libc::SYS_fcntl,
    libc::SYS_flock,
    libc::SYS_fstat,
    libc::SYS_newfstatat,
    libc::SYS_statx,
    libc::SYS_fstatfs,
    libc::SYS_statfs,
    libc::SYS_ftruncate,
    libc::SYS_fallocate,
    libc::SYS_fsync,
    libc::SYS_fdatasync,
    libc::SYS_fchmod,
    libc::SYS_fchmodat,
    libc::SYS_umask,
    libc::SYS_openat,
    libc::SYS_getdents64,
    libc::SYS_readlinkat,
    libc::SYS_faccessat,
    libc::SYS_faccessat2,
    libc::SYS_mkdirat,
    libc::SYS_unlinkat,
    libc::SYS_renameat2,
    libc::SYS_renameat,
    libc::SYS_getcwd,
    libc::SYS_ppoll,
    libc::SYS_pipe2,
    libc::SYS_dup3,
];
/// Sockets that are open already; `socket` itself has a rule a family.
const OPEN_SOCKETS: [i64; 15] = [
    libc::SYS_socketpair,
    libc::SYS_bind,
    libc::SYS_listen,
    libc::SYS_accept4,
    libc::SYS_connect,
    libc::SYS_shutdown,
    libc::SYS_getsockname,
    libc::SYS_getpeername,
    libc::SYS_getsockopt,
    libc::SYS_setsockopt,
    libc::SYS_sendto,
    libc::SYS_recvfrom,
    libc::SYS_sendmsg,
    libc::SYS_recvmsg,
    libc::SYS_recvmmsg,
];
/// Older names of some of these, which only this processor has.
#[cfg(target_arch = "x86_64")]
const OLDER: [i64; 17] = [
    libc::SYS_arch_prctl,
    libc::SYS_access,
    libc::SYS_open,
    libc::SYS_stat,
    libc::SYS_lstat,
    libc::SYS_chmod,
    libc::SYS_mkdir,
    libc::SYS_rmdir,
    libc::SYS_unlink,
    libc::SYS_rename,
    libc::SYS_readlink,
    libc::SYS_poll,
    libc::SYS_epoll_wait,
    libc::SYS_accept,
    libc::SYS_time,
    libc::SYS_dup2,
    libc::SYS_pipe,
];
#[cfg(not(target_arch = "x86_64"))]
const OLDER: [i64; 0] = [];

/// Allows this process only the calls of `row`. A call that makes or changes other processes, programs, mounts or
/// namespaces ends it; any other fails with EPERM.
pub(crate) fn apply(row: &ServiceRights) -> Result<(), Error> {
    apply_fatal()?;
    // The flags of clone3 are in memory, which no filter can read. A C library that gets ENOSYS falls back to clone.
    let clone3 = BTreeMap::from([(libc::SYS_clone3, Vec::new())]);
    apply_filter(&filter(clone3, SeccompAction::Allow, SeccompAction::Errno(libc::ENOSYS as u32))?)?;
    // Last: this filter refuses the calls that install a filter.
    apply_filter(&filter(allowed(row)?, SeccompAction::Errno(libc::EPERM as u32), SeccompAction::Allow)?)
}

/// Ends a process at a call that no service has a use for; all others are left as they are.
pub(crate) fn apply_fatal() -> Result<(), Error> {
    apply_filter(&filter(fatal(), SeccompAction::Allow, SeccompAction::KillProcess)?)
}

/// Ends a process at its next call that is one of [`fatal`].
fn fatal() -> BTreeMap<i64, Vec<SeccompRule>> {
    let all = [&OTHERS[..], &FILES, &NAMESPACES, &KERNEL, &MACHINE, &PROCESSOR, &PROGRAMS].concat();
    in_both(all.into_iter().map(|call| (call, Vec::new())).collect())
}

fn filter(
    rules: BTreeMap<i64, Vec<SeccompRule>>,
    action: SeccompAction,
    listed: SeccompAction,
) -> Result<BpfProgram, Error> {
    let arch = TargetArch::try_from(std::env::consts::ARCH)?;
    Ok(BpfProgram::try_from(SeccompFilter::new(rules, action, listed, arch)?)?)
}

fn allowed(row: &ServiceRights) -> Result<BTreeMap<i64, Vec<SeccompRule>>, Error> {
    let always = [&SELF[..], &OPEN_FILES, &OPEN_SOCKETS, &OLDER].concat();
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> = always.into_iter().map(|call| (call, Vec::new())).collect();
    // An empty list of rules would allow every socket: without sockets the call is left out.
    let sockets = sockets(row)?;
    if !sockets.is_empty() {
        rules.insert(libc::SYS_socket, sockets);
    }
    // Allowed here, since the strictest answer of all filters counts: the filter above gives ENOSYS.
    rules.insert(libc::SYS_clone3, Vec::new());
    let thread = libc::CLONE_THREAD as u64;
    rules.insert(libc::SYS_clone, vec![rule(&[(0, SeccompCmpOp::MaskedEq(thread), thread)])?]);
    // Signals to itself alone, as `abort` sends them; limits only read; names of threads and of memory.
    let own_pid = u64::from(std::process::id());
    rules.insert(libc::SYS_tgkill, vec![rule(&[(0, SeccompCmpOp::Eq, own_pid)])?]);
    let asks = SeccompCondition::new(2, SeccompCmpArgLen::Qword, SeccompCmpOp::Eq, 0)?;
    rules.insert(libc::SYS_prlimit64, vec![SeccompRule::new(vec![asks])?]);
    let options = [libc::PR_SET_NAME, libc::PR_GET_NAME, libc::PR_SET_VMA, libc::PR_GET_PDEATHSIG];
    rules.insert(libc::SYS_prctl, one_of(0, &options.map(|option| option as u64))?);
    // Requests for blocking, close-on-exec, waiting bytes and terminals: no other reaches a device.
    rules.insert(libc::SYS_ioctl, one_of(1, &[libc::FIONBIO, libc::FIOCLEX, libc::FIONREAD, libc::TCGETS])?);
    Ok(rules)
}

/// Rules for `socket`: local ones, by which the bus wakes its readers, and those of the row's network.
fn sockets(row: &ServiceRights) -> Result<Vec<SeccompRule>, Error> {
    /// The type without its flags.
    const TYPE: u64 = 0xf;
    let inet = |kind: i32| {
        rule(&[(0, SeccompCmpOp::Eq, libc::AF_INET as u64), (1, SeccompCmpOp::MaskedEq(TYPE), kind as u64)])
    };
    let mut rules = Vec::new();
    if row.bus || row.log.is_some() {
        rules.push(rule(&[(0, SeccompCmpOp::Eq, libc::AF_UNIX as u64)])?);
    }
    if row.network.contains(&Network::Udp) {
        rules.push(inet(libc::SOCK_DGRAM)?);
    }
    if row.network.contains(&Network::TcpListens) || row.network.contains(&Network::TcpConnects) {
        rules.push(inet(libc::SOCK_STREAM)?);
    }
    Ok(rules)
}

fn one_of(argument: u8, values: &[u64]) -> Result<Vec<SeccompRule>, Error> {
    values.iter().map(|value| rule(&[(argument, SeccompCmpOp::Eq, *value)])).collect()
}

/// A rule that holds where all conditions hold: argument by number, comparison, and value.
fn rule(conditions: &[(u8, SeccompCmpOp, u64)]) -> Result<SeccompRule, Error> {
    let condition = |(argument, compare, value): &(u8, SeccompCmpOp, u64)| {
        SeccompCondition::new(*argument, SeccompCmpArgLen::Dword, compare.clone(), *value)
    };
    let conditions: Result<Vec<_>, _> = conditions.iter().map(condition).collect();
    Ok(SeccompRule::new(conditions?)?)
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests;
