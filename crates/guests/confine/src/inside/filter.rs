//! System calls that a guest is refused, with the reason for each. A refused call fails with EPERM; the guest goes on.

use std::collections::BTreeMap;

use nix::libc;
use sandbox::calls::{FILES, KERNEL, MACHINE, NAMESPACES, OTHERS, PROCESSOR};
use sandbox::numbering::in_both;
use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    TargetArch, apply_filter,
};

/// Applies the filter to this process and all that it starts. `network` is true in a network namespace, in which sockets reach no other.
pub(super) fn apply(network: bool) -> Result<(), Error> {
    apply_filter(&program(rules(network)?, libc::EPERM)?)?;
    // The flags of clone3 lie in memory, where no filter sees them. A C library that gets ENOSYS takes clone.
    apply_filter(&program(in_both(BTreeMap::from([(libc::SYS_clone3, Vec::new())])), libc::ENOSYS)?)
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
    Ok(in_both(rules))
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
