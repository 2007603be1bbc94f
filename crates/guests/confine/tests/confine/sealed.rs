//! The view of a guest: files, environment, other processes, network.

use std::fs;
use std::net::TcpListener;
use std::path::Path;

use confine::level;
use guest::Patience;

use crate::{Case, helper};

/// The guest's one line.
fn guest_line(case: &Case) -> String {
    let mut channel = case.launch().expect("a start");
    channel.exchange("start", Patience::Start).expect("an answer")
}

/// True if this machine lets namespaces be taken; tests of them report it and end otherwise.
fn namespaces() -> bool {
    let level = level(helper(), Vec::new()).expect("a level");
    if !level.namespaces {
        println!("skipped: {level}");
    }
    level.namespaces
}

#[test]
fn the_level_has_reasons_unless_full() {
    let found = level(helper(), Vec::new()).unwrap();
    println!("{found}");
    assert!(found.seccomp && found.network, "{found}");
    assert_eq!(found.to_string() == "full", found.why.is_empty(), "{found}");
    let plain = level(helper(), vec!["--no-namespaces".into()]).unwrap();
    assert!(!plain.namespaces && plain.network && plain.to_string().starts_with("partial: no namespaces (not wanted)"));
}

#[test]
fn no_file_of_the_machine_is_written() {
    if !namespaces() {
        return;
    }
    let text = "take()\ndone = []\n\
        for place in ['/', '/etc', '/usr', os.path.dirname(sys.argv[0]), '/proc', '/sys', '/dev', '/run', '/tmp', '/dev/shm']:\n  \
        try: open(place + '/' + sys.argv[1], 'w').close(); done.append(place)\n  \
        except OSError: pass\n\
        give(' '.join(done))\n";
    let Some(case) = Case::python(text, "") else { return };
    assert_eq!(guest_line(&case), "/tmp /dev/shm", "those in memory alone");
    for place in ["/", "/etc", "/tmp", "/dev/shm"] {
        assert!(!Path::new(place).join(&case.mark).exists(), "{place}");
    }
    assert_eq!(fs::read_dir(case.folder.path()).unwrap().count(), 1, "the guest's program");
}

#[test]
fn temporary_files_are_bounded() {
    if !namespaces() {
        return;
    }
    let text = "take()\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\nn = 0\n\
        try:\n  for name in 'ab':\n    with open('/tmp/' + name, 'wb', 0) as file:\n      for _ in range(100): n += file.write(bytes(1 << 20))\n\
        except OSError as why: give('%d MiB, %s' % (n >> 20, why.strerror))\n";
    let Some(case) = Case::python(text, "step_ms = 10000") else { return };
    let line = guest_line(&case);
    assert!(line == "64 MiB, File too large" || line == "64 MiB, No space left on device", "{line}");
}

#[test]
fn devices_and_other_processes_are_hidden() {
    if !namespaces() {
        return;
    }
    let text = "take(); give(' '.join(sorted(os.listdir('/dev'))) + '; ' + ' '.join(sorted(p for p in os.listdir('/proc') if p.isdigit())))\n";
    let Some(case) = Case::python(text, "") else { return };
    let line = guest_line(&case);
    let (devices, processes) = line.split_once("; ").unwrap();
    assert_eq!(devices, "fd full null random shm stderr stdin stdout urandom zero");
    assert_eq!(processes.split(' ').count(), 2, "the warden and the guest: {processes}");
}

#[test]
fn the_environment_is_the_files_alone() {
    let text = "take(); give(json.dumps(sorted(k for k in os.environ if k != 'LC_CTYPE')))\n";
    let Some(case) = Case::python(text, "") else { return };
    assert_eq!(guest_line(&case), "[\"ONLY\"]", "Python itself adds LC_CTYPE");
}

#[test]
fn the_wardens_secrets_are_closed_to_guests() {
    if !namespaces() {
        return;
    }
    let text = "take()\ndef can(f):\n  \
        try: f(); return 'yes'\n  \
        except OSError as why: return why.strerror\n\
        give(can(lambda: open('/proc/1/environ').read()) + ', ' + can(lambda: os.readlink('/proc/1/fd/2')) + ', ' + can(lambda: open('/proc/1/mem', 'rb'))\n  \
        + ', ' + ' '.join(sorted(os.listdir('/proc/self/fd'))))\n";
    let Some(case) = Case::python(text, "") else { return };
    assert_eq!(
        guest_line(&case),
        "Permission denied, Permission denied, Permission denied, 0 1 2 3",
        "3 is the listing's own"
    );
}

/// Tries of a guest to connect to this port, and to open other sockets.
const SOCKETS: &str = "take()\ndef can(f):\n  \
    try: f(); return 'yes'\n  \
    except OSError as why: return why.strerror\n\
    def loop():\n  \
    a = socket.create_server(('127.0.0.1', 0)); socket.create_connection(a.getsockname(), 5)\n\
    give(', '.join([can(lambda: socket.create_connection(('127.0.0.1', PORT), 5)), can(loop), can(lambda: socket.socket(socket.AF_INET6)),\n  \
    can(lambda: socket.socket(socket.AF_NETLINK)), can(lambda: socket.socket(socket.AF_UNIX)), can(lambda: socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)), can(socket.socketpair)]))\n";

#[test]
fn no_network_is_reached() {
    if !namespaces() {
        return;
    }
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let text = SOCKETS.replace("PORT", &listener.local_addr().unwrap().port().to_string());
    let Some(case) = Case::python(&text, "") else { return };
    let denied = "Operation not permitted";
    assert_eq!(
        guest_line(&case),
        format!("Connection refused, yes, {denied}, {denied}, {denied}, {denied}, yes"),
        "loopback alone, of its own"
    );
}

/// A helper that fails with namespaces, as where the kernel grants them and refuses their parts.
#[test]
fn refused_parts_of_namespaces_lead_to_a_start_without() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("helper");
    let text = format!(
        "#!/bin/sh\ncase \"$*\" in *--no-namespaces*) exec '{}' \"$@\" ;; esac\necho 'uid_map: refused' >&2\nexit 1\n",
        helper().display()
    );
    fs::write(&script, text).unwrap();
    // A shell reads it: as its own program it would be busy, were another test to start one while it is written.
    let leading = [script.to_string_lossy().into_owned(), "mark".to_owned()];
    let (arguments, level) = confine::best(Path::new("/bin/sh"), &leading).unwrap();
    assert_eq!(arguments[1..], ["mark", "--no-namespaces"]);
    assert!(!level.namespaces && level.to_string().contains("uid_map: refused"), "{level}");
    let (arguments, level) = confine::best(&helper(), &[]).unwrap();
    assert_eq!(level.namespaces, arguments.is_empty(), "{level}");
}

/// The hidden folder of this test lies beside the guest's own.
#[test]
fn a_hidden_folder_is_empty() {
    if !namespaces() {
        return;
    }
    let root = std::env::current_dir().unwrap();
    if ["/tmp", "/var/tmp", "/run", "/dev"].iter().any(|covered| root.starts_with(covered)) {
        println!("skipped: {} is covered in any case", root.display());
        return;
    }
    let hidden = tempfile::Builder::new().prefix("hidden-").tempdir_in(&root).unwrap();
    fs::write(hidden.path().join("truth"), "x").unwrap();
    let text = format!("take(); give(str(os.listdir({:?})))\n", hidden.path());
    let Some(mut case) = Case::python(&text, "") else { return };
    assert_eq!(guest_line(&case), "['truth']");
    case.launcher = confine::launcher(helper(), vec![case.mark.clone()], Some(hidden.path().to_owned()));
    assert_eq!(guest_line(&case), "[]");
}

#[test]
fn no_network_is_reached_without_namespaces() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let text = SOCKETS.replace("PORT", &listener.local_addr().unwrap().port().to_string());
    let Some(case) = Case::python(&text, "") else { return };
    let denied = "Operation not permitted";
    assert_eq!(guest_line(&case.plain()), format!("{denied}, {denied}, {denied}, {denied}, {denied}, {denied}, yes"));
}

#[test]
fn dangerous_calls_are_refused() {
    let text = "import ctypes\nlibc = ctypes.CDLL(None, use_errno=True)\n\
        def errno(f): ctypes.set_errno(0); f(); return ctypes.get_errno()\n\
        take(); give(' '.join(str(errno(f)) for f in [lambda: libc.ptrace(0, 0, 0, 0), lambda: libc.mount(b'a', b'/tmp', b'tmpfs', 0, 0),\n  \
        lambda: libc.unshare(0x10000000), lambda: libc.setns(0, 0), lambda: libc.syscall(425, 8, 0), lambda: libc.syscall(435, 0, 0)]))\n";
    let Some(case) = Case::python(text, "") else { return };
    assert_eq!(guest_line(&case), "1 1 1 1 1 38", "EPERM, and for clone3 ENOSYS");
    assert_eq!(guest_line(&case.plain()), "1 1 1 1 1 38", "without namespaces too");
}

#[test]
fn rights_are_gone_for_good() {
    let text = "take(); give(' '.join(line.split()[1] for line in open('/proc/self/status') if line.startswith(('Cap', 'NoNewPrivs'))))\n";
    if !namespaces() {
        return;
    }
    let Some(case) = Case::python(text, "") else { return };
    let none = "0000000000000000";
    assert_eq!(guest_line(&case), format!("{none} {none} {none} {none} {none} 1"));
}
