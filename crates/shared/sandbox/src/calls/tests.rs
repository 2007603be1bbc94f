//! Calls of the second numbering, x32, of which no service makes any.

use super::*;
use crate::numbering::X32;
use crate::table::rows;

#[test]
fn no_service_makes_a_call_of_x32() {
    for row in rows().values() {
        assert!(allowed(row).unwrap().keys().all(|call| call & X32 == 0), "a list of allowed calls");
    }
}

/// A process with a window has this list alone.
#[test]
fn x32_numbers_of_a_denied_call_are_denied() {
    let fatal = fatal();
    for call in [libc::SYS_ptrace, 521, libc::SYS_mount, 540, 545, libc::SYS_io_uring_setup] {
        assert!(fatal.contains_key(&(call | X32)), "{call}");
    }
}
