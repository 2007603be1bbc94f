//! The second numbering of calls on x86-64, x32: a filter that lists refused calls by their first numbers alone does not see them.
//!
//! A filter that lists allowed calls refuses every number of x32, since it lists none. Numbers come from Linux's `syscall_64.tbl`.

use std::collections::BTreeMap;

use nix::libc;
use seccompiler::SeccompRule;

/// Set in the number of every x32 call.
pub(crate) const X32: i64 = 0x4000_0000;
/// Calls that have another number there, besides the bit.
const RENUMBERED: [(i64, i64); 6] = [
    (libc::SYS_execve, 520),
    (libc::SYS_ptrace, 521),
    (libc::SYS_kexec_load, 528),
    (libc::SYS_process_vm_readv, 539),
    (libc::SYS_process_vm_writev, 540),
    (libc::SYS_execveat, 545),
];

/// The rules of refused calls, each repeated for the call's numbers in x32.
#[must_use]
pub fn in_both(mut rules: BTreeMap<i64, Vec<SeccompRule>>) -> BTreeMap<i64, Vec<SeccompRule>> {
    if cfg!(target_arch = "x86_64") {
        let other = |call: i64| RENUMBERED.iter().find(|(first, _)| *first == call).map(|(_, number)| *number);
        let numbers = |call: i64| std::iter::once(call).chain(other(call)).map(|number| number | X32);
        let repeated: Vec<_> =
            rules.iter().flat_map(|(call, rule)| numbers(*call).map(|number| (number, rule.clone()))).collect();
        rules.extend(repeated);
    }
    rules
}
