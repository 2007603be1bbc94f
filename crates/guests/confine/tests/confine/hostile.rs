//! Guests that do not answer as they should.

use std::sync::Arc;

use guest::{Failure, Patience, Session};
use wire::guest::Fault;

use crate::{Case, start};

fn assert_failed(failure: &Failure, fault: Fault, reason: &str) {
    assert_eq!(failure.fault, fault, "{failure}");
    assert!(failure.why.contains(reason), "{failure}");
}

#[test]
fn a_silent_guest_fails_by_its_limit() {
    let failure = Case::shell("sleep 1000", "").with_start_ms(5000).failure(0);
    assert_failed(&failure, Fault::Silent, "within 5000 ms");
}

#[test]
fn a_hanging_step_fails_by_its_limit() {
    let failure = Case::shell("read line; echo ready; sleep 1000", "step_ms = 200").failure(1);
    assert_failed(&failure, Fault::Silent, "within 200 ms");
}

#[test]
fn a_guest_that_never_reads_is_silent() {
    let case = Case::shell("sleep 1000", "").with_start_ms(5000);
    let mut channel = case.launch().unwrap();
    let failure = channel.exchange(&"x".repeat(1 << 20), Patience::Start).unwrap_err();
    assert_failed(&failure, Fault::Silent, "bytes of the request unread");
    drop(channel);
    assert!(case.left().is_empty());
}

#[test]
fn a_value_that_is_no_number_is_refused() {
    let Some(case) = Case::python("take(); give('NaN'); take()\n", "") else { return };
    let mut session = Session::new(Arc::new(case.program.clone()), Arc::clone(&case.launcher));
    let failure = session.ask(&start()).unwrap_err();
    assert_failed(&failure, Fault::Malformed, "NaN");
    assert!(case.left().is_empty(), "a session ends its process with the first failure");
}

#[test]
fn a_line_without_end_is_a_flood() {
    let text = "take()\nfor _ in range(1 << 14): sys.stdout.write('x' * (1 << 16))\n";
    let Some(case) = Case::python(text, "") else { return };
    assert_failed(&case.failure(0), Fault::Flood, "at most 65536 bytes");
}

#[test]
fn many_lines_for_one_request_are_a_flood() {
    let failure = Case::shell("read line; yes ready | head -n 1000; sleep 1000", "").failure(1);
    assert_failed(&failure, Fault::Flood, "one line for a request expected");
}

#[test]
fn a_guest_that_dies_at_once_has_ended() {
    let failure = Case::shell("echo no map >&2; exit 3", "").failure(0);
    assert_failed(&failure, Fault::Ended, "exit status 3; its last words: no map");
}

#[test]
fn a_guest_that_dies_in_a_step_has_ended() {
    let failure = Case::shell("read line; echo ready; read line; kill -SEGV $$", "").failure(1);
    assert_failed(&failure, Fault::Ended, "killed by SIGSEGV");
}

#[test]
fn an_abort_is_named_as_one() {
    let Some(case) = Case::python("take(); os.abort()\n", "") else { return };
    assert_failed(&case.failure(0), Fault::Ended, "killed by SIGABRT");
}

#[test]
fn a_fork_bomb_ends_with_its_guest() {
    let failure =
        Case::shell("read line; f() { f | f & }; f 2>/dev/null; wait; sleep 1000", "").with_start_ms(2000).failure(0);
    assert!(matches!(failure.fault, Fault::Silent | Fault::Ended), "{failure}");
}

#[test]
fn a_memory_hog_meets_its_limit() {
    let Some(case) = Case::python("take()\nx = []\nwhile True: x.append(bytearray(1 << 24))\n", "memory_mib = 256")
    else {
        return;
    };
    assert_failed(&case.failure(0), Fault::Ended, "MemoryError");
}

#[test]
fn a_small_limit_still_lets_start() {
    let case = Case::shell("while read line; do echo ready; done", "memory_mib = 16\nfiles = 16\nprocesses = 1");
    let mut channel = case.launch().unwrap();
    assert_eq!(channel.exchange("start", Patience::Start).unwrap(), "ready");
}

#[test]
fn a_flood_of_errors_is_bounded_and_harmless() {
    let text = "for line in sys.stdin:\n  for _ in range(256): sys.stderr.write('\\x1b[31me' * (1 << 12))\n  give('ok')\n  if 'end' in line: os._exit(9)\n";
    let Some(case) = Case::python(text, "step_ms = 10000") else { return };
    let mut channel = case.launch().unwrap();
    assert_eq!(channel.exchange("start", Patience::Start).unwrap(), "ok");
    assert_eq!(channel.exchange("end", Patience::Step).unwrap(), "ok");
    let failure = channel.exchange("more", Patience::Step).unwrap_err();
    assert_failed(&failure, Fault::Ended, "exit status 9; its last words:");
    assert!(failure.why.len() < 2200 && !failure.why.contains('\x1b'), "{} bytes", failure.why.len());
}

#[test]
fn a_guest_that_ignores_sigterm_is_ended() {
    let failure =
        Case::shell("trap '' TERM HUP INT; read line; echo ready; while :; do sleep 100; done", "step_ms = 200")
            .failure(1);
    assert_failed(&failure, Fault::Silent, "");
}

#[test]
fn a_guest_that_closes_its_output_has_ended() {
    let Some(case) = Case::python("os.close(0); os.close(1); time.sleep(1000)\n", "") else { return };
    assert_failed(&case.failure(0), Fault::Ended, "its standard output is closed, the program went on");
}

/// Leaves a process of another session behind, with the mark in its command line, and ends in its first step.
const DAEMON: &str = "read line\n\
    (setsid /bin/sh -c 'trap \"\" TERM HUP; while :; do sleep 100; done' \"$1\" </dev/null >/dev/null 2>&1 &)\n\
    echo ready; read line; exit 0";

#[test]
fn a_daemon_does_not_survive_its_guest() {
    assert_failed(&Case::shell(DAEMON, "").failure(1), Fault::Ended, "exit status 0");
}

#[test]
fn a_daemon_without_namespaces_does_not_survive_either() {
    assert_failed(&Case::shell(DAEMON, "").plain().failure(1), Fault::Ended, "exit status 0");
}

#[test]
fn bytes_that_are_no_text_are_malformed() {
    let failure = Case::shell("read line; printf 'ok\\377\\n'; read line", "").failure(0);
    assert_failed(&failure, Fault::Malformed, "offset 2");
}

#[test]
fn a_program_that_cannot_start_says_why() {
    let mut case = Case::shell("", "");
    let mut not_started = |word: &str, reason: &str| {
        case.program.command[0] = word.replace("{dir}", &case.folder.path().to_string_lossy());
        assert_failed(&case.failure(0), Fault::NotStarted, reason);
    };
    not_started("no-such-program", "no-such-program: not found in /usr/local/bin:/usr/bin:/bin");
    not_started("{dir}/none", "not found");
    not_started("{dir}/guest", "Permission denied");
}

#[test]
fn a_missing_helper_is_named() {
    let mut case = Case::shell("", "");
    case.launcher = confine::launcher("/no/such/helper".into(), Vec::new(), None);
    assert_failed(&case.failure(0), Fault::NotStarted, "/no/such/helper: No such file");
}

#[test]
fn a_helper_that_is_another_program_is_named() {
    let mut case = Case::shell("", "");
    case.launcher = confine::launcher("/bin/cat".into(), vec!["/no/such/file".into()], None);
    assert_failed(&case.failure(0), Fault::NotStarted, "");
}
